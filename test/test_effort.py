"""The effort of a movement so far: closed forms without noise, bounds with noise, and no effort from noise alone."""

from collections.abc import Callable

import numpy as np
import pytest

from foc_ros.core.config import EstimatorConfig
from foc_ros.core.estimation.effort import LEAST_TIME_S, Effort, add_sample
from foc_ros.core.estimation.kalman_filter import update
from foc_ros.core.types import Array, HandSample

STDDEV = 1e-3


def minimum_jerk(t: Array, distance: float, duration: float) -> Array:
    s = np.clip(t / duration, 0.0, 1.0)
    return distance * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)


def reach(t: Array) -> Array:
    return np.stack([minimum_jerk(t, 0.3, 1.0), 0.0 * t], axis=1)


def fed(times: Array, positions: Array, stddev: float = STDDEV) -> Effort:
    effort = Effort()
    for t, position in zip(times, positions, strict=True):
        effort = add_sample(effort, round(t * 1e9), position, stddev)
    return effort


def tracked(times: Array, positions: Array, stddev: float = STDDEV) -> Array:
    """Effort spent after every sample, through the whole estimator."""
    state, spent = None, []
    for t, position in zip(times, positions, strict=True):
        state = update(state, HandSample(round((t + 10.0) * 1e9), position), EstimatorConfig(position_stddev=stddev)).state
        spent.append(state.effort_spent)
    return np.array(spent)


@pytest.mark.parametrize(('distance', 'duration'), [(0.3, 1.0), (0.3, 4.0), (0.05, 0.5), (2.0, 30.0)])
def test_a_whole_minimum_jerk_reach_has_its_closed_form(distance: float, duration: float) -> None:
    t = np.linspace(0.0, duration, 101)
    direction = np.array([0.6, -0.8])
    effort = fed(t + 5.0, np.outer(minimum_jerk(t, distance, duration), direction), stddev=1e-7)
    assert effort.spent == pytest.approx(720.0 * distance**2 / duration**5, rel=1e-3)


def test_constant_jerk_has_its_square_times_the_time() -> None:
    t = np.linspace(0.0, 1.5, 76)
    assert fed(t, np.outer(t**3 / 6.0, [4.0, 3.0]), stddev=1e-6).spent == pytest.approx(25.0 * 1.5, rel=1e-3)


def test_uniform_acceleration_costs_nothing() -> None:
    t = np.linspace(0.0, 2.0, 101)
    assert fed(t, np.outer(0.2 * t - 0.3 * t**2, [1.0, 2.0])).spent == 0.0


def test_turning_or_shifting_the_frame_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    t = np.linspace(0.0, 1.0, 51)
    positions = reach(t) + STDDEV * rng.standard_normal((51, 2))
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    assert fed(t, positions).spent > 0.0
    assert fed(t + 7.0, positions @ turn.T + [3.0, -2.0]).spent == pytest.approx(fed(t, positions).spent, rel=1e-6)


def test_two_quintics_are_two_segments_and_their_efforts_add_up() -> None:
    t = np.linspace(0.0, 2.0, 401)
    aside = np.where(t < 1.0, minimum_jerk(t, 0.2, 1.0), 0.2 - minimum_jerk(t - 1.0, 0.2, 1.0))
    effort = fed(t, np.stack([0.0 * t, aside], axis=1), stddev=1e-5)
    assert effort.before > 0.0
    assert effort.spent == pytest.approx(2.0 * 720.0 * 0.2**2, rel=0.1)


@pytest.mark.parametrize('rate', [15.0, 50.0, 200.0])
@pytest.mark.parametrize('duration', [1.0, 2.0])
def test_a_noisy_reach_is_within_the_stated_factor_at_its_end(rate: float, duration: float) -> None:
    rng, true = np.random.default_rng(11), 720.0 * 0.3**2 / duration**5
    ends = []
    for _ in range(15):
        t = np.arange(-0.5 + rng.uniform(0.0, 1.0 / rate), duration, 1.0 / rate)
        positions = np.stack([minimum_jerk(t, 0.3, duration), 0.0 * t], axis=1)
        spent = tracked(t, positions + STDDEV * rng.standard_normal((len(t), 2))) / true
        assert spent.max() < 1.1
        ends.append(spent[np.flatnonzero(spent)[-1:]].sum())
    assert 0.35 < np.median(ends) < 0.85


@pytest.mark.parametrize('rate', [15.0, 50.0, 200.0, 1000.0])
def test_noise_on_uniform_motion_is_not_taken_for_effort(rate: float) -> None:
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 2.0, 1.0 / rate)
    effort, highest = Effort(), 0.0
    for time, noise in zip(t, STDDEV * rng.standard_normal((len(t), 2)), strict=True):
        effort = add_sample(effort, round(time * 1e9), np.array([0.2 * time, 0.1]) + noise, STDDEV)
        highest = max(highest, effort.spent)
    assert highest == 0.0


@pytest.mark.parametrize('rate', [50.0, 200.0])
def test_an_outlier_belongs_to_no_segment(rate: float) -> None:
    rng = np.random.default_rng(7)
    t = np.arange(0.0, 1.0, 1.0 / rate)
    positions = reach(t) + 1e-4 * rng.standard_normal((len(t), 2))
    positions[round(0.6 * rate)] += [0.03, -0.02]
    assert fed(t, positions, stddev=1e-4).spent < 1.1 * 720.0 * 0.3**2


def test_short_segments_and_clustered_samples_give_no_effort() -> None:
    clustered = np.concatenate([1e-6 * np.arange(10.0), [LEAST_TIME_S + 0.1]])
    assert fed(clustered, reach(clustered)).spent == 0.0
    short = np.linspace(0.0, 0.9 * LEAST_TIME_S, 100)
    assert fed(short, np.outer(short**3, [50.0, 0.0])).spent == 0.0


@pytest.mark.parametrize('change', [lambda e: e.powers, lambda e: e.products, lambda e: e.origin])
def test_the_record_is_frozen(change: Callable[[Effort], Array]) -> None:
    with pytest.raises(ValueError, match='read-only'):
        change(fed(np.linspace(0.0, 1.0, 11), reach(np.linspace(0.0, 1.0, 11))))[0] = 1.0
