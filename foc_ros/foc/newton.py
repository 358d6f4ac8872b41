"""Newton steps on the Karush-Kuhn-Tucker equations of a mean that is held off circles at a few contacts.

Where sequential QPs would creep along a circle, these jump: they know its curvature. A contact is held at its step, as a row of a
QP is, or it slides: it is then where the mean, between its steps too, comes closest to the circle.
"""

from __future__ import annotations

import numpy as np

from .between import entered
from .contacts import Contacts, merged
from .homotopy import swept_angles
from .problem import Problem
from .qp import NO_TIMES, Cost, depths, margins, wanted_distance
from .records import Array
from .sliding import CLEAR, SETTLED, slide
from .solver import Verdict, with_rows
from .touching import half_planes_between, touching

STAYS = 3e-7
"""Largest move of the mean that counts as staying, relative to the scene's extent."""
LEAP = 0.1
"""Depth in a circle between two steps, relative to the smallest, from which on the mean may be on the wrong side of it."""


def held(problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float) -> tuple[Array, Contacts] | None:
    """Find the solution near a control (2N,) that touches at the given steps; None where it is none, or enters a circle."""
    inverse, _, factor = cost.factors
    found, control, time, force = touching(
        problem.horizon.motion,
        problem.free_course,
        inverse,
        factor,
        cost.goal_control,
        problem.obstacles.centre,
        problem.drift,
        *margins(problem, tau),
        contacts.obstacle,
        contacts.time,
        contacts.force,
        np.ascontiguousarray(control, dtype=float),
        0,
        SETTLED * problem.extent,
    )
    if not found or (force <= 0).any():
        return None
    depth = depths(problem.positions(control), problem.centres, wanted_distance(problem, tau))
    return None if depth.max(initial=0.0) > CLEAR * problem.extent else (control, Contacts(contacts.obstacle, time, force))


def joined(problem: Problem, contacts: Contacts) -> Contacts:
    """Return contacts that came from rows at steps, or from another problem, as they slide: one for each place."""
    return Contacts(*merged(contacts.obstacle, contacts.time, contacts.force, problem.first_alike))


def leapt(problem: Problem, control: Array, tau: float) -> Array:
    """Return the times at which the mean of a control (2N,) is much too near a circle between the steps."""
    reach, missing, pace = margins(problem, tau)
    if not len(reach):
        return NO_TIMES
    much = LEAP * float(reach.min())
    times: Array = entered(problem.course(control), problem.obstacles.centre, problem.drift, reach, missing, pace, much)[:, 1]
    return times


def slid(
    problem: Problem, control: Array, contacts: Contacts, tau: float, lam: float, way: Array | None = None
) -> tuple[Array, Contacts] | None:
    """Find the solution at (tau, lambda) near a control (2N,) that keeps out of circles between the steps too.

    contacts: to begin with; way (m,): the class that it has to be in, as of `way_of`; that of the control if not given.
    Returns the control and its contacts; None where there is none in that class.
    """
    found, changed, solution, obstacle, time, force = slide(
        problem.horizon.motion,
        problem.free_course,
        problem.obstacles.centre,
        problem.drift,
        *margins(problem, tau),
        problem.weighted_variance,
        problem.summed_variance,
        lam,
        *problem.goal_rows,
        contacts.obstacle,
        contacts.time,
        contacts.force,
        np.ascontiguousarray(control, dtype=float),
        problem.extent,
    )
    if not found:
        return None
    if way is None and changed:  # with the same contacts it is in the class of the control
        way = way_of(problem, control)
    if way is not None and not goes(problem, solution, way):
        return None
    return solution, Contacts(obstacle, time, force)


def way_of(problem: Problem, control: Array) -> Array:
    """Return the angles (m,) that the mean of a control (2N,) sweeps about the centres, which tell its class."""
    return swept_angles(problem.course(control)[:2].T, problem.courses)


def goes(problem: Problem, control: Array, way: Array) -> bool:
    """Whether the mean of a control (2N,) passes every circle on the same side as a way (m,), as of `way_of`."""
    return bool((np.abs(way_of(problem, control) - way) < np.pi).all())


def stays(problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float) -> bool:
    """Whether the QP linearised at a control (2N,), with a row for each contact, has that control as its solution."""
    if not len(contacts):
        return True
    reach, missing, pace = margins(problem, tau)
    rows, limits = half_planes_between(
        problem.horizon.motion,
        problem.free_course,
        control,
        problem.obstacles.centre,
        problem.drift,
        reach,
        missing,
        pace,
        contacts.obstacle,
        contacts.time,
    )
    answer = with_rows(cost, rows, limits)
    if isinstance(answer, Verdict):
        return False
    move = problem.positions(answer[0]) - problem.positions(control)
    return float(np.abs(move).max()) < STAYS * problem.extent
