# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages made for rclpy and for rosbags have the same bytes, and stamps stay in range."""

from __future__ import annotations

import pytest

from foc_ros.ros.messages import types as conversion_types
from foc_ros.ros.messages.types import RosbagsTypes


@pytest.mark.parametrize(
    ('stamp_ns', 'expected'),
    [(0, (0, 0)), (1_500_000_000, (1, 500_000_000)), (-1, (-1, 999_999_999)), (2**80, (2**31 - 1, 2**80 % 10**9))],
)
def test_stamps_split_and_stay_in_range(stamp_ns: int, expected: tuple[int, int]) -> None:
    made = conversion_types.make_stamp(RosbagsTypes(STORE), stamp_ns)
    assert (made.sec, made.nanosec) == expected
