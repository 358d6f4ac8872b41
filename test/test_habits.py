# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Goals of the past: those that were reached more often than their distances lead to expect are likelier."""

import numpy as np
import pytest

from foc_ros.core.config import Config
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, HandSample

HOME, NEAR, FAR = (0.0, 0.0), (0.2, 0.1), (0.25, -0.15)
CONFIG = Config().with_values({'foc.steps': 20, 'likelihood.other_goal': 0.0, 'estimator.gap_s': 10.0})
BETA = CONFIG.likelihood.beta
EXPECTED = 1.0 / (1.0 + ((0.25**2 + 0.15**2) / (0.2**2 + 0.1**2)) ** BETA)
"""Probability of the far goal by the distances from `HOME`."""
BOX = np.array([[-0.02, -0.02], [0.02, -0.02], [0.02, 0.02], [-0.02, 0.02]])


class Session:
    """A hand that moves from place to place, rests there, and is asked where it will go next."""

    def __init__(self, goals, names=(), **values):
        self.pipeline, self.tick, self.place = Pipeline(CONFIG.with_values(values), is_timed=False), 0, np.array(HOME)
        self.announce(goals, names)
        self.move(HOME)

    def announce(self, goals, names=()):
        obstacles = make_obstacles(np.array(goals), 1e-3, ids=names, polygons=[BOX] * len(goals)) if names else make_obstacles()
        self.pipeline.set_obstacles('cloud', obstacles, None, 'world')
        self.pipeline.set_goals(np.array(goals), 'world')
        self.tick += 100  # a second, in which the likelihoods follow

    def move(self, target):
        start = self.place
        for s in np.clip(np.linspace(0.0, 1.6, 96), 0.0, 1.0):
            self.place = start + (np.array(target) - start) * (10 * s**3 - 15 * s**4 + 6 * s**5)
            self.pipeline.add_hand_sample(HandSample(round(self.tick * NANOSECONDS / 100), self.place, 0.0, 'world'))
            self.tick += 1

    def return_home(self):
        """Let the hand appear at home again, as with a clutch: the way back is no reach."""
        self.pipeline.set_engaged(False)
        self.place, self.tick = np.array(HOME), self.tick + 2000
        self.pipeline.set_engaged(True)
        self.move(HOME)

    def share(self, goal):
        self.pipeline.add_hand_sample(HandSample(round(self.tick * NANOSECONDS / 100), self.place, 0.0, 'world'))
        self.tick += 1
        prediction = self.pipeline.predict()
        assert prediction is not None
        return sum(each.likelihood for each in prediction.candidates if each.candidate.goal == goal)


def odds(share):
    return share / (1.0 - share)


@pytest.mark.parametrize('past_goals', [0.0, 1.0, 3.0])
def test_a_goal_that_was_reached_more_often_than_expected_gets_likelier(past_goals):
    session = Session([NEAR, FAR], **{'likelihood.past_goals': past_goals})
    before = session.share(1)
    assert before == pytest.approx(EXPECTED, rel=0.05)
    for _ in range(3):
        session.move(FAR)
        session.return_home()
    weights = [(1 + past_goals * reached) / (1 + past_goals * 3 * share) for reached, share in ((0, 1 - EXPECTED), (3, EXPECTED))]
    # the movement has an onset, a little later than it begins
    assert odds(session.share(1)) / odds(before) == pytest.approx(weights[1] / weights[0], rel=0.1)


def test_habits_follow_the_object_and_not_its_place():
    session = Session([NEAR, FAR], ('cup', 'jug'))
    before = session.share(0), session.share(1)
    for _ in range(3):
        session.move(FAR)
        session.return_home()
    session.announce([FAR, NEAR], ('cup', 'jug'))
    assert session.share(1) > before[0] > before[1]  # the jug, which is now where the cup was
    session.announce([FAR, NEAR])
    assert session.share(1) == pytest.approx(before[0], rel=0.05)  # goals that are no objects are others


def test_a_goal_elsewhere_is_another_one():
    session = Session([NEAR, FAR])
    before = session.share(1)
    session.move(FAR)
    session.return_home()
    assert session.share(1) > 1.2 * before
    session.announce([NEAR, (FAR[0] + 0.01, FAR[1])])
    known = session.share(1)
    assert known > 1.2 * before
    session.announce([NEAR, (FAR[0] + 0.04, FAR[1])])
    assert odds(session.share(1)) < 0.7 * odds(known)


def test_a_movement_that_ends_far_from_all_goals_says_nothing_and_a_reset_forgets():
    session = Session([NEAR, FAR])
    before = session.share(1)
    session.move((0.1, -0.06))
    session.return_home()
    assert session.share(1) == pytest.approx(before)
    session.move(FAR)
    session.return_home()
    assert session.share(1) > 1.2 * before
    session.pipeline.reset()
    session.return_home()
    assert session.share(1) == pytest.approx(before)


def test_reaches_are_expected_to_end_where_the_earlier_ones_did():
    goals = [NEAR, (NEAR[0], NEAR[1] - 0.05)]
    session = Session(goals, **{'likelihood.past_goals': 1e-6})
    for _ in range(6):
        session.move((NEAR[0], NEAR[1] - 0.02))
        session.return_home()
    habits = session.pipeline.learnt.habits
    np.testing.assert_allclose(habits.find_ends(np.zeros((1, 2))), [[0.0, -0.02 * 6 / 9]], atol=1e-3)
    ends = np.hypot(*habits.find_ends(np.array(goals)).T)
    assert odds(session.share(1)) == pytest.approx((ends[0] / ends[1]) ** (2 * BETA), rel=0.01)
