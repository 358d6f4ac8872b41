"""The waiting time of hands is estimated from the samples at rest before a movement."""

import numpy as np
import pytest
from evaluation_samples import reach
from fit_recordings import recorded_hand

from foc_ros.analysis.fitting.duration_fit import fit_wait
from foc_ros.core.config import Config
from foc_ros.core.types import make_obstacles

GOAL = np.array([[0.3, 0.0]])


def _make_hand(rest: float):
    return recorded_hand('one', *reach(0.0, (0.3, 0.0), rest=rest), make_obstacles([], []), GOAL)


def test_half_of_the_wait_is_left_on_average_and_the_stay_at_the_goal_does_not_count() -> None:
    found = fit_wait([_make_hand(0.6), _make_hand(1.0)], Config())
    # the wait includes the first 0.15 s of a movement, until its onset is detected
    assert found['duration.wait_s'].value == pytest.approx(0.4, abs=0.1)
    assert found['duration.wait_s'].low < found['duration.wait_s'].value < found['duration.wait_s'].high


def test_hands_that_never_rest_give_no_estimate() -> None:
    times = np.arange(0.0, 1.0, 0.02)
    moving = recorded_hand('one', times, np.outer(times, [0.3, 0.0]), make_obstacles([], []), GOAL)
    found = fit_wait([moving], Config())
    assert not found or found['duration.wait_s'].value < 0.1
