"""The derivatives of the margin of a polygon at a vertex, on an edge, inside, and where a contact is held at a corner.

Each is compared with finite differences along random directions of the control. The kernels are run as plain Python.
"""

from types import ModuleType

import numpy as np
import pytest
from reach_helpers import bowed, reach, solved

from foc_ros.core.dynamics import condensed, impulse_response
from foc_ros.core.obstacles import rounded_polygon
from foc_ros.core.obstacles.shapes import Box, Capsule, Hull, Shape, collect_obstacles
from foc_ros.core.ocp import clearance
from foc_ros.core.ocp.contacts import corners, hermite, surrogate, surrogate_newton
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.problem import Problem

STEPS, K, MULTIPLIER = 24, 2.0, 3.0
GOAL = (0.3, 0.02)
SHAPES: dict[str, Shape] = {
    'box': Box((0.15, 0.0), size=(0.06, 0.04), yaw=0.4, radius=0.01, radius_stddev=0.002),
    'sharp box': Box((0.14, -0.01), size=(0.08, 0.03), yaw=-0.3),
    'capsule': Capsule((0.12, -0.01), (0.17, 0.02), radius=0.015, radius_stddev=0.002, centre_stddev=0.002),
    'moving hull': Hull([(0.11, -0.03), (0.17, -0.04), (0.19, 0.0), (0.14, 0.02)], radius=0.01, velocity=(0.03, 0.02)),
}
EVERY = pytest.mark.parametrize('name', SHAPES)
MODULES: tuple[ModuleType, ...] = (
    impulse_response,
    condensed,
    rounded_polygon,
    clearance,
    hermite,
    surrogate,
    corners,
    surrogate_newton,
)


@pytest.fixture(autouse=True)
def interpreted(monkeypatch):
    """Run the kernels of the margins as plain Python: to compile them for calls from here takes longer than the tests."""
    for module in MODULES:
        for name, kernel in list(vars(module).items()):
            if hasattr(kernel, 'py_func'):
                monkeypatch.setattr(module, name, kernel.py_func)


def make_problem(shape: Shape, amplitude: float = 0.08, tau: float = 1e-3) -> tuple[Problem, np.ndarray]:
    """Return a problem with an uncertain start, and a control (2N,) that passes near its obstacle."""
    start = 1e-6 * (np.eye(6) + 0.3)
    made = reach(collect_obstacles([shape]), goal=GOAL, steps=STEPS, noise=(0.1, 0.15), initial_covariance=start)
    return made, np.ascontiguousarray(
        solved(made, bowed((0, 0), GOAL, STEPS, amplitude), 'fixed', tau=tau, lam=1e4).control.T.ravel()
    )


def evaluate(problem: Problem, control: np.ndarray, time: float, scale: float = 0.0) -> surrogate.Margin:
    trajectory = problem.trajectory(control)
    return surrogate.evaluate_margin(problem.terms, problem.obstacles_with_reach(0.0), trajectory, control, 0, time, K, scale)


def find_places(problem: Problem, control: np.ndarray) -> dict[bool, list[float]]:
    """Return times away from corners at which the nearest point is on an edge, and at which it is a vertex."""
    places: dict[bool, list[float]] = {False: [], True: []}
    for time in np.arange(2.3, STEPS - 1, 0.5):
        near = [evaluate(problem, control, time + step).is_on_edge for step in (-0.1, 0.0, 0.1)]
        if len(set(near)) == 1:
            places[near[1]].append(float(time))
    return places


def random_directions(control: np.ndarray, count: int = 4) -> np.ndarray:
    return np.abs(control).max() * np.random.default_rng(2).standard_normal((count, len(control)))


@EVERY
def test_the_row_of_a_margin_is_its_derivative_by_the_control(name):
    problem, control = make_problem(SHAPES[name])
    places = find_places(problem, control)
    assert places[True] and places[False]
    for time in (*places[True], *places[False]):
        at = evaluate(problem, control, time)
        for direction in 1e-6 * random_directions(control):
            more, less = (evaluate(problem, control + sign * direction, time, at.scale) for sign in (1, -1))
            assert at.row @ direction == pytest.approx((more.value - less.value) / 2, rel=1e-4, abs=1e-12)
            change = (more.stddev**2 - less.stddev**2) / 2
            assert at.variance_row @ direction == pytest.approx(change, rel=1e-4, abs=1e-15)


def test_inside_a_polygon_the_margin_grows_towards_the_nearest_edge():
    made = reach(collect_obstacles([SHAPES['box']]), goal=GOAL, steps=STEPS, noise=(0.1, 0.15))
    straight = solved(reach(collect_obstacles([]), goal=GOAL, steps=STEPS), bowed((0, 0), GOAL, STEPS, 0.0), 'fixed')
    control = np.ascontiguousarray(straight.control.T.ravel())
    inside = [t for t in np.arange(2.3, STEPS - 1, 0.5) if evaluate(made, control, t).side < 0.0]
    assert len(inside) > 3
    for time in inside:
        at = evaluate(made, control, time)
        assert at.value < -SHAPES['box'].radius / 2
        for direction in 1e-7 * random_directions(control):
            more, less = (evaluate(made, control + sign * direction, time, at.scale).value for sign in (1, -1))
            assert at.row @ direction == pytest.approx((more - less) / 2, rel=1e-3, abs=1e-12)


