# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Seconds of a noisy hand and noisy obstacles at 100 Hz: labels and the most likely class stay the same."""

from itertools import pairwise

import numpy as np
import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import HandSample

PERIOD_NS = 10_000_000
SAMPLES = {'optimal': 1000, 'lv': 250, 'hc': 250}
"""Ten seconds of the default strategy, and fewer of those that seek a point of a curve, which take several times as long."""
NOISE = 0.001


def predictions(count, **settings):
    """Yield predictions at 100 Hz for a hand at rest before a circle on its straight path, with 1 mm of noise on both."""
    config = replace_values(Config(), {'rate_hz': 100.0, 'foc.steps': 20, **settings})
    pipeline, rng = Pipeline(config), np.random.default_rng(11)
    pipeline.set_goals(np.array([[0.3, 0.0]]), 'world')
    for tick in range(count):
        stamp_ns = 1_000_000_000 + tick * PERIOD_NS
        centre = np.array([[0.15, 0.0]]) + rng.normal(0.0, NOISE, 2)
        pipeline.set_obstacles('cloud', make_obstacles(centre, 0.03, 0.001), stamp_ns, 'world')
        pipeline.add_hand_sample(HandSample(stamp_ns, rng.normal(0.0, NOISE, 2), 0.0, 'world'))
        prediction = pipeline.predict()
        assert prediction is not None, pipeline.last_refusal
        yield prediction


def changes(values):
    return sum(a != b for a, b in pairwise(values))


@pytest.mark.parametrize('strategy', SAMPLES)
def test_the_most_likely_class_of_a_symmetric_obstacle_does_not_flicker(strategy):
    made = list(predictions(SAMPLES[strategy], **{'foc.strategy': strategy}))
    assert len(made) == SAMPLES[strategy]
    assert all({outcome.candidate.label for outcome in one.solved_candidates} == {'goal0:+0', 'goal0:-0'} for one in made)
    assert changes([one.most_likely for one in made]) <= 1
