# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Folders of recordings: reaches among boxes, each with its own scene, and the optional Avoiding task with its labels."""

import json
from pathlib import Path

import numpy as np
import pytest
from evaluation_samples import reach, write_tables
from homotopy_scenes import AVOIDING

from foc_ros.analysis.evaluation.observations import observe
from foc_ros.analysis.evaluation.questions import GAP, GOAL, PATH_CLASS, ask, ask_all, find_relevant_obstacles
from foc_ros.analysis.evaluation.report import find_gaps, find_label_mismatches
from foc_ros.analysis.evaluation.scores import leave_goals_out
from foc_ros.analysis.recordings import find_recordings
from foc_ros.cli.main import main
from foc_ros.core.config import replace_values
from foc_ros.core.errors import RecordingError
from foc_ros.ros.parameters import load_parameter_file

HEADER = 'recording,object,x_m,y_m,z_m,width_m,depth_m,height_m\n'
BOXES = (
    'a,Target,0.3,0,0,0.05,0.05,0.08\n'
    'a,ObstacleLong,0.15,0.0,0,0.05,0.04,0.1\n'
    'a,LeftBoundary,0.1,0.15,0,0.6,0.02,0.1\n'
    'a,RightBoundary,0.1,-0.03,0,0.6,0.005,0.1\n'
    'a,Ceiling,0.1,0.0,0.2,0.9,0.9,0.02\n'
    'b,Target,0.3,0.01,0,0.05,0.05,0.08\n'
)


@pytest.fixture
def folder(tmp_path):
    """Write a reach to the left of a box, between two walls and under a ceiling, and another without obstacles."""
    write_tables(tmp_path / 'data', {'a': reach(0.06, (0.3, 0.0)), 'b': reach(0.0, (0.3, 0.01))}, ())
    (tmp_path / 'data' / 'goals.csv').unlink()
    (tmp_path / 'data' / 'scenes.csv').write_text(HEADER + BOXES)
    (tmp_path / 'data' / 'trials.csv').write_text('recording,person,sides\na,one,Long=left\nb,one,\n')
    return tmp_path / 'data'


def observe_one(folder, hand_radius):
    config = load_parameter_file(folder / 'parameters.yaml').with_values({'scene.hand_radius': hand_radius})
    return observe(find_recordings(folder)['a'], config)


def test_each_recording_has_its_boxes_by_name_and_its_target_as_goal(folder):
    first = observe_one(folder, 0.0).observations[0]
    assert first.ids == ('ObstacleLong/0', 'LeftBoundary/0', 'RightBoundary/0')
    assert first.row.tolist() == [0, -1, -1] and first.goals.tolist() == [[0.3, 0.0]]
    np.testing.assert_allclose(first.centre, [[0.15, 0.0], [0.1, 0.15], [0.1, -0.03]])


def test_a_gap_between_box_and_wall_that_is_too_narrow_is_not_open(folder):
    for hand_radius, sides in ((0.0, [-1, 1]), (0.01, [1])):
        gaps = observe_one(folder, hand_radius).observations[0].gaps
        assert [each[:, 0].tolist() for each in gaps] == [sides]
    assert not ask_all(observe_one(folder, 0.01), PATH_CLASS)


def test_sides_of_the_table_of_trials_are_compared_with_the_path(folder):
    observed = [observe_one(folder, 0.0)]
    assert find_label_mismatches(folder, observed) == {}
    (folder / 'trials.csv').write_text('recording,person,sides\na,one,Long=right\n')
    assert find_label_mismatches(folder, observed) == {'a': 'Long label right, path left'}
    (folder / 'trials.csv').write_text('recording,person,sides\n')
    assert find_label_mismatches(folder, observed) == {'a': 'no label'}


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('recording,object,x_m\n', 'scenes.csv: row 1: no column y_m'),
        (HEADER + 'a,Target,0,0,0,1,1,-1\n', "row 2, column height_m: expected a number in [0, 10000], got '-1'"),
        (HEADER + 'a,Target,0,nan,0,1,1,1\n', "row 2, column y_m: expected a number in [-10000, 10000], got 'nan'"),
        (HEADER + 'a,,0,0,0,1,1,1\n', "row 2, column object: expected a name, got ''"),
        (HEADER + 2 * 'a,Wall,0,0,0,1,1,1\n', 'row 3, column object: expected another name than the rows above'),
        (HEADER + 'a,Wall,0,0,0,1,1,1\n', "scenes.csv: no row of recording 'a' has the object Target"),
    ],
)
def test_a_wrong_table_is_named(folder, text, words):
    (folder / 'scenes.csv').write_text(text)
    with pytest.raises(RecordingError) as caught:
        find_recordings(folder)
    assert words in str(caught.value)


