# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The derivatives of margins by finite differences: the second ones make warm predictions fast, and no result shows them."""

import numpy as np
import pytest
from reach_helpers import bowed, reach, solved

from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, Shape, collect_obstacles
from foc_ros.core.ocp import gradients
from foc_ros.core.ocp.margin import Contacts, Margins
from foc_ros.core.ocp.problem import rest_to_goal
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


def make_problem(name, start, mass=None):
    """Return a problem, and a control (2N,) in units of `Horizon.gain` that passes near its obstacle; mass: a damped one."""
    obstacles, noise = collect_obstacles(SHAPES[name]), np.array([0.1, 0.15])
    if mass is None:
        made = reach(obstacles, goal=GOAL, steps=STEPS, noise=noise, initial_covariance=STARTS[start])
    else:
        horizon = condense(discretise_damped_mass(1.0 / STEPS, mass, 4.0), STEPS)
        made = rest_to_goal(horizon, np.zeros(4), np.array(GOAL), obstacles, noise, 0.9)
    solution = solved(made, bowed((0, 0), GOAL, STEPS, 0.08), 'fixed', tau=1e-3, lam=1e4 if mass is None else 10.0)
    return made, solution.control.T.ravel() * made.horizon.gain


MADE = {
    **{f'{name}, {start} start': (name, start) for name in SHAPES for start in STARTS},
    **{f'{name}, damped mass': (name, 'certain', 1.5) for name in ('circle', 'box')},
}


def linearise(margins, control, times, k=K, slides=True, is_free=False):
    count = len(times)
    none = np.zeros(count, dtype=np.intp)
    controls, is_held = np.tile(control, (count, 1)), np.full(count, slides)
    return gradients.linearise(
        margins, Contacts(none, none, times), controls, np.full(count, k), is_held, np.full(count, is_free)
    )


def list_minima(margins, control):
    """Return the times of the local minima of a margin, to a tenth of a step."""
    times = np.arange(1.5, STEPS - 0.4, 0.1)
    values = linearise(margins, control, times).value
    return times[np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])) + 1].tolist()


def find_least(margins, control, time, is_free=False):
    """Return the time near another at which the margin, or the safety factor that is free, is least, and its value then."""
    none, within = np.zeros(21, dtype=np.intp), 0.3
    motion = margins.move(np.zeros(1, dtype=np.intp), control[None])
    for _ in range(8):
        times = time + within * np.linspace(-1, 1, 21)
        if is_free:
            values = margins.measure(Contacts(none, none, times), none, motion, np.zeros(21)).factor
        else:
            values = linearise(margins, control, times).value
        time, within = float(times[values.argmin()]), within / 5
    return time, float(values.min())


def is_smooth(margins, control, time):
    """Return whether the nearest point is on one side or one corner around a time."""
    none, times = np.zeros(5, dtype=np.intp), time + np.linspace(-0.1, 0.1, 5)
    found = margins.measure(Contacts(none, none, times), none, margins.move(none[:1], control[None]), np.full(5, K))
    return len(set(found.is_on_edge.tolist())) == 1


def check_derivatives(made, control, find, least, rate, within):
    """Compare the derivatives at a control with differences of `find`, a function of the control, times a rate."""
    directions = np.random.default_rng(2).standard_normal((3, len(control)))
    for direction in 1e-3 * np.abs(control).max() * directions:
        more, less = (find(control + sign * direction) for sign in (1, -1))
        along = made.factors[0] @ direction
        added = made.diagonal[0] @ direction**2 + along @ made.weights[0] @ along
        assert made.gradient[0] @ direction == pytest.approx(rate * (more - less) / 2, rel=1e-3, abs=1e-9)
        assert added == pytest.approx(-rate * (more - 2 * least + less), rel=2e-2, abs=within)


@pytest.mark.parametrize('case', MADE)
@pytest.mark.parametrize('is_free', [False, True], ids=['margin', 'safety factor'])
def test_the_hessian_is_that_of_the_least_margin_which_slides_or_of_the_least_safety_factor(case, is_free):
    """Second differences of G(u) = min_t g(u, t), minus those that a unit of the multiplier adds to the Lagrangian.

    Where the safety factor is free, those of min_t k(u, t), times the rate r by which a margin falls with k.
    """
    problem, control = make_problem(*MADE[case])
    margins, seen = Margins([problem], np.zeros(1), is_chance=True), 0
    for near in list_minima(margins, control):
        time, least = find_least(margins, control, near, is_free)
        if not is_smooth(margins, control, time) or (is_free and (abs(time - near) > 0.29 or least <= 0.0)):
            continue
        seen += 1
        made = linearise(margins, control, np.array([time]), least if is_free else K, is_free=is_free)
        assert made.value[0] == pytest.approx(0.0 if is_free else least, abs=1e-9)
        rate, within = (made.stddev_rate[0], 2e-9) if is_free else (1.0, 1e-9)
        find = lambda moved, time=time: find_least(margins, moved, time, is_free)[1]  # noqa: E731
        check_derivatives(made, control, find, least, rate, within)
    assert seen or 'circle' not in case, 'a circle has a least margin where it is smooth'
