"""How long hands wait is found from the samples at rest before a movement."""

import numpy as np
import pytest
from evaluation_samples import reach
from fit_recordings import demonstration

from foc_ros.analysis.fitting.wait_fit import fit_wait
from foc_ros.core.config import Config
from foc_ros.core.types import make_obstacles

GOAL = np.array([[0.3, 0.0]])


def _waits(rest: float):
    return demonstration('one', *reach(0.0, (0.3, 0.0), rest=rest), make_obstacles([], []), GOAL)


def test_half_of_the_wait_is_left_on_average_and_the_stay_at_the_goal_does_not_count() -> None:
    found, _ = fit_wait([_waits(0.6), _waits(1.0)], Config())
    # and the first 0.15 s of a movement, until it is one
    assert found['duration.wait_s'].value == pytest.approx(0.4, abs=0.1)
    assert found['duration.wait_s'].low < found['duration.wait_s'].value < found['duration.wait_s'].high


def test_of_hands_that_never_rest_nothing_is_told() -> None:
    times = np.arange(0.0, 1.0, 0.02)
    moving = demonstration('one', times, np.outer(times, [0.3, 0.0]), make_obstacles([], []), GOAL)
    found, warnings = fit_wait([moving], Config())
    assert warnings == [] and (not found or found['duration.wait_s'].value < 0.1)
