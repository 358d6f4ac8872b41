# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Margins by finite differences and brute force: their derivatives, and the least safety factor over all times."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, reach, solved

from foc_ros.core.obstacles.geometry import Edges, find_offset
from foc_ros.core.obstacles.risk import compute_safety_factor
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, Shape, collect_obstacles
from foc_ros.core.ocp import gradients
from foc_ros.core.ocp.gradients import Gradients
from foc_ros.core.ocp.margin import Contacts, Margins
from foc_ros.core.ocp.minima import find_least_factors
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.plant.plants import condense, discretise_damped_mass
from foc_ros.core.safety_preference import SafetyPreference

STEPS, GOAL, K = 24, (0.3, 0.02), 2.0
SHAPES: dict[str, list[Shape]] = {
    'circle': [Circle((0.15, 0.0), radius=0.03)],
    'moving uncertain circle': [Circle((0.14, -0.02), 0.03, 0.003, velocity=(0.03, 0.02), centre_stddev=0.002)],
    'box': [Box((0.15, 0.0), size=(0.06, 0.04), yaw=0.4, radius=0.01, radius_stddev=0.002)],
    'sharp box': [Box((0.14, -0.01), size=(0.08, 0.03), yaw=-0.3)],
    'moving capsule': [Capsule((0.12, -0.01), (0.17, 0.02), 0.015, 0.002, velocity=(0.02, -0.03), centre_stddev=0.002)],
    'hull': [Hull([(0.11, -0.03), (0.17, -0.04), (0.19, 0.0), (0.14, 0.02)], radius=0.01)],
}
STARTS = {'certain': np.zeros((6, 6)), 'uncertain': 1e-6 * (np.eye(6) + 0.3)}
STRATEGIES = ('lv', 'hc', 'optimal', 'fixed', 'algorithm1')


def make_problem(name: str, start: str = 'certain', tau: float = 1e-3) -> tuple[Problem, np.ndarray]:
    """Return a problem, and a control (2N,) in units of `Horizon.gain` that passes near its obstacle."""
    obstacles = collect_obstacles(SHAPES[name])
    made = reach(obstacles, goal=GOAL, steps=STEPS, noise=(0.1, 0.15), initial_covariance=STARTS[start])
    solution = solved(made, bowed((0, 0), GOAL, STEPS, 0.08), 'fixed', tau=tau, lam=1e4)
    return made, solution.control.T.ravel() * made.horizon.gain


def make_mass_problem(name: str) -> tuple[Problem, np.ndarray]:
    """Return the same for a damped mass."""
    horizon = condense(discretise_damped_mass(1.0 / STEPS, 1.5, 4.0), STEPS)
    made = rest_to_goal(horizon, np.zeros(4), np.array(GOAL), collect_obstacles(SHAPES[name]), np.array([0.1, 0.15]), 0.9)
    solution = solved(made, bowed((0, 0), GOAL, STEPS, 0.08), 'fixed', tau=1e-3, lam=10.0)
    return made, solution.control.T.ravel() * horizon.gain


MADE = {
    **{f'{name}, {start} start': (make_problem, name, start) for name in SHAPES for start in STARTS},
    **{f'{name}, damped mass': (make_mass_problem, name) for name in ('circle', 'box')},
}
EVERY = pytest.mark.parametrize('case', MADE)


def linearise(
    margins: Margins, control: np.ndarray, times: np.ndarray, k: float = K, slides: bool = True, is_free: bool = False
) -> Gradients:
    count = len(times)
    none = np.zeros(count, dtype=np.intp)
    controls, is_held = np.tile(control, (count, 1)), np.full(count, slides)
    return gradients.linearise(
        margins, Contacts(none, none, times), controls, np.full(count, k), is_held, np.full(count, is_free)
    )


def random_directions(control: np.ndarray, count: int = 3) -> np.ndarray:
    return np.abs(control).max() * np.random.default_rng(2).standard_normal((count, len(control)))


def is_smooth(margins: Margins, control: np.ndarray, time: float) -> bool:
    """Return whether the nearest point is on one side or one corner around a time."""
    none, times = np.zeros(5, dtype=np.intp), time + np.linspace(-0.1, 0.1, 5)
    found = margins.measure(Contacts(none, none, times), none, margins.move(none[:1], control[None]), np.full(5, K))
    return len(set(found.is_on_edge.tolist())) == 1


@EVERY
def test_the_gradient_of_a_margin_is_its_derivative_at_any_time(case):
    make, *given = MADE[case]
    problem, control = make(*given)
    margins = Margins([problem], np.zeros(1), is_chance=True)
    times = np.array([time for time in np.arange(2.3, STEPS - 1, 0.7) if is_smooth(margins, control, time)])
    assert len(times) > 8
    at, h = linearise(margins, control, times), 1e-4
    for direction in 1e-6 * random_directions(control):
        more, less = (linearise(margins, control + sign * direction, times).value for sign in (1, -1))
        expected = (more - less) / 2
        np.testing.assert_allclose(at.gradient @ direction, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())
    more, less = (linearise(margins, control, times, K + sign * h).value for sign in (1, -1))
    np.testing.assert_allclose(-at.stddev_rate, (more - less) / (2 * h), rtol=1e-6)


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
    for seed in range(30 if strategy in ('optimal', 'fixed') else 8):
        problem, guess = narrow_scene(seed)
        solution = solved(problem, guess, strategy, tau=1e-5, algorithm1_growth=1.5)
        least, reported = measure_factors(problem, solution.control.T.ravel()).min(), solution.safety_factor
        if reported > 0.0 and not reported - 1e-3 * max(reported, 0.01) <= least <= reported + 0.02 * max(reported, 0.1):
            wrong[seed] = (solution.status.value, reported, least)
    assert wrong == {}


def test_times_before_the_hand_has_to_be_out_of_a_margin_do_not_count():
    near = collect_obstacles([Circle((0.0, 0.021), 0.02, 0.002)])
    problem = reach(near, recovery_s=0.3)
    control = solved(problem, bowed((0, 0), (0.3, 0), 50, -0.02), 'optimal').control.T.ravel() * problem.horizon.gain
    counted, all_times = (Margins([replace(problem, recovery_s=each)], np.zeros(1), is_chance=True) for each in (0.3, 0.0))
    (k,), _, (time,) = find_least_factors(counted, control[None])
    (least,), _, (first,) = find_least_factors(all_times, control[None])
    assert k > least
    assert time >= 15.0 > first
