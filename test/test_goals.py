# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Goals that are obstacles, that nobody announced, and that were reached before."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import make_predictor

import foc_ros
from foc_ros.core.config import Config
from foc_ros.core.goals import compute_straight_effort
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.clearance import measure_clearance
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import NANOSECONDS, HandSample, HandState

BOX = np.array([[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]])
PLACES = np.array([[0.2, 0.0], [0.4, 0.01]])
CUPS = make_obstacles(PLACES, 1e-3, ids=('front', 'back'), polygons=[BOX, BOX])
HAND = HandState(0, np.zeros(6), 1e-6 * np.eye(6))


def predict_in(obstacles, goals, **values):
    return predict(Config().with_values(values), HAND, obstacles, goals, NO_TRACKS)[0]


def shares_of_goals(prediction):
    goals, shares = zip(*((each.candidate.goal, each.likelihood) for each in prediction.candidates), strict=True)
    return np.bincount(goals, shares)


@pytest.mark.parametrize('hand_radius', [0.0, 0.01])
def test_the_object_of_a_goal_blocks_all_goals_but_its_own(hand_radius):
    prediction = predict_in(CUPS, PLACES, **{'scene.hand_radius': hand_radius})
    assert {each.candidate.goal for each in prediction.solved_candidates} == {0, 1}
    for each in prediction.solved_candidates:
        goal, solution = each.candidate.goal, each.solution
        np.testing.assert_allclose(solution.path[-1], PLACES[goal], atol=1e-6)
        own, other = (measure_clearance(solution.path, CUPS.take([row]), solution.dt) for row in (goal, 1 - goal))
        assert own < 0.0 and other > hand_radius
    to_back = [each for each in prediction.solved_candidates if each.candidate.goal == 1]
    assert {each.candidate.sides[0][0] for each in to_back} == {'front'}


@pytest.mark.parametrize(('speed', 'is_goal'), [(0.0, True), (0.02, True), (0.2, False)])
def test_an_obstacle_that_moves_on_before_the_hand_is_there_is_not_the_goal(speed, is_goal):
    cup = foc_ros.Circle((0.3, 0.0), 0.03, 0.001, velocity=(-speed, 0.0), name='cup')
    named = foc_ros.Goal((0.3, 0.0), object='cup')
    for goal, is_in_the_way in (((0.3, 0.0), not is_goal), (named, False)):
        for found in foc_ros.solve_classes((0.0, 0.0), goal, cup, duration_s=1.2):
            centre = np.array([0.3, 0.0]) - found.times[:, None] * [speed, 0.0]
            assert (np.hypot(*(found.mean[:, :2] - centre).T).min() > 0.03) == is_in_the_way


def compute_goal_costs(prediction, common_s):
    """Return the costs by which goals are compared for a hand at rest, from the least costs of the movements to them."""
    straight = compute_straight_effort(np.zeros((3, 2)), prediction.goal_positions, np.full(len(prediction.goals), common_s))
    least = [
        min(each.effort * each.solution.dt for each in prediction.solved_candidates if each.candidate.goal == goal)
        for goal in range(len(prediction.goals))
    ]
    return straight**0.75 * np.array(least) ** 0.25


@pytest.mark.parametrize('obstacles', [make_obstacles(), CUPS, make_obstacles([[0.1, 0.0], [0.1, 0.07]], 0.03)])
def test_goals_are_compared_by_the_straight_effort_in_a_common_time_and_less_by_the_movements_to_them(obstacles):
    values = {'likelihood.planning_horizon_s': 1000.0, 'budget_s': 0.0}
    found = predict_in(obstacles, PLACES, **values)
    costs = compute_goal_costs(found, min(each.times[-1] for each in found.solved_candidates))
    shares = [each.likelihood for each in found.goals]
    assert shares[0] / shares[1] == pytest.approx((costs[1] / costs[0]) ** 2.0, rel=0.02)


