# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Extreme scenes and faults of a robot cell in a running node; and that it publishes what a replay predicts, to the last bit."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ros_required  # noqa: F401
import numpy as np
import pytest
from bag_helpers import CONFIG, messages, write_bag
from bag_helpers import TYPES as BAG_TYPES
from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped
from node_helpers import CROWD, GOALS, OK, ROWS, TYPES, WARN, Bench, begin, figures, hand_path, list_labels, stamps
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock

from foc_ros.analysis.replay import Replay
from foc_ros.core.classes.library import is_same_recording
from foc_ros.core.config import Config, flatten, replace_values
from foc_ros.core.solution import Status
from foc_ros.io.bags import BagReader
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.node import DRAWN_S

ROOT = Path(__file__).parents[1]
TAKING_PART = tuple(f'{status.value}, likelihood ' for status in Status if status.has_likelihood)
RING = [(0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.0, 0.02) for angle in np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)]


@dataclass
class Case:
    """A scene; the least and largest number of candidates; level and text of the diagnostics."""

    rows: list[tuple[float, ...]]
    candidates: tuple[int, int]
    level: bytes
    words: str
    goals: list[tuple[float, ...]] = field(default_factory=lambda: list(GOALS))
    parameters: dict[str, Any] = field(default_factory=dict)


OUT_OF_REACH = {'foc.eta': 0.999, 'foc.noise_x': 1.0, 'foc.noise_y': 1.0}
CASES = {
    'empty scene': Case([], (1, 1), OK, 'predicting'),
    'hand just inside an obstacle': Case([(0.0, 0.028, 0.0, 0.03)], (1, 2), WARN, 'scene_hand_inside 1'),
    'one goal of two inside': Case([(0.3, 0.01, 0.0, 0.03)], (2, 4), OK, 'predicting', goals=[(0.3, 0.0, 0.0), (0.0, 0.3, 0.0)]),
    'no way through': Case(RING, (0, 0), WARN, 'predict_nothing_solved 1; scene_no_way 1'),
    'ten thousand obstacles': Case(CROWD, (1, 2), OK, 'predicting'),
    'eta out of reach': Case(ROWS, (1, 4), OK, 'predicting', parameters=OUT_OF_REACH),
    'eta out of reach, and a condition': Case(
        ROWS, (0, 0), WARN, 'predict_nothing_solved 1', parameters=OUT_OF_REACH | {'likelihood.shortfall': math.inf}
    ),
    'hand at its goal': Case([(0.15, 0.0, 0.0, 0.03)], (1, 1), OK, 'predicting', goals=[(0.0, 0.0, 0.0)]),
}


@pytest.mark.parametrize('name', CASES)
def test_the_outputs_and_the_level_of_an_extreme_scene(ros, name):
    case = CASES[name]
    bench = Bench(ros, **case.parameters)
    bench.publish_scene(case.rows, case.goals)
    bench.health()
    (pose,) = hand_path(1)
    bench.move([pose])
    (table,), (path,), (cloud_out,) = (bench.wait_for(each, 1) for each in ('likelihoods', 'path', 'prediction'))
    count = len(list_labels(table))
    fewest, most = case.candidates
    assert fewest <= count <= most
    assert cloud_out.width == count * 21
    assert len(path.poses) == (21 if count else 0)
    assert stamps([cloud_out, path]) == stamps([pose]) * 2
    rows = np.array(table.data).reshape(-1, 4)
    assert len(rows) - count in (0, 1, 2), 'the last rows are the shares that no candidate has'
    assert np.isfinite(rows[:count]).all()
    assert (rows[:, 0] >= 0.0).all() and rows[:, 0].sum() == pytest.approx(1.0)
    assert count or rows[:, 0].tolist() == [1.0], 'where nothing is solved, all is unknown'
    status = bench.health()
    assert (status.level, status.message) == (case.level, case.words)
    told = [value for key, value in figures(status).items() if key.startswith('candidate ')]
    assert len([value for value in told if value.startswith(TAKING_PART)]) == count
    solved = [value for value in told if value.startswith('solved')]
    assert (rows[:, 3] >= bench.node.pipeline.config.foc.eta - 1e-5).sum() >= len(solved)


