"""Means and variances of the position over the horizon, as functions of the stacked control."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.types import Array

from .impulse_response import apply_impulse_response


class PositionNoise(NamedTuple):
    """How a control spreads the position over the horizon.

    responses (5, 2, N + 1): impulse responses of x and y and their products xx, yy, xy (`Horizon.maps`); noise_variance (2N,):
    c^2 for each entry of the stacked control; free (3, N): variances xx, yy, xy that the control does not cause [m^2].
    """

    responses: Array
    noise_variance: Array
    free: Array


def position_variances(noise: PositionNoise, control: Array) -> Array:
    """Return the position covariance at steps 1..N as rows xx, yy, xy, (3, N) [m^2], for a stacked control (2N,)."""
    variance: Array = noise.free + apply_impulse_response(noise.responses[2:], noise.noise_variance * control**2)[:, 1:]
    return variance


def variance_weights(states: Array, terminal: Array, stage: Array) -> Array:
    """Return d (2N,), where d.u^2 is what a control's noise u adds to sum_i terminal_i X_i(N)^2 + stage_i sum_{t < N} X_i(t)^2.

    states (n, 2, N + 1): impulse responses of the states; terminal, stage (n,): weights.
    """
    squares = states**2
    since = np.tensordot(terminal, squares[..., 1:], 1) + np.tensordot(stage, squares[..., :-1].cumsum(axis=-1), 1)
    return since[:, ::-1].ravel()
