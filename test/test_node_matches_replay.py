# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node in its own process publishes the predictions of a replay when a bag's raw messages are sent over DDS."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from bag_helpers import CONFIG, TYPES, messages, write_bag, write_parameters  # noqa: E402
from message_helpers import cloud, obstacle_table, pose_array  # noqa: E402
from process_helpers import Player, ended, parameters, running  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.analysis.replay import Replay  # noqa: E402
from foc_ros.core.config import Config, replace_values  # noqa: E402
from foc_ros.io.bags import BagReader, Item  # noqa: E402
from foc_ros.ros.messages.encode_prediction import encode_outputs  # noqa: E402

SECONDS = 0.3
LV = replace_values(Config(), {'foc.eta': 0.3, 'foc.steps': 30, 'foc.noise_x': 0.02, 'foc.noise_y': 0.02})
NO_LIMITS = 'scene.timeout_s:=0.0', 'estimator.hand_timeout_s:=0.0', 'budget_s:=0.0'
RELIABLE = [f'qos_overrides./{name}.subscription.reliability:=reliable' for name in ('hand_pose', 'obstacles')]
EXACT = ('candidate', 'compromised', 'goal', 'way')


def messages_in_space() -> list[tuple[str, int, Any]]:
    """Return a reach that goes down to a goal, over a low obstacle and past one of any height."""
    columns = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'size_z')]
    scene = obstacle_table([(0.15, 0.0, 0.02, 0.03, 0.04), (0.2, 0.02, 0.0, 0.02, 0.0)], columns)
    found = []
    for topic, stamp_ns, message in messages(SECONDS):
        if topic == '/obstacles':
            message = cloud(TYPES, scene, stamp_ns)
        elif topic == '/goals':
            message = pose_array(TYPES, [(0.3, 0.0, 0.2)])
        else:
            message.pose.position.z = 0.4 - 0.5 * message.pose.position.x
        found.append((topic, stamp_ns, message))
    return found


CASES = {
    'lv': (LV, lambda: messages(SECONDS)),
    'heights': (CONFIG, messages_in_space),
    '1 kHz': (CONFIG, lambda: messages(0.1, rate_hz=1000.0)),
}
"""Parameters, and the messages of a recording."""


def play(ros: Graph, items: list[Item], due: set[int], file: str) -> Player:
    """Publish the raw messages, the scene first, to a node with a parameter file; return what the player heard.

    due: log times of the poses that are due. The next message is sent after their predictions, so that a slow machine is slower
    and drops nothing.
    """
    player, arguments = Player(ros), ('--ros-args', '--params-file', file, *parameters(*RELIABLE, *NO_LIMITS))
    command = [sys.executable, '-m', 'foc_ros', 'node']
    with running(ros, *arguments, command=command) as process:
        player.connect()
        first = next(place for place, item in enumerate(items) if item.role == 'hand_pose')
        for item in items[:first]:
            player.publishers[item.role].publish(bytes(item.raw))
        ros.spin_until(player.is_scene_known, 'the node to know the scene')
        for item in items[first:]:
            player.publishers[item.role].publish(bytes(item.raw))
            if item.role == 'hand_pose' and item.log_ns in due:
                wanted = len(player.predictions) + 1
                heard = lambda wanted=wanted: len(player.predictions) >= wanted <= len(player.likelihoods)  # noqa: E731
                ros.spin_until(heard, f'prediction {wanted}')
        poses = sum(item.role == 'hand_pose' for item in items)
        ros.spin_until(lambda: player.figure('hand_pose refused') == f'0 of {poses}', 'every pose in the diagnostics')
        code, errors = ended(process)
    assert code == 0, errors
    return player


def replayed(bag: Path, config: Config) -> tuple[dict[int, dict[str, Any]], dict[str, int]]:
    """Return the messages of each prediction of a replay, by the log time of its pose, and the counts."""
    replay = Replay(config)
    with BagReader(bag) as reader:
        found = {
            step.item.log_ns: encode_outputs(step.prediction, step.scene.obstacles(step.prediction.stamp_ns), 'xy', TYPES)
            for step in replay.steps(reader)
            if step.prediction is not None
        }
    return found, replay.intake.counts


def table(cloud: Any) -> np.ndarray:
    kind = np.dtype([(field.name, {7: '<f4', 6: '<u4'}[field.datatype]) for field in cloud.fields])
    return np.frombuffer(bytes(cloud.data), dtype=kind)


@pytest.mark.parametrize('case', CASES)
def test_the_node_publishes_what_replay_computes(ros: Graph, tmp_path: Path, case: str) -> None:
    config, make_messages = CASES[case]
    bag = write_bag(tmp_path / 'reach', make_messages())
    with BagReader(bag) as reader:
        items = list(reader)
    expected, counts = replayed(bag, config)
    player = play(ros, items, set(expected), write_parameters(tmp_path, config))
    assert len(player.predictions) == len(player.likelihoods) == len(expected) > 3
    assert (player.figure('count hand_skipped') or '0') == str(counts.get('hand_skipped', 0))
    assert max(len(table(each['prediction'])) for each in expected.values()) == 2 * (config.foc.steps + 1)
    for answer, likelihood, both in zip(player.predictions, player.likelihoods, expected.values(), strict=True):
        header, wanted = answer.header, both['prediction'].header
        assert (header.stamp.sec, header.stamp.nanosec) == (wanted.stamp.sec, wanted.stamp.nanosec)
        assert header.frame_id == wanted.frame_id
        labels = [dimension.label for dimension in both['likelihoods'].layout.dim]
        assert [dimension.label for dimension in likelihood.layout.dim] == labels
        assert np.allclose(likelihood.data, both['likelihoods'].data, rtol=1e-9, atol=1e-9, equal_nan=True)
        live, computed = table(answer), table(both['prediction'])
        assert live.dtype == computed.dtype
        for name in live.dtype.names or ():
            rtol, atol = (0.0, 0.0) if name in EXACT else (1e-4, 1e-6 if name in ('x', 'y', 'z', 't', 'likelihood') else 1e-9)
            assert np.allclose(live[name], computed[name], rtol=rtol, atol=atol), name


def test_the_case_with_heights_has_heights(tmp_path: Path) -> None:
    """The low obstacle, number 0, is cleared, and the height and its variance change along the path."""
    bag = write_bag(tmp_path / 'reach', messages_in_space())
    found, _ = replayed(bag, CONFIG)
    flat, _ = replayed(bag, replace_values(CONFIG, {'predict_height': False}))
    for answers, is_named in ((found, False), (flat, True)):
        labels = [each['likelihoods'].layout.dim[0].label for each in answers.values()]
        assert labels and all(('+0' in label or '-0' in label) == is_named for label in labels)
    for each in found.values():
        rows = table(each['prediction'])
        assert np.ptp(rows['z']) > 0.1 and np.ptp(rows['vz']) > 0.1 and np.ptp(rows['zz']) > 1e-5
