# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Factors on predicted standard deviations are learnt from errors: causally, equally for equal input, until a reset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.config import Config, CovarianceConfig, replace_values
from foc_ros.core.learning.dispersion import REST_SHARE, Dispersion
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import Candidate, Solution, Status
from foc_ros.core.types import NANOSECONDS, HandSample, HandState

STDDEV = 0.02
FIXED = {'duration.adaptation': 'none'}
CONFIG = replace_values(Config(), {'rate_hz': 10.0, 'foc.steps': 15, 'estimator.position_stddev': 1e-4} | FIXED)


def make_candidate(likelihood: float = 1.0, duration_s: float = 2.0, place: Sequence[float] = (0.0, 0.0)) -> PredictedCandidate:
    """Return a candidate that stays at a place with a standard deviation of `STDDEV` along each axis."""
    mean, covariance = np.zeros((9, 6)), np.tile(STDDEV**2 * np.eye(6), (9, 1, 1))
    mean[:, :2] = place
    solution = Solution(Status.SOLVED, '', duration_s / 8.0, mean, covariance, np.zeros((8, 2)), 1.0, {}, 0.0, 0.0, 1.0)
    return PredictedCandidate(Candidate('goal0', 0, (), mean[:, :2], 0.0), solution, {}, 1.0, likelihood)


def place_hand(stamp_ns: int, position: Sequence[float]) -> HandState:
    """Return a moving hand at a position."""
    mean = np.array([*position, 0.0, 0.0, 0.0, 0.0])
    return HandState(stamp_ns, mean, np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def judge(ahead_s: float, factor: float, duration_s: float, count: int = 60) -> Dispersion:
    """Return what is learnt if the hand is beside the candidate by `factor` standard deviations in 2D some time later."""
    generator, dispersion, candidates = np.random.default_rng(3), Dispersion(), [make_candidate(duration_s=duration_s)]
    for position in factor * STDDEV * generator.standard_normal((count, 2)):
        dispersion = dispersion.interrupt().follow(place_hand(0, (0.0, 0.0))).add(0, candidates, CovarianceConfig())
        due = [replace(each, count=1.0) for each in dispersion.forecasts if each.due_ns == round(ahead_s * NANOSECONDS)]
        dispersion = replace(dispersion, forecasts=tuple(due))
        dispersion = dispersion.follow(place_hand(round(ahead_s * NANOSECONDS), position))
    return dispersion


@pytest.mark.parametrize('factor', [0.25, 3.0])
@pytest.mark.parametrize(('ahead_s', 'duration_s', 'share'), [(0.25, 10.0, 0.025), (1.0, 2.0, 0.5), (1.0, 0.8, 1.0)])
def test_the_factor_of_gaussian_errors_is_recovered(factor: float, ahead_s: float, duration_s: float, share: float) -> None:
    dispersion = judge(ahead_s, factor, duration_s)
    assert dispersion.errors == 60
    near, far = dispersion.factors
    assert near ** (1.0 - share) * far**share == pytest.approx(factor, rel=0.15)
    if share == 1.0:
        assert near == pytest.approx(1.0, abs=0.1)


def reach(pipeline: Pipeline, start_s: float, until_s: float = 1.6) -> list[Prediction]:
    """Pass a reach around an obstacle through a pipeline that predicts; return the predictions."""
    pipeline.set_obstacles('cloud', make_obstacles([[0.15, 0.0]], 0.03, 0.001), int(start_s * NANOSECONDS), 'world')
    pipeline.set_goals(np.array([[0.3, 0.0]]), 'world')
    made = []
    for t in np.arange(0.0, until_s, 0.05):
        s = np.clip((t - 0.3) / 0.8, 0.0, 1.0)
        x = 0.3 * (10 * s**3 - 15 * s**4 + 6 * s**5)
        stamp_ns = int((start_s + t) * NANOSECONDS)
        pipeline.add_hand_sample(HandSample(stamp_ns, np.array([x, 0.06 * np.sin(np.pi * x / 0.3)]), 0.0, 'world'))
        prediction = pipeline.predict() if pipeline.is_due else None
        made += [prediction] if prediction is not None else []
    return made


def test_factors_scale_the_covariance_and_nothing_else() -> None:
    off = {'covariance.adaptation': 'none'}
    plain = reach(Pipeline(replace_values(CONFIG, off)), 1.0)
    scaled = reach(Pipeline(replace_values(CONFIG, off | {'covariance.near': 2.0, 'covariance.far': 2.0})), 1.0)
    assert len(plain) == len(scaled) > 10
    at_rest = list[bool]()
    for one, other in zip(plain, scaled, strict=True):
        for before, after in zip(one.candidates, other.candidates, strict=True):
            at_rest.append(bool(after.covariance[0, 0, 0] < 3.9 * before.covariance[0, 0, 0]))
            factors = 2.0 ** np.linspace(REST_SHARE if at_rest[-1] else 1.0, 1.0, len(after.mean))
            np.testing.assert_allclose(after.covariance, factors[:, None, None] ** 2 * before.covariance, rtol=1e-12)
            np.testing.assert_array_equal(after.mean, before.mean)
            np.testing.assert_array_equal(after.motor_covariance, before.motor_covariance)
            assert after.likelihood == before.likelihood
    assert at_rest[0] and at_rest[-1] and not all(at_rest), 'the hand rests before and after the reach'


def test_factors_are_forgotten_by_a_reset_and_by_other_parameters_and_can_be_switched_off() -> None:
    pipeline = Pipeline(CONFIG)
    reach(pipeline, 1.0)
    assert pipeline.adapted_config.covariance == pipeline.learnt.dispersion.adapt(CONFIG.covariance) != CONFIG.covariance
    pipeline.reconfigure(replace_values(CONFIG, {'rate_hz': 20.0}))
    assert pipeline.learnt.dispersion.errors > 0
    pipeline.reconfigure(replace_values(CONFIG, {'foc.endpoint_stddev': 0.1}))
    assert pipeline.learnt.dispersion.errors == 0
    reach(pipeline, 11.0)
    pipeline.reset()
    assert pipeline.learnt.dispersion.errors == 0 and pipeline.adapted_config.covariance == CONFIG.covariance
    off = replace_values(CONFIG, {'covariance.adaptation': 'none'})
    pipeline = Pipeline(off)
    reach(pipeline, 1.0)
    assert pipeline.learnt.dispersion.errors == 0 and pipeline.adapted_config is off