@pytest.fixture
def picks(folder):
    """Let the reach of the folder end at one of two objects, between them and the walls; the other one is picked up later."""
    boxes = BOXES.replace('0.3,0,0,', '0.3,0.0,0,').splitlines(keepends=True)
    (folder / 'scenes.csv').write_text(HEADER + ''.join(each for each in boxes if 'RightBoundary' not in each))
    (folder / 'trials.csv').write_text('recording,person,object\na,one,Target\nb,one,Target\nc,one,ObstacleLong\n')
    return folder


def test_objects_that_are_picked_up_are_goals_and_obstacles(picks):
    recording = find_recordings(picks)['a']
    observed = observe_one(picks, 0.0)
    first = observed.observations[0]
    assert recording.goal == observed.path.goal == 0
    assert first.ids == ('Target/0', 'ObstacleLong/0', 'LeftBoundary/0') and first.goals.tolist() == [[0.3, 0.0], [0.15, 0.0]]
    assert {*first.candidates.goal.tolist()} == {0, 1} and first.candidates.has_likelihood.all()
    assert find_label_mismatches(picks, [observed]) == {}
    ((_, question), *_) = ask_all(observed, GOAL)
    assert (question.possible, question.truth) == (2, 0)


def test_the_share_of_another_goal_is_judged_with_the_goal_left_out(picks, capsys):
    assert {name: len(each.scene.goals) for name, each in leave_goals_out(find_recordings(picks)).items()} == {'a': 1}
    arguments = ['evaluate', str(picks), '--params', str(picks / 'parameters.yaml'), '--unannounced', '--workers', '1', '--json']
    assert main(arguments) == 0
    answer = json.loads(capsys.readouterr().out)
    found = answer['other_goal']
    assert 0.0 < found['share'] < found['share_left_out'] and found['area_under_curve'] > 0.5
    assert 0.0 <= found['calibration_error'] < 1.0 and answer['verdict'][-1].startswith('Another goal: ')


THUMB_STICK = Path(__file__).parents[1] / 'doc' / 'examples' / 'thumb_stick.yaml'


@pytest.mark.skipif(not AVOIDING.is_dir(), reason='optional data ../shared/data/d3il_avoiding is not there')
@pytest.mark.parametrize('name', ['000', '053'])
def test_the_classes_taken_are_as_labelled(name, tmp_path):
    config = replace_values(load_parameter_file(THUMB_STICK), {'rate_hz': 0.5})
    recording = observe(find_recordings(AVOIDING)[name], config)
    first, relevant = recording.observations[0], find_relevant_obstacles(recording)
    assert first.row.tolist() == [0, 1, 1, 2, 2, 2]
    assert ask(PATH_CLASS, first, relevant).possible == 24
    assert ask(GAP, first, relevant).possible == 2
    # a goal stands behind each gap of the last row
    assert ask(GOAL, first, relevant).truth == find_gaps(first)[2]
    label = next(line for line in (AVOIDING / 'labels.csv').read_text().splitlines() if line.startswith(f'{name},'))
    (tmp_path / 'labels.csv').write_text(f'recording,gap_row1,gap_row2,gap_row3\n{label}\n')
    assert find_label_mismatches(tmp_path, [recording]) == {}
