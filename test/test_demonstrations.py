# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations are recorded with the obstacles that they pass, and recalled if the scene is the same."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.classes import find_path_sides, search
from foc_ros.core.classes.library import STEP_S, GuessTiming, recall_demonstrations, record_demonstration
from foc_ros.core.config import Config, HomotopyConfig, replace_values
from foc_ros.core.errors import FocError
from foc_ros.core.learning.learnt import Knowledge
from foc_ros.core.learning.recordings import (
    NO_LIBRARY,
    PRIOR_COUNT,
    PRIOR_COUNT_GOAL,
    compute_goal_factors,
    find_evidence,
    make_library,
)
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState
from foc_ros.io.class_library import load_library, save_library

OBSTACLES = make_obstacles([[0.15, 0.0], [0.15, 0.06], [0.15, -0.06]], 0.015)
GOAL = np.array([[0.3, 0.0]])


def bow(height):
    s = np.linspace(0.0, 1.0, 40)
    return np.column_stack([0.3 * s, height * np.sin(np.pi * s)])


def hand(at=(0.0, 0.0), frame_id='world'):
    return HandState(1, np.array([*at, 0.0, 0.0, 0.0, 0.0]), np.zeros((6, 6)), frame_id=frame_id)


def recall(demonstration, obstacles=OBSTACLES, goals=GOAL, state=None, found=()):
    library = demonstration if isinstance(demonstration, list) else [demonstration]
    state, goals, timing = state or hand(), np.asarray(goals), GuessTiming([1.0] * len(goals), 50)
    searched = search(state.mean, goals, obstacles, HomotopyConfig(), *timing)
    return recall_demonstrations(library, state, goals, obstacles, timing, replace(searched, candidates=tuple(found)))


DEMONSTRATION = record_demonstration('world', bow(0.1), OBSTACLES)


def test_a_demonstrated_class_longer_than_the_candidates_is_solved_too():
    config = replace_values(Config(), {'homotopy.max_candidates': 2})
    without, _ = predict(config, hand(), OBSTACLES, GOAL, NO_TRACKS)
    prediction, memory = predict(config, hand(), OBSTACLES, GOAL, NO_TRACKS, Knowledge(make_library([DEMONSTRATION])))
    labels = {one.label for one in prediction.solved_candidates}
    assert 'goal0:+0+1+2' in labels - {one.label for one in without.candidates}
    assert prediction.notes['recalled'] == 1
    assert 'goal0:+0+1+2' in {one.label for one in memory.candidates}


@pytest.mark.parametrize(
    ('change', 'kept'),
    [
        pytest.param({}, True, id='as it was'),
        pytest.param({'obstacles': OBSTACLES.take([2, 0, 1])}, True, id='reordered'),
        pytest.param({'obstacles': make_obstacles(OBSTACLES.centre + 0.01, 0.015)}, True, id='moved a little'),
        pytest.param({'obstacles': make_obstacles(OBSTACLES.centre + 0.03, 0.015)}, False, id='moved'),
        pytest.param({'obstacles': OBSTACLES.take([0, 1])}, False, id='one is gone'),
        pytest.param({'obstacles': make_obstacles([*OBSTACLES.centre, [0.15, 0.3]], 0.015)}, True, id='one more elsewhere'),
        pytest.param({'obstacles': make_obstacles([*OBSTACLES.centre, [0.15, 0.1]], 0.015)}, False, id='one more in the way'),
        pytest.param({'goals': [[0.31, 0.01]]}, True, id='goal moved a little'),
        pytest.param({'goals': [[0.35, 0.0]]}, False, id='another goal'),
        pytest.param({'goals': [[0.35, 0.0], [0.3, 0.0]]}, True, id='second goal'),
        pytest.param({'state': hand((0.05, 0.06))}, True, id='hand on the way'),
        pytest.param({'state': hand((0.0, -0.3))}, False, id='hand far away'),
        pytest.param({'state': hand(frame_id='base')}, False, id='another frame'),
    ],
)
def test_when_a_demonstration_is_recalled(change, kept):
    assert len(recall(DEMONSTRATION, **change)) == kept


def test_a_library_file_is_read_as_it_was_written(tmp_path):
    file = tmp_path / 'ways.json'
    save_library(file, [DEMONSTRATION])
    (read,) = load_library(str(file))
    assert (read.frame_id, read.ids, read.sides) == (DEMONSTRATION.frame_id, DEMONSTRATION.ids, DEMONSTRATION.sides)
    np.testing.assert_array_equal(read.path, DEMONSTRATION.path)
    np.testing.assert_array_equal(read.centre, DEMONSTRATION.centre)
    assert [one.name for one in tmp_path.iterdir()] == ['ways.json']
    assert load_library('') == ()


