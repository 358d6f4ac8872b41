"""The parameters that widen the covariance are found by the density of true positions."""

from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import TWO_CLASSES, H, observation, recorded

from foc_ros.analysis.evaluation.ground_truth import TIMES_S
from foc_ros.analysis.fitting.covariance_fit import (
    NO_WIDENING,
    WIDENINGS,
    Widening,
    compute_log_densities,
    estimate_widening,
    score_positions,
    tabulate_densities,
    widen_covariance,
)
from foc_ros.core.config import Config

S = np.array(TIMES_S)
TO_GOAL = 10 * S**3 - 15 * S**4 + 6 * S**5
LATE = 9.0 * (S**3 * (1 - S) ** 2)[:, None] * [1.0, 0.0]
CANDIDATES = replace(TWO_CLASSES, covariance=np.tile(1e-8 * np.eye(2), (2, H, 1, 1)), duration_sensitivity=np.stack([LATE, LATE]))


def _make_recordings(endpoint: float, spread: float) -> list:
    """Return twelve recordings of eight movements of 1 s each, with scattered ends and durations."""
    draws = np.random.default_rng(3)
    moved = [
        np.outer(TO_GOAL, draws.normal(0.0, endpoint, 2)) - draws.normal(0.0, spread) * LATE + draws.normal(0.0, 1e-4, (H, 2))
        for _ in range(96)
    ]
    observed = [observation(CANDIDATES, positions=each) for each in moved]
    return [recorded(*observed[8 * number : 8 * number + 8], name=str(number)) for number in range(12)]


@pytest.mark.parametrize(('endpoint', 'spread'), [(0.006, 0.0), (0.002, 0.3)])
def test_the_true_values_are_found_and_ellipses_then_have_their_coverage(endpoint: float, spread: float) -> None:
    recordings = _make_recordings(endpoint, spread)
    table = tabulate_densities(recordings, Config())
    found, warnings = estimate_widening(table)
    assert warnings == []
    assert found['foc.endpoint_stddev'].value == pytest.approx(endpoint, rel=0.4)
    assert found['duration.spread'].value == pytest.approx(spread, abs=0.11)
    for each in found.values():
        assert each.low <= each.value <= each.high
    scores = score_positions(table, Config(), recordings, cross=True)
    assert scores['inside_90']['motor noise alone'] < 0.1
    for kind in ('inside_90', 'inside_all_90'):
        assert scores[kind]['fitted'] == pytest.approx(0.9, abs=0.08)
        assert scores[kind]['without the recording'] == pytest.approx(0.9, abs=0.08)


def test_the_density_is_that_of_the_widened_mixture() -> None:
    observed, widening = _make_recordings(0.006, 0.3)[0].observations[0], Widening(0.5, 0.004, 0.2)
    found = compute_log_densities(observed, np.array([0.3, 0.7]), Config(), [NO_WIDENING, widening])
    rows = [TIMES_S.index(each) for each in (0.25, 0.5, 1.0)]
    for value, each in zip(found, (NO_WIDENING, widening), strict=True):
        covariance = widen_covariance(observed, each, Config())[0, rows]
        offset = observed.truth.positions[rows]
        squared = np.einsum('hi,hij,hj->h', offset, np.linalg.inv(covariance), offset)
        logs = -0.5 * (squared + np.log(np.linalg.det(covariance))) - np.log(2 * np.pi)
        assert value == pytest.approx(np.maximum(logs, -30.0).mean())
    assert WIDENINGS[0] == NO_WIDENING


def test_a_hand_at_rest_does_not_count() -> None:
    assert compute_log_densities(observation(CANDIDATES, movement_age_s=0.0), np.array([0.5, 0.5]), Config(), WIDENINGS) is None


def test_a_value_at_the_edge_of_the_grid_has_a_warning() -> None:
    table = tabulate_densities(_make_recordings(0.3, 0.0), Config())
    found, warnings = estimate_widening(table)
    assert found['foc.endpoint_stddev'].value == max(each.endpoint_stddev for each in WIDENINGS)
    assert [words for words in warnings if words.startswith('foc.endpoint_stddev: 0.16 is the largest')]
