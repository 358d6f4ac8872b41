"""How unsure predictions are is found by the density of what came true."""

from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import TWO_WAYS, H, observation, recorded

from foc_ros.analysis.evaluation.observations import TIMES_S
from foc_ros.analysis.fitting.densities import DOUBTS, NO_DOUBT, Doubt, log_densities, widened
from foc_ros.analysis.fitting.doubts import coverage, density_table, doubt_estimates, doubts
from foc_ros.core.config import Config

S = np.array(TIMES_S)
TO_GOAL = 10 * S**3 - 15 * S**4 + 6 * S**5
LATE = 9.0 * (S**3 * (1 - S) ** 2)[:, None] * [1.0, 0.0]
WAYS = replace(TWO_WAYS, covariance=np.tile(1e-8 * np.eye(2), (2, H, 1, 1)), late=np.stack([LATE, LATE]))


def _recordings(endpoint: float, spread: float) -> list:
    """Twelve recordings of eight movements of 1 s each, that end beside the goal and are late by so much."""
    draws = np.random.default_rng(3)
    moved = [
        np.outer(TO_GOAL, draws.normal(0.0, endpoint, 2)) - draws.normal(0.0, spread) * LATE + draws.normal(0.0, 1e-4, (H, 2))
        for _ in range(96)
    ]
    seen = [observation(WAYS, positions=each) for each in moved]
    return [recorded(*seen[8 * number : 8 * number + 8], name=str(number)) for number in range(12)]


@pytest.mark.parametrize(('endpoint', 'spread'), [(0.006, 0.0), (0.002, 0.3)])
def test_what_made_the_recordings_is_found_and_the_ellipses_then_hold_what_they_say(endpoint: float, spread: float) -> None:
    recordings = _recordings(endpoint, spread)
    table = density_table(recordings, Config())
    found = doubt_estimates(table)
    assert found['foc.endpoint_stddev'].value == pytest.approx(endpoint, rel=0.4)
    assert found['duration.spread'].value == pytest.approx(spread, abs=0.11)
    for each in found.values():
        assert each.low <= each.value <= each.high
    by_name = doubts(table, [each.name for each in recordings])
    held = {name: coverage(recordings, Config(), each) for name, each in by_name.items()}
    assert held['motor noise alone']['inside_90'] < 0.1
    for kind in ('inside_90', 'inside_all_90'):
        assert held['fitted'][kind] == pytest.approx(0.9, abs=0.08)
        assert held['without the recording'][kind] == pytest.approx(0.9, abs=0.08)


def test_the_density_is_that_of_the_widened_mixture() -> None:
    seen, doubt = _recordings(0.006, 0.3)[0].each[0], Doubt(0.5, 0.004, 0.2)
    found = log_densities(seen, np.array([0.3, 0.7]), Config(), [NO_DOUBT, doubt])
    places = [TIMES_S.index(each) for each in (0.25, 0.5, 1.0)]
    for value, each in zip(found, (NO_DOUBT, doubt), strict=True):
        covariance = widened(seen, each, Config())[0, places]
        away = seen.truth.positions[places]
        squared = np.einsum('hi,hij,hj->h', away, np.linalg.inv(covariance), away)
        logs = -0.5 * (squared + np.log(np.linalg.det(covariance))) - np.log(2 * np.pi)
        assert value == pytest.approx(np.maximum(logs, -30.0).mean())
    assert DOUBTS[0] == NO_DOUBT


def test_a_hand_that_waits_tells_nothing_of_how_it_moves() -> None:
    assert log_densities(observation(WAYS, since_s=0.0), np.array([0.5, 0.5]), Config(), DOUBTS) is None
