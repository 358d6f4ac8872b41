# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `evaluate`: kinds of data, failures by name, workers, JSON, page, baselines from outside, folders of boxes."""

import contextlib
import io
import json
import re

import numpy as np
import pytest
from evaluation_samples import reach, write_tables

from foc_ros.analysis.evaluation import Forecast, register_baseline
from foc_ros.analysis.evaluation.baselines import BASELINES
from foc_ros.analysis.evaluation.observations import GOAL as GOAL_QUESTION
from foc_ros.analysis.evaluation.observations import PATH_CLASS, ask_all, observe
from foc_ros.analysis.evaluation.report import find_label_mismatches
from foc_ros.analysis.evaluation.scores import leave_goals_out
from foc_ros.analysis.recordings import find_recordings
from foc_ros.cli.main import main
from foc_ros.core.errors import FocWarning, InputError, RecordingError
from foc_ros.ros.parameters import load_parameter_file

ASIDE = {'left': 0.06, 'right': -0.06, 'left too': 0.05}
OBSTACLE = [(0.15, 0.0, 0.03)]
GOAL = [(0.3, 0.0)]


def write_three(folder):
    """Write three reaches past one obstacle, the last one with a wrong label."""
    write_tables(folder, {name: reach(aside, GOAL[0]) for name, aside in ASIDE.items()}, GOAL, OBSTACLE)
    # low x is on neither side of a movement along x; by convention the left counts as high
    labels = {'left': 1, 'right': 0, 'left too': 0}
    (folder / 'labels.csv').write_text('recording,gap\n' + ''.join(f'{name},{gap}\n' for name, gap in labels.items()))
    return folder


@pytest.fixture
def tables(tmp_path):
    return write_three(tmp_path / 'data')


def run(data, *options, workers='--workers=1'):
    return main(['evaluate', str(data), '--params', str(data / 'parameters.yaml'), workers, *options])


def evaluate(data, *options, code=0, workers='--workers=1'):
    with contextlib.redirect_stdout(io.StringIO()) as output:
        assert run(data, '--json', *options, workers=workers) == code
    return json.loads(output.getvalue())


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    return evaluate(write_three(tmp_path_factory.mktemp('whole') / 'data'))


def test_reaches_past_an_obstacle_are_scored_by_class(whole):
    assert whole['recordings'] == 3 and whole['failed'] == {} and whole['warnings'] == [] and whole['predictions'] >= 12
    assert set(whole['questions']) == {'way', 'gap'}
    by_class = whole['questions']['way']
    assert by_class['uniform']['gain'] == 0.0 and by_class['uniform']['log_likelihood'] == pytest.approx(np.log(0.5))
    # a bent reach shows early on which side it will pass
    assert by_class['foc']['gain'] > 0.1 and by_class['constant velocity']['gain'] > 0.0
    assert sum(each['predictions'] for each in by_class['foc']['by_tenth']) == by_class['foc']['predictions']
    assert sum(each['count'] for each in by_class['foc']['reliability']) == by_class['foc']['predictions']
    assert whole['parameters']['foc.steps'] == 15
    assert whole['labels_not_taken'] == {'left too': 'label 0, path 1'}


def test_in_order_a_recording_is_evaluated_with_what_was_learnt_in_those_before_and_bad_ones_fail_by_name(tables, whole, capsys):
    with (tables / 'recordings.csv').open('a') as file:
        file.write('broken,0.0,0.0,0.0\nbroken,0.1,nan,0.0\nbackward,1.0,0.0,0.0\nbackward,0.5,0.1,0.0\n')
    learnt = evaluate(tables, '--in-order', code=2)
    assert set(learnt['failed']) == {'broken', 'backward'} and learnt['recordings'] == whole['recordings']
    assert 'column x_m' in learnt['failed']['broken'] and 'column t_s' in learnt['failed']['backward']
    assert 'foc_ros evaluate: broken: ' in capsys.readouterr().err
    assert learnt['questions']['way']['foc'] != whole['questions']['way']['foc']
    assert learnt['questions']['way']['uniform'] == whole['questions']['way']['uniform']


