# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The marks by which `make check`, `make test` and `make test-long` choose."""

from tiers import LONG, PROCESS, is_listed, list_test_functions


def test_every_pattern_matches_a_test() -> None:
    functions = list_test_functions()
    stale = [pattern for pattern in LONG + PROCESS if not any(is_listed(*each, (pattern,)) for each in functions)]
    assert stale == []
