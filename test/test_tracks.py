# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tracks: a class keeps its number, its solution and its share under changing names, and what fails is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.duration import CHANGE_S, limit_change
from foc_ros.core.hand.kalman import update
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.solution import LEFT, RIGHT, Candidate, Status
from foc_ros.core.tracks import NO_TRACKS, REST_S, SMOOTHING_S, TURNS, Track, Tracks
from foc_ros.core.types import HandSample, HandState

CONFIG = replace_values(Config(), {'foc.steps': 20})
GOALS = np.array([[0.3, 0.0]])
MOVING = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
STEP_NS = 20_000_000


def make_class(sides: dict[str, int], goal: int = 0) -> Candidate:
    label = f'goal{goal}:' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides.items())
    return Candidate(label, goal, tuple(sides.items()), np.zeros((2, 2)), 0.1)


def number(*predictions: tuple[Candidate, ...]) -> list[list[int]]:
    """Return the numbers of the classes in predictions 20 ms after one another."""
    tracks, numbers = NO_TRACKS, []
    for tick, candidates in enumerate(predictions):
        matched = tracks.match(candidates, tick * STEP_NS)
        numbers.append([each.number for each in matched])
        seen = [replace(each, candidate=made, seen_ns=tick * STEP_NS) for each, made in zip(matched, candidates, strict=True)]
        absent = [each for each in (*tracks.followed, *tracks.absent) if each.number not in numbers[-1]]
        tracks = Tracks(
            tuple(seen), tuple(absent), tick * STEP_NS, next_number=max([tracks.next_number, *(n + 1 for n in numbers[-1])])
        )
    return numbers


OVER, UNDER = make_class({'a': LEFT}), make_class({'a': RIGHT})


def test_a_class_that_is_missing_for_a_short_time_keeps_its_number() -> None:
    for gap, expected in ((9, 0), (10, 1)):
        assert number((OVER,), *([()] * gap), (OVER,))[-1] == [expected]


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
def test_a_candidate_continues_the_track_of_its_class_under_any_name(now: Candidate, before: int) -> None:
    known = make_class({'a': LEFT, 'b': LEFT}), make_class({'a': LEFT, 'b': RIGHT})
    tracks = Tracks((Track(0, known[0], 0, 0.2), Track(1, known[1], 0, 0.8)), (), 0, next_number=2)
    assert [each.number for each in tracks.match([now], STEP_NS)] == [before]


def predict_at(tick: int, y: float, tracks: Tracks, config: Config = CONFIG, goals: np.ndarray = GOALS, radius: float = 0.02):
    stamp_ns = STEP_NS * tick
    hand = HandState(stamp_ns, MOVING, np.zeros((6, 6)), onset_ns=stamp_ns, onset_position=np.zeros(2))
    return predict(config, hand, make_obstacles([[0.15, y]], radius, 0.001), goals, tracks)


def find_likelihoods(prediction) -> dict[str, float]:
    return {each.label: each.likelihood for each in prediction.candidates}


def test_likelihoods_follow_a_filter_of_the_stated_time_constant() -> None:
    """After a step of the scene the difference decays as exp(-t / SMOOTHING_S), whatever the period of the predictions."""
    first, after = (find_likelihoods(predict_at(0, y, NO_TRACKS)[0]) for y in (-0.015, 0.015))
    for ticks in ((5, 10), (1, 2, 3, 7, 10)):
        _, tracks = predict_at(0, -0.015, NO_TRACKS)
        for tick in ticks:
            prediction, tracks = predict_at(tick, 0.015, tracks)
        found, rest = find_likelihoods(prediction), np.exp(-0.2 / SMOOTHING_S)
        assert sum(found.values()) + prediction.other == pytest.approx(1.0)
        for label, share in found.items():
            assert share == pytest.approx(rest * first[label] + (1.0 - rest) * after[label], abs=5e-3)
            assert abs(first[label] - after[label]) > 0.05, 'the scene is no test'


