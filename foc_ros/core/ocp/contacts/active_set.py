"""Active set iteration over contacts: which are released, which are added, and when the set has settled."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Matrix, Vector, compiled_separately
from foc_ros.core.ocp.clearance import find_penetrations
from foc_ros.core.ocp.qp import GoalSolution
from foc_ros.core.ocp.terms import MovingObstacles, ProblemTerms

from .contacts import Contacts
from .hermite import compute_trajectory
from .newton import newton_on_contacts

NEWTON_TOLERANCE = 1e-5
"""Largest move of a contact, relative to the scene, at which the Newton iteration ends. Quadratic convergence leaves about
1e-9."""
CLEAR = 3e-8
"""Depth in an obstacle that counts as rounding, relative to the scene."""
MAX_CHANGES = 8
"""How often contacts may be released or added."""
MOST_CONTACTS = 12
"""Contacts with which a point is given up: the work grows with the third power, and a movement has a few."""
NEW_MULTIPLIER = 1e-6
"""Multiplier with which a new contact begins, relative to the largest, so that it bends the cost hardly at all."""


@compiled_separately
def update_active_contacts(
    terms: ProblemTerms, obstacles: MovingObstacles, goal: GoalSolution, contacts: Contacts, near: Vector
) -> tuple[bool, bool, Vector, Matrix, Contacts]:
    """Find the least cost near a control (2N,) that keeps clear of every obstacle at every time, from contacts to begin with.

    Contacts slide; those with a negative multiplier are released, and an obstacle that is penetrated becomes a new one. Returns
    whether there is a solution, whether it has other contacts, so that it may be in another homotopy class, the control, its
    trajectory and its contacts.
    """
    motion = terms.motion
    control, obstacle = near.copy(), contacts.obstacle.copy()
    time, multiplier = contacts.time.copy(), contacts.multiplier.copy()
    for count in range(MAX_CHANGES + 1):
        if len(multiplier) > MOST_CONTACTS:
            break
        if len(multiplier):
            active = Contacts(obstacle, time, multiplier)
            found, control, active = newton_on_contacts(
                motion, obstacles, goal, active, control, True, NEWTON_TOLERANCE * terms.extent
            )
            if not found:
                break
            time, multiplier = active.time, active.multiplier
        else:
            control = goal.control.copy()
        pushing = np.flatnonzero(multiplier > 0.0)
        if len(pushing) < len(multiplier):
            obstacle, time, multiplier = obstacle[pushing], time[pushing], multiplier[pushing]
            continue
        trajectory = compute_trajectory(motion, control)
        new = find_penetrations(trajectory, obstacles, CLEAR * terms.extent)
        if len(new) == 0:
            return True, count > 0, control, trajectory, Contacts(obstacle, time, multiplier)
        slight = NEW_MULTIPLIER * (multiplier.max() if len(multiplier) else 1.0)
        obstacle = np.concatenate((obstacle, new[:, 0].astype(np.intp)))
        time, multiplier = np.concatenate((time, new[:, 1])), np.concatenate((multiplier, np.full(len(new), slight)))
    return False, False, control, motion.free.copy(), Contacts(obstacle, time, multiplier)
