# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo end to end: the real node in its own process receives the first seconds of the packaged recording over DDS."""

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import ros_required  # noqa: F401
import pytest
from play_helpers import has_ended, until
from rosbags.highlevel import AnyReader

from foc_ros.cli.main import main

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

ROOT = Path(__file__).resolve().parents[1]
LAST_S = 2.0
OUTPUTS = ('/foc/prediction', '/foc/likelihoods', '/foc/path', '/foc/markers')
STARTED = 'demo with the node in process '


def counted(bag):
    """Return how many messages of each topic can be read and decoded."""
    with AnyReader([bag]) as reader:
        found: Counter[str] = Counter()
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
            found[connection.topic] += 1
        assert found.total() == reader.message_count
    return found


def read_stamps(bag, topic):
    with AnyReader([bag]) as reader:
        chosen = [each for each in reader.connections if each.topic == topic]
        stamps = [reader.deserialize(raw, each.msgtype).header.stamp for each, _, raw in reader.messages(chosen)]
    return [stamp.sec * 10**9 + stamp.nanosec for stamp in stamps]


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
    found = counted(tmp_path / 'out' / 'bag')
    assert (found['/hand_pose'], found['/obstacles'], found['/goals']) == (201, 11, 3)
    assert found['/foc/prediction'] > 0
    assert {found[topic] for topic in OUTPUTS if topic != '/foc/markers'} == {found['/foc/prediction']}
    assert 0 < found['/foc/markers'] <= found['/foc/prediction']
    sent, made = (read_stamps(tmp_path / 'out' / 'bag', topic) for topic in ('/hand_pose', '/foc/prediction'))
    assert set(made) <= set(sent) and made == sorted(set(made)), 'the live predictions are those of the recording'
    numbers = json.loads((tmp_path / 'out' / 'report' / 'predictions.json').read_text(encoding='utf-8'))
    assert len(numbers['predictions']) == found['/foc/prediction']
    assert all(each['candidates'] or each['unsolved'] is not None for each in numbers['predictions'])
    assert any(each['candidates'] for each in numbers['predictions'])
    page = (tmp_path / 'out' / 'report' / 'index.html').read_text(encoding='utf-8')
    assert 'id="scene"' in page and '"frames"' in page, 'the page draws by itself what the pictures beside it show'
    assert (tmp_path / 'out' / 'report' / 'overview.png').read_bytes().startswith(b'\x89PNG')


def start(output):
    """Start a demo as a process and return it with the process id of its node once the recording plays."""
    program = f"""
import sys
from pathlib import Path
from foc_ros.cli import demo
from foc_ros.ros import isolated_node
entered = isolated_node.NodeProcess.__enter__
def enter(self):
    node = entered(self)
    print({STARTED!r} + str(node.pid), flush=True)
    return node
isolated_node.NodeProcess.__enter__ = enter
sys.exit(demo.perform(Path({str(output)!r})))
"""
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    demo = subprocess.Popen([sys.executable, '-u', '-c', program], cwd=ROOT, **pipes)
    assert demo.stdout is not None
    pid = 0
    for line in demo.stdout:
        if line.startswith(STARTED):
            pid = int(line.removeprefix(STARTED))
        if ' of 20.' in line:
            return demo, pid
    demo.kill()
    raise AssertionError(f'the demo never played: {demo.communicate()}')


def test_an_interrupt_ends_it_cleanly(tmp_path):
    demo, node = start(tmp_path / 'out')
    demo.send_signal(signal.SIGINT)
    printed, errors = demo.communicate(timeout=60)
    assert (demo.returncode, errors) == (130, '')
    assert printed.splitlines()[-1].startswith('interrupted')
    until(lambda: has_ended(node), 'the end of the node', 10.0)
    assert counted(tmp_path / 'out' / 'bag')['/hand_pose'] > 0
    assert not (tmp_path / 'out' / 'report').exists()


def test_a_node_that_dies_is_told(tmp_path):
    demo, node = start(tmp_path / 'out')
    os.kill(node, signal.SIGKILL)
    _, errors = demo.communicate(timeout=60)
    assert demo.returncode == 1
    (line,) = errors.splitlines()
    assert line.startswith('foc_ros demo: the node ended with exit code -9: ')


def test_an_unknown_middleware_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_of_nobody')
    assert main(['demo', '--output', str(tmp_path / 'out')]) == 2
    printed, errors = capsys.readouterr()
    assert printed == '' and not (tmp_path / 'out').exists()
    assert errors.startswith('foc_ros demo: RMW_IMPLEMENTATION: expected a middleware that is installed, got rmw_of_nobody: ')
