"""The least safety factor over all times, by brute force in narrow scenes."""

import numpy as np
import pytest
from reach_helpers import bowed, reach, solved

from foc_ros.core.obstacles.geometry import Edges, find_offset
from foc_ros.core.obstacles.risk import compute_safety_factor
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Shape, collect_obstacles
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.safety_preference import SafetyPreference

STRATEGIES = ('lv', 'hc', 'optimal', 'fixed', 'algorithm1')


def measure_factors(problem: Problem, control: np.ndarray, points: int = 100) -> np.ndarray:
    """Return the safety factors at `points` times a step, obstacle by obstacle, as the paper has them, for a certain start."""
    times = np.arange(points, points * problem.horizon.steps + 1) / points
    response = problem.horizon.position_response.at(times)
    scaled = control * problem.horizon.gain
    free = np.stack([np.interp(times, np.arange(problem.horizon.steps + 1), problem.free[:, axis]) for axis in (0, 1)], axis=1)
    position = free + response @ scaled
    spread = problem.noise_variance * scaled**2
    xx, yy, xy = (response[:, a] * response[:, b] @ spread for a, b in ((0, 0), (1, 1), (0, 1)))
    factors = []
    for row in range(len(problem.obstacles)):
        centre = problem.obstacles.centre[row] + times[:, None] * problem.drift[row]
        at = find_offset(*(position - centre).T, Edges(*(each[row] for each in problem.edges)))
        fixed = problem.obstacles.centre_covariance[row]
        nx, ny = at.normal_x, at.normal_y
        along = nx * nx * (xx + fixed[0, 0]) + ny * ny * (yy + fixed[1, 1]) + 2 * nx * ny * (xy + fixed[0, 1])
        factors.append(compute_safety_factor(at.distance, along, *(each[row] for each in problem.size)))
    return np.array(factors)


def narrow_scene(seed: int) -> tuple[Problem, np.ndarray]:
    """Return a problem with two random shapes with a gap of 1 to 20 mm, at times a third one, and a guess through the gap."""
    generator = np.random.default_rng(seed)
    gap, x, y = 10 ** generator.uniform(-3, -1.7), generator.uniform(0.12, 0.18), generator.uniform(-0.02, 0.02)
    shapes: list[Shape] = []
    for side in (-1, 1):
        radius, stddev = generator.uniform(0.004, 0.02), generator.choice([0.0, 0.001])
        width, height = generator.uniform(0.01, 0.06, 2)
        at = np.array([x, y + side * (gap / 2 + radius)])
        far = np.add(at, (0.0, side * height))
        velocity = (0.02, 0.0) if seed % 4 == 3 else (0.0, 0.0)
        shapes.append(
            (
                Circle(at, radius, stddev, velocity=velocity),
                Capsule(at, np.add(far, (width / 2, 0.0)), radius, stddev, velocity=velocity),
                Box(np.add(at, (0.0, side * height / 2)), (width, height), 0.0, radius, stddev, velocity=velocity),
            )[generator.integers(3)]
        )
    if seed % 3 == 0:
        shapes.append(Box((0.23, generator.uniform(-0.03, 0.03)), (0.02, 0.03), generator.uniform(-3, 3)))
    preference = SafetyPreference(beta=1.0, shortfall=3.0, dt=0.025)
    problem = reach(collect_obstacles(shapes), steps=40, noise=(0.05, 0.05), preference=preference)
    straight = bowed((0, 0), (0.3, 0), 40, 0.0)
    return problem, straight + np.array([0.0, y]) * np.sin(np.pi * straight[:, :1] / 0.3)


@pytest.mark.parametrize('strategy', STRATEGIES)
def test_nothing_is_below_the_least_safety_factor_that_is_reported(strategy):
    """At a hundred times a step, in scenes with gaps down to 1 mm."""
    wrong = {}
    for seed in range(30 if strategy in ('optimal', 'fixed') else 4):
        problem, guess = narrow_scene(seed)
        solution = solved(problem, guess, strategy, tau=1e-5, algorithm1_growth=1.5)
        least, reported = measure_factors(problem, solution.control.T.ravel()).min(), solution.safety_factor
        if reported > 0.0 and not reported - 1e-3 * max(reported, 0.01) <= least <= reported + 0.02 * max(reported, 0.1):
            wrong[seed] = (solution.status.value, reported, least)
    assert wrong == {}
