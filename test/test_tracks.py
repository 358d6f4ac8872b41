# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tracks: a class keeps its number, its solution and its share under changing names, and what fails is held."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle

import foc_ros
from foc_ros.core.candidates import solve_candidates
from foc_ros.core.classes import search
from foc_ros.core.config import Config, FocConfig, HomotopyConfig, replace_values
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.hand.kalman import update
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.predict import predict
from foc_ros.core.situation import prepare_situation
from foc_ros.core.solution import LEFT, RIGHT, Candidate, Status
from foc_ros.core.tracks import FULL_CHANGE_S, NO_TRACKS, Track, Tracks
from foc_ros.core.types import NANOSECONDS, HandSample, HandState

CONFIG = replace_values(Config(), {'foc.steps': 20})
GOALS = np.array([[0.3, 0.0]])
STEP_NS = 20_000_000


def make_class(sides, goal=0):
    label = f'goal{goal}:' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides.items())
    return Candidate(label, goal, tuple(sides.items()), np.zeros((2, 2)), 0.1)


@pytest.mark.parametrize(
    ('now', 'before'),
    [
        pytest.param(make_class({'a': LEFT, 'b': RIGHT}), 1, id='the same name'),
        pytest.param(make_class({'b': LEFT}), 0, id='an obstacle passed'),
        pytest.param(make_class({'a': LEFT, 'b': RIGHT, 'c': LEFT}), 1, id='an obstacle come into reach'),
        pytest.param(make_class({'a': LEFT}), 1, id='the likelier of two that were told apart by what is passed'),
        pytest.param(make_class({'a': RIGHT}), 2, id='another side'),
        pytest.param(make_class({'a': LEFT, 'c': LEFT}), 2, id='one obstacle for another'),
        pytest.param(make_class({'b': LEFT}, goal=1), 2, id='another goal'),
    ],
)
def test_a_candidate_continues_the_track_of_its_class_under_any_name(now, before):
    known = make_class({'a': LEFT, 'b': LEFT}), make_class({'a': LEFT, 'b': RIGHT})
    tracks = Tracks((Track(0, known[0], 0, 0.2), Track(1, known[1], 0, 0.8)), (), 0, next_number=2)
    assert [each.number for each in tracks.match([now], STEP_NS)] == [before]


@pytest.mark.parametrize('most', [6, 7, 8])
def test_no_class_is_gone_for_a_moment_while_obstacles_are_passed_on_the_way_to_one_goal_before_the_other(most):
    goals, tracks, last = np.array([[0.3, 0.1], [0.3, -0.1]]), NO_TRACKS, dict[int, int]()
    obstacles = make_obstacles([[0.05, -0.03], [0.15, 0.05], [0.15, -0.05], [0.22, 0.0]], 0.015, 0.001)
    for tick in range(60):
        hand, config = np.array([0.002 * tick, 0.0, 0.2, 0.0, 0.0, 0.0]), HomotopyConfig(max_candidates=most)
        candidates = search(hand, goals, obstacles, config, [1.0, 1.0], 10, tracks.candidates).candidates
        matched = tracks.match(candidates, STEP_NS * tick)
        found = [Track(track.number, each, STEP_NS * tick) for track, each in zip(matched, candidates, strict=True)]
        numbers = {each.number for each in found}
        assert all(last.get(number, tick - 1) == tick - 1 for number in numbers)
        last |= dict.fromkeys(numbers, tick)
        absent = tuple(each for each in (*tracks.followed, *tracks.absent) if each.number not in numbers)
        tracks = Tracks(tuple(found), absent, next_number=max(last) + 1)


def predict_at(tick, y, tracks):
    stamp_ns, mean = STEP_NS * tick, np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    hand = HandState(stamp_ns, mean, np.zeros((6, 6)), onset_ns=stamp_ns, onset_position=np.zeros(2))
    return predict(CONFIG, hand, make_obstacles([[0.15, y]], 0.02, 0.001), GOALS, tracks)


