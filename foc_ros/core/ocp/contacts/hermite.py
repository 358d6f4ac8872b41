"""The mean between two steps, by Hermite interpolation: the cubic through their positions and velocities.

The interpolation is exact for the triple integrator, whose jerk is constant during a step, and an approximation for other plants.
Times are in steps from now, 0..N, fractions allowed; velocities are per step. With t = floor(time), a = time - t,
p(time) = (2a^3 - 3a^2 + 1) p_t + (a^3 - 2a^2 + a) v_t + (3a^2 - 2a^3) p_(t+1) + (a^3 - a^2) v_(t+1).
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.dynamics.impulse_response import apply_impulse_response
from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled, compiled_with_caller
from foc_ros.core.ocp.terms import Motion


@compiled_with_caller
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
def compute_trajectory(motion: Motion, control: Vector) -> Matrix:
    """Return the trajectory (4, N + 1) of a control (2N,)."""
    trajectory: Matrix = motion.free + apply_impulse_response(motion.responses, control)
    return trajectory


@compiled
def interpolate(trajectory: Matrix, time: float, order: int) -> Vector:
    """Return the position (2,) on a trajectory (4, N + 1) at a time, or its first or second derivative (order 1 or 2)."""
    t = min(int(time), trajectory.shape[1] - 2)
    weight, point = basis(time - t, order), np.empty(2)
    for axis in range(2):
        point[axis] = (
            weight[0] * trajectory[axis, t]
            + weight[1] * trajectory[2 + axis, t]
            + weight[2] * trajectory[axis, t + 1]
            + weight[3] * trajectory[2 + axis, t + 1]
        )
    return point


@compiled_with_caller
def trajectory_around(motion: Motion, control: Vector, t: int) -> Matrix:
    """Return the trajectory of a control (2N,) at steps t and t + 1 only, (4, 2)."""
    trajectory, steps = np.empty((4, 2)), motion.responses.shape[2] - 1
    for q in range(4):
        for i in range(2):
            total = motion.free[q, t + i]
            for channel in range(2):
                for k in range(t + i):
                    total += motion.responses[q, channel, t + i - k] * control[channel * steps + k]
            trajectory[q, i] = total
    return trajectory


@compiled
def interpolation_row(responses: Tensor, time: float, x: float, y: float) -> Vector:
    """Return the row (2N,) whose product with the control is its effect on x p_x + y p_y at a time; see `Motion.responses`."""
    steps = responses.shape[2] - 1
    t = min(int(time), steps - 1)
    weight, direction = basis(time - t, 0), (x, y)
    row = np.zeros(2 * steps)
    for channel in range(2):
        for axis in range(2):
            p, v = responses[axis, channel], responses[2 + axis, channel]
            for k in range(t + 1):
                now, then = t - k, t + 1 - k
                value = weight[0] * p[now] + weight[1] * v[now] + weight[2] * p[then] + weight[3] * v[then]
                row[channel * steps + k] += direction[axis] * value
    return row


@compiled
def interpolation_rows(motion: Motion, times: Vector) -> tuple[Tensor, Matrix]:
    """Return the effect of the control on x and y at times (e,) as rows (2, e, 2N), and the positions (e, 2) without control."""
    rows, free = np.empty((2, len(times), 2 * (motion.responses.shape[2] - 1))), np.empty((len(times), 2))
    for i in range(len(times)):
        rows[0, i] = interpolation_row(motion.responses, times[i], 1.0, 0.0)
        rows[1, i] = interpolation_row(motion.responses, times[i], 0.0, 1.0)
        free[i] = interpolate(motion.free, times[i], 0)
    return rows, free


@compiled_with_caller
def contact_rows(responses: Tensor, time: float, x: float, y: float, turn: float) -> Matrix:
    """Return the effect of the control at a time, (3, 2N): on n.p; on n.v + turn t.p; on t.p, for n = (x, y), t = (-y, x)."""
    steps = responses.shape[2] - 1
    step = min(int(time), steps - 1)
    p, v = basis(time - step, 0), basis(time - step, 1)
    rows = np.zeros((3, 2 * steps))
    for channel in range(2):
        response = responses[:, channel]
        for k in range(step + 1):
            now, then, u = step - k, step + 1 - k, channel * steps + k
            xa, va, xb, vb = response[0, now], response[2, now], response[0, then], response[2, then]
            ya, wa, yb, wb = response[1, now], response[3, now], response[1, then], response[3, then]
            px, py = p[0] * xa + p[1] * va + p[2] * xb + p[3] * vb, p[0] * ya + p[1] * wa + p[2] * yb + p[3] * wb
            vx, vy = v[0] * xa + v[1] * va + v[2] * xb + v[3] * vb, v[0] * ya + v[1] * wa + v[2] * yb + v[3] * wb
            along, across = x * px + y * py, x * py - y * px
            rows[0, u], rows[1, u], rows[2, u] = along, x * vx + y * vy + turn * across, across
    return rows
