# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Strategies `lv` and `hc` with a finite shortfall: the point with the least loss, and its limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, case_guess, case_problem, random_scene, reach, reference_cases

from foc_ros.core.config import FocConfig
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.safety_preference import SafetyPreference
from foc_ros.core.solution import Solution, Status

SOFT = SafetyPreference(beta=0.5, shortfall=1.0, dt=0.02)
SETTINGS = {name: FocConfig(strategy=name) for name in ('lv', 'hc')}
EVERY = pytest.mark.parametrize('strategy', SETTINGS)


def scenes(count: int, seed: int = 1) -> list[tuple[Problem, np.ndarray]]:
    """Return soft problems of three noises with their guesses."""
    generator, made = np.random.default_rng(seed), []
    for number in range(count):
        obstacles, goal, amplitude = random_scene(generator)
        noise = (0.05, 0.15, 0.3)[number % 3]
        problem = replace(reach(obstacles, goal=goal, noise=(noise, noise)), preference=SOFT)
        made.append((problem, bowed((0, 0), goal, 50, amplitude)))
    return made


def loss(solution: Solution, problem: Problem) -> float:
    return problem.preference.compute_loss(solution.effort, max(solution.safety_factor, 0.0), problem.wanted_k)


@EVERY
@pytest.mark.parametrize('case', reference_cases()[:4])
def test_an_infinite_shortfall_is_the_rule_of_the_paper(case, strategy):
    problem, start = case_problem(case), cold_start(case_guess(case))
    paper = solve_problem(problem, start, SETTINGS[strategy])
    hard = solve_problem(replace(problem, preference=replace(SOFT, shortfall=math.inf)), start, SETTINGS[strategy])
    assert (hard.status, hard.message, hard.effort, hard.lam) == (paper.status, paper.message, paper.effort, paper.lam)
    np.testing.assert_array_equal(hard.mean, paper.mean)


@EVERY
def test_a_cheap_eta_is_met_with_the_same_effort_and_a_compromise_costs_no_more_than_what_it_gains(strategy):
    """log J / J_0 <= shortfall / beta (k_wanted - k_0), J_0 and k_0 those of the least effort."""
    kinds = []
    for problem, guess in scenes(12):
        hard = solve_problem(
            replace(problem, preference=replace(SOFT, shortfall=math.inf)), cold_start(guess), SETTINGS[strategy]
        )
        soft = solve_problem(problem, cold_start(guess), SETTINGS[strategy])
        kinds.append((hard.status, soft.status))
        if soft.status is Status.SOLVED:
            assert soft.effort == pytest.approx(hard.effort, rel=1e-6)
        elif hard.status is Status.SOLVED:
            assert loss(soft, problem) < loss(hard, problem)
        if soft.status is Status.COMPROMISED:
            least = solve_problem(problem, cold_start(guess), FocConfig(strategy='fixed', tau=0.0, lam=1.0))
            gained = problem.wanted_k - least.safety_factor
            assert math.log(soft.effort / least.effort) <= SOFT.shortfall / SOFT.beta * gained + 1e-6
    assert {soft for hard, soft in kinds if hard is Status.ETA_UNREACHABLE} == {Status.COMPROMISED}
    assert kinds.count((Status.SOLVED, Status.SOLVED)) >= 4
    assert kinds.count((Status.SOLVED, Status.COMPROMISED)) >= 1
