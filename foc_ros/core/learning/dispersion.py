# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is learnt of the errors of predicted positions: factors on the standard deviations, from now to the end of a movement.

The parameters of the covariance are expectations, and devices and people differ by much. The distances between predicted and true
positions show what the standard deviations should be. The standard deviations of a candidate that lasts T are multiplied, at a
time t ahead, by a factor that leads from `covariance.near` = f now to `covariance.far` = f' at its end:

    f(t) = f^(1 - s) f'^s,  s = (t / T)^2.                                                                                  (1)

A hand that is on its way follows a plan closely. How it arrives, when, and what it does then are known less well, however near
the end is.

Predictions of a moving hand, `SAMPLE_S` apart, are kept until the hand has reached the times h of `HORIZONS_S`. With its position
x there and the mixture of normal distributions (p_i, m_i, S_i) that was predicted without the factors, each pair of factors has
the log-posterior

    log w(f, f') = -(log^2 f + log^2 f') / 2 + sum_h sum_predictions c log sum_i p_i N(x; m_i, f_i(h)^2 S_i).

The errors at one time ahead within one second, which depend on each other, count as one: c is the time since the prediction
before over 1 s, at most 1, or `SAMPLE_S` over 1 s for the first one of a movement. The factors in use are the posterior means, of
the logarithms. They change little from one prediction to the next, so that the stiffness of guidance does not jump.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from foc_ros.core.config import CovarianceConfig
from foc_ros.core.parameter import clip_values
from foc_ros.core.prediction import PredictedCandidate
from foc_ros.core.types import NANOSECONDS, Array, HandState, Record, as_readonly

from .posterior import GridPosterior

LOG_FACTORS = as_readonly(math.log(2.0) * np.linspace(-3.0, 2.0, 11))
"""Logarithms of the factors that are judged, for now and for the end."""
PRIOR = GridPosterior.from_normal((LOG_FACTORS, LOG_FACTORS), (1.0, 1.0))
"""The posterior before the first prediction: the logarithm of each factor has a standard deviation of 1."""
HORIZONS_S = (0.25, 0.5, 1.0)
"""Times ahead at which predicted positions are judged [s]."""
SAMPLE_S = 0.1
"""Interval at which predictions are judged [s]."""


@dataclass(frozen=True, eq=False)
class Forecast(Record):
    """Where a prediction at a stamp expects the hand at a time ahead: a mixture of k normal distributions.

    due_ns: the time ahead, as a stamp; count: its weight, in independent observations; share (k,): s in equation 1; weight (k,);
    mean (k, 2) [m]; covariance (k, 2, 2) [m^2]: without the factors.
    """

    due_ns: int
    count: float
    share: Array
    weight: Array
    mean: Array
    covariance: Array

    def score(self, position: Array) -> Array:
        """Return the log-density (f, f') [nat, metres] of a position (2,) for each pair of factors."""
        x, y = (position - self.mean).T
        xx, yy, xy = (self.covariance[:, row, column] for row, column in ((0, 0), (1, 1), (0, 1)))
        determinant = xx * yy - xy**2
        squared = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / determinant
        logs = np.log(self.weight / (2.0 * np.pi * np.sqrt(determinant)))
        scale = LOG_FACTORS[:, None, None] * (1.0 - self.share) + LOG_FACTORS[:, None] * self.share
        exponents = logs - 2.0 * scale - 0.5 * squared * np.exp(-2.0 * scale)
        largest = exponents.max(axis=-1)
        density: Array = largest + np.log(np.exp(exponents - largest[..., None]).sum(axis=-1))
        return density


