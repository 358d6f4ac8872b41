# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Projection of points onto the task plane, and its inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from foc_ros.ros.messages.plane import lift, project

PLANES = ('xy', 'xz', 'yz')
points = arrays(np.float64, st.tuples(st.integers(0, 5), st.just(3)), elements=st.floats(-1e4, 1e4))


@pytest.mark.parametrize(
    ('plane', 'position', 'height'), [('xy', (1.0, 2.0), 3.0), ('xz', (1.0, 3.0), 2.0), ('yz', (2.0, 3.0), 1.0)]
)
def test_axes_of_each_plane(plane: str, position: tuple[float, float], height: float) -> None:
    projected, above = project((1.0, 2.0, 3.0), plane)
    assert tuple(projected) == position
    assert above == height
    assert tuple(lift(projected, above, plane)) == (1.0, 2.0, 3.0)


@given(points, st.sampled_from(PLANES))
def test_lift_is_the_inverse_of_project(table: np.ndarray, plane: str) -> None:
    positions, heights = project(table, plane)
    assert positions.shape == (len(table), 2)
    np.testing.assert_array_equal(lift(positions, heights, plane), table)
