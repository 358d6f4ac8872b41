"""What an error of the initial state becomes when the operator corrects it on the way.

The operator sees the hand and moves from where it is: whatever the true state, its plan ends at the goal. With least effort,
u = -R_N^+ A^N e takes an error e of the state to zero at step N, so that at step t it is (A^t - R_t R_N^+ A^N) e. Without
this, the estimator's doubt about acceleration would grow with t^2 over the whole horizon, although no hand would act on it.

Nobody keeps to a plan either. Jerk that nobody planned, white of unit spectral density, adds the covariance G (`estimator`) to
the state in every step, and is corrected from then on like any other error:

    D(t) = sum_{k < t} E_{N-k-1}(t - k - 1) G E_{N-k-1}(t - k - 1)',

with E_m the map of an error m steps before the goal. At first this is the t^5 / 20 of the filter's model; at the goal it is
small. Where the goal does not fix the velocity (`dynamics.states_at_goal`), its errors are not corrected: A^N and R_N hold the
rows of the other states.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .dynamics import CACHED_HORIZONS, Horizon, horizon, state_scale, states_at_goal, triple_integrator
from .estimator import gramian
from .records import Array


def replanned_error_map(stacked: Horizon, passing: bool = False) -> Array:
    """Return what an initial error becomes at steps 0..N, (N + 1, n, n); passing: the goal does not fix the velocity."""
    fixed = states_at_goal(len(stacked.powers[-1]), passing)
    last = stacked.response[-1][fixed]
    # rows scaled to unit length first: they mix metres, metres per second and their like
    scale = 1.0 / np.sqrt((last**2).sum(axis=1))
    correction = -np.linalg.pinv(scale[:, None] * last) @ (scale[:, None] * stacked.powers[-1][fixed])
    error_map = stacked.powers.copy()
    error_map[1:] += stacked.response @ correction
    return error_map


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_error_map(steps: int, passing: bool) -> Array:
    return replanned_error_map(horizon(triple_integrator(1.0), steps), passing)


def triple_integrator_error_map(dt: float, steps: int, passing: bool = False) -> Array:
    """Return the same for the triple integrator at any dt [s], by scaling the map of unit step."""
    scale = state_scale(dt)
    error_map: Array = _unit_error_map(steps, passing) * (scale[:, None] / scale[None, :])
    return error_map


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_process_covariance(steps: int, passing: bool) -> Array:
    added = np.kron(gramian(1.0), np.eye(2))
    covariance = np.zeros((steps + 1, 6, 6))
    for step in range(steps):
        left = steps - step - 1
        error_map = replanned_error_map(horizon(triple_integrator(1.0), left), passing) if left else np.eye(6)[None]
        covariance[step + 1 :] += error_map @ added @ error_map.swapaxes(1, 2)
    return covariance


def triple_integrator_process_covariance(dt: float, steps: int, passing: bool = False) -> Array:
    """Return D at steps 0..N, (N + 1, 6, 6): what white jerk of unit spectral density does while it is corrected; dt [s]."""
    scale = dt**2.5 * state_scale(dt)
    covariance: Array = _unit_process_covariance(steps, passing) * (scale[:, None] * scale[None, :])
    return covariance
