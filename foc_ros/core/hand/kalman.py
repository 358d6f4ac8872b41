# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Kalman filter of the hand: stamped positions enter; mean and covariance of position, velocity and acceleration leave.

Per axis the state is x = (position, velocity, acceleration), driven by white jerk of spectral density q^2,

    x(t + dt) = A(dt) x(t) + w,  A = [[1, dt, dt^2/2], [0, 1, dt], [0, 0, 1]],  w ~ N(0, q^2 G(dt)),
    G(dt) = [[dt^5/20, dt^4/8, dt^3/6], [dt^4/8, dt^3/3, dt^2/2], [dt^3/6, dt^2/2, dt]],

the exact discretisation for any dt, so that irregular stamps need no resampling. The two axes of the task plane and the height
over it are measured equally well, so they share one 3 x 3 covariance P and one gain.

The filter propagates the lower triangular root L of P = L L'. The time update makes the columns [A L, q C] triangular, with C C'
= G(dt). The measurement update, for a position of standard deviation r, involves only the first row of L, which is (l, 0, 0):
with the variance e^2 = l^2 + r^2 of the innovation, the gain is L_1 l / e^2, the first column becomes L_1 r / e, and the others
stay. The covariance is therefore symmetric and positive for all deviations and intervals; the Joseph form was not for two samples
1 us apart.

The first sample gives the position. Velocity and acceleration start at zero, with the covariance that the jerk would give a hand
at rest within `gap_s`, the longest time for which the filter trusts an old state.

A tracker that has lost the hand, or takes another object for it, makes its position jump. A sample that is farther in the plane
from where the hand was going at its estimated velocity than `JUMP_STDDEVS` r + `JUMP_SPEED` dt is such a jump, since no hand
changes its velocity by as much between two samples. It is not used, and the next sample decides: where it continues the jump, the
filter starts anew there, since the speed of a jump is not that of a movement; where it continues the movement, the jump was an
outlier. A hand that is already as fast as that when the filter starts is therefore not followed.

A movement begins when the speed in the plane exceeds both `onset_speed` and three of its own standard deviations, and ends below
half of `onset_speed`. Measured at rest with 1 mm of noise and the default jerk density, the second condition reduces the false
onsets from several per second to at most one in 45 s, and delays a true one (0.3 m in 1 s) by 0.03 s at 200 Hz and 0.09 s at
15 Hz.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from foc_ros.core.config import EstimatorConfig
from foc_ros.core.errors import InputError
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState, SampleStatus, as_readonly

JUMP_STDDEVS = 10.0
JUMP_SPEED = 5.0
"""Change of velocity between two samples that no hand has [m/s]."""


@dataclass(frozen=True, eq=False)
class FilterState(HandState):
    """A hand state with the internal state of the filter.

    root (3, 3): lower triangular root of the covariance of one axis; jumped: the last sample, if its position jumped; restarts:
    how often the filter has started anew.
    """

    root: Array = field(default_factory=lambda: np.zeros((3, 3)))
    jumped: HandSample | None = None
    restarts: int = 0

    def is_continued_by(self, later: FilterState | None) -> bool:
        """Return whether there is a later state, and the filter has not started anew in between."""
        return later is not None and later.restarts == self.restarts


@dataclass(frozen=True)
class Update:
    """The state after a sample, and what became of the sample."""

    state: FilterState
    status: SampleStatus


def update(state: FilterState | None, sample: HandSample, config: EstimatorConfig) -> Update:
    """Update the filter by one sample.

    Parameters
    ----------
    state
        State after the last sample; None at the start.
    sample
        The measured position.
    config
        Parameters of the filter.

    Returns
    -------
    Update
        A sample with the last stamp, or late by at most `gap_s`, is dropped, and the state stays as it was. A sample that is
        earlier than that, or later than the last one by more than `gap_s`, restarts the filter. A position that jumps is not
        used, but kept in the state: a sample that continues it restarts the filter.
    """
    if state is None:
        return Update(_start_state(sample, config), SampleStatus.ACCEPTED)
    dt = (sample.stamp_ns - state.stamp_ns) / NANOSECONDS
    if dt == 0.0:
        return Update(state, SampleStatus.DUPLICATE)
    if dt < -config.gap_s:
        return Update(_start_state(sample, config, state.restarts + 1), SampleStatus.RESTARTED_BACKWARD)
    if dt < 0.0:
        return Update(state, SampleStatus.LATE)
    if dt > config.gap_s:
        return Update(_start_state(sample, config, state.restarts + 1), SampleStatus.RESTARTED_GAP)
    away_m, limit_m = measure_jump(state, sample, config)
    if state.jumped is not None and state.jumped.stamp_ns < sample.stamp_ns:
        jumped_m, jumped_limit_m = measure_jump(_start_state(state.jumped, config), sample, config)
        if jumped_m < away_m and jumped_m <= jumped_limit_m:
            return Update(_start_state(sample, config, state.restarts + 1), SampleStatus.RESTARTED_JUMP)
    if away_m > limit_m:
        return Update(replace(state, jumped=sample), SampleStatus.JUMPED)
    return Update(_update_state(state, sample, dt, config), SampleStatus.ACCEPTED)


