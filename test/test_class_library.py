# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Class libraries as files: `learn` and `replay --learn` write them, and what of them cannot be used is told."""

import json
import os
import shutil
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from bag_helpers import messages, write_bag
from evaluation_samples import write_tables
from test_demonstrations import ABOVE

import foc_ros
from foc_ros.analysis.replay import Replay
from foc_ros.cli.main import main
from foc_ros.core.classes.library import STEP_S, record_demonstration
from foc_ros.core.config import Config
from foc_ros.core.errors import FocWarning, RecordingError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.io import class_library
from foc_ros.io.bags import BagReader
from foc_ros.io.class_library import load_library, save_library
from foc_ros.ros.parameters import load_parameter_file


def write_reaches(folder, ends):
    share = np.linspace(0.0, 1.0, 51)
    paths = [np.column_stack([end * share, 0.03 * np.sin(np.pi * share)]) for end in ends]
    write_tables(folder, {f'r{k}': (share, path) for k, path in enumerate(paths)}, [(0.3, 0.0)], [(0.15, 0.0, 0.015)])


def test_learn_names_what_reaches_no_goal_and_writes_what_a_predictor_uses_in_its_frame_or_without_one(tmp_path, capsys):
    write_reaches(tmp_path, [0.3, 0.1, 0.3])
    file, shares = tmp_path / 'ways.json', []
    assert main(['learn', str(tmp_path), '--output', str(file)]) == 2
    assert 'r1: expected a movement' in capsys.readouterr().err
    recordings = load_library(str(file))
    assert len(recordings) == 2
    for each in recordings:
        assert 0.5 < STEP_S * len(each.states) < 1.5
        assert np.diff(each.states[:, 0]).min() > -1e-3
        assert each.states[-1, :2] == pytest.approx([0.3, 0.0], abs=0.02)
    obstacle = foc_ros.Circle((0.15, 0.0), 0.015, name='0')
    for frame, library in (('', ()), ('', file), ('world', file), ('arm', file)):
        predictor = foc_ros.Predictor(Config(budget_s=0.0, frame_id=frame), library=library)
        predictor.set_goals([(0.3, 0.0)])
        predictor.set_obstacles([obstacle])
        expected = (
            pytest.warns(FocWarning, match="in the frame 'world', the working frame is 'arm'")
            if frame == 'arm'
            else nullcontext()
        )
        with expected as issued:
            for share in np.linspace(0.0, 0.2, 11):
                prediction = predictor.update(share, (0.3 * share, 0.0))
        assert issued is None or len(issued) == 1
        shares.append({each.label: each.likelihood for each in prediction}['goal0:+0'])
    assert shares[1] == shares[2] > shares[0] + 0.02, 'the recordings pass on the left'
    assert shares[3] == shares[0], 'in another frame they say nothing'


def test_copies_of_a_bag_count_once(tmp_path, capsys):
    bags = tmp_path / 'bags'
    bags.mkdir()
    bag = write_bag(bags / 'a', messages(seconds=1.02))
    write_bag(bags / 'c', messages(seconds=1.04))
    (file,) = bag.glob('*.mcap')
    shutil.copytree(bag, bags / 'b')
    shutil.copy(file, bags / 'd.mcap')
    assert main(['learn', str(bags), '--output', str(tmp_path / 'ways.json')]) == 0
    assert len(load_library(str(tmp_path / 'ways.json'))) == 2
    copies = [f'foc_ros learn: {bags / name}: left out, because it is a copy of {file}' for name in ('b', 'd.mcap')]
    assert [line for line in capsys.readouterr().err.splitlines() if 'copy' in line] == copies


PARAMETERS = '/**: {ros__parameters: {rate_hz: 1.0, foc.steps: 20, homotopy.library: "%s"}}'


def run(bag, *options, library=''):
    parameters = bag.parent / 'parameters.yaml'
    parameters.write_text(PARAMETERS % library)
    return main(['replay', str(bag), '--params', str(parameters), *options])


@pytest.fixture
def bag(tmp_path):
    return write_bag(tmp_path / 'reach', messages(seconds=1.02))


