"""Newton steps on the Karush-Kuhn-Tucker equations of a mean that is held off circles at a few contacts.

Where sequential QPs would creep along a circle, these jump: they know its curvature. A contact is held at its step, as a row of a
QP is, or it slides: it is then where the mean, between its steps too, comes closest to the circle.
"""

from __future__ import annotations

import numpy as np

from .between import course_of, entered, place
from .contacts import Contacts
from .problem import Problem
from .qp import NO_TIMES, Cost, depths, margins, wanted_distance
from .records import Array
from .solver import Verdict, with_rows
from .touching import half_planes_between, touching

SETTLED = 1e-5
"""Largest move of a contact at which the steps end, relative to the scene: they converge quadratically, so 1e-9 is left."""
STAYS = 3e-7
"""Largest move of the mean that counts as staying, relative to the scene's extent."""
CLEAR = 3e-8
"""Depth in a circle that is rounding; relative."""
LEAP = 0.2
"""Depth in a circle between two steps, relative to the smallest, from which on the mean may be on the wrong side of it."""
CHANGES = 8
"""How often contacts may be let go or found anew."""
NEW = 1e-6
"""Force at which a new contact begins, relative to the largest: hardly any curvature."""


def held(problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float) -> tuple[Array, Contacts] | None:
    """Find the solution near a control (2N,) that touches at the given steps; None where it is none, or enters a circle."""
    found = _touched(problem, cost, control, contacts, tau, sliding=False)
    if found is None or (found[1].force <= 0).any():
        return None
    depth = depths(problem.positions(found[0]), problem.centres, wanted_distance(problem, tau))
    return None if depth.max(initial=0.0) > CLEAR * problem.extent else found


def joined(problem: Problem, contacts: Contacts) -> Contacts:
    """Return contacts that came from rows at steps, or from another problem, as they slide: one for each place."""
    return Contacts(problem.first_alike[contacts.obstacle], contacts.time, contacts.force).merged()


def leapt(problem: Problem, control: Array, tau: float) -> Array:
    """Return the times at which the mean of a control (2N,) is much too near a circle between the steps."""
    reach, missing, pace = margins(problem, tau)
    if not len(reach):
        return NO_TIMES
    course = course_of(problem.horizon.motion, problem.free_course, np.ascontiguousarray(control))
    much = LEAP * float(reach.min())
    times: Array = entered(course, problem.obstacles.centre, problem.drift, reach, missing, pace, much)[:, 1]
    return times


def slid(problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float) -> tuple[Array, Contacts] | None:
    """Find the solution near a control (2N,) that keeps out of circles between the steps too; None where there is none.

    contacts: to begin with; they slide, those that pull are let go, and where circles are entered there are new ones.
    """
    margin, sides = margins(problem, tau), course_of(problem.horizon.motion, problem.free_course, np.ascontiguousarray(control))
    for _ in range(CHANGES + 1):
        found = _touched(problem, cost, control, contacts, tau, sliding=True)
        if found is None:
            return None
        control, contacts = found
        if (contacts.force <= 0).any():
            contacts = contacts.only(contacts.force > 0)
            continue
        course = course_of(problem.horizon.motion, problem.free_course, control)
        new = entered(course, problem.obstacles.centre, problem.drift, *margin, CLEAR * problem.extent)
        if not len(new):
            return (control, contacts) if _same_sides(problem, sides, course, contacts) else None
        contacts = contacts.joined(new[:, 0].astype(np.intp), new[:, 1], NEW * float(contacts.force.max(initial=1.0)))
    return None


def _same_sides(problem: Problem, before: Array, after: Array, contacts: Contacts) -> bool:
    """Whether two courses (4, N + 1) pass the circles of the contacts on the same side, when the second touches them."""
    for obstacle, time in zip(contacts.obstacle, contacts.time, strict=True):
        centre = problem.obstacles.centre[obstacle] + time * problem.drift[obstacle]
        if (place(before, time, 0) - centre) @ (place(after, time, 0) - centre) < 0:
            return False
    return True


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


def _touched(
    problem: Problem, cost: Cost, control: Array, contacts: Contacts, tau: float, *, sliding: bool
) -> tuple[Array, Contacts] | None:
    if not len(contacts):
        return cost.goal_control, contacts
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
        1 if sliding else 0,
        SETTLED * problem.extent,
    )
    return (control, Contacts(contacts.obstacle, time, force)) if found else None
