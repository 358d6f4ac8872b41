"""Kalman filter of the hand: positions with stamps in, mean and covariance of position, velocity and acceleration out.

Per axis the state is x = (position, velocity, acceleration) driven by white jerk of spectral density q^2,

    x(t + dt) = A(dt) x(t) + w,  A = [[1, dt, dt^2/2], [0, 1, dt], [0, 0, 1]],  w ~ N(0, q^2 G(dt)),
    G(dt) = [[dt^5/20, dt^4/8, dt^3/6], [dt^4/8, dt^3/3, dt^2/2], [dt^3/6, dt^2/2, dt]],

the exact discretisation for any dt, so irregular stamps need no resampling. Both axes are measured equally well, so they share
one 3 x 3 covariance and one gain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .config import EstimatorConfig
from .records import NANOSECONDS, Array, HandSample, HandState
from .verdict import Verdict


@dataclass(frozen=True)
class Update:
    """The estimator's answer: the state to hand in next time, and what became of the sample."""

    state: HandState
    verdict: Verdict


def update(state: HandState | None, sample: HandSample, config: EstimatorConfig) -> Update:
    """Take one sample into the filter.

    state: of the last update, None at the start. A sample of the same stamp, or late by no more than `gap_s`, is dropped: the
    state is returned as it was. A stamp farther back, or farther ahead than `gap_s`, starts the filter anew.
    """
    if state is None:
        return Update(_first(sample, config), Verdict.ACCEPTED)
    dt = (sample.stamp_ns - state.stamp_ns) / NANOSECONDS
    if dt == 0.0:
        return Update(state, Verdict.DUPLICATE)
    if dt < -config.gap_s:
        return Update(_first(sample, config), Verdict.RESTARTED_BACKWARD)
    if dt < 0.0:
        return Update(state, Verdict.LATE)
    if dt > config.gap_s:
        return Update(_first(sample, config), Verdict.RESTARTED_GAP)
    return Update(_onset(_filtered(state, sample, dt, config), config), Verdict.ACCEPTED)


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


def _first(sample: HandSample, config: EstimatorConfig) -> HandState:
    """Start: the position as measured; velocity and acceleration as far from rest as the jerk could bring them in `gap_s`."""
    covariance = config.jerk_density**2 * gramian(config.gap_s)
    covariance[0] = covariance[:, 0] = (config.position_stddev**2, 0.0, 0.0)
    mean = np.concatenate([sample.position, np.zeros(4)])
    return HandState(sample.stamp_ns, mean, _both_axes(covariance), sample.height, sample.frame_id)


def _filtered(state: HandState, sample: HandSample, dt: float, config: EstimatorConfig) -> HandState:
    """Predict to the sample's stamp and correct by it, in Joseph form: the covariance stays symmetric and positive."""
    variance = config.position_stddev**2
    a = transition(dt)
    mean = a @ state.mean.reshape(3, 2)
    covariance = a @ state.covariance[::2, ::2] @ a.T + config.jerk_density**2 * gramian(dt)
    gain = covariance[:, 0] / (covariance[0, 0] + variance)
    mean = mean + np.outer(gain, sample.position - mean[0])
    keep = np.eye(3)
    keep[:, 0] -= gain
    covariance = keep @ covariance @ keep.T + variance * np.outer(gain, gain)
    covariance = (covariance + covariance.T) / 2.0
    return replace(
        state,
        stamp_ns=sample.stamp_ns,
        mean=mean.ravel(),
        covariance=_both_axes(covariance),
        height=sample.height,
        frame_id=sample.frame_id,
    )


def _both_axes(covariance: Array) -> Array:
    """Return the (6, 6) covariance of x, y, vx, vy, ax, ay from the (3, 3) one that both axes have."""
    both = np.zeros((6, 6))
    both[::2, ::2] = both[1::2, 1::2] = covariance
    return both


def _onset(state: HandState, config: EstimatorConfig) -> HandState:
    """Begin a movement above `onset_speed`, end it below half of that."""
    speed = float(np.hypot(state.mean[2], state.mean[3]))
    if state.onset_ns is None and speed > config.onset_speed:
        return replace(state, onset_ns=state.stamp_ns, onset_position=state.mean[:2].copy(), effort_spent=0.0)
    if state.onset_ns is not None and speed < config.onset_speed / 2.0:
        return replace(state, onset_ns=None, onset_position=None, effort_spent=0.0)
    return state