def find_shares(prediction):
    return {each.label: each.likelihood for each in prediction.candidates_with_likelihood}


def test_no_likelihood_changes_by_one_in_less_than_the_stated_time():
    """After a step of the scene, likelihoods go straight to the new ones, and reach them when the largest change may have."""
    first, after = (find_shares(predict_at(0, y, NO_TRACKS)[0]) for y in (-0.015, 0.015))
    largest = max(abs(first[label] - after[label]) for label in first)
    part = STEP_NS / NANOSECONDS / FULL_CHANGE_S
    assert largest > 2.0 * part, 'the scene is no test'
    _, tracks = predict_at(0, -0.015, NO_TRACKS)
    for tick in range(1, 8):
        prediction, tracks = predict_at(tick, 0.015, tracks)
        found, gain = find_shares(prediction), min(1.0, tick * part / largest)
        assert sum(found.values()) + prediction.other == pytest.approx(1.0)
        for label, share in found.items():
            assert share == pytest.approx((1.0 - gain) * first[label] + gain * after[label], abs=5e-3)


def test_the_shares_of_goals_change_no_faster():
    goals, none = np.array([[0.2, 0.1], [0.2, -0.1]]), make_obstacles()

    def turn_to(tick, y, tracks):
        mean, stamp_ns = np.array([0.05, 0.0, 0.3, y, 0.0, 0.0]), STEP_NS * tick
        hand = HandState(stamp_ns, mean, np.zeros((6, 6)), onset_ns=stamp_ns - STEP_NS, onset_position=np.zeros(2))
        prediction, following = predict(CONFIG, hand, none, goals, tracks)
        return np.array([*[each.likelihood for each in prediction.goals], prediction.unknown, prediction.other]), following

    left, tracks = turn_to(0, 0.1, NO_TRACKS)
    right = turn_to(1, -0.1, NO_TRACKS)[0]
    gain = STEP_NS / NANOSECONDS / FULL_CHANGE_S / abs(left - right).max()
    assert gain < 0.5, 'the hand is no test'
    assert turn_to(1, -0.1, tracks)[0] == pytest.approx((1.0 - gain) * left + gain * right, abs=5e-3)


def reaching(x, tracks):
    """Predict for a hand at (x, 0) that moves, among two obstacles of which it passes the first at x = 0.1."""
    obstacles, state = make_obstacles([[0.1, 0.04], [0.2, -0.01]], 0.02, 0.001), None
    for tick in range(40):
        stamp_ns = 1_000_000_000 + round(x / 0.4 * 1e9) + 10_000_000 * tick
        state = update(state, HandSample(stamp_ns, np.array([x - 0.004 * (39 - tick), 0.0])), CONFIG.estimator).state
    return predict(CONFIG, state, obstacles, GOALS, tracks)


def test_when_an_obstacle_is_passed_the_candidates_keep_their_solutions_and_numbers():
    before, tracks = reaching(0.099, NO_TRACKS)
    warm, _ = reaching(0.101, tracks)
    cold, _ = reaching(0.101, NO_TRACKS)
    numbers = {each.way: each.label for each in before.candidates}
    assert all(numbers[each.way] != each.label for each in warm.candidates if each.way in numbers), 'all names are new ones'
    assert {each.label for each in warm.solved_candidates} == {each.label for each in cold.solved_candidates}
    for one in warm.solved_candidates:
        other = next(each for each in cold.solved_candidates if each.label == one.label)
        if one.way in numbers:
            assert one.solution.qp_solves < other.solution.qp_solves
        exact = 1e-4 if one.likelihood > 0.5 else 1e-3  # an unlikely class is settled less exactly
        np.testing.assert_allclose(one.solution.path, other.solution.path, atol=exact)