@pytest.mark.parametrize(
    ('break_it', 'words'),
    [
        (lambda way: way.pop('path'), r'ways\[0\]: expected exactly frame_id, passed, path and'),
        (lambda way: way['path'].pop(), r'ways\[0\].path: expected finite numbers of shape \(65, 2\), got .* of shape \(64, 2\)'),
        (lambda way: way['path'].__setitem__(3, [0, float('nan')]), r'ways\[0\].path: expected numbers in \[-10000, 10000\]'),
        (lambda way: way['path'].__setitem__(3, [0, 10**400]), r'path: expected .*, got a whole number beyond all floats'),
        (lambda way: way['passed'][1].update(side='up'), r'passed\[1\].side: expected left or right, got .up'),
        (lambda way: way['passed'][1].update(id=7), r'passed\[1\]: expected id'),
        (lambda way: way['passed'].append(way['passed'][0]), r'passed: expected each obstacle once'),
        (lambda way: way.update(frame_id=None), r'frame_id: expected a text'),
    ],
)
def test_errors_in_a_library_file_name_the_field(tmp_path, break_it, words):
    save_library(tmp_path / 'good.json', [DEMONSTRATION])
    document = json.loads((tmp_path / 'good.json').read_text())
    break_it(document['ways'][0])
    (tmp_path / 'bad.json').write_text(json.dumps(document))
    with pytest.raises(FocError, match=words):
        load_library(str(tmp_path / 'bad.json'))


CONFIG = Config().with_values({'foc.steps': 20, 'homotopy.max_detour': 100.0, 'likelihood.other_goal': 0.0})


def move(path, rest_s=0.5, moving_s=2.0):
    """Return the states of a hand that rests at both ends of a path."""
    at = np.arange(0.0, moving_s + 2.0 * rest_s, STEP_S)
    times = rest_s + np.linspace(0.0, moving_s, len(path))
    positions = np.column_stack([np.interp(at, times, axis) for axis in path.T])
    return np.column_stack([positions, np.gradient(positions, STEP_S, axis=0)])


def record(path, obstacles=OBSTACLES):
    return record_demonstration('world', path, obstacles, move(path))


ABOVE = record(bow(0.03))
HAND = HandState(1, np.zeros(6), 1e-6 * np.eye(6), frame_id='world')


def ask(library, hand=HAND, obstacles=OBSTACLES):
    return predict(CONFIG, hand, obstacles, GOAL, NO_TRACKS, Knowledge(library))[0]


def by_label(prediction):
    return {each.label: each for each in prediction.candidates}


def sides_of(recording):
    return dict(zip(recording.ids, recording.sides, strict=True))


def test_likelihoods_are_those_of_a_dirichlet_distribution():
    before, after = by_label(ask(NO_LIBRARY)), by_label(ask(make_library([ABOVE, ABOVE])))
    taken = [label for label, each in before.items() if dict(each.candidate.sides).items() <= sides_of(ABOVE).items()]
    assert len(taken) == 1
    prior, count = PRIOR_COUNT, 2.0
    for label, each in before.items():
        if each.has_likelihood:
            expected = (prior * each.likelihood + count * (label in taken)) / (prior + count)
            assert after[label].likelihood == pytest.approx(expected, abs=1e-9)


def test_recordings_tell_goals_apart_by_where_they_led_and_not_by_how_many_there_are():
    """A hand moves like all recordings to one of two goals, and like none to the other."""
    goals, none = np.array([[0.3, 0.1], [0.3, -0.1]]), make_obstacles()
    share = np.linspace(0.0, 1.0, 65)[:, None]
    there, elsewhere = (record(share * goal, none) for goal in goals)
    moving = replace(HAND, mean=np.array([*there.states[20], 0.0, 0.0]), onset_ns=0)

    def find_odds(recordings, hand):
        library = Knowledge(make_library((), recordings))
        first, second = (each.likelihood for each in predict(CONFIG, hand, none, goals, NO_TRACKS, library)[0].goals)
        return first / second

    for hand in (HAND, moving):
        for one_sided in ([], [there] * 9):
            assert find_odds(one_sided, hand) == pytest.approx(find_odds([], hand)), 'of the other goal nothing is known'
    assert find_odds([there] * 9 + [elsewhere], HAND) == pytest.approx(find_odds([], HAND), rel=1e-3), 'all began here'
    known = find_odds([there] * 3 + [elsewhere] * 2, moving) / find_odds([], moving)
    prior, near = PRIOR_COUNT_GOAL, 3 / 5
    assert known == pytest.approx((prior * near + 3) / (prior + 3) / (prior * near / (prior + 2)), rel=0.02)


