"""Estimator, durations and resampling: parameters that are fitted without a prediction."""

import numpy as np
import pytest
from fit_recordings import GOALS, reach, recorded_hand

from foc_ros.analysis.fitting.duration_fit import fit_duration
from foc_ros.analysis.fitting.estimator_fit import Innovations, fit_estimator
from foc_ros.analysis.fitting.resampling import expand_quadratic
from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.kalman import compute_gramian, compute_transition, update
from foc_ros.core.types import HandSample, SampleStatus, make_obstacles


def _drifting(seed: int, stddev: float, density: float, count: int = 6) -> list:
    """Return hands that are driven by white jerk, as the filter expects."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.01, 0.03, 200))
    found = []
    for number in range(count):
        state, path = np.zeros((3, 2)), []
        for dt in np.diff(times, prepend=times[0] - 0.02):
            state = compute_transition(dt) @ state + density * np.linalg.cholesky(compute_gramian(dt)) @ rng.standard_normal(
                (3, 2)
            )
            path.append(state[0] + rng.normal(0.0, stddev, 2))
        found.append(recorded_hand(f'{number}', times, np.array(path), make_obstacles(), GOALS))
    return found


def test_innovations_are_those_of_the_estimator() -> None:
    each = _drifting(1, 1e-3, 3.0, 1)[0]
    gap = each.stamps_ns.copy()
    gap[100:] += 1_000_000_000
    jumped = each.positions + 0.5 * (np.arange(len(gap)) >= 50)[:, None]
    each = recorded_hand('gap', gap * 1e-9, jumped, each.obstacles, each.goals)
    config, total, state = Config().estimator, 0.0, None
    for stamp_ns, position in zip(each.stamps_ns.tolist(), each.positions, strict=True):
        updated = update(state, HandSample(stamp_ns, position), config)
        following = updated.state
        if state is not None and updated.status is SampleStatus.ACCEPTED:
            dt = (stamp_ns - state.stamp_ns) * 1e-9
            prior = compute_transition(dt) @ state.covariance[::2, ::2] @ compute_transition(
                dt
            ).T + config.jerk_density**2 * compute_gramian(dt)
            S = prior[0, 0] + config.position_stddev**2
            v = position - (compute_transition(dt) @ state.mean.reshape(3, 2))[0]
            total -= np.log(2 * np.pi * S) + v @ v / (2 * S)
        state = following
    found = Innovations([each], config).log_likelihood(config.position_stddev, config.jerk_density)
    assert found == pytest.approx([total], rel=1e-9)


@pytest.mark.parametrize(('stddev', 'density'), [(1e-3, 3.0), (3e-4, 20.0)])
def test_the_deviations_that_made_the_data_are_found(stddev: float, density: float) -> None:
    estimates, warnings = fit_estimator(_drifting(2, stddev, density), Config())
    assert warnings == []
    for name, true in (('estimator.position_stddev', stddev), ('estimator.jerk_density', density)):
        found = estimates[name]
        assert found.low <= found.value <= found.high
        assert found.value == pytest.approx(true, rel=0.1)
        assert 0.8 * found.low < true < 1.2 * found.high


def test_noise_below_the_resolution_is_reported_as_undetermined() -> None:
    _, warnings = fit_estimator(_drifting(3, 1e-9, 3.0), Config())
    assert any(words.startswith('estimator.position_stddev: the recordings do not determine it') for words in warnings)


def _reaches(durations: list[float], goals: np.ndarray) -> list:
    rng = np.random.default_rng(4)
    rows = [reach(goal, 0.0, seconds, 100.0, rng, 2e-4) for seconds, goal in zip(durations, goals, strict=True)]
    return [
        recorded_hand(f'{k}', each[:, 0], each[:, 1:], make_obstacles(), goal[None])
        for k, (each, goal) in enumerate(zip(rows, goals, strict=True))
    ]


def test_one_factor_is_fitted_where_distances_are_alike() -> None:
    config = replace_values(Config(), {'estimator.position_stddev': 2e-4})
    given = config.duration.fitts_a_s + config.duration.fitts_b_s * np.log2(0.3 / config.duration.target_width + 1)
    goals = np.tile([0.3, 0.0], (5, 1))
    estimates, warnings = fit_duration(_reaches([2.0 * given] * 5, goals), config)
    a, b = estimates['duration.fitts_a_s'], estimates['duration.fitts_b_s']
    assert a.value / config.duration.fitts_a_s == pytest.approx(b.value / config.duration.fitts_b_s, rel=1e-4)
    assert a.value / config.duration.fitts_a_s == pytest.approx(2.0, rel=0.2)
    assert a.low <= a.value <= a.high
    assert any('too alike to tell intercept and slope apart' in words for words in warnings)


def test_distances_that_differ_determine_intercept_and_slope() -> None:
    config = replace_values(Config(), {'estimator.position_stddev': 2e-4})
    distances = np.array([0.05, 0.1, 0.2, 0.4, 0.8])
    durations = 0.5 + 0.3 * np.log2(distances / config.duration.target_width + 1)
    estimates, warnings = fit_duration(_reaches(durations.tolist(), np.column_stack([distances, np.zeros(5)])), config)
    assert warnings == []
    fitted = estimates['duration.fitts_a_s'].value + estimates['duration.fitts_b_s'].value * np.log2(
        distances / config.duration.target_width + 1
    )
    # the filter detects each onset equally late
    assert (fitted - durations).min() > -0.25 and (fitted - durations).max() < 0.0
    assert np.ptp(fitted - durations) < 0.05


def test_without_a_goal_reached_durations_are_kept() -> None:
    far = _reaches([1.0], np.array([[0.3, 0.0]]))[0]
    missed = recorded_hand('missed', far.times, far.positions, far.obstacles, np.array([[0.9, 0.0]]))
    estimates, warnings = fit_duration([missed], Config())
    assert estimates == {} and 'no recording has a movement that ends near a goal' in warnings[0]


def test_resamples_scatter_as_the_mean_of_a_sample_does() -> None:
    data = np.random.default_rng(6).normal(2.0, 0.5, 400)
    low, high = np.array([-10.0]), np.array([10.0])
    found = expand_quadratic(lambda x: -0.5 * ((data - x[0]) / 0.5) ** 2, np.array([data.mean()]), low, high)
    ends = np.ravel(found.compute_interval())
    assert ends == pytest.approx(data.mean() + 1.96 * data.std() / 20 * np.array([-1, 1]), abs=0.006)
    assert found.deviation == pytest.approx([0.5 / 20], rel=1e-3)


def test_a_determined_sum_does_not_determine_its_parts() -> None:
    data = np.random.default_rng(8).normal(1.0, 0.1, 50)
    found = expand_quadratic(
        lambda x: -50.0 * (data - x[0] - x[1]) ** 2, np.array([0.5, 0.5]), np.full(2, -10.0), np.full(2, 10.0)
    )
    assert found.undetermined == [0, 1]
