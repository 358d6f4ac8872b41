"""Kalman filter of the hand: positions with stamps in, mean and covariance of position, velocity and acceleration out.

Per axis the state is x = (position, velocity, acceleration) driven by white jerk of spectral density q^2,

    x(t + dt) = A(dt) x(t) + w,  A = [[1, dt, dt^2/2], [0, 1, dt], [0, 0, 1]],  w ~ N(0, q^2 G(dt)),
    G(dt) = [[dt^5/20, dt^4/8, dt^3/6], [dt^4/8, dt^3/3, dt^2/2], [dt^3/6, dt^2/2, dt]],

the exact discretisation for any dt, so irregular stamps need no resampling. Both axes are measured equally well, so they share
one 3 x 3 covariance P and one gain.

The filter works on the lower triangular root L of P = L L'. In time, the columns [A L, q C] are made triangular, C C' = G(dt).
A measured position of deviation r sees the first row of L alone, which is (l, 0, 0): with e^2 = l^2 + r^2 the variance of the
innovation, the gain is L_1 l / e^2 and the first column becomes L_1 r / e, the others stay. So the covariance is symmetric and
positive whatever the deviations and intervals; an update in Joseph form was not for two samples 1 us apart.

The first sample gives the position. Velocity and acceleration then start at zero with the covariance that a hand at rest would
have got from the jerk in `gap_s`, the longest time for which the filter believes in an old state.

A movement begins where the speed exceeds `onset_speed` and three of its own standard deviations, and ends below half of
`onset_speed`. Measured at rest with 1 mm of noise and the default jerk density: the second condition lowers the false onsets from
several per second to one in 45 s or fewer, and delays a true one (0.3 m in 1 s) by 0.03 s at 200 Hz and 0.09 s at 15 Hz.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.config import EstimatorConfig
from foc_ros.core.kernels import Matrix, Vector, compiled
from foc_ros.core.linear_algebra import multiply, multiply_transposed
from foc_ros.core.sample_status import SampleStatus
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState, as_readonly

from .effort import Effort, add_sample

ONSET_STDDEVS = 3.0


@dataclass(frozen=True, eq=False)
class FilterState(HandState):
    """A hand state, and what else the estimator remembers.

    root (3, 3): lower triangular root of one axis' covariance; effort: the samples since onset, as far as the effort needs them.
    """

    root: Array = field(default_factory=lambda: np.zeros((3, 3)))
    effort: Effort = field(default_factory=Effort)


@dataclass(frozen=True)
class Update:
    """The estimator's answer: the state to hand in next time, and what became of the sample."""

    state: FilterState
    verdict: SampleStatus


def update(state: FilterState | None, sample: HandSample, config: EstimatorConfig) -> Update:
    """Take one sample into the filter.

    state: of the last update, None at the start. A sample of the same stamp, or late by no more than `gap_s`, is dropped: the
    state is returned as it was. A stamp farther back, or farther ahead than `gap_s`, starts the filter anew.
    """
    if state is None:
        return Update(_first(sample, config), SampleStatus.ACCEPTED)
    dt = (sample.stamp_ns - state.stamp_ns) / NANOSECONDS
    if dt == 0.0:
        return Update(state, SampleStatus.DUPLICATE)
    if dt < -config.gap_s:
        return Update(_first(sample, config), SampleStatus.RESTARTED_BACKWARD)
    if dt < 0.0:
        return Update(state, SampleStatus.LATE)
    if dt > config.gap_s:
        return Update(_first(sample, config), SampleStatus.RESTARTED_GAP)
    return Update(_followed(state, sample, dt, config), SampleStatus.ACCEPTED)


@compiled
def transition(dt: float) -> Array:
    """Return A(dt), (3, 3), of one axis."""
    return np.array([[1.0, dt, dt**2 / 2.0], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])


def gramian(dt: float) -> Array:
    """Return G(dt), (3, 3): the covariance that white jerk of unit density gives one axis in dt."""
    return np.array(
        [
            [dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0],
            [dt**4 / 8.0, dt**3 / 3.0, dt**2 / 2.0],
            [dt**3 / 6.0, dt**2 / 2.0, dt],
        ]
    )


