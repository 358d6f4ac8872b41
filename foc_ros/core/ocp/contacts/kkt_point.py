"""Points that satisfy the Karush-Kuhn-Tucker conditions at given (tau, lambda): found by Newton steps, and checked by a QP."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.classes import compute_swept_angles
from foc_ros.core.dynamics.condensed import largest_shift
from foc_ros.core.kernels import Matrix, Vector, compiled, compiled_separately, freeze
from foc_ros.core.obstacles.rounded_polygon import find_normal, find_offset, measure_half_widths
from foc_ros.core.ocp.clearance import SMALLEST_DISTANCE, find_deepest, find_penetrations, required_distance
from foc_ros.core.ocp.minimum_safety_factor import MinimumSafetyFactor, minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import NO_TIMES, solve_cost
from foc_ros.core.ocp.terms import CostTerms, Motion, MovingObstacles, ProblemTerms
from foc_ros.core.ocp.working_set import DualQP, DualStatus, range_space, solve_dual
from foc_ros.core.types import Array

from .active_set import CLEAR, NEWTON_TOLERANCE, update_active_contacts
from .contacts import Contacts
from .hermite import compute_trajectory, interpolate, interpolation_row
from .newton import newton_on_contacts
from .swept_angles import is_same_class, sweep_angles

STAYS = 3e-7
"""Largest move of the mean, relative to the scene, at which a linearisation counts as returning its own control."""
CROSSING = 0.1
"""Depth in an obstacle between two steps, relative to half the width of the thinnest, from which the mean may be on the wrong
side of it."""
ANY_CLASS = np.zeros(0)


class KktPoint(NamedTuple):
    """A control (2N,), the contacts that hold it, and its minimum safety factor, between the steps too."""

    control: Vector
    contacts: Contacts
    minimum: MinimumSafetyFactor


def solve_kkt_point(
    problem: Problem, control: Array, contacts: Contacts, tau: float, lam: float, class_angles: Array | None = None
) -> KktPoint | None:
    """Find the solution at (tau, lambda) that keeps out of obstacles between the steps too, near a control.

    Parameters
    ----------
    problem
        The problem.
    control
        Stacked control to begin with, (2N,).
    contacts
        Contacts to begin with.
    tau, lam
        Clearance term [m^2] and weight of the variances [1/s^6].
    class_angles
        (m,): angles that the mean has to sweep about the centres, to within half a turn, which define its homotopy class;
        those of the control if not given.

    Returns
    -------
    KktPoint | None
        None where there is none in that class.
    """
    control = np.ascontiguousarray(control, dtype=float)
    angles = ANY_CLASS if class_angles is None else class_angles
    found, point = _solve_kkt_point(problem.terms, problem.obstacles_with_reach(tau), lam, contacts, control, angles)
    return KktPoint(point.control, freeze(point.contacts), point.minimum) if found else None


@compiled
def _solve_kkt_point(
    terms: ProblemTerms, obstacles: MovingObstacles, lam: float, contacts: Contacts, near: Vector, class_angles: Vector
) -> tuple[bool, KktPoint]:
    """Return whether there is a point near a control (2N,), and the point; class_angles (m,): none for those of the control."""
    motion, goal = terms.motion, solve_cost(terms.cost, lam)
    found, is_changed, control, trajectory, active = update_active_contacts(terms, obstacles, goal, contacts, near)
    if found and (is_changed or len(class_angles) > 0):  # with the same contacts it is in the class of the control
        wanted = class_angles
        if len(class_angles) == 0:
            wanted = sweep_angles(compute_trajectory(motion, near)[:2].T.copy(), terms.centre_trajectories)
        found = is_same_class(sweep_angles(trajectory[:2].T.copy(), terms.centre_trajectories), wanted)
    if not found:
        return False, KktPoint(control, active, MinimumSafetyFactor(0.0, 0, 0.0))
    return True, KktPoint(control, active, minimum_safety_factor(motion, terms.chance, trajectory, control, True))


def solve_at_fixed_times(
    problem: Problem, control: Array, contacts: Contacts, tau: float, lam: float
) -> tuple[Array, Contacts] | None:
    """Find the solution near a control (2N,) whose contacts hold at given steps; None where it is none, or enters an obstacle."""
    obstacles = problem.obstacles_with_reach(tau)
    found, control, contacts = _solve_at_fixed_times(
        problem.terms, obstacles, lam, contacts, np.ascontiguousarray(control, dtype=float)
    )
    if not found or (contacts.multiplier <= 0).any():
        return None
    deepest, _, _ = find_deepest(problem.positions(control), obstacles)
    return None if deepest > CLEAR * problem.extent else (control, freeze(contacts))


@compiled
def _solve_at_fixed_times(
    terms: ProblemTerms, obstacles: MovingObstacles, lam: float, contacts: Contacts, near: Vector
) -> tuple[bool, Vector, Contacts]:
    """Return what `newton_on_contacts` does for contacts that do not slide."""
    active = Contacts(contacts.obstacle.copy(), contacts.time.copy(), contacts.multiplier.copy())
    goal = solve_cost(terms.cost, lam)
    return newton_on_contacts(terms.motion, obstacles, goal, active, near.copy(), False, NEWTON_TOLERANCE * terms.extent)


def is_fixed_point(problem: Problem, control: Array, contacts: Contacts, tau: float, lam: float) -> bool:
    """Tell whether the QP linearised at a control (2N,), with a row for each contact, has that control as its solution."""
    if not len(contacts.time):
        return True
    motion, cost = problem.terms.motion, problem.terms.cost
    dual, free = _reduce_contacts(motion, cost, problem.obstacles_with_reach(tau), lam, contacts, control)
    multipliers = solve_dual(dual, problem.qp_backend)
    if isinstance(multipliers, DualStatus):
        return False
    return largest_shift(problem.horizon.maps[:2], control, free + multipliers @ dual.effects) < STAYS * problem.extent


@compiled_separately
def _linearise_contacts(motion: Motion, obstacles: MovingObstacles, control: Vector, contacts: Contacts) -> tuple[Matrix, Vector]:
    """Return rows n.S(s) (k, 2N) and limits (k,) on them [m]: the half-planes that touch the obstacles at the contacts."""
    k = len(contacts.time)
    rows, limits = np.empty((k, len(control))), np.empty(k)
    trajectory = compute_trajectory(motion, control)
    for i in range(k):
        j, s = contacts.obstacle[i], contacts.time[i]
        at, free = interpolate(trajectory, s, 0), interpolate(motion.free, s, 0)
        cx, cy = obstacles.centre[j, 0] + s * obstacles.drift[j, 0], obstacles.centre[j, 1] + s * obstacles.drift[j, 1]
        offset = find_offset(obstacles.polygons, j, at[0] - cx, at[1] - cy)
        _, x, y = find_normal(offset, SMALLEST_DISTANCE)
        rows[i] = interpolation_row(motion.responses, s, x, y)
        nearest_x, nearest_y = at[0] - offset.x, at[1] - offset.y
        limits[i] = required_distance(obstacles, j, s)[0] + x * (nearest_x - free[0]) + y * (nearest_y - free[1])
    return rows, limits


@compiled
def _reduce_contacts(
    motion: Motion, cost: CostTerms, obstacles: MovingObstacles, lam: float, contacts: Contacts, control: Vector
) -> tuple[DualQP, Vector]:
    """Return the dual QP linearised at a control (2N,), with a row for each contact, and the control (2N,) without rows."""
    goal = solve_cost(cost, lam)
    rows, limits = _linearise_contacts(motion, obstacles, control, contacts)
    return range_space(rows, limits, goal, 0.0), goal.control


def find_crossings(problem: Problem, control: Array, tau: float) -> Array:
    """Return the times at which the mean of a control (2N,) is so deep in an obstacle that it may cross it between two steps."""
    obstacles = problem.obstacles_with_reach(tau)
    if not len(obstacles.reach):
        return NO_TIMES
    thinnest = float((obstacles.reach + measure_half_widths(obstacles.polygons)).min())
    times: Array = find_penetrations(problem.trajectory(control), obstacles, CROSSING * thinnest)[:, 1]
    return times


def compute_class_angles(problem: Problem, control: Array) -> Array:
    """Return the angles (m,) that the mean of a control (2N,) sweeps about the centres, which define its homotopy class."""
    return compute_swept_angles(problem.trajectory(control)[:2].T, problem.centre_trajectories)


def is_in_class(problem: Problem, control: Array, class_angles: Array) -> bool:
    """Tell whether the mean of a control (2N,) passes every obstacle on the same side as one with these angles (m,)."""
    return is_same_class(compute_class_angles(problem, control), class_angles)
