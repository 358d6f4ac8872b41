"""Signal-dependent noise, which makes every variance a diagonal quadratic function of the control.

The plant receives U + eps with eps_i = c_i phi U_i, phi standard normal at every step and channel (paper, equations 2-3). Hence
P(t + 1) = A P(t) A' + B diag(c^2 u_t^2) B'; over the horizon, P(t) = A^t P(0) A'^t + sum_k R_k diag(c^2 u_k^2) R_k', with R_k the
response of the state at step t to the control at step k.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

from .impulse_response import apply_impulse_response
from .plants import Horizon


def stack_noise(noise: Array, steps: int) -> Array:
    """Return c for every entry of the stacked control, (2N,), from noise c per channel (2,)."""
    return np.repeat(np.asarray(noise, dtype=float), steps)


def scale_noise(noise_at_reference: Array, reference_step: float, dt: float) -> Array:
    """Convert noise c from a reference step [s] to dt [s]: c sqrt(reference / dt) keeps the noise power per second."""
    scaled: Array = np.asarray(noise_at_reference, dtype=float) * np.sqrt(reference_step / dt)
    return scaled


def propagate_covariance(horizon: Horizon, free: Array, noise_variance: Array, control: Array) -> Array:
    """Return P at steps 0..N, (N + 1, n, n).

    free (N + 1, n, n): the part that the control does not cause; noise_variance (2N,): c^2; control (2N,): stacked.
    """
    caused = apply_impulse_response(horizon.products, noise_variance * control**2)
    covariance: Array = free + caused.T.reshape(free.shape)
    return covariance