def linearise(problem: Problem, control: np.ndarray, time: float) -> surrogate_newton.Linearisation:
    contacts = Contacts(np.zeros(1, dtype=np.intp), np.array([time]), np.array([MULTIPLIER]))
    return surrogate_newton.linearise_conditions(problem.terms, problem.obstacles_with_reach(0.0), control, contacts, K)


def multiply_curvature(made: surrogate_newton.Linearisation, problem: Problem, direction: np.ndarray) -> np.ndarray:
    """Return the product of a direction with what a contact adds to the Hessian of the Lagrangian."""
    low = made.rows[: len(made.blocks[0])]
    added = made.diagonal - 2.0 * (1.0 + problem.terms.cost.weighted_variance)
    return added * direction + low.T @ (made.blocks[0] @ (low @ direction))


@EVERY
def test_second_derivatives_at_a_vertex_and_on_an_edge(name):
    problem, control = make_problem(SHAPES[name])
    places, h = find_places(problem, control), 1e-3
    for time in (*places[True][::3], *places[False][::3]):
        at, made = evaluate(problem, control, time), linearise(problem, control, time)
        if made.slides[0] == 0.0:
            continue  # held at a corner near this time
        count = len(made.blocks[0]) + 1
        np.testing.assert_allclose(made.rows[count], at.row, rtol=1e-9)
        later, earlier = (evaluate(problem, control, time + step, at.scale).row for step in (h, -h))
        np.testing.assert_allclose(made.rows[count + 1], (later - earlier) / (2 * h), atol=1e-6 * np.abs(at.row).max())
        for direction in 1e-5 * random_directions(control, 2):
            more, less = (evaluate(problem, control + sign * direction, time, at.scale).row for sign in (1, -1))
            expected = -MULTIPLIER * (more - less) / 2
            np.testing.assert_allclose(
                multiply_curvature(made, problem, direction), expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max()
            )


def find_kink(problem: Problem, control: np.ndarray, time: float):
    terms, obstacles, trajectory = problem.terms, problem.obstacles_with_reach(0.0), problem.trajectory(control)
    here = surrogate.evaluate_margin(terms, obstacles, trajectory, control, 0, time, K, 0.0)
    return surrogate.find_kink(terms, obstacles, trajectory, control, 0, time, K, here)


def find_corner_time(problem: Problem, control: np.ndarray, time: float) -> float:
    """Return the time near another at which the mean is over a corner, infinite if there is none."""
    for _ in range(6):
        if time < STEPS:
            time = corners.find_corner(problem.obstacles_with_reach(0.0), problem.trajectory(control), 0, time, 1.0).time
    return float(time)


def find_kinks() -> list[tuple[Problem, np.ndarray, float]]:
    """Return places where a margin is least at a corner, one for each of some random boxes and capsules where there is one."""
    found = []
    for seed in range(60):
        generator = np.random.default_rng(seed)
        size = generator.uniform(0.02, 0.07, 2) * (1.0, generator.integers(2))
        box = Box((0.15, generator.uniform(-0.02, 0.02)), size, generator.uniform(-3, 3), 0.01, 0.002)
        problem, control = make_problem(box, generator.choice([-0.1, 0.1]), 10 ** generator.uniform(-4, -2.5))
        times = [find_corner_time(problem, control, time) for time in np.arange(3.0, STEPS - 2.0)]
        found += [
            (problem, control, time) for time in times if time < STEPS and find_kink(problem, control, time)[0].time < np.inf
        ][:1]
    return found


def test_the_derivatives_of_a_margin_that_is_held_at_a_corner(monkeypatch):
    """G(u) = g(u, s(u)) at the time s(u) at which the mean is over the corner: its gradient, its Hessian, its change with k.

    The Hessian is exact but for a term of the order of the difference in time, which is smaller here than in the solver.
    """
    for module in (surrogate, surrogate_newton):
        monkeypatch.setattr(module, 'TIME_STEP', 1e-4)
    kinks = find_kinks()
    assert len(kinks) >= 5
    for problem, control, near in kinks:
        corner, (at, _, _) = find_kink(problem, control, near)
        made = linearise(problem, control, near)
        assert made.slides[0] == 0.0
        count, by_k = len(made.blocks[0]) + 1, len(made.rows) - 1 - len(problem.terms.cost.softness)

        def hold(other: np.ndarray, problem=problem, corner=corner, at=at) -> surrogate.Margin:
            return evaluate(problem, other, find_corner_time(problem, other, corner.time), at.scale)

        expected, found = [], []
        for direction in 1e-4 * random_directions(control):
            more, less, middle = hold(control + direction), hold(control - direction), hold(control)
            slope, bend = (more.value - less.value) / 2, more.value - 2 * middle.value + less.value
            spread = at.scale * (more.stddev - less.stddev) / 2
            expected.append([slope, -MULTIPLIER * bend, MULTIPLIER * spread])
            curvature = direction @ multiply_curvature(made, problem, direction)
            found.append([made.rows[count] @ direction, curvature, made.rows[by_k] @ direction])
        largest = np.abs(expected).max(axis=0)
        assert (np.abs(np.subtract(found, expected)) <= [1e-4, 5e-2, 1e-2] * largest).all()