@dataclass(frozen=True, eq=False)
class Dispersion(Record):
    """The errors of the predictions so far.

    errors: how many were judged; posterior: of both factors; factors: for now and for the end, exactly 1 before the first
    error; hand: the last state of the hand; taken_ns: stamp of the last prediction that was taken;
    forecasts: that the hand has not reached yet.
    """

    errors: int = 0
    posterior: GridPosterior = PRIOR
    factors: tuple[float, float] = (1.0, 1.0)
    hand: HandState | None = None
    taken_ns: int | None = None
    forecasts: tuple[Forecast, ...] = ()

    def adapt(self, config: CovarianceConfig) -> CovarianceConfig:
        """Return the parameters with the factors of this operator."""
        if not self.errors:
            return config
        near, far = self.factors
        return clip_values(config, {'near': near * config.near, 'far': far * config.far})

    def follow(self, hand: HandState) -> Dispersion:
        """Return what is known after the next state of the hand, which ends the forecasts that it has reached."""
        before = self.hand
        if before is None or before.onset_ns != hand.onset_ns or hand.stamp_ns <= before.stamp_ns:
            return replace(self, hand=hand, taken_ns=None, forecasts=())
        reached = [each for each in self.forecasts if each.due_ns <= hand.stamp_ns]
        if not reached:
            return replace(self, hand=hand)
        posterior = self.posterior
        for each in reached:
            share = (each.due_ns - before.stamp_ns) / (hand.stamp_ns - before.stamp_ns)
            posterior = posterior.add(each.count * each.score((1.0 - share) * before.mean[:2] + share * hand.mean[:2]))
        left = tuple(each for each in self.forecasts if each.due_ns > hand.stamp_ns)
        near, far = np.exp(posterior.mean()).tolist()
        errors = self.errors + len(reached)
        return replace(self, errors=errors, posterior=posterior, factors=(near, far), hand=hand, forecasts=left)

    def add(self, stamp_ns: int, candidates: Sequence[PredictedCandidate], config: CovarianceConfig) -> Dispersion:
        """Return what is known after a prediction with the factors of config, which counts if the hand is moving."""
        if self.hand is None or self.hand.onset_ns is None or stamp_ns < self.hand.onset_ns:
            return self
        since_s = SAMPLE_S if self.taken_ns is None else (stamp_ns - self.taken_ns) / NANOSECONDS
        taking_part = [each for each in candidates if each.likelihood > 0.0]
        if since_s < SAMPLE_S or not taking_part:
            return self
        count = min(since_s, 1.0)  # the errors within 1 s count as one
        made = [make_forecast(stamp_ns, ahead_s, count, taking_part, config) for ahead_s in HORIZONS_S]
        later = [each for each in made if each.due_ns > self.hand.stamp_ns]  # a prediction may take longer than the first time
        return replace(self, taken_ns=stamp_ns, forecasts=(*self.forecasts, *later))

    def interrupt(self) -> Dispersion:
        """Return what is known without the present movement."""
        return replace(self, hand=None, taken_ns=None, forecasts=())


def make_forecast(
    stamp_ns: int, ahead_s: float, count: float, candidates: Sequence[PredictedCandidate], config: CovarianceConfig
) -> Forecast:
    """Return where candidates, published with the factors of config, expect the hand some time ahead, at their end after it."""
    times, means, covariances = [], [], []
    for solution in (each.solution for each in candidates):
        at = min(ahead_s / solution.dt, len(solution.control))
        row = min(int(at), len(solution.control) - 1)
        after = at - row
        times.append(at / len(solution.control))
        means.append((1.0 - after) * solution.mean[row, :2] + after * solution.mean[row + 1, :2])
        covariances.append((1.0 - after) * solution.covariance[row, :2, :2] + after * solution.covariance[row + 1, :2, :2])
    share = compute_shares(np.array(times))
    covariance = np.array(covariances) / interpolate_factors(share, config)[:, None, None] ** 2
    covariance += 1e-12 * np.eye(2)  # so that the density of a known position is finite
    due_ns, weight = stamp_ns + round(ahead_s * NANOSECONDS), np.array([each.likelihood for each in candidates])
    return Forecast(due_ns, count, share, weight, np.array(means), covariance)


def compute_shares(times: Array) -> Array:
    """Return the shares s of equation 1 at times relative to the duration, t / T, any shape."""
    shares: Array = times**2
    return shares


def interpolate_factors(share: Array, config: CovarianceConfig) -> Array:
    """Return the factors on standard deviations at shares s, any shape: equation 1."""
    factors: Array = config.near ** (1.0 - share) * config.far**share
    return factors


def scale_covariances(candidates: Sequence[PredictedCandidate], config: CovarianceConfig) -> tuple[PredictedCandidate, ...]:
    """Return candidates whose covariances have the factors of config; those of motor noise and of the height stay.

    The error of the position is f(t) times what it was, and those of velocity and acceleration are its derivatives.
    """
    if config.near == config.far == 1.0 or not candidates:
        return tuple(candidates)
    solutions = [each.solution for each in candidates]
    total = np.stack([each.covariance for each in solutions])
    count, states = total.shape[1:3]
    end_s = np.array([float(each.times[-1]) for each in solutions])[:, None, None, None]
    times = np.linspace(0.0, 1.0, count)[:, None, None]
    growth = 2.0 * math.log(config.far / config.near) / end_s**2
    rate = growth * end_s * times * np.eye(2)  # f' / f
    errors = np.tile(np.eye(states), (*rate.shape[:2], 1, 1))
    errors[..., 2:4, :2] = rate
    if states >= 6:
        errors[..., 4:6, 2:4], errors[..., 4:6, :2] = 2.0 * rate, rate**2 + growth * np.eye(2)
    errors *= interpolate_factors(compute_shares(times), config)
    scaled = errors @ total @ errors.swapaxes(-1, -2)
    return tuple(
        replace(each, solution=each.solution.with_covariance(covariance))
        for each, covariance in zip(candidates, scaled, strict=True)
    )
