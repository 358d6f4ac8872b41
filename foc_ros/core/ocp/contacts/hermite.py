"""The mean between two steps: the cubic through their positions and velocities, exact for the triple integrator.

Times are in steps from now, 0..N, fractions allowed; velocities are per step. With t = floor(time), a = time - t,
p(time) = (2a^3 - 3a^2 + 1) p_t + (a^3 - 2a^2 + a) v_t + (3a^2 - 2a^3) p_(t+1) + (a^3 - a^2) v_(t+1).
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.dynamics.impulse_response import apply_impulse_response
from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled

ROOT_STEPS = 40
"""Steps of regula falsi, or halvings, to the moment of closest approach within a step; five are usual."""
ROOT_CLOSE = 1e-12
"""In steps."""


@compiled
def basis(a: float, order: int) -> Vector:
    """Return the weights (4,) of p_t, v_t, p_(t+1), v_(t+1) in the position, or its first or second derivative by time."""
    weight = np.empty(4)
    if order == 0:
        weight[0], weight[1] = 2 * a**3 - 3 * a**2 + 1, a**3 - 2 * a**2 + a
        weight[3] = a**3 - a**2
    elif order == 1:
        weight[0], weight[1] = 6 * a**2 - 6 * a, 3 * a**2 - 4 * a + 1
        weight[3] = 3 * a**2 - 2 * a
    else:
        weight[0], weight[1] = 12 * a - 6, 6 * a - 4
        weight[3] = 6 * a - 2
    weight[2] = (1.0 if order == 0 else 0.0) - weight[0]
    return weight


@compiled
def interpolate(course: Matrix, time: float, order: int) -> Vector:
    """Return the position (2,), or its derivative, on a course (4, N + 1) of x, y and their velocities at steps 0..N."""
    t = min(int(time), course.shape[1] - 2)
    weight, point = basis(time - t, order), np.empty(2)
    for axis in range(2):
        point[axis] = (
            weight[0] * course[axis, t]
            + weight[1] * course[2 + axis, t]
            + weight[2] * course[axis, t + 1]
            + weight[3] * course[2 + axis, t + 1]
        )
    return point


@compiled
def interpolation_row(motion: Tensor, time: float, x: float, y: float) -> Vector:
    """Return what the control (2N,) adds to x p_x + y p_y at a time; motion (4, 2, N + 1): the course's responses to it."""
    steps = motion.shape[2] - 1
    t = min(int(time), steps - 1)
    weight, direction = basis(time - t, 0), (x, y)
    row = np.zeros(2 * steps)
    for channel in range(2):
        for axis in range(2):
            p, v = motion[axis, channel], motion[2 + axis, channel]
            for k in range(t + 1):
                now, then = t - k, t + 1 - k
                value = weight[0] * p[now] + weight[1] * v[now] + weight[2] * p[then] + weight[3] * v[then]
                row[channel * steps + k] += direction[axis] * value
    return row


@compiled
def around(motion: Tensor, free: Matrix, control: Vector, t: int) -> Matrix:
    """Return the course of a control (2N,) at steps t and t + 1 only, (4, 2)."""
    course, steps = np.empty((4, 2)), motion.shape[2] - 1
    for q in range(4):
        for i in range(2):
            total = free[q, t + i]
            for channel in range(2):
                for k in range(t + i):
                    total += motion[q, channel, t + i - k] * control[channel * steps + k]
            course[q, i] = total
    return course


@compiled
def contact_rows(motion: Tensor, time: float, x: float, y: float, turn: float) -> Matrix:
    """Return what the control adds at a time, (3, 2N): to n.p; to n.v + turn t.p; to t.p. n = (x, y), t = (-y, x)."""
    steps = motion.shape[2] - 1
    step = min(int(time), steps - 1)
    p, v = basis(time - step, 0), basis(time - step, 1)
    rows = np.zeros((3, 2 * steps))
    for channel in range(2):
        response = motion[:, channel]
        for k in range(step + 1):
            now, then, u = step - k, step + 1 - k, channel * steps + k
            xa, va, xb, vb = response[0, now], response[2, now], response[0, then], response[2, then]
            ya, wa, yb, wb = response[1, now], response[3, now], response[1, then], response[3, then]
            px, py = p[0] * xa + p[1] * va + p[2] * xb + p[3] * vb, p[0] * ya + p[1] * wa + p[2] * yb + p[3] * wb
            vx, vy = v[0] * xa + v[1] * va + v[2] * xb + v[3] * vb, v[0] * ya + v[1] * wa + v[2] * yb + v[3] * wb
            along, across = x * px + y * py, x * py - y * px
            rows[0, u], rows[1, u], rows[2, u] = along, x * vx + y * vy + turn * across, across
    return rows


@compiled
def compute_trajectory(motion: Tensor, free: Matrix, control: Vector) -> Matrix:
    """Return the course (4, N + 1) of a control (2N,); free (4, N + 1): without it."""
    course: Matrix = free + apply_impulse_response(motion, control)
    return course


@compiled
def required_distance(reach: float, missing: float, pace: float, time: float) -> tuple[float, float, float]:
    """Return the distance to be kept from a centre at a time, and its first and second derivative.

    reach [m], less what was missing of it at first [m] and still is: a minimum-jerk movement over 1 / pace steps takes it to 0.
    """
    s = time * pace
    if missing <= 0.0 or s >= 1.0:
        return reach, 0.0, 0.0
    left = 1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate, bend = 30.0 * s**2 * (1.0 - s) ** 2, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return reach - missing * left, missing * rate * pace, missing * bend * pace**2