def test_a_reach_is_learned_once(bag, tmp_path, capsys):
    file = tmp_path / 'ways.json'
    assert run(bag, '--learn', str(file), '--json') == 0
    assert json.loads(capsys.readouterr().out)['summary']['learned'] == 1
    (demonstration,) = load_library(str(file))
    held = file.read_text()
    assert demonstration.ids and np.hypot(*(demonstration.path[-1] - demonstration.path[0])) > 0.1
    assert run(bag, '--learn', str(file), '--json') == 0
    assert json.loads(capsys.readouterr().out)['summary']['learned'] == 0
    assert file.read_text() == held
    assert run(bag, library=str(file)) == 0


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'frame_id': 'arm'}, "they are in the frame 'arm', the working frame is 'world'"),
        ({'ids': ('cup',)}, "they pass obstacles that the scene does not have: 'cup'"),
        ({'centre': np.array([[0.2, 0.1]])}, ''),
    ],
    ids=['frame', 'ids', 'places'],
)
def test_a_library_of_no_use_is_told_once(bag, tmp_path, capsys, change, words):
    run(bag, '--learn', str(tmp_path / 'ways.json'))
    (way,) = load_library(str(tmp_path / 'ways.json'))
    file = tmp_path / 'others.json'
    save_library(file, [replace(way, **change)] * 2)
    capsys.readouterr()
    assert run(bag, library=str(file)) == 0
    told = f'foc_ros replay: {file}: none of its paths counts: {words}\n' if words else ''
    assert capsys.readouterr().err.replace('\r', '') == told


def test_a_library_of_no_use_is_told_once_for_all_recordings(tmp_path, capsys):
    write_reaches(tmp_path, [0.3, 0.3])
    file, parameters = tmp_path / 'ways.json', tmp_path / 'parameters.yaml'
    save_library(file, [replace(ABOVE, frame_id='arm')])
    parameters.write_text(PARAMETERS % file)
    assert main(['evaluate', str(tmp_path), '--params', str(parameters), '--workers', '1']) == 0
    assert capsys.readouterr().err.count('none of its paths counts') == 1


def test_another_library_in_the_parameters_is_refused(bag, tmp_path, capsys, monkeypatch):
    assert run(bag, '--learn', str(tmp_path / 'ways.json'), library=str(tmp_path / 'other.json')) == 2
    assert '--learn: expected no other class library in homotopy.library' in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
    assert run(bag, '--learn', 'ways.json') == 0
    assert run(bag, '--learn', 'ways.json', library=str(tmp_path / 'ways.json')) == 0, 'it is the same'
    assert run(bag, '--learn', 'new', '--operator', str(tmp_path / 'new')) == 2
    assert '--operator: expected another file than that of --learn' in capsys.readouterr().err


@pytest.mark.parametrize('text', ['{"ways": [{}]}', '{', 'x' * 6_000_000])
@pytest.mark.parametrize('use', ['learn', 'load'])
def test_a_library_that_cannot_be_used_is_exit_2_in_one_line(bag, tmp_path, capsys, use, text):
    file = tmp_path / 'ways.json'
    file.write_text(text)
    options = {'learn': (['--learn', str(file)], ''), 'load': ([], str(file))}[use]
    assert run(bag, *options[0], library=options[1]) == 2
    captured = capsys.readouterr()
    assert captured.out == ''
    assert str(file) in captured.err and captured.err.count('\n') == 1
    assert file.read_text() == text


def test_a_library_behind_a_link_is_written_there_and_a_device_stays(tmp_path):
    file, link, device = tmp_path / 'ways.json', tmp_path / 'link.json', tmp_path / 'pipe'
    save_library(file, [])
    link.symlink_to(file)
    way = record_demonstration('world', np.array([[0.0, 0.0], [0.3, 0.0]]), make_obstacles([[0.1, 1.0]], 0.01))
    save_library(link, [way])
    assert link.is_symlink() and len(load_library(str(file))) == 1
    os.mkfifo(device)
    with pytest.raises(RecordingError, match='pipe: cannot be written: it is no regular file'):
        save_library(device, [way])
    assert device.is_fifo()


def test_a_full_library_stays_as_it_was(bag, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(class_library, 'MOST_WAYS', 3)
    file, far = tmp_path / 'ways.json', make_obstacles([[0.1, 1.0]], 0.01)
    save_library(file, [record_demonstration('other', np.array([[0.0, y], [0.3, y]]), far) for y in (0.0, 0.1, 0.2)])
    held = file.read_bytes()
    assert run(bag, '--learn', str(file)) == 2
    assert 'ways: expected at most 3, got 4 with the new ones' in capsys.readouterr().err
    assert file.read_bytes() == held


def test_the_parameters_of_the_operator_are_written(bag, tmp_path):
    file = tmp_path / 'operator.yaml'
    assert run(bag, '--operator', str(file)) == 0
    replayed = Replay(load_parameter_file(bag.parent / 'parameters.yaml'))
    with BagReader(bag) as reader:
        assert sum(step.prediction is not None for step in replayed.steps(reader)) > 0
    assert load_parameter_file(file) == replayed.pipeline.adapted_config
    assert run(bag, '--operator', '/nowhere/operator.yaml') == 2