def reaching(x: float, tracks: Tracks):
    """Predict for a hand at (x, 0) that moves, among two obstacles of which it passes the first at x = 0.1."""
    obstacles = make_obstacles([[0.1, 0.04], [0.2, -0.01]], 0.02, 0.001)
    state = None
    for tick in range(40):
        place = np.array([x - 0.004 * (39 - tick), 0.0])
        stamp_ns = 1_000_000_000 + round(x / 0.4 * 1e9) + 10_000_000 * tick
        state = update(state, HandSample(stamp_ns, place), CONFIG.estimator).state
    return predict(CONFIG, state, obstacles, GOALS, tracks)


def test_when_an_obstacle_is_passed_the_candidates_keep_their_solutions_and_numbers() -> None:
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
        np.testing.assert_allclose(one.solution.path, other.solution.path, atol=1e-4)


def test_unlikely_classes_are_solved_in_turns_unless_the_scene_changes() -> None:
    config = CONFIG.with_values({'homotopy.max_detour': 100.0, 'likelihood.planning_horizon_s': 1000.0})
    row = make_obstacles([[0.15, 0.05], [0.15, -0.05], [0.2, 0.0]], 0.02)
    hand = HandState(0, np.zeros(6), np.zeros((6, 6)))
    first, tracks = predict(config, hand, row, GOALS, NO_TRACKS)
    unlikely = {each.way for each in first.candidates if each.likelihood < 0.02 * first.candidates[0].likelihood}
    assert 1 < len(unlikely) < len(first.candidates)
    solved, ages = set(), []
    for tick in range(1, TURNS + 1):
        prediction, following = predict(config, replace(hand, stamp_ns=tick * STEP_NS), row, GOALS, tracks)
        new = {each.way for each in prediction.candidates if not each.age_s}
        assert new >= {each.way for each in first.candidates} - unlikely and len(new & unlikely) <= 1 + len(unlikely) // TURNS
        assert all(np.hypot(*each.mean[0, :2]) < 1e-9 for each in prediction.candidates)
        solved |= new
        ages += [each.age_s for each in prediction.candidates]
        tracks = following
    assert solved >= unlikely and max(ages) <= REST_S + 1e-9
    aside, wider, fewer = row.centre + np.array([0.0, 0.02]), row.radius + 0.02, row.take([0, 1])
    for now, some_rest in ((row, True), (replace(row, centre=aside), False), (replace(row, radius=wider), False), (fewer, False)):
        prediction, _ = predict(config, replace(hand, stamp_ns=TURNS * STEP_NS + 1_000_000), now, GOALS, tracks)
        assert any('solved again soon' in each.solution.message for each in prediction.candidates) == some_rest


def test_an_earlier_solution_on_another_side_is_no_start() -> None:
    """An obstacle jumps over the earlier paths: both classes are solved from their guesses, and none leaves its class."""
    hand = HandState(0, np.zeros(6), np.zeros((6, 6)))
    _, tracks = predict(CONFIG, hand, make_obstacles([[0.15, -0.02]], 0.02, 0.001), GOALS, NO_TRACKS)
    later, jumped = replace(hand, stamp_ns=STEP_NS), make_obstacles([[0.15, 0.02]], 0.02, 0.001)
    warm, cold = (predict(CONFIG, later, jumped, GOALS, each)[0] for each in (tracks, NO_TRACKS))
    assert {each.label: each.status for each in warm.candidates} == {'goal0:+0': Status.SOLVED, 'goal0:-0': Status.SOLVED}
    costs = {each.label: each.cost for each in cold.candidates}
    assert {each.label: each.cost for each in warm.candidates} == pytest.approx(costs, rel=1e-5)


@pytest.mark.parametrize('elapsed_s', [0.005, 0.02, 0.1])
def test_the_time_to_go_changes_gradually_and_never_slower_than_time(elapsed_s: float) -> None:
    factor = np.exp(elapsed_s / CHANGE_S)
    assert limit_change(4.8, 2.2, elapsed_s) == pytest.approx(2.2 * factor)
    assert limit_change(0.3, 2.2, elapsed_s) == pytest.approx(2.2 / factor)
    assert limit_change(2.2 - elapsed_s, 2.2, elapsed_s) == 2.2 - elapsed_s
    assert limit_change(0.2 - elapsed_s, 0.2, elapsed_s) == 0.2 - elapsed_s, 'the end of a movement'
    assert limit_change(4.8, 2.2, np.inf) == 4.8
