# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`examples/plan_recovery`: tau and lambda are recovered from movements that were planned with them, or said to be unknown."""

import numpy as np
import pytest
import trials
from plan_recovery import Movement, interpolate_plan, plan, recover

import foc_ros


def test_recovered_from_mean_trajectories_with_1_mm_of_sensor_noise():
    """Of another seed, 1, tau comes out 15 % too large: the fixed strategy creeps along the steps."""
    tau, lam, count, found = trials.run_trial(3, repeats=1)
    assert count >= 4
    assert trials.is_recovered(tau, lam, found), (found.tau / tau, found.lam / lam)
    assert 0.7e-3 < found.stddev < 2.5e-3
    assert found.undetermined == () and max(found.log_stddev) < 0.2


def test_without_an_obstacle_lambda_is_determined_and_tau_is_not():
    config, goal, rng = trials.CONFIG, np.array([0.3, 0.0]), np.random.default_rng(5)
    times = np.arange(0.0, 1.001, 0.01)
    solution = plan(Movement(times, times[:, None] * goal, goal, ()), 1e-9, 3e6, config)
    assert solution is not None
    measured = [interpolate_plan(solution, times) + rng.normal(0.0, 1e-3, (len(times), 2)) for _ in range(4)]
    found = recover([Movement(times, each, goal, ()) for each in measured], config)
    assert 1 / 1.2 < found.lam / 3e6 < 1.2
    assert found.undetermined == ('tau',)


def test_a_movement_that_reaches_no_goal_is_rejected():
    times = np.arange(0.0, 1.0, 0.02)
    with pytest.raises(foc_ros.InputError, match=r'expected an end within 0.05 m of the goal, got 0.202 m'):
        Movement(times, times[:, None] * np.array([0.1, 0.0]), np.array([0.3, 0.0]), ())