def test_paths_to_a_goal_behind_obstacles_are_solved_beside_a_free_goal():
    """They cost more than ten times as much as the path to the other goal, which makes them less likely, and no less exact."""
    obstacles = [foc_ros.Box((0.01, 0.15), (0.3, 0.02), name='wall'), foc_ros.Circle((-0.05, 0.22), 0.03, 0.003, name='cup')]

    def solve_paths_to_last(goals):
        prediction = make_predictor(Config(budget_s=0.0), goals, obstacles).update(0.0, (0.0, 0.0))
        found = [each for each in prediction.solved_candidates if each.candidate.goal == len(goals) - 1]
        return {each.candidate.sides: pytest.approx(each.effort, rel=1e-5) for each in found}, prediction.goals[-1].likelihood

    alone, _ = solve_paths_to_last([(0.0, 0.3)])
    beside, likelihood = solve_paths_to_last([(0.3, 0.0), (0.0, 0.3)])
    assert len(alone) == 2 and beside == alone and likelihood > 0.15


def test_a_goal_whose_object_is_missing_is_noted_by_predictors_and_refused_elsewhere():
    cup, goal, predictor = (
        foc_ros.Circle((0.15, 0.0), 0.03, name='cup'),
        foc_ros.Goal((0.3, 0.0), object='jug'),
        foc_ros.Predictor(),
    )
    predictor.set_goals(goal)
    words = "goals[0].object: expected the id of an obstacle (cup), got 'jug'"
    for t, (name, missing, told) in enumerate((('cup', 1, [words]), ('cup', 1, []), ('jug', 0, []), ('cup', 1, [words]))):
        predictor.set_obstacles(replace(cup, name=name))
        with warnings.catch_warnings(record=True) as issued:
            warnings.simplefilter('always')
            assert predictor.update(float(t), (0.0, 0.0)).notes.get('object_missing', 0) == missing
        assert [str(each.message) for each in issued] == told, 'once for each change'
    with pytest.raises(foc_ros.InputError, match=r"^goals\[0\]\.object: expected the id of an obstacle \(cup\), got 'jug'"):
        foc_ros.solve((0.0, 0.0), goal, cup)


def test_likelihoods_do_not_depend_on_the_side_on_which_a_path_ends_in_its_goal():
    goals = np.array([[0.2, 0.1], [0.25, -0.15]])
    cups = make_obstacles(goals, 1e-3, polygons=[BOX, BOX])
    found = []
    for y in (-1e-5, -1e-6, 0.0, 1e-6, 1e-5):
        hand = HandState(0, np.array([0.0, y, 0.0, 0.0, 0.0, 0.0]), 1e-6 * np.eye(6))
        prediction = predict(Config(), hand, cups, goals, NO_TRACKS)[0]
        found.append(shares_of_goals(prediction)[1])
    np.testing.assert_allclose(found, found[0], atol=1e-3)


LEFT_GOAL, RIGHT_GOAL, MIDDLE = (0.3, 0.25), (0.3, -0.25), (0.32, 0.0)


@pytest.mark.parametrize('goals', [[0, 1], [1, 0]])
@pytest.mark.parametrize('beside', [0.03, 0.1])
def test_objects_that_mirror_each_other_are_equally_likely_goals(beside, goals):
    """A path that ends in one of them passes it on neither side."""
    places = np.array([[0.3, beside], [0.3, -beside]])
    prediction = predict_in(make_obstacles(places, 0.03, 0.001, ids=('left', 'right')), places[goals])
    one, other = (each.likelihood for each in prediction.goals)
    assert one == pytest.approx(other, rel=1e-6)


PRIOR = Config().likelihood.other_goal


def reach(target, goals, share=0.6, **values):
    """Return the predictions during a part of a minimum-jerk reach of 1 s to a target."""
    pipeline = Pipeline(Config().with_values({'foc.steps': 20, **values}), is_timed=False)
    pipeline.set_obstacles('cloud', make_obstacles(), None, 'world')
    found = []
    for tick in range(round(100 * share)):
        s = max(tick / 100 - 0.05, 0.0)
        place = np.array(target) * (10 * s**3 - 15 * s**4 + 6 * s**5)
        pipeline.add_hand_sample(HandSample(round(tick * NANOSECONDS / 100), place, 0.0, 'world'))
        pipeline.set_goals(np.array(goals), 'world')
        if tick % 5 == 0:
            prediction = pipeline.predict()
            assert prediction is not None
            followed = sum(each.likelihood for each in prediction.candidates)
            assert followed + prediction.unknown + prediction.other == pytest.approx(1)
            found.append(prediction)
    return found


