"""The number of candidates that a fit asks for: room for every goal and for the ways open."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.analysis.fitting.demonstrations import Demonstration
from foc_ros.analysis.fitting.followed import MOST, NAME, fit_followed, ways
from foc_ros.core.config import Config, updated
from foc_ros.core.types import make_obstacles


def demonstration(centres, goals=((1.0, 0.0),)) -> Demonstration:
    positions = np.linspace([0.0, 0.0], [1.0, 0.0], 12)
    return Demonstration('one', np.arange(12) * 100_000_000, positions, make_obstacles(centres, 0.02), np.array(goals))


TWO_ROWS = [(0.3, -0.1), (0.3, 0.1), (0.6, 0.0)]


@pytest.mark.parametrize(
    ('centres', 'expected'),
    [([], 1), (TWO_ROWS, 6), ([*TWO_ROWS, (-0.5, 0.0), (1.5, 0.0)], 6), ([(0.1 * k, 0) for k in range(1, 9)], 256)],
)
def test_rows_between_start_and_goal_multiply(centres, expected: int) -> None:
    assert ways(demonstration(centres)) == expected


@pytest.mark.parametrize(
    ('found', 'given', 'expected'),
    [
        pytest.param(demonstration(TWO_ROWS), 4, 6, id='ways'),
        pytest.param(demonstration(TWO_ROWS), 8, None, id='enough'),
        pytest.param(demonstration([], [(1.0, 0.1 * k) for k in range(30)]), 4, 30, id='goals'),
        pytest.param(demonstration([(0.1 * k, 0) for k in range(1, 9)]), 4, MOST, id='too many'),
    ],
)
def test_there_is_room_for_goals_and_ways_and_never_less_than_given(
    found: Demonstration, given: int, expected: int | None
) -> None:
    estimates, warnings = fit_followed([found], updated(Config(), {NAME: given}))
    assert (estimates[NAME].value if estimates else None) == expected
    assert bool(warnings) == (expected == MOST)
