# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo end to end: the real node in its own process receives the first seconds of the packaged recording over DDS."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import ros_required  # noqa: F401
import pytest
from node_helpers import stamps
from play_helpers import has_ended, until
from rosbags.highlevel import AnyReader

from foc_ros.cli.main import main

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

ROOT = Path(__file__).resolve().parents[1]
LAST_S = 2.0
OUTPUTS = ('/foc/prediction', '/foc/likelihoods', '/foc/path', '/foc/markers')


def read(bag):
    """Return the messages of each topic."""
    found: dict[str, list[Any]] = {}
    with AnyReader([bag]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(reader.deserialize(raw, connection.msgtype))
        assert sum(map(len, found.values())) == reader.message_count
    return found


def test_end_to_end(tmp_path, capsys):
    from foc_ros.cli.demo import perform

    before = dict(os.environ)
    assert perform(tmp_path / 'out', last_s=LAST_S) == 0
    assert dict(os.environ) == before
    printed = capsys.readouterr().out
    told = (
        'The node starts ...',
        ' of 2.0 s   hand samples ',
        'The report is written ...',
        'predictions were',
        'report/index.html',
    )
    places = [printed.find(words) for words in told]
    assert places == sorted(places) and places[0] == 0
    bag = read(tmp_path / 'out' / 'bag')
    found = {topic: len(each) for topic, each in bag.items()}
    assert (found['/hand_pose'], found['/obstacles'], found['/goals']) == (201, 11, 3)
    assert found['/foc/prediction'] > 0
    assert {found[topic] for topic in OUTPUTS if topic != '/foc/markers'} == {found['/foc/prediction']}
    assert 0 < found['/foc/markers'] <= found['/foc/prediction']
    sent, made = (stamps(bag[topic]) for topic in ('/hand_pose', '/foc/prediction'))
    assert set(made) <= set(sent) and made == sorted(set(made)), 'the live predictions are those of the recording'
    numbers = json.loads((tmp_path / 'out' / 'report' / 'predictions.json').read_text(encoding='utf-8'))
    assert len(numbers['predictions']) == found['/foc/prediction']
    assert all(each['candidates'] or each['unsolved'] is not None for each in numbers['predictions'])
    assert any(each['candidates'] for each in numbers['predictions'])
    page = (tmp_path / 'out' / 'report' / 'index.html').read_text(encoding='utf-8')
    assert 'id="scene"' in page and '"frames"' in page, 'the page draws by itself what the pictures beside it show'


def wait_until_it_plays(demo):
    """Return the process id of the node of a demo once the recording plays."""
    for line in demo.stdout:
        if ' of 20.' in line:
            children = [each for file in Path(f'/proc/{demo.pid}/task').glob('*/children') for each in file.read_text().split()]
            (node,) = [int(each) for each in children if b'\0node\0' in Path(f'/proc/{each}/cmdline').read_bytes()]
            return node
    demo.kill()
    raise AssertionError(f'the demo never played: {demo.communicate()}')


def test_an_interrupt_ends_it_cleanly_and_a_node_that_dies_is_told(tmp_path):
    command = [sys.executable, '-u', '-m', 'foc_ros', 'demo', '--output']
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    outputs = tmp_path / 'interrupted', tmp_path / 'killed'
    interrupted, killed = demos = [subprocess.Popen([*command, str(each)], cwd=ROOT, **pipes) for each in outputs]
    nodes = [wait_until_it_plays(each) for each in demos]
    interrupted.send_signal(signal.SIGINT)
    os.kill(nodes[1], signal.SIGKILL)
    printed, errors = interrupted.communicate(timeout=60)
    assert (interrupted.returncode, errors) == (130, '')
    assert printed.splitlines()[-1].startswith('interrupted')
    until(lambda: has_ended(nodes[0]), 'the end of the node', 10.0)
    assert read(outputs[0] / 'bag')['/hand_pose']
    assert not (outputs[0] / 'report').exists()
    _, errors = killed.communicate(timeout=60)
    assert killed.returncode == 1
    (line,) = errors.splitlines()
    assert line.startswith('foc_ros demo: the node ended with exit code -9: ')


def test_an_unknown_middleware_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_of_nobody')
    assert main(['demo', '--output', str(tmp_path / 'out')]) == 2
    printed, errors = capsys.readouterr()
    assert printed == '' and not (tmp_path / 'out').exists()
    assert errors.startswith('foc_ros demo: RMW_IMPLEMENTATION: expected a middleware that is installed, got rmw_of_nobody: ')
