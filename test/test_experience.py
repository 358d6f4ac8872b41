# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of a scene change likelihoods and positions where they agree with the scene and the hand, and nothing elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_demonstrations import GOAL, OBSTACLES, bow

from foc_ros.cli.main import main
from foc_ros.core.classes import find_path_sides
from foc_ros.core.classes.library import STEP_S, record_demonstration
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.core.learning.learnt import Knowledge
from foc_ros.core.learning.recordings import (
    NO_LIBRARY,
    PRIOR_COUNT,
    make_library,
)
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState
from foc_ros.io.class_library import load_library, save_library

CONFIG = Config().with_values({'foc.steps': 20, 'homotopy.max_detour': 100.0, 'likelihood.other_goal': 0.0})


def move(path, rest_s=0.5, moving_s=2.0):
    """Return the states of a hand that rests at both ends of a path."""
    at = np.arange(0.0, moving_s + 2.0 * rest_s, STEP_S)
    times = rest_s + np.linspace(0.0, moving_s, len(path))
    positions = np.column_stack([np.interp(at, times, axis) for axis in path.T])
    return np.column_stack([positions, np.gradient(positions, STEP_S, axis=0)])


def record(path):
    return record_demonstration('world', path, OBSTACLES, move(path))


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


MOVING = replace(HAND, mean=np.array([*ABOVE.states[20], 0.0, 0.0]), onset_ns=0)
"""The hand of a recording one second after it began, half a second after the onset."""


def find_taken(prediction):
    """Return the candidate on the sides of the recording."""
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
    assert (np.diff(distances) < 0.0).all() and distances[-1] < 0.1 * distances[0]
    assert (np.diff(stddevs) < 0.0).all()


def test_other_classes_effort_and_eta_stay_those_of_the_plan():
    known, model = by_label(ask(make_library([ABOVE] * 20), MOVING)), by_label(ask(NO_LIBRARY, MOVING))
    others = [label for label, each in model.items() if not dict(each.candidate.sides).items() <= sides_of(ABOVE).items()]
    assert others
    for label in others:
        np.testing.assert_array_equal(known[label].mean, model[label].mean)
        np.testing.assert_array_equal(known[label].covariance, model[label].covariance)
    for label, each in model.items():
        assert known[label].eta == each.eta and known[label].effort == each.effort
        np.testing.assert_array_equal(known[label].motor_covariance, each.motor_covariance)


@given(st.floats(0.012, 0.05), st.floats(-0.01, 0.01), st.floats(0.0, 0.9))
@settings(max_examples=10, deadline=None)
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
    ],
    ids=['none', 'without states', 'another frame', 'obstacles moved', 'far from the hand'],
)
def test_without_a_recording_that_agrees_it_is_the_model(library):
    known, model = ask(make_library(library)), ask(NO_LIBRARY)
    for one, other in zip(known.candidates, model.candidates, strict=True):
        assert one.label == other.label and one.likelihood == other.likelihood
        np.testing.assert_array_equal(one.mean, other.mean)
        np.testing.assert_array_equal(one.covariance, other.covariance)


@pytest.mark.parametrize('states', ['[[0, 0, 0, 0]]', '1', '[[0, 0], [0, 0]]', '[[0, 0, 0, 0], [0, 0, 0, "x"]]'])
def test_wrong_states_name_the_field(tmp_path, states):
    file = tmp_path / 'ways.json'
    save_library(file, [ABOVE])
    text = file.read_text()
    file.write_text(text[: text.index('"states": ') + 10] + states + '}]}')
    with pytest.raises(InputError, match=r'ways\[0\]\.states'):
        load_library(str(file))


HEADS = {'goals.csv': 'goal,x_m,y_m\n0,0.3,0.0\n', 'obstacles.csv': 'obstacle,x_m,y_m,radius_m\na,0.15,0.0,0.015\n'}


def write_tables(folder, ends):
    for name, text in HEADS.items():
        (folder / name).write_text(text)
    rows = [
        f'r{k},{0.02 * t:.3f},{end * t / 50:.5f},{0.03 * np.sin(np.pi * t / 50):.5f}'
        for k, end in enumerate(ends)
        for t in range(51)
    ]
    (folder / 'recordings.csv').write_text('recording,t_s,x_m,y_m\n' + '\n'.join(rows) + '\n')


def test_learn_writes_a_library_of_recordings(tmp_path):
    write_tables(tmp_path, [0.3, 0.3])
    assert main(['learn', str(tmp_path), '--output', str(tmp_path / 'ways.json')]) == 0
    recordings = load_library(str(tmp_path / 'ways.json'))
    assert len(recordings) == 2
    for each in recordings:
        assert 0.5 < STEP_S * len(each.states) < 1.5
        assert np.diff(each.states[:, 0]).min() > -1e-3
        assert each.states[-1, :2] == pytest.approx([0.3, 0.0], abs=0.02)


def test_a_recording_that_does_not_reach_its_goal_is_named(tmp_path, capsys):
    write_tables(tmp_path, [0.3, 0.1])
    assert main(['learn', str(tmp_path), '--output', str(tmp_path / 'ways.json')]) == 2
    assert 'r1: expected a movement' in capsys.readouterr().err
    assert len(load_library(str(tmp_path / 'ways.json'))) == 1
