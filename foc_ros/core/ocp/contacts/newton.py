"""One contact problem in machine code: the mean pressed against circles, where it touches them and how hard."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.linear_algebra import (
    factorise_cholesky,
    multiply,
    multiply_transposed,
    multiply_vector,
    solve_lower,
    solve_lower_transposed,
)
from foc_ros.core.ocp.qp import schur_complement

from .hermite import around, compute_trajectory, contact_rows, interpolate, interpolation_row, required_distance

MAX_STEPS = 12
UNSETTLED = 4
"""Steps after which the moves have to shrink."""
WAVERING = 2.0
"""Growth of the moves from one step to the next at which they are then given up."""
LONGEST = 2.0
"""Steps in time that a contact may slide at once."""
SLIGHT = 1e-3
"""Least force of a contact that bends the way round its circle, relative to the largest: a negative one would not hold."""
FLAT = 1e-2
"""Least bend of the distance over time at a contact, as a share of what a straight way past it has: while steps are made."""
TINY = 1e-30
"""The same of a mean that stands still."""
SHARED = 1e-13
"""Softness of a contact relative to what it moves itself: contacts that say the same twice share the force."""


@compiled
def half_planes_between(
    motion: Tensor,
    free: Matrix,
    centre: Matrix,
    drift: Matrix,
    reach: Vector,
    short: Vector,
    pace: float,
    control: Vector,
    obstacle: Indices,
    time: Vector,
) -> tuple[Matrix, Vector]:
    """Return `qp.half_planes` for contacts at any time: rows (k, 2N) n.S(s) and limits (k,) on them [m]; see `touching`."""
    k = len(obstacle)
    rows, limits = np.empty((k, len(control))), np.empty(k)
    course = compute_trajectory(motion, free, control)
    for i in range(k):
        j, s = obstacle[i], time[i]
        at, without = interpolate(course, s, 0), interpolate(free, s, 0)
        cx, cy = centre[j, 0] + s * drift[j, 0], centre[j, 1] + s * drift[j, 1]
        distance = np.hypot(at[0] - cx, at[1] - cy)
        x, y = (at[0] - cx) / distance, (at[1] - cy) / distance
        rows[i] = interpolation_row(motion, s, x, y)
        limits[i] = required_distance(reach[j], short[j], pace, s)[0] + x * (cx - without[0]) + y * (cy - without[1])
    return rows, limits


@compiled
def newton_step(
    give: Matrix, missing: Matrix, bend: Vector, distance: Vector, force: Vector, slides: Indices
) -> tuple[bool, Matrix, Vector]:
    """One step of `touching`: whether it has an answer, the weights (1, 3k) of the rows y, m, f, and y (k,)."""
    k = len(force)
    A, B, unit = np.empty((2 * k, 2 * k)), np.empty((2 * k, k)), np.empty(2 * k)
    wanted = missing[: 2 * k].copy()
    for i in range(2 * k):
        for j in range(2 * k):
            A[i, j] = give[i, j]
        for j in range(k):
            B[i, j] = give[i, 2 * k + j]
    for i in range(k):
        A[k + i, k + i] += bend[i] / force[i]
        if slides[i] == 0:  # held in time: no moment
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
        A[i, i] += SHARED
        B[i] *= unit[i]
        wanted[i] *= unit[i]
    normal = factorise_cholesky(A, 0.0)
    eased, along = solve_lower(normal, B), solve_lower(normal, wanted)[:, 0].copy()
    stiffness, pull = np.empty((k, k)), np.empty((k, 1))
    for i in range(k):
        pull[i, 0] = -missing[2 * k + i, 0]
        for q in range(2 * k):
            pull[i, 0] += eased[q, i] * along[q]
        for j in range(k):
            stiffness[i, j] = -give[2 * k + i, 2 * k + j]
            for q in range(2 * k):
                stiffness[i, j] += eased[q, i] * eased[q, j]
        stiffness[i, i] += distance[i] / force[i]
    for i in range(k):
        pull[i] *= np.sqrt(force[i] / distance[i])
        for j in range(k):
            stiffness[i, j] *= np.sqrt(force[i] / distance[i] * force[j] / distance[j])
    tangent = factorise_cholesky(stiffness, 0.0)
    across = solve_lower_transposed(tangent, solve_lower(tangent, pull)[:, 0].copy())
    weights = np.empty((1, 3 * k))
    for i in range(k):
        across[i] *= np.sqrt(force[i] / distance[i])
        weights[0, 2 * k + i] = across[i]
        for q in range(2 * k):
            along[q] -= eased[q, i] * across[i]
    along = solve_lower_transposed(normal, along)
    for i in range(2 * k):
        weights[0, i] = along[i] * unit[i]
    return bool(np.isfinite(weights).all()), weights, weights[0, :k].copy()


@compiled
def newton_on_contacts(
    motion: Tensor,
    free: Matrix,
    inverse: Vector,
    factor: Matrix,
    goal_control: Vector,
    centre: Matrix,
    drift: Matrix,
    reach: Vector,
    short: Vector,
    pace: float,
    obstacle: Indices,
    begin: Vector,
    force: Vector,
    near: Vector,
    sliding: int,
    settled: float,
) -> tuple[bool, Vector, Vector, Vector]:
    """Press the mean against circles until it touches them.

    The mean gives way like a beam. A contact at time s and distance d, with force y along its normal n, turns by f d / y under
    a force f along its tangent t. As the mean passes at velocity v and acceleration a, its distance falls and grows again with
    the bend b = n.a + (t.v)^2 / d, so a moment m on the rate of the distance moves the contact by m / y in time. With the rows
        h = n.S(s),    r = dh/ds = n.S'(s) + (t.v / d) t.S(s),    g = t.S(s),
    S(s) what the control does to the position, and C the compliance P between rows,
        C_hh y + C_hr m + C_hg f = what h misses,
        C_rh y + (C_rr + b / y_last) m + C_rg f = what r misses,
        C_gh y + C_gr m + (C_gg - d / y_last) f = what g misses.
    It is a minimum if the first two are positive definite, and d / y_last less what is left of C_gg is too: pressed any harder,
    the mean would slip round the circle. A contact that is held in time has no moment, and holds less: the mean may slip past it.

    motion (4, 2, N + 1), free (4, N + 1): the course, as in `between`; centre, drift, reach, short, pace: the circles, as
    there; obstacle, begin, force (k,): the contacts; near (2N,): where to begin; sliding: 1, or 0 for contacts held in time;
    settled [m]: a move of the contacts that ends the steps. Returns whether there is such a minimum, the control, times (k,)
    and forces (k,); where some turn out to pull, at once, with control and times as they were to begin with.
    """
    k, end = len(obstacle), motion.shape[2] - 1.0
    control, time, pressing, last = near.copy(), begin.copy(), force.copy(), np.inf
    rows, missing = np.empty((3 * k, len(inverse))), np.empty((3 * k, 1))
    normal, first = np.empty((k, 2)), np.empty((k, 2))
    distance, bend, passing = np.empty(k), np.empty(k), np.empty(k)
    slides = np.empty(k, np.intp)
    for count in range(MAX_STEPS):
        flat = False
        for i in range(k):
            j, s = obstacle[i], time[i]
            wanted, faster, harder = required_distance(reach[j], short[j], pace, s)
            t = min(int(s), motion.shape[2] - 2)
            course = around(motion, free, control, t)
            at, velocity, acceleration = (
                interpolate(course, s - t, 0),
                interpolate(course, s - t, 1),
                interpolate(course, s - t, 2),
            )
            x, y = at[0] - centre[j, 0] - s * drift[j, 0], at[1] - centre[j, 1] - s * drift[j, 1]
            distance[i] = np.hypot(x, y)
            x, y = x / distance[i], y / distance[i]
            normal[i, 0], normal[i, 1] = x, y
            vx, vy = velocity[0] - drift[j, 0], velocity[1] - drift[j, 1]
            passing[i], rate = x * vy - y * vx, x * vx + y * vy - faster
            slides[i] = sliding if not (s <= 1.0 and rate > 0.0) and not (s >= end and rate < 0.0) else 0
            past = passing[i] ** 2 / distance[i]
            bend[i] = x * acceleration[0] + y * acceleration[1] + past - harder
            if slides[i] == 1 and bend[i] < FLAT * past + TINY:
                bend[i], flat = FLAT * past + TINY, True
            rows[i::k] = contact_rows(motion, s, x, y, passing[i] / distance[i])
            missing[i, 0], missing[k + i, 0], missing[2 * k + i, 0] = wanted - distance[i], -rate, 0.0
        if count == 0:
            first[:] = normal
        missing += multiply_transposed(rows, np.expand_dims(control - goal_control, 0))
        pressed, give = schur_complement(rows, inverse, factor)
        at_least = np.maximum(pressing, SLIGHT * pressing.max())
        found, weights, pressing = newton_step(give, missing, bend, distance, at_least, slides)
        if not found:
            break
        if pressing.min() < 0.0:
            kept_force = force.copy()
            kept_force[pressing.argmin()] = pressing.min()
            return True, near.copy(), begin.copy(), kept_force
        before = control
        control = goal_control + multiply(weights, pressed)[0]
        moved, move = multiply_vector(rows, control - before), 0.0
        for i in range(k):
            move = max(move, abs(moved[i]), abs(moved[2 * k + i]))
            if slides[i] == 1:
                slide = min(max(weights[0, k + i] / at_least[i], -LONGEST), LONGEST)
                time[i] = min(max(time[i] + slide, 1.0), end)
                move = max(move, abs(slide * passing[i]))
        if move < settled:
            turned = False  # round to the other side of a circle: another way
            for i in range(k):
                turned = turned or normal[i, 0] * first[i, 0] + normal[i, 1] * first[i, 1] < 0.0
            return not flat and not turned, control, time, pressing
        if count >= UNSETTLED and move > WAVERING * last:
            break
        last = move
    return False, goal_control.copy(), time, pressing
