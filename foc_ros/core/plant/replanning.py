# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Errors under replanning: how the operator corrects an error on the way, and what a displaced end changes in the plan.

The operator sees the hand and plans anew from where it is: whatever the true state, the plan ends at the goal. The control
u = R_N^+ d moves the end by d with least effort, and moves the state at step t by K_t d, K_t = R_t R_N^+. An error e of the
initial state would move the end by A^N e. The operator corrects this, so that the error at step t is (A^t - K_t A^N) e, and zero
at step N. Without the correction, the uncertainty of the acceleration would grow with t^2 over the whole horizon, although the
hand of a seeing operator does not.

Unplanned control noise, white and of unit spectral density, adds a covariance G to the state in every step (for jerk: the
`gramian` of the Kalman filter), and is corrected from then on like any other error:

    D(t) = sum_{k < t} E_{N-k-1}(t - k - 1) G E_{N-k-1}(t - k - 1)',

with E_m the map of an error m steps before the goal. For jerk, this is t^5 / 20 at first, as in the filter's model, and small at
the goal. Where the goal does not fix the velocity (`plants.states_at_goal`), errors of the velocity are not corrected: A^N and
R_N have only the rows of the other states.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

from .plants import Horizon, Plant, condense, find_states_at_goal


def compute_goal_map(horizon: Horizon, passing: bool = False) -> Array:
    """Return K_t at steps 0..N, (N + 1, n, n): how a displaced state at the goal displaces the plan of least effort to it.

    passing: the goal does not fix the velocity; the columns of states that the goal does not fix are zero.
    """
    fixed = find_states_at_goal(len(horizon.powers[-1]), passing)
    last = horizon.last[fixed]
    # the rows have different units (m, m/s, ...), so they are scaled to unit length first
    scale = 1.0 / np.sqrt((last**2).sum(axis=1))
    goal_map = np.zeros_like(horizon.powers)
    goal_map[1:, :, fixed] = horizon.response @ (np.linalg.pinv(scale[:, None] * last) * scale)
    return goal_map


def compute_error_map(horizon: Horizon, passing: bool = False) -> Array:
    """Return what remains of an initial error at steps 0..N, (N + 1, n, n); passing: the goal does not fix the velocity."""
    error_map: Array = horizon.powers - compute_goal_map(horizon, passing) @ horizon.powers[-1]
    return error_map


def compute_process_covariance(plant: Plant, steps: int, added: Array, passing: bool) -> Array:
    """Return D at steps 0..N, (N + 1, n, n), for a covariance `added` (n, n) that each step adds and the operator corrects."""
    covariance = np.zeros((steps + 1, *added.shape))
    for step in range(steps):
        left = steps - step - 1
        error_map = compute_error_map(condense(plant, left), passing) if left else np.eye(len(added))[None]
        covariance[step + 1 :] += error_map @ added @ error_map.swapaxes(1, 2)
    return covariance