def test_recordings_of_ways_that_are_closed_now_say_nothing_of_goals():
    """Neither when the hand begins as they do, nor when it has left them."""
    goals, post = np.array([[0.3, 0.1], [0.3, -0.1]]), [(0.2, 0.1)]
    share = np.linspace(0.0, 1.0, 65)[:, None]
    closed, free = (record(share * goal, make_obstacles(post, 0.01)) for goal in goals)
    away = replace(HAND, mean=np.array([*free.states[20], 0.0, 0.0]), onset_ns=0)
    for hand in (HAND, away):
        known, same = (
            find_evidence(make_library(each), hand, make_obstacles(post, 0.05), goals) for each in ([closed, free], [free])
        )
        assert known.recorded.tolist() == same.recorded.tolist() == [0, 1]
        assert compute_goal_factors(known) == pytest.approx(compute_goal_factors(same))


MOVING = replace(HAND, mean=np.array([*ABOVE.states[20], 0.0, 0.0]), onset_ns=0)
"""The hand of a recording one second after it began, half a second after the onset."""


def find_taken(prediction):
    return next(each for each in prediction.candidates if dict(each.candidate.sides).items() <= sides_of(ABOVE).items())


def test_a_path_approaches_the_recordings_with_their_number():
    times = find_taken(ask(NO_LIBRARY, MOVING)).times
    at = 1.0 + times
    recorded = np.column_stack([np.interp(at, STEP_S * np.arange(len(ABOVE.states)), axis) for axis in ABOVE.states[:, :2].T])
    distances, stddevs = [], []
    for number in (0, 1, 4, 16):
        taken = find_taken(ask(make_library([ABOVE] * number), MOVING))
        distances.append(np.hypot(*(taken.mean[:, :2] - recorded).T).mean())
        stddevs.append(np.sqrt(taken.covariance[1:, 0, 0]).mean())
        assert np.linalg.eigvalsh(taken.covariance).min() > -1e-9
        assert np.hypot(*(taken.mean[-1, :2] - GOAL[0])) < 1e-6, 'where the recordings are slower than the plan, too'
    assert (np.diff(distances) < 0.0).all() and distances[-1] < 0.1 * distances[0]
    assert (np.diff(stddevs) < 0.0).all()


def test_a_hand_at_rest_follows_recordings_from_their_onset():
    """Half a second of rest comes before the movement; noise does not decide how much of it the prediction contains."""
    generator = np.random.default_rng(0)
    at_rest = np.arange(len(ABOVE.states)) < 0.5 / STEP_S
    noise = generator.normal(0.0, 1e-3, ABOVE.states.shape) * at_rest[:, None]
    library = make_library([replace(ABOVE, states=ABOVE.states + noise)] * 8)
    paths = []
    for place in generator.normal(0.0, 1e-3, (6, 2)):
        taken = find_taken(ask(library, replace(HAND, mean=np.array([*place, 0.0, 0.0, 0.0, 0.0]))))
        paths.append(taken.solution.path - place)
    assert np.ptp(paths, axis=0).max() < 0.01
    without_rest = record_demonstration('world', bow(0.03), OBSTACLES, move(bow(0.03), rest_s=0.1))
    np.testing.assert_allclose(paths[0], find_taken(ask(make_library([without_rest] * 8))).solution.path, atol=0.01)


@given(st.floats(0.012, 0.05), st.floats(-0.01, 0.01), st.floats(0.0, 0.9))
@settings(max_examples=6, deadline=None)
def test_a_pooled_path_stays_in_its_class_and_out_of_obstacles(height, beside, share):
    recording = record(bow(height))
    state = recording.states[int(share * (len(recording.states) - 1))]
    hand = replace(MOVING, mean=np.array([state[0], state[1] + beside, *state[2:], 0.0, 0.0]))
    before = by_label(ask(NO_LIBRARY, hand))
    for label, each in by_label(ask(make_library([recording] * 8), hand)).items():
        if not each.has_likelihood:
            continue
        assert find_path_sides(each.mean[:, :2], OBSTACLES).items() >= each.sides.items()
        nearest = [measure_offsets(one.mean[:, :2], OBSTACLES)[1].min() for one in (before[label], each)]
        assert nearest[1] >= min(nearest[0], OBSTACLES.radius[0]) - 1e-9


@pytest.mark.parametrize(
    'library',
    [
        [],
        [replace(ABOVE, states=None)],
        [replace(ABOVE, frame_id='elsewhere')],
        [replace(ABOVE, centre=ABOVE.centre + 0.03)],
        [replace(ABOVE, states=ABOVE.states + 1.0)],
        [record(bow(0.01), make_obstacles(OBSTACLES.centre, 0.005))],
    ],
    ids=['none', 'without states', 'another frame', 'obstacles moved', 'far from the hand', 'obstacles have grown'],
)
def test_without_a_recording_that_agrees_it_is_the_model(library):
    known, model = ask(make_library(library)), ask(NO_LIBRARY)
    for one, other in zip(known.candidates, model.candidates, strict=True):
        assert one.label == other.label and one.likelihood == other.likelihood
        np.testing.assert_array_equal(one.mean, other.mean)
        np.testing.assert_array_equal(one.covariance, other.covariance)
