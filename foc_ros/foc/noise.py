"""Signal-dependent noise: every variance is a diagonal quadratic in the control.

U + eps, eps_i = c_i phi U_i with phi standard normal at every step and channel (paper, equations 2-3), so that
P(t) = A^t P(0) A'^t + sum_k R_k diag(c^2 u_k^2) R_k', with R_k the response of the state at step t to the control at step k.
"""

from __future__ import annotations

import numpy as np

from .compiled import Tensor, Vector, compiled
from .dynamics import Horizon
from .records import Array


def stacked_noise(noise: Array, steps: int) -> Array:
    """Return c for every entry of u, (2N,): noise (2,) per channel, drawn once per step."""
    return np.repeat(np.asarray(noise, dtype=float), steps)


def noise_per_step(noise_at_reference: Array, reference_step: float, dt: float) -> Array:
    """Scale c from a reference step [s] to dt [s]: c sqrt(reference / dt), so that the noise power per second stays."""
    scaled: Array = np.asarray(noise_at_reference, dtype=float) * np.sqrt(reference_step / dt)
    return scaled


def state_covariance(horizon: Horizon, free: Array, noise: Array, control: Array) -> Array:
    """Return P at steps 0..N, (N + 1, n, n): free part (N + 1, n, n), noise (2,), control stacked (2N,)."""
    covariance = free.copy()
    covariance[1:] += outer_sums(horizon.response, (stacked_noise(noise, horizon.steps) * control) ** 2)
    return covariance


@compiled
def outer_sums(response: Tensor, weights: Vector) -> Tensor:
    """Return sum_u weights_u r_u r_u' for the columns r_u of every step's response (N, n, 2N): (N, n, n)."""
    steps, n, _ = response.shape
    summed = np.empty((steps, n, n))
    for t in range(steps):
        for i in range(n):
            weighted = response[t, i] * weights
            for j in range(i + 1):
                total = 0.0
                for u in range(len(weights)):
                    total += weighted[u] * response[t, j, u]
                summed[t, i, j], summed[t, j, i] = total, total
    return summed
