"""The state that a prediction starts from: at rest, with its acceleration, or at the speed that this leads to."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.predict import predict, warm_up
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState, make_obstacles

MEAN = np.array([0.0, 0.0, 0.2, 0.1, -0.4, 1.0])


def first(time_s: float, onset_ns: int | None = 0) -> np.ndarray:
    """The state of the predicted movement at its first step."""
    config = replace_values(Config(), {'estimator.acceleration_time_s': time_s})
    hand = HandState(200_000_000, MEAN, 1e-6 * np.eye(6), onset_ns=onset_ns, onset_position=np.zeros(2))
    prediction, _ = predict(config, hand, make_obstacles(), np.array([[0.3, 0.1]]), NO_TRACKS)
    return prediction.candidates[0].solution.mean[0]


@pytest.mark.parametrize(
    ('time_s', 'expected'),
    [(0.0, MEAN), (0.1, [0.0, 0.0, 0.16, 0.2, 0.0, 0.0]), (0.5, [0.0, 0.0, 0.0, 0.6, 0.0, 0.0])],
)
def test_a_movement_goes_on_at_the_speed_that_its_acceleration_leads_to(time_s: float, expected: list[float]) -> None:
    np.testing.assert_allclose(first(time_s), expected, atol=1e-12)


@pytest.mark.parametrize('time_s', [0.0, 0.5])
def test_a_hand_that_has_not_begun_to_move_is_at_rest(time_s: float) -> None:
    np.testing.assert_allclose(first(time_s, None), np.zeros(6), atol=1e-12)


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal', 'algorithm1', 'fixed'])
@pytest.mark.parametrize('model', ['fixed', 'fitts'])
def test_every_configuration_can_be_rehearsed(strategy, model):
    warm_up(replace_values(Config(), {'foc.strategy': strategy, 'duration.model': model, 'foc.steps': 10}))