_UNIT_ROOT = np.linalg.cholesky(gramian(1.0))
"""C for dt = 1 s; the rows scale with dt^2.5, dt^1.5 and dt^0.5."""


@compiled
def triangularise(columns: Matrix) -> Matrix:
    """Return the lower triangular L (n, n) with L L' = M M' for columns M (n, q), q >= n: M turned by plane rotations."""
    turned = columns.copy()
    n, q = turned.shape
    for i in range(n):
        for j in range(i + 1, q):
            length = np.hypot(turned[i, i], turned[i, j])
            if length > 0.0:
                c, s = turned[i, i] / length, turned[i, j] / length
                for k in range(i, n):
                    turned[k, i], turned[k, j] = c * turned[k, i] + s * turned[k, j], c * turned[k, j] - s * turned[k, i]
    return turned[:, :n].copy()


@compiled
def both_axes(covariance: Matrix) -> Matrix:
    """Return the (6, 6) covariance of x, y, vx, vy, ax, ay from the (3, 3) one that both axes have."""
    both = np.zeros((6, 6))
    for i in range(3):
        for j in range(3):
            both[2 * i, 2 * j] = both[2 * i + 1, 2 * j + 1] = covariance[i, j]
    return both


@compiled
def filter_step(
    mean: Vector, root: Matrix, dt: float, jerk_density: float, stddev: float, position: Vector
) -> tuple[Vector, Matrix, Matrix]:
    """Return mean (6,), covariance (6, 6) and root (3, 3) a time dt [s] on, corrected by a position (2,) of a deviation [m]."""
    step, columns = transition(dt), np.empty((3, 6))
    columns[:, :3] = multiply(step, root)
    for i in range(3):
        columns[i, 3:] = jerk_density * dt ** (2.5 - i) * _UNIT_ROOT[i]
    corrected = triangularise(columns)
    first = corrected[0, 0]
    deviation = np.hypot(first, stddev)
    states = multiply(step, mean.reshape(3, 2))
    missed = position - states[0]
    for i in range(3):
        states[i] += corrected[i, 0] * (first / deviation / deviation) * missed
        corrected[i, 0] *= stddev / deviation
    return states.ravel(), both_axes(multiply_transposed(corrected, corrected)), corrected


def _first(sample: HandSample, config: EstimatorConfig) -> FilterState:
    """Start from one position."""
    root = np.zeros((3, 3))
    root[0, 0] = config.position_stddev
    root[1:, 1:] = config.jerk_density * np.linalg.cholesky(gramian(config.gap_s)[1:, 1:])
    mean = np.concatenate([sample.position, np.zeros(4)])
    return FilterState(sample.stamp_ns, mean, both_axes(root @ root.T), sample.height, sample.frame_id, root=root)


def _followed(state: FilterState, sample: HandSample, dt: float, config: EstimatorConfig) -> FilterState:
    """Predict to the sample's stamp, correct by its position, and see what becomes of the movement."""
    settings = config.jerk_density, config.position_stddev
    mean, covariance, root = map(as_readonly, filter_step(state.mean, state.root, dt, *settings, sample.position))
    onset_ns, onset_position, effort = _movement(state, sample, mean, covariance, config)
    hand = sample.stamp_ns, mean, covariance, sample.height, sample.frame_id
    return FilterState(*hand, onset_ns, onset_position, effort.spent, root, effort)


def _movement(
    state: FilterState, sample: HandSample, mean: Array, covariance: Array, config: EstimatorConfig
) -> tuple[int | None, Array | None, Effort]:
    """Begin, go on with, or end a movement: return its onset and where that was, None at rest, and its effort."""
    onset_ns, onset_position, speed = state.onset_ns, state.onset_position, math.hypot(mean[2], mean[3])
    if onset_ns is None:
        if speed <= max(config.onset_speed, ONSET_STDDEVS * math.sqrt(covariance[2, 2])):
            return None, None, state.effort
        onset_ns, onset_position = sample.stamp_ns, mean[:2]
    elif speed < config.onset_speed / 2.0:
        return None, None, Effort()
    return onset_ns, onset_position, add_sample(state.effort, sample.stamp_ns, sample.position, config.position_stddev)
