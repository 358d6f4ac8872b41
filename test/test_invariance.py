"""The answer does not depend on what is no part of the problem: mirror, frame, order, duplicates, units."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from reach_helpers import bowed, random_scene, reach

from foc_ros.core.config import FocConfig
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.types import Obstacles, Solution, Status

SEEDS = st.integers(0, 10_000)
STRATEGIES = pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])
FEW = settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much])


def scene(seed: int):
    obstacles, goal, amplitude = random_scene(np.random.default_rng(seed))
    return obstacles, goal, bowed((0, 0), goal, 40, amplitude)


def solve(
    obstacles: Obstacles, goal, guess, strategy: str, duration=1.0, noise=0.1, start=(0.0, 0.0), eta=0.8, **units
) -> Solution:
    problem = reach(obstacles, goal=goal, start=start, steps=40, duration=duration, noise=(noise, noise), eta=eta)
    return solve_problem(problem, cold_start(guess), replace(FocConfig(strategy=strategy), **units))


def well_posed(obstacles: Obstacles, goal, guess, strategy: str) -> Solution:
    """Solve a scene in which rounding decides nothing.

    eta is reached with something to spare, and it does not lie in a gap of what the curve of solutions reaches: where the
    touching step changes, k jumps, and the solution beyond the jump exceeds eta.
    """
    assume(solve(obstacles, goal, guess, strategy, eta=0.87).status is Status.SOLVED)
    solution = solve(obstacles, goal, guess, strategy)
    assert solution.status is Status.SOLVED
    assume(solution.lam <= 1.0 or solution.eta < 0.8 + 1e-4)
    return solution


def same(first: Solution, second: Solution, moved) -> None:
    """The second solution is the first one moved, within what the root in s and the relinearisation leave open."""
    assert second.status is Status.SOLVED
    assert second.effort == pytest.approx(first.effort, rel=1e-3)
    assert np.abs(second.path - moved(first.path)).max() < 5e-4


@STRATEGIES
@FEW
@given(SEEDS)
def test_mirror(strategy, seed):
    obstacles, goal, guess = scene(seed)
    flip = np.array([1.0, -1.0])
    mirrored = replace(obstacles, centre=obstacles.centre * flip)
    same(well_posed(obstacles, goal, guess, strategy), solve(mirrored, goal, guess * flip, strategy), lambda path: path * flip)


@STRATEGIES
@FEW
@given(SEEDS, st.integers(1, 3), st.floats(-5, 5))
def test_quarter_turns_and_shift(strategy, seed, quarters, shift):
    """Only by quarter turns: the model's noise acts along two axes, c_x|u_x| and c_y|u_y|, and has no covariance in between."""
    obstacles, goal, guess = scene(seed)
    turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), quarters)

    def moved(points):
        return points @ turn.T + shift

    turned = replace(obstacles, centre=moved(obstacles.centre))
    same(
        well_posed(obstacles, goal, guess, strategy),
        solve(turned, moved(goal), moved(guess), strategy, start=moved(np.zeros(2))),
        moved,
    )


@STRATEGIES
@FEW
@given(SEEDS, st.randoms(use_true_random=False))
def test_order_and_duplicates_of_obstacles(strategy, seed, random):
    obstacles, goal, guess = scene(seed)
    rows = [*range(len(obstacles)), *range(len(obstacles))]
    random.shuffle(rows)
    same(well_posed(obstacles, goal, guess, strategy), solve(obstacles.take(rows), goal, guess, strategy), lambda path: path)


@STRATEGIES
@FEW
@given(SEEDS, st.sampled_from([0.01, 0.1, 10.0, 100.0]))
def test_unit_of_length(strategy, seed, unit):
    """Lengths times a unit: tau and effort times its square, lambda unchanged."""
    obstacles, goal, guess = scene(seed)
    scaled = replace(
        obstacles, centre=obstacles.centre * unit, radius=obstacles.radius * unit, radius_stddev=obstacles.radius_stddev * unit
    )
    metres = well_posed(obstacles, goal, guess, strategy)
    other = solve(scaled, goal * unit, guess * unit, strategy, lv_delta=5e-5 * unit**2, hc_delta=1e-4 * unit**2)
    assert other.status is Status.SOLVED
    assert other.effort == pytest.approx(metres.effort * unit**2, rel=1e-3)
    assert np.abs(other.path / unit - metres.path).max() < 5e-4


@STRATEGIES
@FEW
@given(SEEDS, st.sampled_from([0.1, 0.5, 3.0, 10.0]))
def test_unit_of_time(strategy, seed, unit):
    """Times times a unit: jerk by its -3rd power, effort and lambda by its -6th."""
    obstacles, goal, guess = scene(seed)
    seconds = well_posed(obstacles, goal, guess, strategy)
    other = solve(obstacles, goal, guess, strategy, duration=unit, lam=unit**-6.0)
    assert other.status is Status.SOLVED
    assert other.effort == pytest.approx(seconds.effort * unit**-6.0, rel=1e-3)
    assert np.abs(other.path - seconds.path).max() < 5e-4
