"""The Singer model forecasts as its closed forms say."""

import numpy as np
import pytest

from foc_ros.analysis.evaluation.baselines import SINGER_SETTINGS, _discretise, forecast_singer
from foc_ros.analysis.evaluation.observations import HORIZONS_S

AHEAD = np.array(HORIZONS_S)


@pytest.mark.parametrize('dt', [1e-3, 0.07, 1.0])
def test_transition_and_added_covariance_are_the_closed_forms(dt: float) -> None:
    transition, added = _discretise(dt)
    for row, (stddev, _, tau) in enumerate(SINGER_SETTINGS):
        decay = np.exp(-dt / tau)
        expected = [[1.0, dt, tau**2 * (dt / tau - 1.0 + decay)], [0.0, 1.0, tau * (1.0 - decay)], [0.0, 0.0, decay]]
        np.testing.assert_allclose(transition[row], expected, rtol=1e-6, atol=1e-12)
        assert added[row, 2, 2] == pytest.approx(stddev**2 * (1.0 - decay**2))
        np.testing.assert_allclose(added[row], added[row].T, rtol=1e-9, atol=1e-15)


def test_a_steady_motion_is_continued_and_an_uncertain_one_has_its_error() -> None:
    stamps_ns = np.arange(0, 2_000_000_000, 20_000_000)
    positions = np.outer(stamps_ns / 1e9, [0.3, -0.1])
    mean, variance = forecast_singer(stamps_ns, positions, stamps_ns[[20, 99]], AHEAD)
    expected = positions[99] + AHEAD[:, None] * [0.3, -0.1]
    np.testing.assert_allclose(mean[1], np.tile(expected, (len(SINGER_SETTINGS), 1, 1)), atol=2e-3)
    assert mean.shape == (2, len(SINGER_SETTINGS), 3, 2) and (np.diff(variance, axis=2) > 0.0).all()


def test_a_forecast_knows_nothing_of_later_samples() -> None:
    draws = np.random.default_rng(0)
    stamps_ns, positions = np.arange(0, 10**9, 5 * 10**7), np.cumsum(draws.normal(0.0, 0.01, (20, 2)), axis=0)
    other = np.where(np.arange(20)[:, None] > 10, 1.0, positions)
    for one, two in zip(*(forecast_singer(stamps_ns, each, stamps_ns[:11], AHEAD) for each in (positions, other)), strict=True):
        np.testing.assert_array_equal(one, two)
