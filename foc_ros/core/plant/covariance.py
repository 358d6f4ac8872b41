# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The predictive covariance: how uncertain a predicted movement is besides the motor noise of its own control.

None of these parts belongs to the chance constraint: the operator knows the own hand and intention better than we do, and plans
margins for motor noise only. A prediction, however, is as uncertain as

- the state that it starts from, whose error the operator corrects on the way (`models`);
- the control between the plans: unplanned control noise (`foc.process_noise`), which is corrected likewise;
- the end of the movement. Movements end beside the marked goal, by `foc.endpoint_stddev` along each axis, and earlier or later
  than the expected T, by `duration.spread` T. A plan that ends at T + delta has at T still to move by delta X'(T), with X' the
  rate of the state, so that to first order both displace the state at the goal:

      cov(X(T)) = endpoint_stddev^2 diag(1, 1, 0, ...) + (spread T)^2 X'(T) X'(T)',

  and with least effort they displace the state at step t by K_t (`models`) times as much. From rest to rest over a distance
  L, with s = t / T, the standard deviations are (10 s^3 - 15 s^4 + 6 s^5) endpoint_stddev and 30 L spread s^3 (1 - s)^2. Where
  the goal is passed at any velocity, the effect of the duration on this velocity is neglected.
- the beginning. The plan for a hand at rest begins now, but the hand begins after an unknown time d. Given only the mean of d,
  `duration.wait_s`, its maximum-entropy distribution is exponential. The hand is at X(t - d), and until then where it is now:

      cov(X(t)) = E[(X(t - d) - X(t)) (X(t - d) - X(t))'],

  with moments of X(t - d) that are low-pass filters of X and X X' with the time constant `wait_s`.

Signal-dependent noise makes every variance a diagonal quadratic function of the control. The plant receives U + eps with eps_i =
c_i phi U_i, phi standard normal at every step and channel (paper, equations 2-3). Hence P(t + 1) = A P(t) A' + B diag(c^2 u_t^2)
B'; over the horizon, P(t) = A^t P(0) A'^t + sum_k R_k diag(c^2 u_k^2) R_k', with R_k the response of the state at step t to the
control at step k.
"""

from __future__ import annotations

import math

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.hand.duration import is_passing
from foc_ros.core.solution import Solution
from foc_ros.core.types import Array, HandState

from .models import PlantModel, make_plant_model
from .plants import Horizon, apply_impulse_response


class SharedCovariances:
    """The covariances that plans from one state of the hand share, by the length of their steps; each is computed once."""

    def __init__(self, hand: HandState, config: Config) -> None:
        self._hand, self._config = hand, config
        self._known: dict[float, Array] = {}

    def __getitem__(self, dt: float) -> Array:
        """Return the covariance (N + 1, n, n) that all plans of N steps of dt [s] share: all parts but timing."""
        if dt in self._known:
            return self._known[dt]
        foc, plant = self._config.foc, make_plant_model(self._config.foc)
        kind = dt, foc.steps, is_passing(self._config.duration)
        covariance = plant.propagate_error(self._hand.covariance, *kind)
        if foc.process_noise > 0.0:
            covariance = covariance + foc.process_noise**2 * plant.compute_process_covariance(*kind)
        if foc.endpoint_stddev > 0.0:
            displaced = foc.endpoint_stddev * plant.compute_goal_map(*kind)[:, :, :2]
            covariance = covariance + displaced @ displaced.swapaxes(1, 2)
        self._known[dt] = covariance
        return covariance


def widen_covariance(solution: Solution, shared: Array, at_rest: bool, config: Config) -> Array:
    """Return the total covariance (N + 1, n, n): of motor noise, of the timing, and what all plans of one duration share."""
    total: Array = solution.covariance + shared
    duration = config.duration
    if duration.spread > 0.0:
        plant = make_plant_model(config.foc)
        displaced = duration.spread * compute_duration_sensitivity(solution, is_passing(duration), plant)
        total += displaced[:, :, None] * displaced[:, None, :]
    if at_rest and duration.wait_s > 0.0:
        total += compute_onset_delay_covariance(solution, duration.wait_s)
    return total


def compute_onset_delay_covariance(solution: Solution, wait_s: float) -> Array:
    """Return the covariance (N + 1, n, n) about a plan from rest if it begins after an exponential time of mean wait_s [s]."""
    states = solution.mean - solution.mean[0]
    products = states[:, :, None] * states[:, None, :]
    lag = np.subtract.outer(np.arange(len(states)), np.arange(1, len(states)))
    decay = math.exp(-solution.dt / wait_s)
    weight = np.where(lag >= 0, (1.0 - decay) * decay ** np.maximum(lag, 0), 0.0)
    mean, square = (np.tensordot(weight, 0.5 * (each[1:] + each[:-1]), 1) for each in (states, products))
    mixed = mean[:, :, None] * states[:, None, :]
    covariance: Array = square - mixed - mixed.swapaxes(1, 2) + products
    return covariance


def compute_duration_sensitivity(solution: Solution, passing: bool, plant: PlantModel) -> Array:
    """Return the displacement of the states at steps 0..N, (N + 1, n), per relative increase of the duration T."""
    goal_map = plant.compute_goal_map(solution.dt, len(solution.control), passing)
    displacement: Array = goal_map @ (float(solution.times[-1]) * plant.compute_end_rate(solution))
    return displacement


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
