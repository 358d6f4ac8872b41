"""Contacts that come and go, in machine code: what is let go, what is touched anew, and when that has come to an end."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.ocp.qp import control_to_goal, goal_factors

from .hermite import compute_trajectory, find_penetrations
from .newton import newton_on_contacts

SETTLED = 1e-5
"""Largest move of a contact at which the steps end, relative to the scene: they converge quadratically, so 1e-9 is left."""
CLEAR = 3e-8
"""Depth in a circle that is rounding; relative."""
CHANGES = 8
"""How often contacts may be let go or found anew."""
NEW = 1e-6
"""Force at which a new contact begins, relative to the largest: hardly any curvature."""


@compiled
def update_active_contacts(
    motion: Tensor,
    free: Matrix,
    centre: Matrix,
    drift: Matrix,
    reach: Vector,
    short: Vector,
    pace: float,
    hessian: Vector,
    goal_rows: Matrix,
    goal_targets: Vector,
    softness: Vector,
    obstacle: Indices,
    time: Vector,
    force: Vector,
    near: Vector,
    extent: float,
) -> tuple[bool, bool, Vector, Matrix, Indices, Vector, Vector]:
    """Find the least cost `qp.effort_cost` near a control (2N,) that keeps clear of every circle at every time.

    From contacts (k,) to begin with, which slide: those that pull are let go, and where a circle is entered there is a new one.
    motion ... pace: as in `touching`; hessian (2N,) and the goal: as in `qp.Cost`; extent: of the scene [m].
    Returns whether there is one, and whether it has other contacts, so that it may pass circles on another side; the control, its
    course, and its contacts' obstacles, times and forces.
    """
    inverse, root, factor = goal_factors(hessian, goal_rows, softness)
    goal_control = control_to_goal(root, factor, goal_targets)
    control, obstacle, time, force = near.copy(), obstacle.copy(), time.copy(), force.copy()
    for count in range(CHANGES + 1):
        if len(force):
            found, control, time, force = newton_on_contacts(
                motion,
                free,
                inverse,
                factor,
                goal_control,
                centre,
                drift,
                reach,
                short,
                pace,
                obstacle,
                time,
                force,
                control,
                1,
                SETTLED * extent,
            )
            if not found:
                break
        else:
            control = goal_control.copy()
        pushing = np.flatnonzero(force > 0.0)
        if len(pushing) < len(force):
            obstacle, time, force = obstacle[pushing], time[pushing], force[pushing]
            continue
        course = compute_trajectory(motion, free, control)
        new = find_penetrations(course, centre, drift, reach, short, pace, CLEAR * extent)
        if len(new) == 0:
            return True, count > 0, control, course, obstacle, time, force
        slight = NEW * (force.max() if len(force) else 1.0)
        obstacle = np.concatenate((obstacle, new[:, 0].astype(np.intp)))
        time, force = np.concatenate((time, new[:, 1])), np.concatenate((force, np.full(len(new), slight)))
    return False, False, control, free.copy(), obstacle, time, force