@pytest.mark.parametrize('rows', [[1, 0], [1], [2, 1, 0]])
def test_classes_are_followed_to_goals_that_have_other_rows_in_the_next_message(rows):
    places = np.array([(0.3, 0.0), (0.25, 0.15), (0.0, 0.3)])

    def follow(rows):
        """Return the numbers of the candidates by goal and sides, after the goals have got these rows."""
        predictor = foc_ros.Predictor(replace_values(Config(), {'budget_s': 0.0, 'foc.steps': 15}))
        predictor.set_obstacles([foc_ros.Circle((0.12, 0.03), 0.02)])
        for step, given in enumerate([[0, 1, 2], [0, 1, 2], rows]):
            predictor.set_goals(places[given])
            prediction = predictor.update(0.02 * step, (0.002 * step, 0.0))
        return {(given[each.candidate.goal], each.candidate.sides): each.way for each in prediction}

    known = follow([0, 1, 2])
    assert follow(rows) == {(goal, sides): way for (goal, sides), way in known.items() if goal in rows}
    # a goal that had no time is searched first, in whatever row it is now
    assert replace(NO_TRACKS, goals=places, next_goal=1).keep_goals(places[rows]).next_goal == rows.index(1)


def test_an_earlier_solution_on_another_side_is_no_start():
    """An obstacle jumps over the earlier paths: both classes are solved from their guesses, and none leaves its class."""
    hand = HandState(0, np.zeros(6), np.zeros((6, 6)))
    _, tracks = predict(CONFIG, hand, make_obstacles([[0.15, -0.02]], 0.02, 0.001), GOALS, NO_TRACKS)
    later, jumped = replace(hand, stamp_ns=STEP_NS), make_obstacles([[0.15, 0.02]], 0.02, 0.001)
    warm, cold = (predict(CONFIG, later, jumped, GOALS, each)[0] for each in (tracks, NO_TRACKS))
    assert {each.label: each.status for each in warm.candidates} == {'goal0:+0': Status.SOLVED, 'goal0:-0': Status.SOLVED}
    costs = {each.label: each.cost for each in cold.candidates}
    assert {each.label: each.cost for each in warm.candidates} == pytest.approx(costs, rel=1e-5)


TWO_CIRCLES = make_obstacles([[0.12, 0.01], [0.2, -0.03]], [0.02, 0.02], 0.001)
SCENES = {
    'two circles': TWO_CIRCLES,
    'a row of three': make_obstacles([[0.15, -0.07], [0.15, 0.005], [0.15, 0.07]], 0.02, 0.002),
    'one that moves': make_obstacles([[0.14, -0.05]], 0.03, 0.002, velocity=[[0.0, 0.06]]),
}
HANDS = [
    update(None, HandSample(1_000_000_000 + 20_000_000 * tick, np.array([1e-4 * tick, 0.0])), CONFIG.estimator).state
    for tick in range(20)
]


class Counted(Deadline):
    """A deadline that allows a number of steps, whatever the clock says, to the search for classes as many as it likes."""

    def __init__(self, steps):
        super().__init__()
        self.steps = steps

    @property
    def left_s(self):
        self.steps -= 1
        return math.inf if self.steps >= 0 else -math.inf

    def take_share(self, share):
        return NEVER if share < 0.5 else self


def predicted(tick, memory, deadline=NEVER, obstacles=TWO_CIRCLES):
    return predict(CONFIG, HANDS[tick], obstacles, GOALS, memory, deadline=deadline)


def test_a_budget_that_is_not_reached_changes_nothing():
    (free, memory), (ample, other) = predicted(0, NO_TRACKS), predicted(0, NO_TRACKS, Deadline(60.0))
    for one, two in ((free, ample), (predicted(1, memory)[0], predicted(1, other, Deadline(60.0))[0])):
        assert one.most_likely == two.most_likely
        for a, b in zip(one.candidates, two.candidates, strict=True):
            assert (a.candidate.label, a.likelihood) == (b.candidate.label, b.likelihood)
            np.testing.assert_array_equal(a.solution.mean, b.solution.mean)


