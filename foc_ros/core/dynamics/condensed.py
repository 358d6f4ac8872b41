"""Means and variances of the position over the horizon, as functions of the stacked control."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled

from .impulse_response import apply_impulse_response


class PositionNoise(NamedTuple):
    """How a control spreads the position over the horizon.

    responses (5, 2, N + 1): impulse responses of x and y and their products xx, yy, xy (`Horizon.maps`); noise_variance (2N,):
    c^2 for each entry of the stacked control; free (3, N): variances xx, yy, xy that the control does not cause [m^2].
    """

    responses: Tensor
    noise_variance: Vector
    free: Matrix


@compiled
def position_variances(noise: PositionNoise, control: Vector) -> Matrix:
    """Return the position covariance at steps 1..N as rows xx, yy, xy, (3, N) [m^2], for a stacked control (2N,)."""
    variance: Matrix = noise.free + apply_impulse_response(noise.responses[2:], noise.noise_variance * control * control)[:, 1:]
    return variance


@compiled
def largest_shift(position: Tensor, control: Vector, other: Vector) -> float:
    """Return the largest difference in x or y between the means of two controls (2N,) [m]; position (2, 2, N + 1)."""
    return float(np.abs(apply_impulse_response(position, control - other)).max())


@compiled
def variance_weights(states: Tensor, terminal: Vector, stage: Vector) -> Vector:
    """Return d (2N,), where d.u^2 is what a control's noise u adds to sum_i terminal_i X_i(N)^2 + stage_i sum_{t < N} X_i(t)^2.

    states (n, 2, N + 1): impulse responses of the states; terminal, stage (n,): weights.
    """
    n, channels, times = states.shape
    weights = np.zeros((channels, times - 1))
    for i in range(n):
        for channel in range(channels):
            before = 0.0
            for since in range(1, times):
                square = states[i, channel, since] ** 2
                weights[channel, -since] += terminal[i] * square + stage[i] * before
                before += square
    return weights.ravel()
