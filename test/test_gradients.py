# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The derivatives of margins by finite differences: the second ones make warm predictions fast, and no result shows them."""

import numpy as np
import pytest
from reach_helpers import bowed, reach, solved

from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, Shape, collect_obstacles
from foc_ros.core.ocp import gradients
from foc_ros.core.ocp.gradients import Gradients
from foc_ros.core.ocp.margin import Contacts, Margins
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.plant.plants import condense, discretise_damped_mass

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


def list_minima(margins: Margins, control: np.ndarray) -> list[float]:
    """Return the times of the local minima of a margin, to a tenth of a step."""
    times = np.arange(1.5, STEPS - 0.4, 0.1)
    values = linearise(margins, control, times).value
    return times[np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])) + 1].tolist()


def find_least_factor(margins: Margins, control: np.ndarray, time: float) -> tuple[float, float]:
    """Return the time near another at which the safety factor is least, and this factor."""
    none, within, motion = np.zeros(21, dtype=np.intp), 0.3, margins.move(np.zeros(1, dtype=np.intp), control[None])
    for _ in range(8):
        times = time + within * np.linspace(-1, 1, 21)
        factors = margins.measure(Contacts(none, none, times), none, motion, np.zeros(21)).factor
        time, within = float(times[factors.argmin()]), within / 5
    return time, float(factors.min())


def find_least(margins: Margins, control: np.ndarray, time: float, within: float = 0.3) -> tuple[float, float]:
    """Return the time near another at which the margin is least, and this margin."""
    for _ in range(8):
        times = time + within * np.linspace(-1, 1, 21)
        values = linearise(margins, control, times).value
        time, within = float(times[values.argmin()]), within / 5
    return time, float(values.min())


def random_directions(control: np.ndarray, count: int = 3) -> np.ndarray:
    return np.abs(control).max() * np.random.default_rng(2).standard_normal((count, len(control)))


def is_smooth(margins: Margins, control: np.ndarray, time: float) -> bool:
    """Return whether the nearest point is on one side or one corner around a time."""
    none, times = np.zeros(5, dtype=np.intp), time + np.linspace(-0.1, 0.1, 5)
    found = margins.measure(Contacts(none, none, times), none, margins.move(none[:1], control[None]), np.full(5, K))
    return len(set(found.is_on_edge.tolist())) == 1


def check_derivatives(made: Gradients, control: np.ndarray, find, least: float, rate: float = 1.0, within: float = 1e-9) -> None:
    """Compare the derivatives at a control with differences of `find`, a function of the control, times a rate."""
    for direction in 1e-3 * random_directions(control):
        more, less = (find(control + sign * direction) for sign in (1, -1))
        along = made.factors[0] @ direction
        added = made.diagonal[0] @ direction**2 + along @ made.weights[0] @ along
        assert made.gradient[0] @ direction == pytest.approx(rate * (more - less) / 2, rel=1e-3, abs=1e-9)
        assert added == pytest.approx(-rate * (more - 2 * least + less), rel=2e-2, abs=within)


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


@EVERY
def test_the_hessian_is_that_of_the_least_margin_which_slides(case):
    """Second differences of G(u) = min_t g(u, t), minus those that a unit of the multiplier adds to the Lagrangian."""
    make, *given = MADE[case]
    problem, control = make(*given)
    margins, seen = Margins([problem], np.zeros(1), is_chance=True), 0
    for near in list_minima(margins, control):
        time, least = find_least(margins, control, near)
        if not is_smooth(margins, control, time):
            continue
        seen += 1
        made = linearise(margins, control, np.array([time]))
        assert made.value[0] == pytest.approx(least, abs=1e-9)
        check_derivatives(made, control, lambda moved, time=time: find_least(margins, moved, time)[1], least)
    assert seen or 'box' in case or 'hull' in case, 'a circle has a least margin where it is smooth'


@EVERY
def test_where_the_safety_factor_is_free_the_hessian_is_that_of_the_least_one(case):
    """Second differences of min_t k(u, t), times the rate r by which a margin falls with k."""
    make, *given = MADE[case]
    problem, control = make(*given)
    margins, seen = Margins([problem], np.zeros(1), is_chance=True), 0
    for near in list_minima(margins, control):
        time, k = find_least_factor(margins, control, near)
        if abs(time - near) > 0.29 or k <= 0.0 or not is_smooth(margins, control, time):
            continue
        seen += 1
        made = linearise(margins, control, np.array([time]), k, is_free=True)
        assert made.value[0] == pytest.approx(0.0, abs=1e-9)
        factor = lambda moved, time=time: find_least_factor(margins, moved, time)[1]  # noqa: E731
        check_derivatives(made, control, factor, k, made.stddev_rate[0], within=2e-9)
    assert seen or 'circle' not in case, 'a circle has a least safety factor where it is smooth'


@pytest.mark.parametrize('name', ['box', 'sharp box', 'hull', 'moving capsule'])
def test_the_gradient_of_a_margin_that_is_least_over_a_corner_of_its_course(name):
    """Where the nearest point passes from an edge to a corner the margin has a kink in time: G is its least value there."""
    found = 0
    for tau in (1e-4, 3e-4, 1e-3, 3e-3):
        problem, control = make_problem(name, tau=tau)
        margins = Margins([problem], np.zeros(1), is_chance=True)
        for near in list_minima(margins, control):
            time, _ = find_least(margins, control, near)
            if abs(time - near) > 0.2:
                continue  # no minimum of its own
            gradient = linearise(margins, control, np.array([time])).gradient[0]
            pairs = []
            for direction in 1e-5 * random_directions(control):
                more, less = (find_least(margins, control + sign * direction, time)[1] for sign in (1, -1))
                pairs.append((gradient @ direction, (more - less) / 2))
            found_rates, expected = np.array(pairs).T
            np.testing.assert_allclose(found_rates, expected, atol=0.1 * np.abs(expected).max())
            found += not is_smooth(margins, control, time)
    assert found or name in ('box', 'moving capsule')