@compiled
def required_distances(reach: Vector, missing: Vector, pace: float, times: Vector) -> Matrix:
    """Return the distances (m, q) to be kept from m centres at times (q,)."""
    wanted = np.empty((len(reach), len(times)))
    for j in range(len(reach)):
        for t in range(len(times)):
            wanted[j, t] = required_distance(reach[j], missing[j], pace, times[t])[0]
    return wanted


@compiled
def clearance(
    x: float, y: float, vx: float, vy: float, reach: float, missing: float, pace: float, time: float
) -> tuple[float, float]:
    """Return how much farther than wanted (x, y) is from a centre at a time [m], and the rate of that; both relative to it."""
    distance = max(np.sqrt(x * x + y * y), 1e-12)
    wanted, faster, _ = required_distance(reach, missing, pace, time)
    return distance - wanted, (x * vx + y * vy) / distance - faster


@compiled
def clearance_at(
    course: Matrix, cx: float, cy: float, dx: float, dy: float, reach: float, missing: float, pace: float, time: float
) -> tuple[float, float]:
    """Return the same on a course (4, N + 1), of a circle that is at (cx, cy) now and moves by (dx, dy) per step."""
    p, v = interpolate(course, time, 0), interpolate(course, time, 1)
    spare, rate = clearance(p[0] - cx - time * dx, p[1] - cy - time * dy, v[0] - dx, v[1] - dy, reach, missing, pace, time)
    return spare, rate


@compiled
def _closest(
    course: Matrix,
    cx: float,
    cy: float,
    dx: float,
    dy: float,
    reach: float,
    missing: float,
    pace: float,
    begin: float,
    rate_begin: float,
    rate_end: float,
) -> float:
    """Return the time within the step from `begin` at which the rate passes zero: regula falsi, halved where it is slow."""
    low, high, below, above = begin, begin + 1.0, rate_begin, rate_end
    time = begin
    for i in range(ROOT_STEPS):
        time = (low + high) / 2 if i % 3 == 2 else (low * above - high * below) / (above - below)
        _, rate = clearance_at(course, cx, cy, dx, dy, reach, missing, pace, time)
        if rate < 0.0:
            low, below = time, rate
        else:
            high, above = time, rate
        if high - low < ROOT_CLOSE or abs(rate) < ROOT_CLOSE * (above - below + 1e-9):
            break
    return time


@compiled
def _longest(course: Matrix) -> float:
    """Return how far a mean gets from the step before it at most, before the next."""
    longest, before = 0.0, 0.0
    for t in range(course.shape[1]):
        speed = np.sqrt(course[2, t] ** 2 + course[3, t] ** 2)
        if t > 0:
            x, y = course[0, t] - course[0, t - 1], course[1, t] - course[1, t - 1]
            longest = max(longest, np.sqrt(x * x + y * y) + before + speed)
        before = speed
    return longest


@compiled
def _is_far(course: Matrix, cx: float, cy: float, dx: float, dy: float, distance: float) -> bool:
    """Tell whether a circle's centre is farther than a distance from the places of all steps."""
    nearest = np.inf
    for t in range(course.shape[1]):
        x, y = course[0, t] - cx - t * dx, course[1, t] - cy - t * dy
        nearest = min(nearest, x * x + y * y)
    return nearest > distance * distance


@compiled
def find_penetrations(
    course: Matrix, centre: Matrix, drift: Matrix, reach: Vector, missing: Vector, pace: float, tolerance: float
) -> Matrix:
    """Return the moments of closest approach (q, 2) at which the mean is too near: row of the circle, time in steps.

    centre (m, 2) at step 0 and drift (m, 2) per step, of m circles; reach, missing (m,), pace: `kept`. From step 1 on: the hand
    cannot be elsewhere before. Between two steps an approach is found where the distance to spare falls at the first and grows at
    the second.
    """
    m, last = len(reach), course.shape[1] - 1
    found, count = np.empty((m * (last + 1), 2)), 0
    travelled = _longest(course)
    for j in range(m):
        cx, cy, dx, dy = centre[j, 0], centre[j, 1], drift[j, 0], drift[j, 1]
        margin, short = reach[j], missing[j]
        if _is_far(course, cx, cy, dx, dy, margin + travelled + np.hypot(dx, dy)):
            continue
        spare_before, rate_before = 0.0, 0.0
        for t in range(1, last + 1):
            x, y = course[0, t] - cx - t * dx, course[1, t] - cy - t * dy
            spare, rate = clearance(x, y, course[2, t] - dx, course[3, t] - dy, margin, short, pace, float(t))
            time = -1.0
            if t == 1 and rate >= 0.0:
                time = 1.0
            elif t > 1 and rate_before < 0.0 <= rate and min(spare, spare_before) < abs(rate_before) + abs(rate):
                time = _closest(course, cx, cy, dx, dy, margin, short, pace, t - 1.0, rate_before, rate)
            if t == last and rate < 0.0:
                time = float(last)
            if time > 0.0:
                nearest, _ = clearance_at(course, cx, cy, dx, dy, margin, short, pace, time)
                if nearest < -tolerance:
                    found[count, 0], found[count, 1] = j, time
                    count += 1
            spare_before, rate_before = spare, rate
    return found[:count].copy()