@pytest.mark.parametrize('name', SCENES)
def test_every_class_has_a_likelihood_whenever_the_time_ends(name):
    """The estimates lead to the answer: within 0.2 of it from the fourth iteration on, whatever was settled by then."""
    expected = find_shares(predicted(0, NO_TRACKS, obstacles=SCENES[name])[0])
    for steps in range(40):
        late, _ = predicted(0, NO_TRACKS, Counted(steps), SCENES[name])
        shares = find_shares(late)
        assert shares.keys() == expected.keys()
        assert sum(shares.values()) + late.unknown + late.other == pytest.approx(1.0)
        assert shares == pytest.approx(expected, abs=0.4 if steps < 4 else 0.2)
        for each in late.candidates if steps == 0 else ():
            unsettled = each.status in (Status.DEADLINE, Status.ESTIMATED)
            assert unsettled or each.solution.safety_factor >= 3.0 - 1e-4, 'solved at once'
            assert each.likelihood > 0.0 and np.isfinite(each.cost)
            assert each.solution.message.count('estimated') == (each.status is not Status.SOLVED)
            assert shares[each.label] > 0.3 * expected[each.label] or expected[each.label] < 0.05, 'no class becomes unlikely'
        assert late.notes.get('unfinished', 0) == sum(each.status is Status.DEADLINE for each in late.candidates)
        if not late.notes.get('unfinished'):
            assert shares == pytest.approx(expected, abs=1e-9)
            break
    assert 1 < steps < 39


def test_what_is_not_settled_goes_on_in_the_next_prediction():
    """With time for two iterations in each prediction, all classes are solved after a few."""
    memory, unfinished = NO_TRACKS, []
    for tick in range(20):
        prediction, memory = predicted(tick, memory, Counted(2))
        unfinished.append(prediction.notes.get('unfinished', 0))
        if not unfinished[-1]:
            break
    assert unfinished[0] > 0, 'the scene is no test'
    assert not unfinished[-1]
    assert find_shares(prediction).keys() == find_shares(predicted(tick, NO_TRACKS)[0]).keys()


@pytest.mark.parametrize(
    ('position', 'velocity', 'acceleration', 'duration_s'),
    [
        pytest.param((0.094, 0.054), (0.13, 0.38), (0.0, -0.2), 1.38, id='beside the obstacle'),
        pytest.param((0.064, 0.026), (0.18, 0.38), (-1.3, 0.0), 1.52, id='away from it'),
        pytest.param((0.113, -0.013), (0.21, 0.13), (-1.0, 0.5), 1.1, id='close before it'),
    ],
)
def test_a_class_waits_for_the_next_prediction_only_if_it_is_unlikely(position, velocity, acceleration, duration_s):
    """A hand that is suddenly faster makes bad starts of the solutions of before: their QPs promise too little."""
    obstacles, goals = make_obstacles([[0.15, 0.0], [0.25, -0.07], [0.25, 0.07]], 0.02, 0.001), np.array([[0.4, 0.0]])

    def prepare(time_s, *state):
        config = replace_values(Config(), {'duration.model': 'fixed', 'duration.fixed_s': time_s})
        hand = HandState(1_000_000_000, np.ravel(state), np.zeros((6, 6)), onset_ns=900_000_000, onset_position=np.zeros(2))
        return prepare_situation(config, hand, obstacles, goals, (), None, NO_TRACKS)

    before, now = prepare(2.5, position, velocity, (0, 0)), prepare(duration_s, position, velocity, acceleration)
    candidates = search(before.hand.mean, goals, obstacles, before.config.homotopy, [2.5], 30).candidates
    problems = [[each.pose_problem(0)] * len(candidates) for each in (before, now)]
    earlier = [each.solution for each in solve_candidates(candidates, problems[0], before.config.foc)]
    whole, brief = (
        solve_candidates(candidates, problems[1], now.config.foc, earlier, Deadline(goes_on=goes_on)) for goes_on in (False, True)
    )
    waiting = [row for row, each in enumerate(brief) if each.status is Status.ESTIMATED]
    assert waiting, 'the scene is no test'
    rule = now.config.likelihood  # costs and missing safety, as likelihoods compare them
    behind = np.array([rule.beta * np.log(each.cost) + rule.shortfall * each.solution.safety_shortfall for each in whole])
    assert (behind[waiting] - behind.min() > 4.0).all()


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal', 'fixed', 'algorithm1'])
def test_a_strategy_stops_at_its_deadline_with_the_best_so_far(strategy):
    problem, start = one_obstacle(0.94), cold_start(bowed((0, 0), (0.3, 0), 50, 0.05))
    settings = FocConfig(strategy=strategy, algorithm1_growth=1.5)
    free = solve_problem(problem, start, settings)
    for deadline in (Deadline(0.0), Counted(1), Counted(2)):
        late = solve_problem(problem, start, settings, deadline)
        assert late.status is Status.DEADLINE
        assert 'out of time' in late.message
        assert np.isfinite(late.mean).all()
        assert late.qp_solves < free.qp_solves