def test_goals_and_frames_that_change_with_every_pose(ros):
    bench, poses = begin(ros), hand_path(20)
    for i, pose in enumerate(poses):
        bench.deliver('goals', pose_array(TYPES, [(0.3, 0.02 * (j - i % 3), 0.0) for j in range(1 + i % 3)]))
        bench.move([pose])
    assert stamps(bench.wait_for('prediction', 10)) == stamps(poses)[::2]
    assert bench.health().level == OK
    poses = hand_path(8, start_s=10.2)
    for i, pose in enumerate(poses):
        pose.header.frame_id = 'camera' if i % 2 else 'world'
    bench.move(poses)
    status = bench.health()
    assert (status.level, figures(status)['count hand_wrong_frame']) == (WARN, '4')
    assert stamps(bench.wait_for('prediction', 14))[10:] == stamps(poses)[::2]
    bench.deliver('goals', pose_array(TYPES, []))
    bench.move(hand_path(1, start_s=10.5))
    status = bench.health()
    assert (status.level, status.message) == (WARN, 'no prediction: no goal: the last goals message was empty')
    assert len(bench.received['prediction']) == 14


def test_a_clock_that_jumps_forward_and_back(ros):
    """A simulation is restarted twice: predictions are made from poses stamped with its time only."""
    bench = begin(ros, outputs=['prediction'], use_sim_time=True, estimator__hand_timeout_s=60.0)
    clock = bench.player.create_publisher(Clock, '/clock', 10)

    def now(seconds):
        message = Clock(clock=pose_stamped(TYPES, (0, 0, 0), round(seconds * SECOND)).header.stamp)
        clock.publish(message)
        ros.spin_until(lambda: bench.node.get_clock().now().nanoseconds == round(seconds * SECOND), f'clock at {seconds} s')

    ros.spin_until(lambda: clock.get_subscription_count() > 0, 'the clock is heard')
    for turn, start_s in enumerate((10.0, 500.0, 10.0)):
        now(start_s)
        bench.move(hand_path(2, start_s=start_s))
        assert stamps(bench.wait_for('prediction', turn + 1))[-1] == round(start_s * SECOND)
        status = bench.health()
        assert status.level == (WARN if turn else OK), status.message
    now(300.0)
    bench.move(hand_path(4, start_s=10.1))
    status = bench.health()
    assert (status.level, len(bench.received['prediction'])) == (WARN, 3)
    assert 'the hand pose is 290 s older than the time of the node' in status.message


def test_several_nodes_of_one_process_are_independent(ros):
    benches = [Bench(ros, namespace=name, outputs=['prediction']) for name in ('left', 'right', 'third')]
    for i, bench in enumerate(benches):
        bench.publish_scene(rows=ROWS[:1] * (i > 0))
    for pose in hand_path(4):
        for bench in benches:
            bench.deliver('hand_pose', pose)
    for i, bench in enumerate(benches):
        assert len(bench.wait_for('prediction', 2)) == 2
        status = bench.health()
        assert status.name == f'{bench.node.get_namespace()[1:]}/foc: prediction'
        assert (status.level, figures(status)['obstacles of cloud']) == (OK, str(int(i > 0)))


@pytest.mark.parametrize(('name', 'strategy'), [('64 on the hand', 'lv'), ('N = 400', 'hc'), ('64 goals x 64', 'lv')])
def test_the_node_keeps_its_promises_in_a_hostile_scene(ros, monkeypatch, name, strategy):
    """The script `stress.py` judges times too; a machine that runs other tests meanwhile cannot."""
    monkeypatch.syspath_prepend(ROOT / 'scripts')
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros.domain))
    import stress

    row = stress.measure_case(stress.CASES[name], strategy, 3.0)
    assert row['errors'] == 0
    assert row['made'] > 0
    assert row['age [s]'] <= Config().estimator.hand_timeout_s, 'of a published prediction'
    assert row['answer [s]'] < row['gap [s]'], 'a service is answered between two diagnostics'


