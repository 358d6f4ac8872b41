# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parts of the demo that need no ROS: recorder, display, the node's process, the output directory."""

import importlib
import io
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bag_helpers import TYPES
from play_helpers import has_ended, until
from report_samples import START_NS, prediction, predictions, samples
from rich.console import Console
from rosbags.highlevel import AnyReader

from foc_ros.cli import demo
from foc_ros.cli.demo import Recorder, describe_lead
from foc_ros.cli.main import main
from foc_ros.core.config import Config
from foc_ros.core.errors import FocError, InputError
from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import LEFT, RIGHT, Status
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import Item
from foc_ros.reporting.live_text import show_live
from foc_ros.reporting.views import build_hand_trajectory, build_snapshot
from foc_ros.ros import isolated_node
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud

STEP_NS = 20_000_000


def send_scene(recorder):
    goals = encode_goals(TYPES, START_NS, 'world', np.array([[0.3, 0.0, 0.1], [0.3, 0.12, 0.1]]))
    cloud = encode_obstacles(TYPES, START_NS, 'world', [(0.15, 0.0, 0.1, 0.03, 0.003, 1)])
    for role, message in (('goals', goals), ('obstacles', cloud)):
        recorder.add_sent(Item(role, f'/{role}', START_NS, message, b''), 0.0)


def send_hand(recorder, number, now):
    stamp_ns = START_NS + number * STEP_NS
    pose = encode_hand_pose(TYPES, stamp_ns, 'world', (0.0, 0.0, 0.1))
    recorder.add_sent(Item('hand_pose', '/hand_pose', stamp_ns, pose, b''), now)


def make(number):
    return prediction(START_NS + number * STEP_NS, np.zeros(2), 0.3 + 0.01 * number)


def filled(count=5, lost=('', 0)):
    """Return a recorder of some predictions; lost: name and number of a message that never comes."""
    recorder = Recorder(Config())
    send_scene(recorder)
    for number in range(count):
        send_hand(recorder, number, now=0.02 * number)
        messages = {
            'prediction': encode_prediction_cloud(make(number), 'xy', TYPES),
            'likelihoods': encode_likelihoods(make(number), TYPES),
        }
        for name in sorted(messages, reverse=number % 2 == 0):  # they arrive in any order
            if (name, number) != lost:
                recorder.add_received(name, messages[name], 0.02 * number + 0.005)
    return recorder


@pytest.mark.parametrize('lost', ['', 'prediction', 'likelihoods'])
def test_recorder_keeps_every_prediction_with_its_scene_also_after_a_loss(lost):
    recorder, kept = filled(6, (lost, 2)), [0, 1, 3, 4, 5] if lost else [*range(6)]
    assert [each.stamp_ns for each in recorder.samples] == [START_NS + n * STEP_NS for n in range(6)]
    assert [each.stamp_ns for each in recorder.snapshots] == [START_NS + n * STEP_NS for n in kept]
    snapshot, expected = recorder.snapshots[-1], build_snapshot(make(5))
    shares = [[(each.label, each.likelihood) for each in view.candidates_with_likelihood] for view in (snapshot, expected)]
    assert shares[0] == shares[1]
    assert snapshot.obstacles.ids == ('1',)
    np.testing.assert_allclose(snapshot.goal_positions, [[0.3, 0.0], [0.3, 0.12]])
    np.testing.assert_allclose(recorder.delays, 0.005)


def shown(recorder, terminal, times):
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=terminal, width=80, height=24)
    items = [Item('goals', '/goals', START_NS + after_ns, None, b'') for after_ns in (0, 5 * NANOSECONDS)]
    with show_live(console) as show:
        for now in times if recorder.snapshots else ():
            show(float(now), recorder.snapshots[-1], recorder.describe(items), recorder.samples[-1].position)
    return screen.getvalue()


def test_without_a_terminal_a_line_is_printed_each_second():
    recorder = filled()
    recorder.health = {'hand_pose rate [Hz]': '99.8', 'prediction rate [Hz]': '49.9'}
    lines = shown(recorder, False, np.arange(0.0, 3.0, 0.01)).splitlines()
    assert len(lines) == 3
    assert lines[0].startswith(' 0.1 of 5.0 s   hand samples 99.8/s, predictions 49.9/s, delay 5 ms')
    assert '56 % goal0: right of 1' in lines[0]
    assert '34 % goal0: left of 1' in lines[0]
    assert '\x1b' not in ''.join(lines)


def test_on_a_terminal_a_table_is_shown():
    text = shown(filled(), True, np.array([0.2]))
    for part in ('likely', 'cost', 'eta', 'A goal0: right of 1', '56 %', 'C goal1: left of 1, right of post', '0.90', 'x 1.15'):
        assert part in text
    assert 'AAAA' in text and 'BBBB' in text and '▒1▒' in text, 'paths have letters, and the obstacle has its number'
    assert '█' in text
    assert '…' not in text and '...  ' not in text


def test_names_that_differ_at_their_end_alone_are_told_apart_on_a_terminal():
    made = make(0)
    compromised = replace(made.candidates[0].solution, status=Status.COMPROMISED)
    made = replace(made, candidates=(replace(made.candidates[0], solution=compromised), *made.candidates[1:]))
    names = ('right of 1, 2, 4, left of 3', 'right of 1, 2, left of 3, 4')
    sides = [tuple(zip('1234', (RIGHT, RIGHT, LEFT, last), strict=True)) for last in (RIGHT, LEFT)]
    changed = [
        replace(each, candidate=replace(each.candidate, sides=one)) for each, one in zip(made.candidates, sides, strict=False)
    ]
    recorder = filled()
    recorder.snapshots[-1] = replace(build_snapshot(made), candidates=tuple(changed))
    text = shown(recorder, True, np.array([0.2]))
    assert all(f'goal0: {words}' in text for words in names)
    assert '0.90*' in text and '* not known to keep the wanted eta' in text


