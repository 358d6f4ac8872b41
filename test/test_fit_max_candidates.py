"""The number of candidates that a fit asks for: room for every goal and homotopy class."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.analysis.fitting.predictor_settings import CANDIDATES, MAX_CLASSES, count_classes, fit_max_candidates
from foc_ros.analysis.fitting.recorded_hand import RecordedHand
from foc_ros.core.config import Config, replace_values
from foc_ros.core.types import make_obstacles


def make_hand(centres, goals=((1.0, 0.0),)) -> RecordedHand:
    positions = np.linspace([0.0, 0.0], [1.0, 0.0], 12)
    return RecordedHand('one', np.arange(12) * 100_000_000, positions, make_obstacles(centres, 0.02), np.array(goals))


TWO_ROWS = [(0.3, -0.1), (0.3, 0.1), (0.6, 0.0)]


@pytest.mark.parametrize(
    ('centres', 'expected'),
    [([], 1), (TWO_ROWS, 6), ([*TWO_ROWS, (-0.5, 0.0), (1.5, 0.0)], 6), ([(0.1 * k, 0) for k in range(1, 9)], 256)],
)
def test_rows_between_start_and_goal_multiply(centres, expected: int) -> None:
    assert count_classes(make_hand(centres)) == expected


@pytest.mark.parametrize(
    ('found', 'given', 'expected'),
    [
        pytest.param(make_hand(TWO_ROWS), 4, 6, id='classes'),
        pytest.param(make_hand(TWO_ROWS), 8, None, id='enough'),
        pytest.param(make_hand([], [(1.0, 0.1 * k) for k in range(30)]), 4, 30, id='goals'),
        pytest.param(make_hand([(0.1 * k, 0) for k in range(1, 9)]), 4, MAX_CLASSES, id='too many'),
    ],
)
def test_there_is_room_for_goals_and_classes_and_never_less_than_given(
    found: RecordedHand, given: int, expected: int | None
) -> None:
    estimates, warnings = fit_max_candidates([found], replace_values(Config(), {CANDIDATES: given}))
    assert (estimates[CANDIDATES].value if estimates else None) == expected
    assert bool(warnings) == (expected == MAX_CLASSES)
