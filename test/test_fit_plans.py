"""Tau and lambda are recovered from movements that were planned with them; a warning says where they cannot be."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from fit_recordings import recorded_hand

from foc_ros.analysis.fitting.plan_fit import fit_plans, interpolate_plan, make_reach, plan
from foc_ros.core.config import Config, FocConfig
from foc_ros.core.errors import RecordingError
from foc_ros.core.types import make_obstacles

SCRIPT = Path(__file__).parents[1] / 'scripts' / 'measure_recovery.py'


@pytest.fixture(scope='module')
def recovery() -> ModuleType:
    """Import the script of the trials."""
    spec = importlib.util.spec_from_file_location('measure_recovery', SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


UNSETTLED = 'the fixed strategy creeps along the steps, and tau comes out 15 % too large'


@pytest.mark.parametrize('seed', [pytest.param(1, marks=pytest.mark.xfail(reason=UNSETTLED)), 2, 3])
def test_recovered_from_mean_trajectories_with_1_mm_of_sensor_noise(recovery: ModuleType, seed: int) -> None:
    made = recovery.run_trial(seed, repeats=1)
    assert made.movements >= 4
    assert made.is_recovered, (made.found.tau / made.tau, made.found.lam / made.lam)
    assert 0.7e-3 < made.found.stddev < 2.5e-3
    low, high = np.exp(made.found.local.compute_interval())
    assert low[0] <= made.found.tau * 1.001 and high[0] >= made.found.tau * 0.999
    assert made.found.local.undetermined == []


def test_without_an_obstacle_lambda_is_determined_and_tau_is_not() -> None:
    config = Config(foc=FocConfig(strategy='fixed', noise_x=0.1, noise_y=0.1))
    goal, times, rng = np.array([[0.3, 0.0]]), np.arange(0.0, 1.001, 0.01), np.random.default_rng(5)
    empty = make_reach(recorded_hand('a', times, times[:, None] * goal, make_obstacles(), goal), config)
    solution = plan(empty, 0.0, 3e6, config)
    assert solution is not None
    measured = [interpolate_plan(solution, times) + rng.normal(0.0, 1e-3, (len(times), 2)) for _ in range(4)]
    reaches = [make_reach(recorded_hand(f'{k}', times, each, make_obstacles(), goal), config) for k, each in enumerate(measured)]
    estimates, warnings = fit_plans(reaches, config)
    assert 1 / 1.2 < estimates['foc.lam'].value / 3e6 < 1.2
    assert any('foc.tau: the movements do not determine it' in words and 'clearance' in words for words in warnings)
    assert not any(words.startswith('foc.lam: the movements do not determine it') for words in warnings)
    assert any('lambda times the square of the noise' in words for words in warnings)


def test_positions_between_the_steps_are_those_of_constant_jerk(recovery: ModuleType) -> None:
    config = recovery.CONFIG
    solution = plan(make_reach(recovery.simulate_hands(1e-3, 1e6, np.random.default_rng(1), 1)[0], config), 1e-3, 1e6, config)
    assert solution is not None
    np.testing.assert_allclose(interpolate_plan(solution, solution.times), solution.path, atol=1e-12)
    fine = np.linspace(0.0, 1.0, 20001)
    jerk = np.diff(interpolate_plan(solution, fine), 3, axis=0) / (fine[1] - fine[0]) ** 3
    middle = (np.arange(config.foc.steps) * 400) + 200
    np.testing.assert_allclose(jerk[middle], solution.control, atol=0.05 * np.abs(solution.control).max())


def test_a_movement_that_reaches_no_goal_is_rejected() -> None:
    times = np.arange(0.0, 1.0, 0.02)
    short = recorded_hand('short', times, times[:, None] * np.array([0.1, 0.0]), make_obstacles(), np.array([[0.3, 0.0]]))
    with pytest.raises(RecordingError, match=r'short: ends 0.202 m from the nearest goal, not within 0.05 m'):
        make_reach(short, Config())