def forecast_first(observation, question, confidence):
    """Name the first answer of the candidates, whatever the hand does."""
    return Forecast.from_answer(question.answers[question.given[0]], confidence, question)


def test_a_predictor_has_one_look_in_all_charts_of_the_page_and_no_two_have_the_same(whole, tmp_path, monkeypatch):
    from matplotlib.container import Container
    from matplotlib.figure import Figure

    from foc_ros.reporting import study_pages
    from foc_ros.reporting.draw import CLASS_COLOURS

    looks: dict[str, set[tuple[str, str, str]]] = {}

    def chart(size, caption, draw, *given):
        draw(axes := Figure(size).subplots(), *given)
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            line = handle[0] if isinstance(handle, Container) else handle
            looks.setdefault(label, set()).add((line.get_color(), line.get_linestyle(), line.get_marker()))
        return '', caption

    monkeypatch.setattr(study_pages, 'make_chart', chart)
    study_pages.write_evaluation(tmp_path, 'x', whole)
    assert len(looks) == len(list(BASELINES)) - 1, 'all but the uniform guess'
    assert all(len(each) == 1 for each in looks.values())
    assert len(set.union(*looks.values())) == len(looks)
    assert not {colour for colour, *_ in set.union(*looks.values())} & {*CLASS_COLOURS}, 'these are the colours of paths'
    page = (tmp_path / 'evaluation.html').read_text(encoding='utf-8')
    unexplained = [name for name in BASELINES if f'>{name}: ' not in page.partition('<figure')[0]]
    assert unexplained == ['foc, held out', 'uniform'] and page.index('>nat: ') < page.index('<figure')


def test_a_baseline_from_outside_is_compared(tables, monkeypatch):
    monkeypatch.setattr(BASELINES, '_parts', dict(BASELINES._parts))
    register_baseline('first answer', forecast_first, [0.0, 0.5])
    with pytest.raises(InputError, match='baseline: expected a new name besides foc, foc, held out'):
        register_baseline('uniform', forecast_first)
    found = evaluate(tables)
    assert list(found['questions']['way'])[-2:] == ['straight minimum jerk', 'first answer']
    scores = found['questions']['way']['first answer']
    assert scores['predictions'] == found['questions']['way']['foc']['predictions'] and scores['log_likelihood'] < 0.0
    assert found['settings']['way']['first answer'] in (0.0, 0.5)


def test_reaches_without_obstacles_are_scored_by_goal(tmp_path):
    goals = [(0.3, 0.0), (0.0, 0.3), (-0.3, 0.0)]
    found = evaluate(write_tables(tmp_path / 'free', {f'to{i}': reach(0.0, goal) for i, goal in enumerate(goals)}, goals))
    assert set(found['questions']) == {'goal'}
    goal = found['questions']['goal']['foc']
    assert goal['uniform'] == pytest.approx(-np.log(3.0))
    assert goal['by_tenth'][9]['right'] == 1.0 and goal['gain'] > 0.2


def test_bags_are_scored_as_their_tables(tables, tmp_path, whole):
    bags = tmp_path / 'bags'
    assert main(['convert', str(tables), '--output', str(bags)]) == 0
    (bags / 'parameters.yaml').write_text((tables / 'parameters.yaml').read_text())
    found = evaluate(bags)
    for question, by_predictor in whole['questions'].items():
        for predictor, scores in by_predictor.items():
            assert found['questions'][question][predictor]['log_likelihood'] == pytest.approx(scores['log_likelihood'])
    assert main(['evaluate', str(bags / 'left'), '--workers', '1', '--params', str(bags / 'parameters.yaml')]) == 0


