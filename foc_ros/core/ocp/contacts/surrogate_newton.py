"""Newton iteration on the optimality conditions of the surrogate: contacts hold the margins at zero, at times that slide.

The unknowns are the control u, the safety factor k, and of each contact the time s and the multiplier y [m/s^6]. With the cost
phi(u), its goal rows E u = e, and the margins g_i(u, s_i, k) of `surrogate`, the conditions are

    d(phi)/du = sum_i y_i dg_i/du - E'nu,   g_i = 0,   dg_i/ds = 0,   E u = e,

and k is either given, or such that more safety would cost more than it is worth (`Preference`):

    -sum_i y_i dg_i/dk = rate J / dt,   J = fixed_cost + dt |u|^2,

where the left side is the derivative of the least effort by k. Each step solves the conditions linearised at the last point. The
Hessian of the Lagrangian is a diagonal D and the low-rank matrix U'C U, with five rows of U for each contact, and one that makes
J in the last condition follow u. With z = C U p for the step p of the control, D is eliminated, and a small system of z, y, the
moves of the contacts sigma = y ds, the step of k and nu remains. A contact where the margin has a kink (`corners`) is held there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled_separately
from foc_ros.core.kernels.linear_algebra import multiply_vector, multiply_weighted, solve_by_elimination
from foc_ros.core.ocp.terms import CostTerms, MovingObstacles, ProblemTerms

from .contacts import Contacts
from .corners import Corner
from .hermite import compute_trajectory, interpolate
from .newton import LARGEST_GROWTH, LONGEST_SLIDE, MAX_STEPS, SETTLING_STEPS, SMALLEST_CURVATURE, SMALLEST_MULTIPLIER, limit_turn
from .surrogate import SMALLEST_DISTANCE, TIME_STEP, Margin, evaluate_margin, find_kink

STANDSTILL_CURVATURE = 1e-12
"""Least curvature of a margin over time while steps are made, of a mean that stands still [m]."""
FAR_OFF = 10.0
"""Margin at a contact, relative to the tolerance of moves, at which the iteration goes on although nothing moves."""
SMALLEST_SHARE = 0.1
"""Least share of a step that the limit on turns may leave: below it an iteration hardly ever comes to an end."""
K_SCALE = 1e-2
"""A change of k by one counts as a move by so much of the scene."""
SMALLEST_COST = 1e-9
"""Least J [m^2/s^5]."""
RANK, RANK_AT_CORNERS = 5, 7
"""Rows of U for each contact; the same where contacts may be held at corners."""


class Preference(NamedTuple):
    """How much effort safety is worth.

    rate: of ln J by k, 0 where k is given; fixed_cost: the part of J that is no effort [m^2/s^5]; dt: length of a step [s].
    """

    rate: float
    fixed_cost: float
    dt: float


class Linearisation(NamedTuple):
    """The conditions linearised at a point, for m contacts and r goal rows; the small system has 7m + 2 + r unknowns.

    rows (7m + 2 + r, 2N): U (5m + 1), dg/du (m), d2g/(du ds) (m), the derivative of the Lagrangian's gradient by k, E; blocks
    (m, 5, 5): C of each contact; diagonal and gradient (2N,): D and d(phi)/du; value, slope, bend (m,): g, dg/ds and d2g/ds2;
    by_k, slope_by_k (m,): dg/dk and d2g/(ds dk); speed (m,): of the passing mean, per step [m]; slides (m,): 0 for contacts that
    are held at their times; offset (m, 2): d [m].
    """

    rows: Matrix
    blocks: Tensor
    diagonal: Vector
    gradient: Vector
    value: Vector
    slope: Vector
    bend: Vector
    by_k: Vector
    slope_by_k: Vector
    speed: Vector
    slides: Vector
    offset: Matrix


@compiled_separately
def linearise_curvature(terms: ProblemTerms, control: Vector, at: Margin, multiplier: float, i: int, into: Linearisation) -> None:
    """Write what the second derivatives of the margin of contact i add to the Hessian: rows of U, its block of C, and D."""
    noise, pull, first = (
        terms.chance.noise.noise_variance,
        multiplier * at.scale * at.k / (2.0 * at.stddev),
        into.blocks.shape[1] * i,
    )
    rows, block = into.rows, into.blocks[i]
    for q in range(len(control)):
        sx, sy = at.position[0, q], at.position[2, q]
        along = at.x * sx + at.y * sy
        weight = 16.0 * noise[q] * control[q] * along
        rows[first, q], rows[first + 1, q], rows[first + 2, q], rows[first + 3, q] = sx, sy, weight * sx, weight * sy
        rows[first + 4, q] = at.variance_row[q]
        into.diagonal[q] += 8.0 * pull * noise[q] * along * along
    for a in range(2):
        for b in range(2):
            block[a, b] = 8.0 * pull * at.covariance[a, b] - (2.0 * multiplier * at.scale * at.side if a == b else 0.0)
        block[a, 2 + a], block[2 + a, a] = pull, pull
    block[4, 4] = -0.5 * pull / at.stddev**2


@compiled_separately
def hold_at_corner(
    terms: ProblemTerms,
    control: Vector,
    contacts: Contacts,
    i: int,
    corner: Corner,
    side: tuple[Margin, Margin, Margin],
    into: Linearisation,
) -> None:
    """Write what belongs to contact i where its margin has a kink: at the time s(u) at which the mean is over a corner.

    side: margins at that time, and one and two steps of time from it on the side of the vertex. For the direction e of the edge,
    c(u, s) = e.(p - corner) is zero, so that ds/du = -c_u / c_s, and the margin G(u) = g(u, s(u)) of the contact has

        G_u = g_u + g_s s_u,   G_uu = g_uu + a s_u' + s_u a',   a = g_us + g_ss s_u / 2 - (g_s / c_s) (c_us + c_ss s_u / 2).
    """
    at, near, far = side
    h, multiplier = corner.step, contacts.multiplier[i]
    slope = (4.0 * near.value - 3.0 * at.value - far.value) / (2.0 * h)
    bend, growth = (at.value - 2.0 * near.value + far.value) / h**2, (near.stddev - at.stddev) / h
    m, contacts.time[i] = len(contacts.time), corner.time
    into.speed[i], into.value[i], into.slope[i], into.bend[i], into.slides[i] = abs(corner.speed), at.value, 0.0, 1.0, 0.0
    into.by_k[i], into.slope_by_k[i] = -at.stddev * at.scale, 0.0
    into.offset[i, 0], into.offset[i, 1] = at.x, at.y
    linearise_curvature(terms, control, near, multiplier, i, into)
    rank = into.blocks.shape[1]
    into.blocks[i, 5, 6] = into.blocks[i, 6, 5] = -multiplier
    first, by_k, low = rank * m + 1, len(into.rows) - 1 - len(terms.cost.softness), rank * i
    for q in range(len(control)):
        along = corner.x * near.position[0, q] + corner.y * near.position[2, q]
        along_far = corner.x * far.position[0, q] + corner.y * far.position[2, q]
        shift = -(2.0 * along - along_far) / corner.speed
        turn = (along_far - along) / h + 0.5 * corner.growth * shift
        into.rows[low + 5, q] = shift
        into.rows[low + 6, q] = (far.row[q] - near.row[q]) / h + 0.5 * bend * shift - slope / corner.speed * turn
        into.rows[first + i, q] = 2.0 * near.row[q] - far.row[q] + slope * shift
        into.rows[by_k, q] += multiplier * (near.variance_row[q] / (2.0 * near.stddev) + growth * shift) * at.scale


@compiled_separately
def linearise_contact(
    terms: ProblemTerms,
    obstacles: MovingObstacles,
    trajectory: Matrix,
    control: Vector,
    contacts: Contacts,
    k: float,
    i: int,
    into: Linearisation,
) -> None:
    """Write all that belongs to contact i."""
    m, steps = len(contacts.time), trajectory.shape[1] - 1
    j, s = contacts.obstacle[i], contacts.time[i]
    at = evaluate_margin(terms, obstacles, trajectory, control, j, s, k, 0.0)
    if obstacles.polygons.corners[j] > 1:
        corner, side = find_kink(terms, obstacles, trajectory, control, j, s, k, at)
        if corner.time < np.inf:
            hold_at_corner(terms, control, contacts, i, corner, side, into)
            return
    earlier, later = max(s - TIME_STEP, 1.0), min(s + TIME_STEP, float(steps))
    before = evaluate_margin(terms, obstacles, trajectory, control, j, earlier, k, at.scale)
    after = evaluate_margin(terms, obstacles, trajectory, control, j, later, k, at.scale)
    span, velocity = later - earlier, interpolate(trajectory, s, 1)
    into.speed[i] = np.hypot(velocity[0] - obstacles.drift[j, 0], velocity[1] - obstacles.drift[j, 1])
    into.value[i], into.slope[i] = at.value, (after.value - before.value) / span
    bend = STANDSTILL_CURVATURE + SMALLEST_CURVATURE * 2.0 * at.scale * into.speed[i] ** 2
    if earlier < s < later:
        change = (after.value - at.value) / (later - s) - (at.value - before.value) / (s - earlier)
        bend = max(bend, 2.0 * change / span)
    into.bend[i] = bend
    begin = max(terms.chance.obstacles.ignored_until[j], 1.0)
    is_at_begin = s <= 1.0 or s == begin
    into.slides[i] = 0.0 if (is_at_begin and into.slope[i] > 0.0) or (s >= steps and into.slope[i] < 0.0) else 1.0
    is_counted = 1.0 if s >= terms.chance.obstacles.ignored_until[j] else 0.0
    into.by_k[i] = -is_counted * at.stddev * at.scale
    into.slope_by_k[i] = -is_counted * (after.stddev - before.stddev) / span * at.scale
    into.offset[i, 0], into.offset[i, 1] = at.x, at.y
    linearise_curvature(terms, control, at, contacts.multiplier[i], i, into)
    first, by_k = into.blocks.shape[1] * m + 1, len(into.rows) - 1 - len(terms.cost.softness)
    for q in range(len(control)):
        into.rows[first + i, q] = at.row[q]
        into.rows[first + m + i, q] = (after.row[q] - before.row[q]) / span
        into.rows[by_k, q] += is_counted * contacts.multiplier[i] * at.variance_row[q] / (2.0 * at.stddev) * at.scale


@compiled_separately
def linearise_conditions(
    terms: ProblemTerms, obstacles: MovingObstacles, control: Vector, contacts: Contacts, k: float
) -> Linearisation:
    """Linearise the conditions at a control (2N,), contacts and k."""
    m, n, r, cost = len(contacts.time), len(control), len(terms.cost.softness), terms.cost
    trajectory, rank = compute_trajectory(terms.motion, control), RANK
    for i in range(m):
        rank = RANK_AT_CORNERS if obstacles.polygons.corners[contacts.obstacle[i]] > 1 else rank
    rows = np.zeros(((rank + 2) * m + 2 + r, n))
    diagonal = 2.0 * (1.0 + cost.weighted_variance)
    gradient = diagonal * control
    made = Linearisation(
        rows,
        np.zeros((m, rank, rank)),
        diagonal,
        gradient,
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty((m, 2)),
    )
    for i in range(m):
        linearise_contact(terms, obstacles, trajectory, control, contacts, k, i, made)
    rows[rank * m] = gradient
    for e in range(r):
        rows[len(rows) - r + e] = cost.goal_rows[e]
    return made


@compiled_separately
def assemble_system(
    made: Linearisation, cost: CostTerms, multiplier: Vector, control: Vector, preference: Preference
) -> tuple[Matrix, Vector, Matrix, Vector]:
    """Return the small system, matrix and right side; the rows by which its unknowns change the control, and p without them.

    Unknowns in order: z (5m + 1), y (m), sigma (m), step of k, nu (r).
    """
    m, r, size = len(multiplier), len(cost.softness), len(made.rows)
    rank = made.blocks.shape[1]
    y, sigma, by_k, goal = rank * m + 1, (rank + 1) * m + 1, size - 1 - r, size - r
    alone = -made.gradient / made.diagonal
    influence = -made.rows / made.diagonal
    influence[y:by_k] *= -1.0
    matrix, right = -multiply_weighted(made.rows, 1.0 / made.diagonal), -multiply_vector(made.rows, alone)
    matrix[:, y:by_k] *= -1.0
    worth, weight = max(preference.fixed_cost + preference.dt * float(control @ control), SMALLEST_COST), 0.0
    for i in range(m):
        weight = max(weight, SMALLEST_MULTIPLIER * multiplier[i])
    for i in range(m):
        first = rank * i
        moved, wanted = -made.blocks[i] @ matrix[first : first + rank], -made.blocks[i] @ right[first : first + rank]
        matrix[first : first + rank], right[first : first + rank] = moved, wanted
        matrix[y + i, by_k] += made.by_k[i]
        right[y + i] -= made.value[i]
        matrix[sigma + i, sigma + i] += made.bend[i] / max(multiplier[i], weight)
        matrix[sigma + i, by_k] += made.slope_by_k[i]
        right[sigma + i] -= made.slope[i]
        matrix[by_k, y + i] -= made.by_k[i]
        matrix[by_k, sigma + i] -= made.slope_by_k[i]
        if made.slides[i] == 0.0:
            matrix[sigma + i], matrix[:, sigma + i], right[sigma + i] = 0.0, 0.0, 0.0
            matrix[sigma + i, sigma + i] = 1.0
    growth = preference.dt / worth if preference.rate > 0.0 else 0.0
    matrix[y - 1], right[y - 1] = growth * matrix[y - 1], growth * right[y - 1]
    for a in range(y):
        matrix[a, a] += 1.0
    right[by_k] += preference.rate * worth / preference.dt
    if preference.rate == 0.0:
        matrix[by_k], right[by_k] = 0.0, 0.0
        matrix[by_k, by_k] = 1.0
    for e in range(r):
        matrix[goal + e, goal + e] -= cost.softness[e]
        right[goal + e] += cost.goal_targets[e] - cost.goal_rows[e] @ control
    return matrix, right, influence, alone


@compiled_separately
def newton_on_surrogate(
    terms: ProblemTerms,
    obstacles: MovingObstacles,
    contacts: Contacts,
    near: Vector,
    k: float,
    preference: Preference,
    tolerance: float,
) -> tuple[bool, Vector, Contacts, float]:
    """Find the control of least cost that keeps the given contacts, near a control (2N,).

    tolerance [m]: move of the contacts at which the iteration ends. Returns whether there is such a minimum, the control, the
    contacts and k. If a multiplier becomes negative, the iteration ends at once with the contacts that it began with, and that
    multiplier.
    """
    m, r, steps, last = len(contacts.time), len(terms.cost.softness), terms.motion.responses.shape[2] - 1.0, np.inf
    control, time, multiplier = near.copy(), contacts.time.copy(), contacts.multiplier.copy()
    first, slide = np.empty((m, 2)), np.empty(m)
    for count in range(MAX_STEPS):
        made = linearise_conditions(terms, obstacles, control, Contacts(contacts.obstacle, time, multiplier), k)
        if count == 0:
            first[:] = made.offset
        matrix, right, influence, alone = assemble_system(made, terms.cost, multiplier, control, preference)
        rank = made.blocks.shape[1]
        y, sigma = rank * m + 1, (rank + 1) * m + 1
        parity, found = solve_by_elimination(matrix, right)
        if parity == 0.0:
            break
        change = alone + found @ influence
        k_change = found[len(found) - 1 - r]
        move, share, weight = (
            K_SCALE * terms.extent * abs(k_change),
            1.0,
            SMALLEST_MULTIPLIER * multiplier.max() if m > 0 else 0.0,
        )
        for i in range(m):
            shift = multiply_vector(made.rows[rank * i : rank * i + 2], change)
            slide[i] = min(max(found[sigma + i] / max(multiplier[i], weight), -LONGEST_SLIDE), LONGEST_SLIDE)
            apart = max(np.hypot(made.offset[i, 0], made.offset[i, 1]), SMALLEST_DISTANCE)
            nx, ny = made.offset[i, 0] / apart, made.offset[i, 1] / apart
            share = min(share, limit_turn(apart, nx * shift[1] - ny * shift[0], nx * shift[0] + ny * shift[1]))
            move = max(move, np.hypot(shift[0], shift[1]), abs(slide[i]) * made.speed[i], abs(made.value[i]) / FAR_OFF)
        if share < SMALLEST_SHARE:
            break
        control, k = control + share * change, k + share * k_change
        multiplier += share * (found[y : y + m] - multiplier)
        for i in range(m):
            begin = max(terms.chance.obstacles.ignored_until[contacts.obstacle[i]], 1.0)
            time[i] = min(max(time[i] + share * slide[i], begin if time[i] >= begin else 1.0), steps)
        if m > 0 and multiplier.min() < 0.0:
            pulling = contacts.multiplier.copy()
            pulling[multiplier.argmin()] = multiplier.min()
            return True, near.copy(), Contacts(contacts.obstacle.copy(), contacts.time.copy(), pulling), k
        if move < tolerance:
            is_turned = False  # a contact went round to the other side of its obstacle: another homotopy class
            for i in range(m):
                is_turned = is_turned or made.offset[i, 0] * first[i, 0] + made.offset[i, 1] * first[i, 1] < 0.0
            # of a minimum, the determinant has the sign of the goal rows; that of a saddle with one falling direction, the other
            is_minimum = parity == (1.0 if r % 2 == 0 else -1.0)
            return is_minimum and not is_turned, control, Contacts(contacts.obstacle.copy(), time, multiplier), k
        if not move < np.inf or (count >= SETTLING_STEPS and move > LARGEST_GROWTH * last):
            break
        last = move
    return False, control, Contacts(contacts.obstacle.copy(), time, multiplier), k
