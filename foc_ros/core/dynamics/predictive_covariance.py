"""How unsure a prediction is beside the motor noise that its plan counts on.

None of it is part of the chance constraint: the operator knows the hand and what it is about better than we do, and plans
margins by motor noise alone. But what we predict is as uncertain as

- the state that it starts from, which the operator goes on to correct;
- the plan's hold on the hand: jerk beside any plan (`foc.process_noise`), corrected likewise (`replanning`);
- the end of the plan. Movements end beside the marked goal, by `foc.endpoint_stddev` along each axis, and sooner or later than at
  the expected T, by `duration.spread` T. A plan that ends at T + delta has at T still to move by delta X'(T), X' the rate of the
  state, so that to first order both displace the state at the goal:

      cov(X(T)) = endpoint_stddev^2 diag(1, 1, 0, ...) + (spread T)^2 X'(T) X'(T)',

  and by least effort the state at step t by K_t (`replanning`) times as much. From rest to rest over a distance L, with
  s = t / T, the standard deviations are (10 s^3 - 15 s^4 + 6 s^5) endpoint_stddev and 30 L spread s^3 (1 - s)^2. Where the goal
  is passed at any velocity, that the duration changes this velocity is left out.
- the beginning. A plan for a hand at rest begins now, the hand after a time d that we do not know. Where no more is known of it
  than its mean, `duration.wait_s`, it is exponentially distributed, and the hand is at X(t - d), until then where it is now:

      cov(X(t)) = E[(X(t - d) - X(t)) (X(t - d) - X(t))'],

  with moments of X(t - d) that are low-pass filters of X and X X' with this time constant.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from foc_ros.core.config import Config, DurationConfig
from foc_ros.core.estimation.duration import is_passing
from foc_ros.core.types import Array, HandState, Solution

from .replanning import triple_integrator_error_covariance, triple_integrator_goal_map, triple_integrator_process_covariance


def predictive_covariance(hand: HandState, dt: float, steps: int, config: Config) -> Array:
    """Return the covariance (N + 1, 6, 6) at steps 0..N that plans of one duration have in common: all but that of the time."""
    kind = dt, steps, is_passing(config.duration)
    unsure = triple_integrator_error_covariance(hand.covariance, *kind)
    if config.foc.process_noise > 0.0:
        unsure = unsure + config.foc.process_noise**2 * triple_integrator_process_covariance(*kind)
    if config.foc.endpoint_stddev > 0.0:
        moved = config.foc.endpoint_stddev * triple_integrator_goal_map(*kind)[:, :, :2]
        unsure = unsure + moved @ moved.swapaxes(1, 2)
    return unsure


def timing_covariances(solution: Solution, at_rest: bool, config: DurationConfig) -> Iterator[Array]:
    """Yield the covariances (N + 1, 6, 6) at steps 0..N that come of not knowing when a plan begins and how long it takes."""
    if config.spread > 0.0:
        moved = config.spread * duration_sensitivity(solution, is_passing(config))
        yield moved[:, :, None] * moved[:, None, :]
    if at_rest and config.wait_s > 0.0:
        yield onset_delay_covariance(solution, config.wait_s)


def onset_delay_covariance(solution: Solution, wait_s: float) -> Array:
    """Return the covariance (N + 1, 6, 6), about a plan from rest, of beginning it after an exponentially distributed time."""
    states = solution.mean - solution.mean[0]
    products = states[:, :, None] * states[:, None, :]
    lag = np.subtract.outer(np.arange(len(states)), np.arange(1, len(states)))
    kept = math.exp(-solution.dt / wait_s)
    share = np.where(lag >= 0, (1.0 - kept) * kept ** np.maximum(lag, 0), 0.0)
    mean, square = (np.tensordot(share, 0.5 * (each[1:] + each[:-1]), 1) for each in (states, products))
    mixed = mean[:, :, None] * states[:, None, :]
    covariance: Array = square - mixed - mixed.swapaxes(1, 2) + products
    return covariance


def duration_sensitivity(solution: Solution, passing: bool) -> Array:
    """Return by how much a plan's states at steps 0..N, (N + 1, 6), lag behind for each share of T that it takes longer."""
    # the control is that of the middle of its step: in 50 steps of a reach from rest, the last is 7 % below the jerk at the end
    jerk = 1.5 * solution.control[-1] - 0.5 * solution.control[-2]
    rate = np.concatenate([solution.mean[-1, 2:6], jerk])
    moved = triple_integrator_goal_map(solution.dt, len(solution.control), passing)
    late: Array = moved @ (float(solution.times[-1]) * rate)
    return late
