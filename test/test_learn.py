# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""replay --learn: a demonstrated reach enters the library once and is recalled in the next replay."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bag_helpers import messages, write_bag

from foc_ros.analysis.replay import Replay
from foc_ros.cli.main import main
from foc_ros.core.classes.library import record_demonstration
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.io.bags import BagReader
from foc_ros.io.class_library import MOST_WAYS, load_library, save_library
from foc_ros.ros.parameters import load_parameter_file

PARAMETERS = '/**: {ros__parameters: {rate_hz: 1.0, foc.steps: 20, homotopy.library: "%s"}}'


def run(bag: Path, *options: str, library: str = '') -> int:
    parameters = bag.parent / 'parameters.yaml'
    parameters.write_text(PARAMETERS % library)
    return main(['replay', str(bag), '--params', str(parameters), *options])


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return write_bag(tmp_path / 'reach', messages(seconds=1.02))


def test_a_reach_is_learned_once(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / 'ways.json'
    assert run(bag, '--learn', str(file), '--json') == 0
    assert json.loads(capsys.readouterr().out)['summary']['learned'] == 1
    (demonstration,) = load_library(str(file))
    held = file.read_text()
    path = demonstration.path
    assert demonstration.ids and np.hypot(*(path[-1] - path[0])) > 0.1
    assert run(bag, '--learn', str(file), '--json') == 0
    assert json.loads(capsys.readouterr().out)['summary']['learned'] == 0
    assert file.read_text() == held
    assert run(bag, library=str(file)) == 0


def test_another_library_in_the_parameters_is_refused(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(bag, '--learn', str(tmp_path / 'ways.json'), library=str(tmp_path / 'other.json')) == 2
    assert '--learn: expected no other class library in homotopy.library' in capsys.readouterr().err


def test_a_reach_that_ends_before_its_goal_is_not_learned(tmp_path: Path) -> None:
    bag, file = write_bag(tmp_path / 'short', messages(seconds=0.4)), tmp_path / 'ways.json'
    assert run(bag, '--learn', str(file)) == 0
    assert load_library(str(file)) == ()


@pytest.mark.parametrize('text', ['{"ways": [{}]}', '{', 'x' * 6_000_000])
@pytest.mark.parametrize('use', ['learn', 'load'])
def test_a_library_that_cannot_be_used_is_exit_2_in_one_line(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], use: str, text: str
) -> None:
    file = tmp_path / 'ways.json'
    file.write_text(text)
    options = {'learn': (['--learn', str(file)], ''), 'load': ([], str(file))}[use]
    assert run(bag, *options[0], library=options[1]) == 2
    captured = capsys.readouterr()
    assert captured.out == ''
    assert str(file) in captured.err and captured.err.count('\n') == 1
    assert file.read_text() == text


def test_a_place_that_cannot_be_written_is_exit_2_in_one_line(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(bag, '--learn', '/nowhere/ways.json') == 2
    error = capsys.readouterr().err
    assert '--learn: expected a file in a directory that exists, got /nowhere/ways.json' in error and error.count('\n') == 1


def test_a_full_library_stays_as_it_was(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / 'ways.json'
    far = make_obstacles([[0.1, 1.0]], 0.01)
    demonstrations = [record_demonstration('other', np.array([[0.0, 0.1 * k], [0.3, 0.1 * k]]), far) for k in range(MOST_WAYS)]
    save_library(file, demonstrations)
    held = file.read_bytes()
    assert run(bag, '--learn', str(file)) == 2
    assert 'ways: expected at most 500, got 501 with the new ones' in capsys.readouterr().err
    assert file.read_bytes() == held


def test_the_parameters_of_the_operator_are_written(bag: Path, tmp_path: Path) -> None:
    file = tmp_path / 'operator.yaml'
    assert run(bag, '--operator', str(file)) == 0
    replayed = Replay(load_parameter_file(bag.parent / 'parameters.yaml'))
    with BagReader(bag) as reader:
        assert sum(step.prediction is not None for step in replayed.steps(reader)) > 0
    assert load_parameter_file(file) == replayed.pipeline.adapted_config
    assert run(bag, '--operator', '/nowhere/operator.yaml') == 2
