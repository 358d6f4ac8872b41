"""A mean that is held off circles at a few contacts: Newton steps on its Karush-Kuhn-Tucker equations, its class, its check.

Where sequential QPs would creep along a circle, these jump: they know its curvature. A contact is held at its step, as a row of a
QP is, or it slides: it is then where the mean, between its steps too, comes closest to the circle.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.dynamics.condensed import apart
from foc_ros.core.homotopy import compute_swept_angles, is_same_class
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import NO_TIMES, Cost, compute_depths, required_margins, wanted_distance
from foc_ros.core.ocp.working_set import DualStatus, solve_with_rows
from foc_ros.core.types import Array

from .active_set import CLEAR, SETTLED
from .contacts import Contacts, merge
from .hermite import find_penetrations
from .newton import half_planes_between, newton_on_contacts

STAYS = 3e-7
"""Largest move of the mean that counts as staying, relative to the scene's extent."""
LEAP = 0.1
"""Depth in a circle between two steps, relative to the smallest, from which on the mean may be on the wrong side of it."""


def newton_at_fixed_times(
    problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float
) -> tuple[Array, Contacts] | None:
    """Find the solution near a control (2N,) that touches at the given steps; None where it is none, or enters a circle."""
    inverse, _, factor = cost.factors
    motion, free, centre, drift = problem.circles
    found, control, time, force = newton_on_contacts(
        motion,
        free,
        inverse,
        factor,
        cost.goal_control,
        centre,
        drift,
        *required_margins(problem, tau),
        *contacts.columns,
        np.ascontiguousarray(control, dtype=float),
        0,
        SETTLED * problem.extent,
    )
    if not found or (force <= 0).any():
        return None
    depth = compute_depths(problem.positions(control), problem.centres, wanted_distance(problem, tau))
    return None if depth.max(initial=0.0) > CLEAR * problem.extent else (control, Contacts(contacts.obstacle, time, force))


def merge_contacts(problem: Problem, contacts: Contacts) -> Contacts:
    """Return contacts that came from rows at steps, or from another problem, as they slide: one for each place."""
    return Contacts(*merge(*contacts.columns, problem.first_alike))


def find_crossings(problem: Problem, control: Array, tau: float) -> Array:
    """Return the times at which the mean of a control (2N,) is much too near a circle between the steps."""
    reach, missing, pace = required_margins(problem, tau)
    if not len(reach):
        return NO_TIMES
    much = LEAP * float(reach.min())
    times: Array = find_penetrations(
        problem.course(control), problem.obstacles.centre, problem.drift, reach, missing, pace, much
    )[:, 1]
    return times


def class_angles(problem: Problem, control: Array) -> Array:
    """Return the angles (m,) that the mean of a control (2N,) sweeps about the centres, which tell its class."""
    return compute_swept_angles(problem.course(control)[:2].T, problem.courses)


def is_in_class(problem: Problem, control: Array, way: Array) -> bool:
    """Whether the mean of a control (2N,) passes every circle on the same side as a way (m,), as of `way_of`."""
    return is_same_class(class_angles(problem, control), way)


def is_fixed_point(problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float) -> bool:
    """Whether the QP linearised at a control (2N,), with a row for each contact, has that control as its solution."""
    if not len(contacts):
        return True
    rows, limits = half_planes_between(
        *problem.circles, *required_margins(problem, tau), control, contacts.obstacle, contacts.time
    )
    answer = solve_with_rows(cost, rows, limits)
    if isinstance(answer, DualStatus):
        return False
    return apart(problem.horizon.maps[:2], control, answer) < STAYS * problem.extent