@pytest.mark.parametrize('terminal', [False, True])
def test_nothing_solved_is_shown(terminal):
    recorder = Recorder(Config())
    send_scene(recorder)
    send_hand(recorder, 0, 0.0)
    made = Prediction(START_NS, 'world', 0.1, (), None)
    recorder.add_received('prediction', encode_prediction_cloud(made, 'xy', TYPES), 0.0)
    recorder.add_received('likelihoods', encode_likelihoods(made, TYPES), 0.0)
    assert 'no solved candidate' in shown(recorder, terminal, np.array([1.0]))


def test_output_directory_is_made_an_earlier_demo_is_replaced_and_other_contents_are_refused(tmp_path):
    output = tmp_path / 'new' / 'demo_output'
    with demo.prepare(output), pytest.raises(InputError, match='--output: expected the directory of a demo that has ended'):
        demo.prepare(output).__enter__()
    for name in ('bag', 'report'):
        (output / name).mkdir()
        (output / name / 'old').write_text('')
    (output / 'notes.txt').write_text('mine')
    with demo.prepare(output):
        assert {file.name for file in output.iterdir()} == {demo.MARK, 'notes.txt'}
    (tmp_path / 'other' / 'bag').mkdir(parents=True)
    (tmp_path / 'file').write_text('mine')
    for other in ('other', 'file'):
        with pytest.raises(InputError, match='--output'):
            demo.prepare(tmp_path / other).__enter__()
    assert (tmp_path / 'other' / 'bag').exists() and (tmp_path / 'file').read_text() == 'mine'


def test_without_rclpy_one_line_says_how_to_install_it(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr('foc_ros.cli.commands.find_spec', lambda name: None)
    assert main(['demo', '--output', str(tmp_path / 'out')]) == 2
    error = capsys.readouterr().err
    assert error.count('\n') == 1
    assert 'make setup' in error
    assert not (tmp_path / 'out').exists()


def test_the_lead_of_the_goal_that_was_reached_is_described():
    made = samples(1)
    snapshots = [build_snapshot(each) for each in predictions(made)]
    words = describe_lead(build_hand_trajectory(made), snapshots)
    # the most likely candidate always leads to goal0, where the hand arrives
    assert words.startswith(
        f'{len(snapshots)} predictions were made. The hand moved to a goal once, for 0.8 s; this goal was the most '
    )
    assert 'most likely one from 0.8 s before the arrival' in words
    others = [replace(each, candidates=each.candidates[::-1]) for each in snapshots]
    assert 'from 0.0 s before the arrival' in describe_lead(build_hand_trajectory(made), others)
    assert describe_lead(build_hand_trajectory(made[:5]), snapshots).endswith('no movement ended at a goal.')


def test_a_domain_in_use_is_not_taken(monkeypatch):
    monkeypatch.setattr(isolated_node, 'DOMAINS', range(200, 203))
    with isolated_node.reserve_domain() as reserved, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        with isolated_node.reserve_domain() as other:
            pass
        participant.bind(('', 7400 + 250 * other + 12))
        with isolated_node.reserve_domain() as last:
            assert {reserved, other, last} == {200, 201, 202}
            with pytest.raises(FocError, match='each of the 3 domains'), isolated_node.reserve_domain():
                pass


@pytest.mark.skipif(sys.platform != 'linux', reason='only Linux ends a child with its parent')
def test_the_node_does_not_outlive_a_killed_demo(tmp_path):
    package = tmp_path / 'stand_in' / 'foc_ros'
    package.mkdir(parents=True)
    (package / '__init__.py').touch()
    (package / '__main__.py').write_text('import time; time.sleep(60)')
    demo = f"""
import os, sys, time
sys.path.insert(0, {str(ROOT)!r})
from pathlib import Path
from foc_ros.ros.isolated_node import NodeProcess
os.chdir({str(package.parent)!r})
os.environ['PYTHONPATH'] = {str(package.parent)!r}
with NodeProcess(Path({str(tmp_path / 'log.txt')!r})) as node:
    print(node.pid, flush=True)
    time.sleep(60)
"""
    with subprocess.Popen([sys.executable, '-c', demo], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        assert not has_ended(pid)
        process.send_signal(signal.SIGKILL)
    until(lambda: has_ended(pid), 'the end of the node', 20.0)


ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))
script = importlib.import_module('recordings')


def read(file):
    with AnyReader([file]) as reader:
        return [(each.topic, log_ns, reader.deserialize(raw, each.msgtype)) for each, log_ns, raw in reader.messages()]


def positions(messages):
    return [[m.pose.position.x, m.pose.position.y, m.pose.position.z] for topic, _, m in messages if topic == '/hand_pose']


def test_the_packaged_recording_and_the_example_tables_equal_those_of_the_script(tmp_path):
    script.write_recording(tmp_path / 'fresh.mcap')
    fresh, packaged = read(tmp_path / 'fresh.mcap'), read(ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap')
    assert [item[:2] for item in fresh] == [item[:2] for item in packaged]
    np.testing.assert_allclose(positions(fresh), positions(packaged), rtol=0, atol=1e-6)
    for (topic, _, made), (_, _, kept) in zip(fresh, packaged, strict=True):
        assert repr(made.header) == repr(kept.header) if topic == '/hand_pose' else repr(made) == repr(kept)
    (tmp_path / 'tables').mkdir()
    script.write_tables(tmp_path / 'tables')
    for file in (tmp_path / 'tables').iterdir():
        assert file.read_bytes() == (ROOT / 'doc' / 'examples' / file.name).read_bytes(), file.name
