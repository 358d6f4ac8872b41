# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations are recorded with the obstacles that they pass, and recalled if the scene is the same."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.classes import find_path_sides
from foc_ros.core.classes.library import (
    GuessTiming,
    recall_demonstrations,
    record_demonstration,
)
from foc_ros.core.config import Config, HomotopyConfig, replace_values
from foc_ros.core.errors import FocError
from foc_ros.core.learning.learnt import Knowledge
from foc_ros.core.learning.recordings import make_library
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState
from foc_ros.io.class_library import load_library, save_library

OBSTACLES = make_obstacles([[0.15, 0.0], [0.15, 0.06], [0.15, -0.06]], 0.015)
GOAL = np.array([[0.3, 0.0]])


def bow(height, end=(0.3, 0.0)):
    s = np.linspace(0.0, 1.0, 40)
    return np.column_stack([s * end[0], s * end[1] + height * np.sin(np.pi * s)])


def hand(at=(0.0, 0.0), frame_id='world'):
    return HandState(1, np.array([*at, 0.0, 0.0, 0.0, 0.0]), np.zeros((6, 6)), frame_id=frame_id)


def recall(demonstration, obstacles=OBSTACLES, goals=GOAL, state=None, found=()):
    library = demonstration if isinstance(demonstration, list) else [demonstration]
    return recall_demonstrations(
        library, state or hand(), np.asarray(goals), obstacles, HomotopyConfig(), GuessTiming([1.0] * len(goals), 50), found, ()
    )


DEMONSTRATION = record_demonstration('world', bow(0.1), OBSTACLES)


def test_a_demonstrated_class_longer_than_the_candidates_is_solved_too():
    config = replace_values(Config(), {'homotopy.max_candidates': 2})
    without, _ = predict(config, hand(), OBSTACLES, GOAL, NO_TRACKS)
    prediction, memory = predict(config, hand(), OBSTACLES, GOAL, NO_TRACKS, Knowledge(make_library([DEMONSTRATION])))
    labels = {one.candidate.label for one in prediction.solved_candidates}
    assert 'goal0:+0+1+2' in labels - {one.candidate.label for one in without.candidates}
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


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.floats(-0.12, 0.12),
    st.tuples(st.floats(-0.05, 0.25), st.floats(-0.1, 0.1)),
    st.tuples(st.floats(-0.013, 0.013), st.floats(-0.013, 0.013)),
)
def test_recalled_candidates_pass_the_obstacles_as_their_labels_say(height, at, shift):
    demonstration = record_demonstration('world', bow(height), OBSTACLES)
    goals = GOAL + np.array(shift)
    for one in recall(demonstration, goals=goals, state=hand(at)):
        sides, shown = find_path_sides(one.guess, OBSTACLES), dict(zip(demonstration.ids, demonstration.sides, strict=True))
        assert one.sides == tuple((name, sides[name]) for name, _ in one.sides)
        assert all(side == shown.get(name, side) for name, side in sides.items())
        assert one.guess[0] == pytest.approx(at, abs=1e-9)
        assert one.guess[-1] == pytest.approx(goals[0], abs=1e-9)


def test_a_library_file_is_read_as_it_was_written(tmp_path):
    file = tmp_path / 'ways.json'
    save_library(file, [DEMONSTRATION])
    (read,) = load_library(str(file))
    assert (read.frame_id, read.ids, read.sides) == (DEMONSTRATION.frame_id, DEMONSTRATION.ids, DEMONSTRATION.sides)
    np.testing.assert_array_equal(read.path, DEMONSTRATION.path)
    np.testing.assert_array_equal(read.centre, DEMONSTRATION.centre)
    assert [one.name for one in tmp_path.iterdir()] == ['ways.json']
    assert load_library('') == ()


def make_document(tmp_path):
    save_library(tmp_path / 'good.json', [DEMONSTRATION])
    return json.loads((tmp_path / 'good.json').read_text())


@pytest.mark.parametrize(
    ('break_it', 'words'),
    [
        (lambda way: way.pop('path'), r'ways\[0\]: expected exactly frame_id, passed, path and'),
        (lambda way: way['path'].pop(), r'ways\[0\].path: expected finite numbers of shape \(65, 2\), got .* of shape \(64, 2\)'),
        (lambda way: way['path'].__setitem__(3, [0, float('nan')]), r'ways\[0\].path: expected numbers in \[-10000, 10000\]'),
        (
            lambda way: way['path'].__setitem__(3, [0, 10**400]),
            r'path: expected finite numbers of shape \(65, 2\), got a whole number beyond all floats',
        ),
        (lambda way: way['passed'][1].update(side='up'), r'passed\[1\].side: expected left or right, got .up'),
        (lambda way: way['passed'][1].update(id=7), r'passed\[1\]: expected id'),
        (lambda way: way['passed'].append(way['passed'][0]), r'passed: expected each obstacle once'),
        (lambda way: way.update(frame_id=None), r'frame_id: expected a text'),
    ],
)
def test_errors_in_a_library_file_name_the_field(tmp_path, break_it, words):
    document = make_document(tmp_path)
    break_it(document['ways'][0])
    file = tmp_path / 'bad.json'
    file.write_text(json.dumps(document))
    with pytest.raises(FocError, match=words):
        load_library(str(file))


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (None, 'cannot be read'),
        ('', 'not a JSON file'),
        ('{"ways": 3}', 'a list of at most 500 ways, got int'),
        ('[]', 'a list of at most 500 ways'),
        (f'{{"ways": [{", ".join(["0"] * 501)}]}}', 'got 501 of them'),
        ('{"ways": []}' + ' ' * 5_000_000, 'expected at most 5,000,000 bytes'),
    ],
)
def test_files_that_are_no_library_are_refused(tmp_path, text, words):
    file = tmp_path / 'ways.json'
    if text is not None:
        file.write_text(text)
    with pytest.raises(FocError, match=words):
        load_library(str(file))
