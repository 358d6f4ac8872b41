"""The smallest k between the steps: it changes smoothly where the smallest at the steps moves on from one step to the next."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from foc_ros.core.dynamics.condensed import position_variances
from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled
from foc_ros.core.obstacles.chance_constraint import CERTAIN_K, safety_factor, variances
from foc_ros.core.types import Array

from .chance_evaluation import Assessment, assessed
from .contacts.hermite import basis, interpolate, interpolation_row
from .problem import Problem

PARABOLAS = 8
VERTEX = 1e-4
"""How near in steps, to the lowest so far, the next lowest is not worth looking at: k is flat there."""
MUCH_MORE = 0.5
"""By how much of 1 + k a step's k may be above the smallest that the smallest between the steps is looked for beside it."""


MinimumSafetyFactor: TypeAlias = tuple[float, int, float]
"""The smallest k, with its obstacle row and time in steps."""


def assess_between(problem: Problem, control: Array, least: MinimumSafetyFactor | None = None) -> Assessment:
    """Assess a control (2N,) at the steps and between them; least: the `smallest`, where it is known."""
    k, row, time = find_minimum_safety_factor(problem, control) if least is None else least
    return assessed(problem, k, (row, time))


def find_minimum_safety_factor(problem: Problem, control: Array) -> MinimumSafetyFactor:
    """Return the smallest k of a control (2N,), at the steps and between them; CERTAIN_K without obstacles."""
    control = np.ascontiguousarray(control, dtype=float)
    motion, _, centre, drift = problem.circles
    return minimum_safety_factor(motion, problem.course(control), centre, drift, *problem.chances, control)


@compiled
def _carried(error_course: Tensor, initial_covariance: Matrix, time: float, x: float, y: float) -> float:
    """Return the variance of x p_x + y p_y at a time that comes from the initial state's."""
    if not initial_covariance.any():
        return 0.0
    t = min(int(time), error_course.shape[1] - 2)
    weight, total = basis(time - t, 0), 0.0
    row = np.zeros(len(initial_covariance))
    for axis in range(2):
        p, v, direction = error_course[axis], error_course[2 + axis], (x, y)[axis]
        row += direction * (weight[0] * p[t] + weight[1] * v[t] + weight[2] * p[t + 1] + weight[3] * v[t + 1])
    for i in range(len(row)):
        for j in range(len(row)):
            total += row[i] * initial_covariance[i, j] * row[j]
    return total


@compiled
def _k_at_time(
    motion: Tensor,
    course: Matrix,
    error_course: Tensor,
    initial_covariance: Matrix,
    control_variance: Vector,
    centre: Vector,
    size_mean: float,
    size_variance: float,
    centre_covariance: Matrix,
    time: float,
) -> float:
    """Return k for one circle, its centre (2,) where it is at a time, from what the course's position owes to each control."""
    at = interpolate(course, time, 0)
    x, y = at[0] - centre[0], at[1] - centre[1]
    # the variance of the distance's square along d is that of d.p: one row for both axes
    row = interpolation_row(motion, time, x, y)
    var = x * x * centre_covariance[0, 0] + 2 * x * y * centre_covariance[0, 1] + y * y * centre_covariance[1, 1]
    for u in range(len(row)):
        var += row[u] * row[u] * control_variance[u]
    var += _carried(error_course, initial_covariance, time, x, y)
    return float(safety_factor(size_mean - x * x - y * y, size_variance + 4 * var))


@compiled
def _moments(
    course: Matrix,
    covariance: Matrix,
    centres: Tensor,
    size_mean: Vector,
    size_variance: Vector,
    centre_covariance: Tensor,
    leaving: Vector,
) -> tuple[Matrix, Matrix]:
    """Return E[C] and Var[C] of every circle at steps 1..N, (m, N) each; E is without a bound where the circle does not count."""
    m, steps, _ = centres.shape
    mean, offset = np.empty((m, steps)), np.empty((m, steps, 2))
    for j in range(m):
        for t in range(steps):
            x, y = course[0, t + 1] - centres[j, t, 0], course[1, t + 1] - centres[j, t, 1]
            offset[j, t, 0], offset[j, t, 1] = x, y
            mean[j, t] = size_mean[j] - x * x - y * y if t + 1.0 >= leaving[j] else -np.inf
    return mean, variances(offset, covariance, size_variance, centre_covariance)


@compiled
def _is_above(bound: float, mean: float, variance: float) -> bool:
    """Tell whether `chance.k_of` is above a bound for certain, without its root: most circles are far away."""
    return mean < 0.0 and (bound <= 0.0 or mean * mean > bound * bound * variance)


@compiled
def minimum_safety_factor(
    motion: Tensor,
    course: Matrix,
    centre: Matrix,
    drift: Matrix,
    maps: Tensor,
    free_variance: Matrix,
    error_course: Tensor,
    initial_covariance: Matrix,
    noise_variance: Vector,
    centres: Tensor,
    size_mean: Vector,
    size_variance: Vector,
    centre_covariance: Tensor,
    leaving: Vector,
    control: Vector,
) -> tuple[float, int, float]:
    """Return the smallest k of a control (2N,) and its course, its circle and its time in steps; CERTAIN_K without circles.

    Where a step's k is smaller than its neighbours', the smallest is looked for beside it: at the vertex of the parabola through
    three times, closer and closer. leaving (m,): steps from now in which a circle does not count.
    """
    control_variance = noise_variance * control * control
    covariance = position_variances(maps, noise_variance, control, free_variance)
    m, steps, _ = centres.shape
    mean, var = _moments(course, covariance, centres, size_mean, size_variance, centre_covariance, leaving)
    least, row, moment = np.inf, 0, 1.0
    for j in range(m):
        for t in range(steps):
            if not _is_above(least, mean[j, t], var[j, t]):
                k = safety_factor(mean[j, t], var[j, t])
                if k < least:
                    least, row, moment = k, j, t + 1.0
    near = least + MUCH_MORE * (1.0 + abs(least))
    for j in range(m):
        for t in range(1, steps - 1):
            if _is_above(near, mean[j, t], var[j, t]):
                continue
            ka, kb, kc = (
                safety_factor(mean[j, t - 1], var[j, t - 1]),
                safety_factor(mean[j, t], var[j, t]),
                safety_factor(mean[j, t + 1], var[j, t + 1]),
            )
            if not (kb <= ka and kb < kc and kb < near and ka < CERTAIN_K and kc < CERTAIN_K):
                continue
            a, b, c = float(t), t + 1.0, t + 2.0
            for _ in range(PARABOLAS):
                bend = (b - a) * (kb - kc) - (b - c) * (kb - ka)
                if bend == 0.0:
                    break
                time = b - 0.5 * ((b - a) ** 2 * (kb - kc) - (b - c) ** 2 * (kb - ka)) / bend
                if not a < time < c or abs(time - b) < VERTEX:
                    break
                k = _k_at_time(
                    motion,
                    course,
                    error_course,
                    initial_covariance,
                    control_variance,
                    centre[j] + time * drift[j],
                    size_mean[j],
                    size_variance[j],
                    centre_covariance[j],
                    time,
                )
                if k <= kb:
                    if time < b:
                        c, kc = b, kb
                    else:
                        a, ka = b, kb
                    b, kb = time, k
                elif time < b:
                    a, ka = time, k
                else:
                    c, kc = time, k
            if kb < least:
                least, row, moment = kb, j, b
    return min(least, CERTAIN_K), row, moment
