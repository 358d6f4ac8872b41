"""The least effort at a safety factor: margins, their derivatives, and the exchange of effort for safety."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, random_scene, reach

from foc_ros.core.config import FocConfig
from foc_ros.core.obstacles.chance_constraint import eta_of_k
from foc_ros.core.ocp.contacts.kkt_point import compute_class_angles
from foc_ros.core.ocp.contacts.surrogate_newton import Preference
from foc_ros.core.ocp.contacts.surrogate_point import SurrogatePoint, solve_surrogate_point
from foc_ros.core.ocp.solve import find_least_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start, warm_start
from foc_ros.core.safety_preference import HARD, SafetyPreference
from foc_ros.core.types import Solution, Status

DT, GRID = 0.02, 40
SEEDS = (1, 2, 3, 4, 5, 7, 8, 9, 11)  # in the others a gap is so narrow that the wanted k is out of reach
SOFT = SafetyPreference(beta=0.5, shortfall=0.25, fixed_cost=20.0, dt=DT)


def make_reach(seed: int, preference: SafetyPreference = HARD, **rest) -> tuple[Problem, np.ndarray]:
    """Return a problem among circles, and a guess."""
    obstacles, goal, amplitude = random_scene(np.random.default_rng(seed))
    problem = reach(obstacles, goal=goal, **{'noise': (0.1, 0.1), 'preference': preference, **rest})
    return problem, bowed((0, 0), goal, problem.horizon.steps, amplitude)


def solve_optimal(problem: Problem, guess: np.ndarray) -> Solution:
    return solve_problem(problem, cold_start(guess), FocConfig(strategy='optimal'))


def find_point(problem: Problem, guess: np.ndarray, k: float) -> SurrogatePoint:
    """Return the point of least effort at k."""
    hard = replace(problem, preference=HARD, eta=eta_of_k(k))
    start = warm_start(solve_optimal(hard, guess), hard)
    assert start.control is not None
    found = solve_surrogate_point(hard, start.control, start.contacts, k, compute_class_angles(hard, start.control))
    assert found is not None
    return found


@pytest.mark.parametrize('seed', SEEDS)
def test_the_rate_is_the_derivative_of_the_effort_by_k(seed):
    problem, guess = make_reach(seed)
    point = find_point(problem, guess, 2.0)
    h = 1e-4
    more, less = (find_point(problem, guess, 2.0 + step).effort for step in (h, -h))
    assert point.rate == pytest.approx((more - less) / (2 * h), rel=1e-3)


@pytest.mark.parametrize('seed', SEEDS)
def test_k_is_kept_between_the_steps_too(seed):
    """On a grid of 40 times a step no margin is below the least by more than a thousandth of k."""
    problem, guess = make_reach(seed)
    solution = solve_optimal(problem, guess)
    assert solution.status is Status.SOLVED
    assert least_k_on_grid(problem, solution) >= 0.999 * problem.wanted_k


def least_k_on_grid(problem: Problem, solution: Solution) -> float:
    """Return the least safety factor at 40 times a step, by propagating mean and covariance there step by step."""
    control, horizon = solution.control, problem.horizon
    least = np.inf
    for t in np.linspace(1.0, horizon.steps, GRID * (horizon.steps - 1) + 1):
        elapsed = t * horizon.dt - np.minimum(np.arange(horizon.steps), t) * horizon.dt
        after = np.maximum(elapsed - horizon.dt, 0.0)
        after[np.arange(horizon.steps) >= t] = elapsed[np.arange(horizon.steps) >= t] = 0.0
        effect = (elapsed**3 - after**3) / 6.0  # of a jerk that is constant during each step, on the position
        position = problem.initial_mean[:2] + effect @ control
        variance = (effect**2) @ (problem.noise * control) ** 2
        offset = position - problem.obstacles.centre
        mean = problem.size[0] - (offset**2).sum(axis=1)
        spread = problem.size[1] + 4.0 * (offset**2 @ variance)
        least = min(least, float((-mean / np.sqrt(spread)).min()))
    return least


def test_the_least_k_agrees_with_propagation_step_by_step():
    """For the triple integrator interpolation is exact, so that both find the same k."""
    problem, guess = make_reach(3)
    solution = solve_optimal(problem, guess)
    found = find_minimum_safety_factor(problem, solution.control.T.ravel(), between_steps=True)
    assert found.k == pytest.approx(least_k_on_grid(problem, solution), rel=1e-3)


@pytest.mark.parametrize('seed', SEEDS)
def test_a_soft_margin_gives_the_least_loss_of_all_k(seed):
    problem, guess = make_reach(seed, SOFT, noise=(0.15, 0.15))
    solution = solve_optimal(problem, guess)
    assert solution.status in (Status.SOLVED, Status.COMPROMISED)
    loss = SOFT.compute_loss(solution.effort, solution.safety_factor, problem.wanted_k)
    for k in np.linspace(0.3, problem.wanted_k, 10):
        effort = find_point(problem, guess, float(k)).effort
        assert loss <= SOFT.compute_loss(effort, float(k), problem.wanted_k) + 1e-5


def test_a_preference_leads_to_the_k_that_is_worth_its_effort():
    problem, guess = make_reach(2, noise=(0.15, 0.15))
    near = find_point(problem, guess, 1.5)
    angles = compute_class_angles(problem, near.control)
    for rate in (0.35, 0.5):
        preference = Preference(rate, 10.0, DT)
        point = solve_surrogate_point(problem, near.control, near.contacts, near.k, angles, preference)
        assert point is not None
        assert DT * point.rate / (10.0 + DT * point.effort) == pytest.approx(rate, rel=1e-4)


@pytest.mark.parametrize('seed', SEEDS)
def test_a_warm_start_finds_what_a_cold_one_finds(seed):
    for preference in (HARD, SOFT):
        problem, guess = make_reach(seed, preference)
        cold = solve_optimal(problem, guess)
        warm = solve_problem(problem, warm_start(cold, problem), FocConfig(strategy='optimal'))
        assert warm.status is cold.status
        assert warm.effort == pytest.approx(cold.effort, rel=1e-6)
        assert warm.qp_solves == 0


def test_a_start_of_uncertain_state_counts():
    """Half of it: the covariance at the start widens the margin, so that the same k takes more effort."""
    problem, guess = make_reach(4)
    uncertain = replace(problem, initial_covariance=np.diag([1e-6, 1e-6, 1e-6, 1e-6, 0.0, 0.0]), error_map=problem.horizon.powers)
    certain, doubtful = (solve_optimal(each, guess) for each in (problem, uncertain))
    assert doubtful.status is Status.SOLVED
    assert doubtful.effort > certain.effort
    control = doubtful.control.T.ravel()
    assert find_minimum_safety_factor(uncertain, control, between_steps=True).k == pytest.approx(problem.wanted_k, rel=1e-4)
