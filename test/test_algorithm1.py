# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The paper's loop as printed: what it ends in is a status, however far it goes."""

import numpy as np
import pytest
from reach_helpers import bowed, random_scene, reach, solved

from foc_ros.core.solution import Status


def dense(seed: int):
    """Return a problem that asks for much among many obstacles, and a guess."""
    generator = np.random.default_rng(seed)
    obstacles, goal, amplitude = random_scene(generator)
    noise, eta = generator.uniform(0.05, 0.15), generator.uniform(0.6, 0.95)
    return reach(obstacles, goal=goal, steps=30, noise=(noise, noise), eta=eta), bowed((0, 0), goal, 30, amplitude)


def test_lambda_beyond_what_numbers_hold_is_said():
    problem, guess = dense(21)
    solution = solved(problem, guess, 'algorithm1')
    assert solution.status is Status.ITERATION_LIMIT
    assert 'the surrogate is still violated' in solution.message
    assert 1e148 < solution.lam < 1e151
    assert 140 < solution.iterations < 160
    assert solution.qp_solves >= solution.iterations
    assert solution.eta < problem.eta
    assert np.isfinite(solution.mean).all()
    assert np.isfinite(solution.covariance).all()


def test_what_it_calls_solved_meets_eta_and_lambda_is_a_power_of_the_growth():
    met = 0
    for seed in range(12):
        problem, guess = dense(seed)
        solution = solved(problem, guess, 'algorithm1')
        assert solution.lam == pytest.approx(10.0 ** round(solution.tau / 5e-5), rel=1e-9)
        if solution.status is Status.SOLVED:
            assert solution.eta >= problem.eta
            met += 1
    assert met >= 8, 'of the other four, two are out of reach of `optimal` too, and two are stepped over'
