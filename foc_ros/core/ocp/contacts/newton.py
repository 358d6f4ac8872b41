"""Newton iteration on the optimality conditions of a mean that is in contact with obstacles.

The mean behaves like a loaded beam. Let a contact at time s have distance d from the polygon and multiplier y along its normal
n. A multiplier f along its tangent t turns the normal by f d / y. As the mean passes with velocity v and acceleration a, its
distance falls and rises again with curvature b = n.a + (t.v)^2 / d, so that a multiplier m on the rate of the distance moves the
contact by m / y in time. With the rows
    h = n.S(s),    r = dh/ds = n.S'(s) + (t.v / d) t.S(s),    g = t.S(s),
S(s) the effect of the control on the position, and C the Schur complement M P M' of rows M, each Newton step solves
    C_hh y + C_hr m + C_hg f = what h misses,
    C_rh y + (C_rr + b / y_last) m + C_rg f = what r misses,
    C_gh y + C_gr m + (C_gg - d / y_last) f = what g misses.
The solution is a minimum if the first two blocks are positive definite, and d / y_last less the Schur complement of C_gg is so
too: with a larger multiplier the mean would slip round the obstacle. A contact that is held at its time has no multiplier m, and
is less stable: the mean may slip past it. Where the nearest point of the polygon lies on an edge, the normal does not turn, and
the d of these equations is infinite.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Vector, compiled_separately, compiled_with_caller
from foc_ros.core.kernels.linear_algebra import (
    factorise_cholesky,
    multiply,
    multiply_transposed,
    multiply_vector,
    solve_lower,
    solve_lower_transposed,
)
from foc_ros.core.obstacles.rounded_polygon import find_normal, find_offset
from foc_ros.core.ocp.clearance import SMALLEST_DISTANCE, required_distance
from foc_ros.core.ocp.qp import GoalSolution, schur_complement
from foc_ros.core.ocp.terms import Motion, MovingObstacles

from .contacts import Contacts
from .hermite import contact_rows, interpolate, trajectory_around

MAX_STEPS = 12
SETTLING_STEPS = 4
"""Steps after which the moves have to shrink."""
LARGEST_GROWTH = 2.0
"""Growth of the moves from one step to the next beyond which the iteration is then given up."""
LARGEST_TURN = 0.5
"""Tangent of the largest angle by which the normal of a contact may turn in one step: beyond it a linearisation means little."""
LONGEST_SLIDE = 2.0
"""Most steps in time that a contact may slide at once."""
SMALLEST_MULTIPLIER = 1e-3
"""Least multiplier in the curvature terms, relative to the largest: with a negative one they would not be positive definite."""
SMALLEST_CURVATURE = 1e-2
"""Least curvature of the distance over time at a contact while steps are made, as a share of that of a straight pass."""
STANDSTILL_CURVATURE = 1e-30
"""The same of a mean that stands still."""
LARGEST_RADIUS = 1e6
"""Radius with which the boundary counts as bent where the contact is on an edge [m]."""
REGULARISATION = 1e-13
"""Softness of a contact relative to its own effect: two contacts with the same row then share the multiplier."""


@compiled_with_caller
def limit_turn(distance: float, across: float, along: float) -> float:
    """Return the largest part, at most 1, of a move that turns the normal of a contact no further than `LARGEST_TURN`.

    distance: from the vertex [m]; across, along: the parts of the move along the tangent and away from the vertex [m].
    """
    excess = abs(across) - LARGEST_TURN * along
    return min(1.0, LARGEST_TURN * distance / excess) if excess > 0.0 else 1.0


@compiled_separately
def newton_step(schur: Matrix, missing: Matrix, curvature: Vector, distance: Vector, slides: Indices) -> tuple[bool, Matrix]:
    """Solve for one Newton step: whether there is a solution, and the multipliers (1, 3k) of the rows h, r and g.

    schur (3k, 3k): C; missing (3k, 1); curvature and distance (k,): b / y_last and d / y_last; slides (k,): 0 for contacts that
    are held at their times. The tangential block is solved in units in which its diagonal term d / y_last is one.
    """
    k = len(distance)
    A, B, unit = np.empty((2 * k, 2 * k)), np.empty((2 * k, k)), np.empty(2 * k)
    wanted = missing[: 2 * k].copy()
    for i in range(2 * k):
        for j in range(2 * k):
            A[i, j] = schur[i, j]
        for j in range(k):
            B[i, j] = schur[i, 2 * k + j]
    for i in range(k):
        A[k + i, k + i] += curvature[i]
        if slides[i] == 0:
            for j in range(2 * k):
                A[k + i, j], A[j, k + i] = 0.0, 0.0
            for j in range(k):
                B[k + i, j] = 0.0
            A[k + i, k + i], wanted[k + i, 0] = 1.0, 0.0
    for i in range(2 * k):
        unit[i] = 1.0 / np.sqrt(A[i, i])
    for i in range(2 * k):
        for j in range(2 * k):
            A[i, j] *= unit[i] * unit[j]
        A[i, i] += REGULARISATION
        B[i] *= unit[i]
        wanted[i] *= unit[i]
    normal = factorise_cholesky(A, 0.0)
    coupling, along = solve_lower(normal, B), solve_lower(normal, wanted)[:, 0].copy()
    stiffness, pull, scale = np.empty((k, k)), np.empty((k, 1)), 1.0 / np.sqrt(distance)
    for i in range(k):
        pull[i, 0] = -missing[2 * k + i, 0]
        for q in range(2 * k):
            pull[i, 0] += coupling[q, i] * along[q]
        for j in range(k):
            stiffness[i, j] = -schur[2 * k + i, 2 * k + j]
            for q in range(2 * k):
                stiffness[i, j] += coupling[q, i] * coupling[q, j]
        stiffness[i, i] += distance[i]
    for i in range(k):
        pull[i] *= scale[i]
        for j in range(k):
            stiffness[i, j] *= scale[i] * scale[j]
    tangent = factorise_cholesky(stiffness, 0.0)
    across = solve_lower_transposed(tangent, solve_lower(tangent, pull)[:, 0].copy())
    step = np.empty((1, 3 * k))
    for i in range(k):
        across[i] *= scale[i]
        step[0, 2 * k + i] = across[i]
        for q in range(2 * k):
            along[q] -= coupling[q, i] * across[i]
    along = solve_lower_transposed(normal, along)
    for i in range(2 * k):
        step[0, i] = along[i] * unit[i]
    return bool(np.isfinite(step).all()), step


@compiled_separately
def newton_on_contacts(
    motion: Motion,
    obstacles: MovingObstacles,
    goal: GoalSolution,
    contacts: Contacts,
    near: Vector,
    may_slide: bool,
    tolerance: float,
) -> tuple[bool, Vector, Contacts]:
    """Find the control of least cost that keeps the given contacts, near a control (2N,).

    may_slide: whether the times of contacts are unknowns too; tolerance [m]: move of the contacts at which the iteration ends.
    Returns whether there is such a minimum, the control and the contacts. If a multiplier becomes negative, the iteration ends at
    once with the control and contacts that it began with, and that multiplier.
    """
    k, steps = len(contacts.time), motion.responses.shape[2] - 1
    control, time, multiplier, last = near.copy(), contacts.time.copy(), contacts.multiplier.copy(), np.inf
    rows, missing = np.empty((3 * k, len(goal.inverse))), np.empty((3 * k, 1))
    normal, first = np.empty((k, 2)), np.empty((k, 2))
    distance, curvature, passing = np.empty(k), np.empty(k), np.empty(k)
    slides = np.empty(k, np.intp)
    for count in range(MAX_STEPS):
        is_flat = False
        for i in range(k):
            j, s = contacts.obstacle[i], time[i]
            required, growth, acceleration = required_distance(obstacles, j, s)
            t = min(int(s), steps - 1)
            around = trajectory_around(motion, control, t)
            at, velocity, bend = interpolate(around, s - t, 0), interpolate(around, s - t, 1), interpolate(around, s - t, 2)
            dx, dy = obstacles.drift[j, 0], obstacles.drift[j, 1]
            x, y = at[0] - obstacles.centre[j, 0] - s * dx, at[1] - obstacles.centre[j, 1] - s * dy
            offset = find_offset(obstacles.polygons, j, x, y)
            apart, x, y = find_normal(offset, SMALLEST_DISTANCE)
            distance[i], turn = (LARGEST_RADIUS, 0.0) if offset.is_on_edge else (apart, 1.0 / apart)
            normal[i, 0], normal[i, 1] = x, y
            vx, vy = velocity[0] - dx, velocity[1] - dy
            passing[i], rate = x * vy - y * vx, x * vx + y * vy - growth
            is_at_end = (s <= 1.0 and rate > 0.0) or (s >= steps and rate < 0.0)
            slides[i] = 1 if may_slide and not is_at_end else 0
            curvature[i] = x * bend[0] + y * bend[1] + passing[i] ** 2 * turn - acceleration
            least = SMALLEST_CURVATURE * passing[i] ** 2 / max(abs(apart), SMALLEST_DISTANCE) + STANDSTILL_CURVATURE
            if slides[i] == 1 and curvature[i] < least:
                curvature[i], is_flat = least, True
            rows[i::k] = contact_rows(motion.responses, s, x, y, passing[i] * turn)
            missing[i, 0], missing[k + i, 0], missing[2 * k + i, 0] = required - apart, -rate, 0.0
        if count == 0:
            first[:] = normal
        missing += multiply_transposed(rows, np.expand_dims(control - goal.control, 0))
        effects, schur = schur_complement(rows, goal.inverse, goal.factor)
        weight = np.maximum(multiplier, SMALLEST_MULTIPLIER * multiplier.max())
        found, step = newton_step(schur, missing, curvature / weight, distance / weight, slides)
        if not found:
            break
        before = control
        control = goal.control + multiply(step, effects)[0]
        moved, move, share = multiply_vector(rows, control - before), 0.0, 1.0
        for i in range(k):
            move = max(move, abs(moved[i]), abs(moved[2 * k + i]))
            share = min(share, limit_turn(abs(distance[i]), moved[2 * k + i], np.sign(distance[i]) * moved[i]))
        control = before + share * (control - before)
        multiplier += share * (step[0, :k] - multiplier)
        if multiplier.min() < 0.0:
            pulling = contacts.multiplier.copy()
            pulling[multiplier.argmin()] = multiplier.min()
            return True, near.copy(), Contacts(contacts.obstacle.copy(), contacts.time.copy(), pulling)
        for i in range(k):
            if slides[i] == 1:
                slide = min(max(step[0, k + i] / weight[i], -LONGEST_SLIDE), LONGEST_SLIDE)
                time[i] = min(max(time[i] + share * slide, 1.0), steps)
                move = max(move, abs(slide * passing[i]))
        if move < tolerance:
            is_turned = False  # a contact went round to the other side of its obstacle: another homotopy class
            for i in range(k):
                is_turned = is_turned or normal[i, 0] * first[i, 0] + normal[i, 1] * first[i, 1] < 0.0
            return not is_flat and not is_turned, control, Contacts(contacts.obstacle.copy(), time, multiplier)
        if count >= SETTLING_STEPS and move > LARGEST_GROWTH * last:
            break
        last = move
    return False, goal.control.copy(), Contacts(contacts.obstacle.copy(), time, multiplier)