SECONDS = 0.2
LV = replace_values(Config(), {'foc.eta': 0.3, 'foc.steps': 20, 'foc.noise_x': 0.02, 'foc.noise_y': 0.02})
LEARNING = {'experience.learning': 'online', 'rate_hz': 10.0, 'foc.steps': 20, 'homotopy.max_candidates': 2}
NO_LIMITS = {'scene.timeout_s': 0.0, 'estimator.hand_timeout_s': 0.0, 'budget_s': 0.0}


def messages_in_space():
    """Return a reach that goes down to a goal, over a low obstacle and past one of any height."""
    columns = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'size_z')]
    scene = obstacle_table([(0.15, 0.0, 0.02, 0.03, 0.04), (0.2, 0.02, 0.0, 0.02, 0.0)], columns)
    found = []
    for topic, stamp_ns, message in messages(SECONDS):
        if topic == '/obstacles':
            message = cloud(BAG_TYPES, scene, stamp_ns)
        elif topic == '/goals':
            message = pose_array(BAG_TYPES, [(0.3, 0.0, 0.2)])
        else:
            message.pose.position.z = 0.4 - 0.5 * message.pose.position.x
        found.append((topic, stamp_ns, message))
    return found


def messages_with_a_refused_pose():
    """Return a reach whose goals arrive after some poses, and before one that is sent again."""
    found = [each for each in messages(SECONDS) if each[0] != '/goals']
    row = [topic for topic, *_ in found].index('/hand_pose') + 2
    topic, stamp_ns, pose = found[row]
    goals = pose_array(BAG_TYPES, GOALS)
    return [*found[: row + 1], ('/goals', stamp_ns + 1, goals), (topic, stamp_ns + 2, pose), *found[row + 1 :]]


REPLAY_CASES = {
    'lv': (LV, lambda: messages(SECONDS)),
    'heights': (CONFIG, messages_in_space),
    'refused pose': (CONFIG, messages_with_a_refused_pose),
    '1 kHz': (CONFIG, lambda: messages(0.1, rate_hz=1000.0)),
    'learning': (replace_values(Config(), LEARNING), lambda: messages(1.0)),
}
"""Parameters, and the messages of a recording."""


def sent(message):
    """Return the message after serialisation, with its float32 fields rounded."""
    return deserialize_message(serialize_message(message), type(message))


@pytest.mark.parametrize('case', REPLAY_CASES)
def test_the_node_publishes_what_replay_computes(ros, tmp_path, case):
    config, make_messages = REPLAY_CASES[case]
    config = replace_values(config, NO_LIMITS)
    bench, replay, expected = Bench(ros, **flatten(config)), Replay(config), []
    with BagReader(write_bag(tmp_path / 'reach', make_messages())) as reader:
        for step in replay.steps(reader):
            bench.deliver(step.item.role, bytes(step.item.raw))
            if step.prediction is not None:
                expected.append(encode_outputs(step.prediction, 'xy', TYPES))
    count = len(expected)
    assert count > 3
    assert max(each['prediction'].width for each in expected) == 2 * (config.foc.steps + 1)
    for name in ('prediction', 'path'):
        assert bench.wait_for(name, count) == [sent(each[name]) for each in expected]
    drawn, last_ns = [], -SECOND
    for each, stamp_ns in zip(expected, stamps([each['path'] for each in expected]), strict=True):
        if stamp_ns - last_ns >= DRAWN_S * SECOND:
            drawn.append(sent(each['markers']))
            last_ns = stamp_ns
    assert bench.wait_for('markers', len(drawn)) == drawn
    for received, each in zip(bench.wait_for('likelihoods', count), expected, strict=True):
        assert received.layout == sent(each['likelihoods']).layout
        assert np.array_equal(received.data, each['likelihoods'].data, equal_nan=True)  # of shares without a candidate
    skipped = figures(bench.health()).get('count hand_skipped', '0')
    assert skipped == str(replay.intake.counts.get('hand_skipped', 0))
    assert (skipped != '0') == (case == '1 kHz')
    live, learnt = (each.learnt.movements.finish().learnt for each in (bench.node.pipeline, replay.pipeline))
    assert (len(live) > 0) == (case == 'learning')
    assert all(is_same_recording(*each) for each in zip(live, learnt, strict=True))