def test_the_share_of_another_goal_grows_if_the_hand_goes_between_the_goals_and_falls_if_it_goes_to_one():
    missed, met = reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL]), reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL, MIDDLE])
    assert missed[0].other == pytest.approx(PRIOR), 'the parameter'
    assert all(each.other == 0.0 for each in reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL], **{'likelihood.other_goal': 0.0}))
    assert missed[-1].other > 2.0 * PRIOR and met[-1].other < PRIOR / 4.0
    assert max(each.other for each in met) < 1.5 * PRIOR


def test_a_goal_that_cannot_be_reached_makes_no_other_one_likelier():
    """The hand moves to a goal within walls, and the only other one is as likely as if this goal were not there."""
    corners = np.array([[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]])
    sides = [np.array([corners[row - 1], corners[row]]) for row in range(4)]
    walls = make_obstacles([[0.3, 0.0]] * 4, 0.005, ids=tuple('abcd'), polygons=sides)
    mean = np.array([0.15, 0.0, 0.3, 0.0, 0.0, 0.0])
    hand = HandState(0, mean, 1e-6 * np.eye(6), onset_ns=-NANOSECONDS // 2, onset_position=np.zeros(2))
    free, within = [0.25, 0.2], [0.3, 0.0]
    alone, beside = (predict(Config(), hand, walls, np.array(goals), NO_TRACKS)[0] for goals in ([free], [free, within]))
    assert beside.goals[1].likelihood is None
    assert beside.goals[0].likelihood == pytest.approx(alone.goals[0].likelihood, abs=0.005)
    assert beside.other == pytest.approx(alone.other, abs=0.005) and alone.other > 2.0 * PRIOR


def test_a_fast_hand_that_slows_down_goes_to_the_near_goal():
    """A farther goal has more time, so that by the efforts alone it would be the likelier one."""
    near, far = (0.2, 0.02), (0.6, 0.06)
    for share in (0.5, 0.6, 0.7):
        to_near, to_far = (shares_of_goals(reach(target, [near, far], share)[-1]) for target in (near, far))
        assert to_near[0] > 0.9 and to_far[1] > to_near[1]


HOME, NEAR, FAR = (0.0, 0.0), (0.2, 0.1), (0.25, -0.15)
CONFIG = Config().with_values(
    {'foc.steps': 20, 'likelihood.other_goal': 0.0, 'estimator.gap_s': 10.0, 'experience.learning': 'none'}
)
BETA = CONFIG.likelihood.beta
EXPECTED = 1.0 / (1.0 + ((0.25**2 + 0.15**2) / (0.2**2 + 0.1**2)) ** BETA)
"""Probability of the far goal by the distances from `HOME`."""


class Session:
    """A hand that moves from place to place, rests there, and is asked where it will go next."""

    def __init__(self, goals, names=(), **values):
        self.pipeline, self.tick, self.place = Pipeline(CONFIG.with_values(values), is_timed=False), 0, np.array(HOME)
        self.announce(goals, names)
        self.move(HOME)

    def announce(self, goals, names=()):
        boxes = {'ids': names, 'polygons': [BOX] * len(names)}
        obstacles = make_obstacles(np.array(goals), 1e-3, **boxes) if names else make_obstacles()
        self.pipeline.set_obstacles('cloud', obstacles, None, 'world')
        self.pipeline.set_goals(np.array(goals), 'world')
        self.tick += 100  # a second, in which the likelihoods follow

    def move(self, target):
        start = self.place
        for s in np.clip(np.linspace(0.0, 1.6, 96), 0.0, 1.0):
            self.place = start + (np.array(target) - start) * (10 * s**3 - 15 * s**4 + 6 * s**5)
            self.sample()

    def sample(self):
        self.pipeline.add_hand_sample(HandSample(round(self.tick * NANOSECONDS / 100), self.place, 0.0, 'world'))
        self.tick += 1

    def reach(self, target, times=1):
        """Move to a target and appear at home again, as with a clutch: the way back is no reach."""
        for _ in range(times):
            self.move(target)
            self.pipeline.set_engaged(False)
            self.place, self.tick = np.array(HOME), self.tick + 2000
            self.pipeline.set_engaged(True)
            self.move(HOME)

    def share(self, goal):
        self.sample()
        prediction = self.pipeline.predict()
        assert prediction is not None
        return shares_of_goals(prediction)[goal]


def odds(share):
    return share / (1.0 - share)


@pytest.mark.parametrize('past_goals', [0.0, 1.0, 3.0])
def test_a_goal_that_was_reached_more_often_than_expected_gets_likelier(past_goals):
    session = Session([NEAR, FAR], **{'likelihood.past_goals': past_goals})
    before = session.share(1)
    session.reach(FAR, times=3)
    weights = [(1 + past_goals * reached) / (1 + past_goals * 3 * share) for reached, share in ((0, 1 - EXPECTED), (3, EXPECTED))]
    # the movement has an onset, a little later than it begins
    assert odds(session.share(1)) / odds(before) == pytest.approx(weights[1] / weights[0], rel=0.1)


def test_habits_follow_the_object_and_not_its_place():
    session = Session([NEAR, FAR], ('cup', 'jug'))
    before = session.share(0), session.share(1)
    session.reach(FAR, times=3)
    session.announce([FAR, NEAR], ('cup', 'jug'))
    assert session.share(1) > before[0] > before[1]  # the jug, which is now where the cup was
    session.announce([FAR, NEAR])
    assert session.share(1) == pytest.approx(before[0], rel=0.05)  # goals that are no objects are others


def test_a_goal_elsewhere_is_another_one():
    session = Session([NEAR, FAR])
    before = session.share(1)
    session.reach(FAR)
    assert session.share(1) > 1.2 * before
    session.announce([NEAR, (FAR[0] + 0.01, FAR[1])])
    known = session.share(1)
    assert known > 1.2 * before
    session.announce([NEAR, (FAR[0] + 0.04, FAR[1])])
    assert odds(session.share(1)) < 0.7 * odds(known)


def test_a_movement_that_ends_far_from_all_goals_or_on_the_way_to_one_says_nothing_and_a_reset_forgets():
    session = Session([NEAR, FAR])
    before = session.share(1)
    for end in ((0.1, -0.06), (0.65 * FAR[0], 0.65 * FAR[1])):
        session.reach(end)
        assert session.share(1) == pytest.approx(before)
    session.reach(FAR)
    assert session.share(1) > 1.2 * before
    session.pipeline.reset()
    session.reach(HOME)
    assert session.share(1) == pytest.approx(before)


def test_other_parameters_leave_habits_but_for_that_by_which_reaches_were_expected():
    session = Session([NEAR, FAR])
    before = session.share(1)
    session.reach(FAR, times=3)
    session.pipeline.reconfigure(CONFIG.with_values({'likelihood.shortfall': 2.0, 'rate_hz': 20.0}))
    session.reach(HOME)
    assert session.share(1) > 1.2 * before
    for beta in (2.0 * BETA, BETA):
        session.pipeline.reconfigure(CONFIG.with_values({'likelihood.beta': beta}))
    session.reach(HOME)
    assert session.share(1) == pytest.approx(before)


def test_reaches_are_expected_to_end_where_the_earlier_ones_did():
    goals = [NEAR, (NEAR[0], NEAR[1] - 0.05)]
    session = Session(goals, **{'likelihood.past_goals': 1e-6})
    session.reach((NEAR[0], NEAR[1] - 0.02), times=6)
    habits = session.pipeline.learnt.habits
    np.testing.assert_allclose(habits.find_ends(np.zeros((1, 2))), [[0.0, -0.02 * 6 / 9]], atol=1e-3)
    ends = np.hypot(*habits.find_ends(np.array(goals)).T)
    # the straight effort counts with the power 0.75, and the costs of the movements depend on the goals themselves
    before, given = odds(Session(goals).share(1)), np.hypot(*np.array(goals).T)
    nearer = (ends[0] / ends[1]) / (given[0] / given[1])
    assert odds(session.share(1)) / before == pytest.approx(nearer ** (1.5 * BETA), rel=0.01)