def measure_jump(state: HandState, sample: HandSample, config: EstimatorConfig) -> tuple[float, float]:
    """Return how far a later sample is from where the hand was going [m], and beyond which distance this is a jump [m]."""
    dt = (sample.stamp_ns - state.stamp_ns) / NANOSECONDS
    away = sample.position - state.mean[:2] - dt * state.mean[2:4]
    return math.hypot(*away), JUMP_STDDEVS * config.position_stddev + JUMP_SPEED * dt


def describe_jump(field: str, state: HandState, sample: HandSample, config: EstimatorConfig) -> InputError:
    """Return the error that says in words how far the position of a sample, a field of that name, jumps."""
    away_m, limit_m = measure_jump(state, sample, config)
    expected = f'a position within {limit_m:.3g} m of where the hand was going, or the same jump again in the next sample'
    return InputError(field, expected, f'one that is {away_m:.3g} m away')


def compute_transition(dt: float) -> Array:
    """Return A(dt), (3, 3), of one axis."""
    return np.array([[1.0, dt, dt**2 / 2.0], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])


def compute_gramian(dt: float) -> Array:
    """Return G(dt), (3, 3): the covariance that white jerk of unit density gives one axis in dt."""
    return np.array(
        [
            [dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0],
            [dt**4 / 8.0, dt**3 / 3.0, dt**2 / 2.0],
            [dt**3 / 6.0, dt**2 / 2.0, dt],
        ]
    )


def expand_to_both_axes(covariance: Array) -> Array:
    """Return the covariance (6, 6) of x, y, vx, vy, ax, ay from the one (3, 3) that all axes share."""
    both = np.zeros((6, 6))
    both[::2, ::2] = both[1::2, 1::2] = covariance
    return both


def _start_state(sample: HandSample, config: EstimatorConfig, restarts: int = 0) -> FilterState:
    """Return the state after a first position."""
    root = np.zeros((3, 3))
    root[0, 0] = config.position_stddev
    root[1:, 1:] = config.jerk_density * np.linalg.cholesky(compute_gramian(config.gap_s)[1:, 1:])
    mean, height_mean = np.concatenate([sample.position, np.zeros(4)]), np.array([sample.height, 0.0, 0.0])
    hand = sample.stamp_ns, mean, expand_to_both_axes(root @ root.T), sample.height, sample.frame_id
    return FilterState(*hand, height_mean=height_mean, root=root, restarts=restarts)


_UNIT_ROOT = np.linalg.cholesky(compute_gramian(1.0))
"""C for dt = 1 s; its rows scale with these powers of dt."""
_ROOT_ORDERS = np.array([[2.5], [1.5], [0.5]])


def _update_state(state: FilterState, sample: HandSample, dt: float, config: EstimatorConfig) -> FilterState:
    """Propagate a state to the stamp of the sample, correct it by the position, and update the movement."""
    step = compute_transition(dt)
    _, upper = np.linalg.qr(np.hstack((step @ state.root, config.jerk_density * dt**_ROOT_ORDERS * _UNIT_ROOT)).T)
    root = upper.T * np.copysign(1.0, upper.diagonal())
    first = root[0, 0]
    deviation = math.hypot(first, config.position_stddev)
    states = step @ np.column_stack((state.mean.reshape(3, 2), state.height_mean))
    innovation = np.array([*sample.position, sample.height]) - states[0]
    states += np.outer(root[:, 0] * (first / deviation / deviation), innovation)
    root[:, 0] *= config.position_stddev / deviation
    found = states[:, :2].ravel(), states[:, 2].copy(), expand_to_both_axes(root @ root.T), root
    mean, height_mean, covariance, root = map(as_readonly, found)
    onset_ns, onset_position = _update_movement(state, sample.stamp_ns, mean, covariance, config)
    hand = sample.stamp_ns, mean, covariance, sample.height, sample.frame_id
    return FilterState(*hand, onset_ns, onset_position, height_mean, root, restarts=state.restarts)


def _update_movement(
    state: FilterState, stamp_ns: int, mean: Array, covariance: Array, config: EstimatorConfig
) -> tuple[int | None, Array | None]:
    """Begin, continue or end a movement; return stamp and position (2,) of its onset, None at rest."""
    onset_ns, onset_position, speed = state.onset_ns, state.onset_position, math.hypot(mean[2], mean[3])
    if onset_ns is None:
        if speed <= max(config.onset_speed, 3.0 * math.sqrt(covariance[2, 2])):
            return None, None
        onset_ns, onset_position = stamp_ns, mean[:2]
    elif speed < config.onset_speed / 2.0:
        return None, None
    return onset_ns, onset_position
