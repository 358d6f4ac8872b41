"""What an error of the initial state becomes when the operator corrects it on the way, and what another end of the plan changes.

The operator sees the hand and moves from where it is: whatever the true state, its plan ends at the goal. What moves the end by d
with least effort, u = R_N^+ d, moves the state at step t by K_t d, K_t = R_t R_N^+. So an error e of the state is taken to zero
at step N by moving the end that it would have by -A^N e, and at step t it is (A^t - K_t A^N) e. Without this, the estimator's
doubt about acceleration would grow with t^2 over the whole horizon, although no hand would act on it.

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

from foc_ros.core.estimation.kalman_filter import gramian
from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled
from foc_ros.core.types import Array

from .plants import CACHED_HORIZONS, Horizon, condense, state_scale, states_at_goal, triple_integrator

STATES = 6
"""Of the triple integrator: a number that the compiler knows makes `carried` twice as fast."""


def goal_map(stacked: Horizon, passing: bool = False) -> Array:
    """Return K_t of steps 0..N, (N + 1, n, n): what another state at the goal changes in the plan of least effort to it.

    passing: the goal does not fix the velocity; the columns of states that it does not fix are zero.
    """
    fixed = states_at_goal(len(stacked.powers[-1]), passing)
    last = stacked.last[fixed]
    # rows scaled to unit length first: they mix metres, metres per second and their like
    scale = 1.0 / np.sqrt((last**2).sum(axis=1))
    moved = np.zeros_like(stacked.powers)
    moved[1:, :, fixed] = stacked.response @ (np.linalg.pinv(scale[:, None] * last) * scale)
    return moved


def replanned_error_map(stacked: Horizon, passing: bool = False) -> Array:
    """Return what an initial error becomes at steps 0..N, (N + 1, n, n); passing: the goal does not fix the velocity."""
    error_map: Array = stacked.powers - goal_map(stacked, passing) @ stacked.powers[-1]
    return error_map


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_goal_map(steps: int, passing: bool) -> Array:
    return goal_map(condense(triple_integrator(1.0), steps), passing)


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_error_map(steps: int, passing: bool) -> Array:
    return replanned_error_map(condense(triple_integrator(1.0), steps), passing)


def triple_integrator_goal_map(dt: float, steps: int, passing: bool = False) -> Array:
    """Return `goal_map` of the triple integrator at any dt [s], by scaling the map of unit step."""
    scale = state_scale(dt)
    moved: Array = _unit_goal_map(steps, passing) * (scale[:, None] / scale[None, :])
    return moved


def triple_integrator_error_map(dt: float, steps: int, passing: bool = False) -> Array:
    """Return `replanned_error_map` of the same."""
    scale = state_scale(dt)
    error_map: Array = _unit_error_map(steps, passing) * (scale[:, None] / scale[None, :])
    return error_map


def triple_integrator_error_covariance(covariance: Array, dt: float, steps: int, passing: bool = False) -> Array:
    """Return what becomes of the covariance (6, 6) of an initial error at steps 0..N, (N + 1, 6, 6); dt [s]."""
    return carried(_unit_error_map(steps, passing), state_scale(dt), covariance)


@compiled
def carried(maps: Tensor, scale: Vector, covariance: Matrix) -> Tensor:
    """Return E P E', (m, 6, 6), of a covariance P (6, 6) for each E = D M D^-1: maps M (m, 6, 6), scale the diagonal of D."""
    after, half, unit = np.empty_like(maps), np.empty((STATES, STATES)), np.empty((STATES, STATES))
    for i in range(STATES):
        for j in range(STATES):
            unit[i, j] = covariance[i, j] / (scale[i] * scale[j])
    for t in range(len(maps)):
        for i in range(STATES):
            for j in range(STATES):
                total = 0.0
                for k in range(STATES):
                    total += maps[t, i, k] * unit[k, j]
                half[i, j] = total
        for i in range(STATES):
            for j in range(i + 1):
                total = 0.0
                for k in range(STATES):
                    total += half[i, k] * maps[t, j, k]
                after[t, i, j] = after[t, j, i] = scale[i] * scale[j] * total
    return after


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_process_covariance(steps: int, passing: bool) -> Array:
    added = np.kron(gramian(1.0), np.eye(2))
    covariance = np.zeros((steps + 1, 6, 6))
    for step in range(steps):
        left = steps - step - 1
        error_map = replanned_error_map(condense(triple_integrator(1.0), left), passing) if left else np.eye(6)[None]
        covariance[step + 1 :] += error_map @ added @ error_map.swapaxes(1, 2)
    return covariance


def triple_integrator_process_covariance(dt: float, steps: int, passing: bool = False) -> Array:
    """Return D at steps 0..N, (N + 1, 6, 6): what white jerk of unit spectral density does while it is corrected; dt [s]."""
    scale = dt**2.5 * state_scale(dt)
    covariance: Array = _unit_process_covariance(steps, passing) * (scale[:, None] * scale[None, :])
    return covariance
