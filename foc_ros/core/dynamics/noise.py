"""Signal-dependent noise, which makes every variance a diagonal quadratic function of the control.

The plant receives U + eps with eps_i = c_i phi U_i, phi standard normal at every step and channel (paper, equations 2-3). Hence
P(t + 1) = A P(t) A' + B diag(c^2 u_t^2) B'; over the horizon, P(t) = A^t P(0) A'^t + sum_k R_k diag(c^2 u_k^2) R_k', with R_k the
response of the state at step t to the control at step k.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled
from foc_ros.core.types import Array

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
    return accumulate_covariance(horizon.powers[1], np.ascontiguousarray(horizon.states[..., 1]), noise_variance, control, free)


@compiled
def accumulate_covariance(A: Matrix, B: Matrix, noise_variance: Vector, control: Vector, free: Tensor) -> Tensor:
    """Return P(t + 1) = A P(t) A' + B diag(c^2 u_t^2) B' from P(0) = 0, plus a free part, (N + 1, n, n): A (n, n), B (n, 2)."""
    n, steps, variance = len(A), len(control) // 2, noise_variance * control * control
    covariance, moved = np.zeros((steps + 1, n, n)), np.empty((n, n))
    for t in range(steps):
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += A[i, k] * covariance[t, k, j]
                moved[i, j] = total
        for i in range(n):
            for j in range(i + 1):
                total = B[i, 0] * variance[t] * B[j, 0] + B[i, 1] * variance[steps + t] * B[j, 1]
                for k in range(n):
                    total += moved[i, k] * A[j, k]
                covariance[t + 1, i, j], covariance[t + 1, j, i] = total, total
    covariance += free
    return covariance