TICKS = {'optimal': 500, 'lv': 120, 'hc': 120}
"""Five seconds of the default strategy, and fewer of those that seek a point of a curve, which take several times as long."""


@pytest.mark.parametrize('strategy', TICKS)
def test_the_most_likely_class_of_a_symmetric_obstacle_does_not_flicker(strategy):
    """At 100 Hz, for a hand at rest before a circle on its straight path, with 1 mm of noise on both."""
    config = replace_values(Config(), {'rate_hz': 100.0, 'foc.steps': 20, 'foc.strategy': strategy})
    pipeline, rng, seen = Pipeline(config), np.random.default_rng(11), []
    pipeline.set_goals(GOALS, 'world')
    for tick in range(TICKS[strategy]):
        stamp_ns = 1_000_000_000 + tick * 10_000_000
        circle = make_obstacles(rng.normal([[0.15, 0.0]], 0.001), 0.03, 0.001)
        pipeline.set_obstacles('cloud', circle, stamp_ns, 'world')
        pipeline.add_hand_sample(HandSample(stamp_ns, rng.normal(0.0, 0.001, 2), 0.0, 'world'))
        prediction = pipeline.predict()
        assert prediction is not None, pipeline.last_refusal
        assert {each.label for each in prediction.solved_candidates} == {'goal0:+0', 'goal0:-0'}
        seen.append(prediction.most_likely)
    assert sum(one != other for one, other in pairwise(seen)) <= 1


def test_a_class_that_was_postponed_goes_on_from_where_it_was():
    boxes = [((0.12, 0.04), (0.05, 0.03), 0.3), ((0.14, -0.05), (0.04, 0.04), 0.0), ((0.23, 0.0), (0.06, 0.02), -0.4)]
    boxes.append(((0.25, 0.09), (0.03, 0.05), 0.1))
    values = {'homotopy.max_candidates': 6, 'duration.model': 'fixed', 'duration.fixed_s': 1.0, 'foc.steps': 50, 'budget_s': 0.0}
    predictor = foc_ros.Predictor(Config().with_values(values))
    predictor.set_obstacles([foc_ros.Box(centre, size, yaw, radius_stddev=0.001) for centre, size, yaw in boxes])
    predictor.set_goals([(0.36, 0.04), (0.36, -0.04)])
    predictions = [predictor.update(0.02 * tick, (2e-4 * tick, 0.0)) for tick in range(8)]
    assert sum(each.status is Status.ESTIMATED for prediction in predictions for each in prediction) > 8
    assert max(each.solution.qp_solves for each in predictions[0]) > 6
    assert max(each.solution.qp_solves for prediction in predictions[2:] for each in prediction) <= 3