def test_the_exit_code_is_3_where_nothing_can_be_scored(tmp_path, capsys):
    ring = [(0.3 + 0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.05) for angle in np.linspace(0.0, 6.0, 13)]
    data = write_tables(tmp_path / 'none', {'blocked': reach(0.0, (0.1, 0.0))}, [(0.3, 0.0)], ring)
    assert run(data) == 3
    captured = capsys.readouterr()
    assert captured.out == '' and captured.err.startswith('foc_ros evaluate: blocked: nothing could be predicted')
    write_tables(data, {'one': [each[:1] for each in reach(0.0, (0.1, 0.0))]}, [(0.3, 0.0)], ())
    assert run(data) == 3
    assert 'evaluate: one: expected at least 10 hand poses, got 1\n' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda data: (data / 'goals.csv').unlink(), 'goals.csv: cannot be read'),
        (lambda data: (data / 'recordings.csv').unlink(), 'expected bags, or recordings.csv with goals.csv'),
        (lambda data: (data / 'obstacles.csv').write_text('x_m,y_m\n'), 'no column radius_m'),
        (lambda data: (data / 'parameters.yaml').write_text('/**: {ros__parameters: {foc.eta: 2.0}}'), 'foc.eta'),
    ],
)
def test_data_that_cannot_be_used_is_one_line_and_exit_2(tables, capsys, change, words):
    change(tables)
    assert run(tables) == 2
    captured = capsys.readouterr()
    assert captured.out == '' and words in captured.err and captured.err.count('\n') == 1


def test_the_report_is_one_page_and_the_terminal_shows_tables_verdict_and_wrong_labels(tables, tmp_path, capsys):
    assert run(tables, '--report', str(tmp_path / 'report')) == 0
    out, err = capsys.readouterr()
    assert err == 'foc_ros evaluate: left too: the label differs from the recorded path: label 0, path 1\n'
    page = (tmp_path / 'report' / 'evaluation.html').read_text('utf-8')
    assert page.count('<img') == 5 and 'constant velocity' in page  # one of them is a recording with its prediction
    assert out.endswith(f'\nreport: file://{tmp_path}/report/evaluation.html\n')
    assert 'log-likelihood above uniform [nat]' in out and 'foc, held out' in out
    lines = out.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    assert any(line.startswith('Paths: foc is by 3 recordings not distinguishable from uniform') for line in lines)
    assert any(line.startswith('Positions 0.5 s ahead: ') for line in lines)
    assert 'In short:\nfoc predicted 3 recordings, at' in out and 'best simple' in out


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
    with pytest.raises(RecordingError, match=re.escape(words)):
        find_recordings(folder)


def test_bags_beside_tables_are_left_out_with_a_warning(folder):
    (folder / 'session.mcap').write_bytes(b'')
    with pytest.warns(FocWarning, match=r'session\.mcap: left out, because .* recordings\.csv'):
        assert list(find_recordings(folder)) == ['a', 'b']


@pytest.fixture
def picks(folder):
    """Let the reach of the folder end at one of two objects, between them and the walls; the other one is picked up later."""
    boxes = [each for each in BOXES.splitlines(keepends=True) if 'RightBoundary' not in each]
    (folder / 'scenes.csv').write_text(HEADER + ''.join(boxes))
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
    ((_, question), *_) = ask_all(observed, GOAL_QUESTION)
    assert (question.possible, question.truth) == (2, 0)


def test_the_share_of_another_goal_is_judged_with_the_goal_left_out(picks):
    assert {name: len(each.scene.goals) for name, each in leave_goals_out(find_recordings(picks)).items()} == {'a': 1}
    answer = evaluate(picks, '--unannounced')
    found = answer['other_goal']
    assert 0.0 < found['share'] < found['share_left_out'] and found['area_under_curve'] > 0.5
    assert 0.0 <= found['calibration_error'] < 1.0 and answer['verdict'][-1].startswith('Another goal: ')


def test_the_goal_that_is_left_out_was_reached_in_the_task_plane(tmp_path):
    t, positions = reach(0.05, (0.3, 0.1))
    rows = ''.join(f'a,{when:.4f},{x:.6f},0.0,{z:.6f}\n' for when, (x, z) in zip(t, positions, strict=True))
    (tmp_path / 'recordings.csv').write_text('recording,t_s,x_m,y_m,z_m\n' + rows)
    (tmp_path / 'goals.csv').write_text('x_m,y_m,z_m\n0.3,0.0,-0.1\n0.3,0.0,0.1\n')
    (left,) = leave_goals_out(find_recordings(tmp_path), 'xz').values()
    assert left.scene.goals.tolist() == [[0.3, 0.0, -0.1]]
