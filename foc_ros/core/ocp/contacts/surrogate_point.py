"""Points of least cost at a safety factor: Newton steps, contacts released and added, the homotopy class checked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Vector, compiled, compiled_separately, freeze
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.terms import MovingObstacles, ProblemTerms
from foc_ros.core.types import Array

from .active_set import MOST_CONTACTS
from .contacts import Contacts
from .hermite import compute_trajectory
from .surrogate import evaluate_margin, find_shortfalls
from .surrogate_newton import Preference, newton_on_surrogate
from .swept_angles import is_same_class, sweep_angles

NEWTON_TOLERANCE = 1e-6
"""Largest move of a contact, relative to the scene, at which the Newton iteration ends."""
CLEAR = 1e-8
"""Shortfall of a margin that counts as rounding, relative to the scene."""
SPARE = 1e-8
"""Clearance term, relative to the square of the scene, that outweighs this rounding."""
SAME_TIME = 1e-6
"""Difference in time, in steps, up to which two shortfalls are the same."""
MOST_REPEATS = 3
"""How often the same contact may be added, and released, one time after the other."""
MAX_CHANGES = 10
"""How often contacts may be released or added."""
NEW_MULTIPLIER = 1e-6
"""Multiplier with which a new contact begins, relative to the largest, so that it bends the cost hardly at all."""
K_IS_GIVEN = Preference(0.0, 0.0, 1.0)


class SurrogatePoint(NamedTuple):
    """A control of least cost at a safety factor.

    control (2N,); contacts; k; rate: derivative of the effort by k [m^2/s^6]; effort [m^2/s^6]; distance, stddev: |d| [m] and
    sqrt(Var) [m^2] of each contact.
    """

    control: Vector
    contacts: Contacts
    k: float
    rate: float
    effort: float
    distance: Vector
    stddev: Vector


@compiled_separately
def update_active_contacts(
    terms: ProblemTerms,
    obstacles: MovingObstacles,
    first_alike: Indices,
    contacts: Contacts,
    near: Vector,
    k: float,
    preference: Preference,
) -> tuple[bool, Vector, Contacts, float]:
    """Find the least cost near a control (2N,) that keeps every margin at every time: whether there is one, control, contacts, k.

    Contacts with a negative multiplier are released, and where a margin falls short there is a new one.
    """
    control, obstacle = near.copy(), contacts.obstacle.copy()
    time, multiplier = contacts.time.copy(), contacts.multiplier.copy()
    added, repeats = np.full(2, np.nan), 0
    for _ in range(MAX_CHANGES + 1):
        if len(time) > MOST_CONTACTS:
            break
        found, control, active, k = newton_on_surrogate(
            terms, obstacles, Contacts(obstacle, time, multiplier), control, k, preference, NEWTON_TOLERANCE * terms.extent
        )
        if not found:
            break
        time, multiplier = active.time, active.multiplier
        pushing = np.flatnonzero(multiplier > 0.0)
        if len(pushing) < len(multiplier):
            obstacle, time, multiplier = obstacle[pushing], time[pushing], multiplier[pushing]
            continue
        trajectory = compute_trajectory(terms.motion, control)
        new = find_shortfalls(terms, obstacles, first_alike, trajectory, control, k, CLEAR * terms.extent)
        if len(new) == 0:
            return True, control, Contacts(obstacle, time, multiplier), k
        if repeats == MOST_REPEATS:
            break
        is_same = new[0, 0] == added[0] and abs(new[0, 1] - added[1]) < SAME_TIME
        repeats, added[:] = repeats + 1 if is_same else 0, new[0]
        slight = NEW_MULTIPLIER * multiplier.max() if len(multiplier) else 1.0
        obstacle = np.concatenate((obstacle, new[:, 0].astype(np.intp)))
        time, multiplier = np.concatenate((time, new[:, 1])), np.concatenate((multiplier, np.full(len(new), slight)))
    return False, control, Contacts(obstacle, time, multiplier), k


@compiled
def _solve_surrogate_point(
    terms: ProblemTerms,
    obstacles: MovingObstacles,
    first_alike: Indices,
    contacts: Contacts,
    near: Vector,
    k: float,
    preference: Preference,
    class_angles: Vector,
) -> tuple[bool, SurrogatePoint]:
    """Return whether there is a point near a control (2N,) in the class of the angles (m,), and the point."""
    start = Contacts(contacts.obstacle.copy(), contacts.time.copy(), contacts.multiplier.copy())
    found, control, active, k = update_active_contacts(terms, obstacles, first_alike, start, near.copy(), k, preference)
    count, rate, effort = len(active.time), 0.0, 0.0
    distance, stddev = np.empty(count), np.empty(count)
    if found:
        trajectory, effort = compute_trajectory(terms.motion, control), float(control @ control)
        found = is_same_class(sweep_angles(trajectory[:2].T.copy(), terms.centre_trajectories), class_angles)
        for i in range(count):
            at = evaluate_margin(terms, obstacles, trajectory, control, active.obstacle[i], active.time[i], k, 0.0)
            distance[i], stddev[i] = np.hypot(at.x, at.y), at.stddev
            if active.time[i] >= terms.chance.obstacles.ignored_until[active.obstacle[i]]:
                rate += active.multiplier[i] * at.stddev * at.scale
    return found, SurrogatePoint(control, active, k, rate, effort, distance, stddev)


def solve_surrogate_point(
    problem: Problem, near: Array, contacts: Contacts, k: float, class_angles: Array, preference: Preference = K_IS_GIVEN
) -> SurrogatePoint | None:
    """Find the control of least cost whose safety factor is k at every time from step 1 on, near another control.

    Parameters
    ----------
    problem
        The problem.
    near, contacts
        Stacked control (2N,) and contacts to begin with.
    k
        Safety factor: the one to keep, or the one to begin with if the preference has a rate.
    class_angles
        (m,): angles that the mean has to sweep about the centres, to within half a turn, which define its homotopy class.
    preference
        Whether k is given, or an unknown (of a start with contacts).

    Returns
    -------
    SurrogatePoint | None
        None where there is none in that class.
    """
    found, point = _solve_surrogate_point(
        problem.terms,
        problem.obstacles_with_reach(SPARE * problem.extent**2),
        problem.first_alike,
        contacts,
        np.ascontiguousarray(near, dtype=float),
        float(k),
        preference,
        class_angles,
    )
    return freeze(point) if found else None
