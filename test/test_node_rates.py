# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Inputs at high rates, in real time, to a node in its own process: its outputs and the level of its diagnostics."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import ros_required  # noqa: F401
import pytest
from message_helpers import SECOND, cloud, obstacle_table, pose_stamped
from node_helpers import CROWD, TYPES, figures
from process_helpers import Player, ended, parameters, running
from ros_helpers import Graph

OK, WARN = b'\x00', b'\x01'
LIGHT = ['foc.steps:=20', 'homotopy.max_candidates:=1', 'rate_hz:=10.0', 'scene.timeout_s:=0.0', 'estimator.hand_timeout_s:=10.0']
RELIABLE = [f'qos_overrides./{name}.subscription.reliability:=reliable' for name in ('hand_pose', 'obstacles')]
UNTIMED = 'budget_s:=0.0'
"""While 500,000 rows are decoded a second, a prediction on two busy cores may miss its budget."""


@pytest.fixture
def player(ros: Graph) -> Iterator[Player]:
    """Yield the player of a node that knows the scene, and stop the node; its text on standard error is `errors`."""
    made = Player(ros)
    with running(ros, *parameters(*LIGHT, *RELIABLE, UNTIMED)) as process:
        made.connect()
        made.publish_scene()
        ros.spin_until(made.is_scene_known, 'the scene')
        made.stop = lambda: ended(process)
        yield made


def check(player: Player, least: int) -> None:
    """Stop the node, and check that it took every pose, predicted often enough, and complained of nothing."""
    player.ros.spin_until(lambda: player.figure('hand_pose refused') == f'0 of {player.sent}', 'all poses in the diagnostics')
    assert player.stop()[0] == 0
    stamps = [each.header.stamp.sec * SECOND + each.header.stamp.nanosec for each in player.predictions]
    assert stamps == sorted(set(stamps))
    assert len(stamps) + int(player.figure('dropped cycles') or 0) >= least
    assert player.figure('count internal_errors') is None
    told = [each for each in player.statuses if 'count predictions' in figures(each)]
    assert told
    # a slow machine may drop cycles
    assert [each.message for each in told if not re.fullmatch(r'predicting|hand_superseded \d+', each.message)] == []


def test_ten_thousand_obstacles_at_50_hz(player: Player) -> None:
    """Every pose is received, predictions are made from the newest, and the level is OK."""
    flood = cloud(TYPES, obstacle_table(CROWD), 10 * SECOND)
    player.play_in_time(3.0, 100.0, lambda i: i % 2 or player.publishers['obstacles'].publish(flood))
    check(player, 6)
    assert len(player.predictions) > 5
    assert player.figure('obstacles of cloud') == '10000'
    assert int(player.figure('note culled') or 0) > 9000


def test_poses_at_1_khz(player: Player) -> None:
    player.play_in_time(2.0, 1000.0)
    assert player.sent == 2000
    check(player, 15)


def test_bad_poses_at_1_khz_write_few_lines_to_the_log(player: Player) -> None:
    nowhere: Any = pose_stamped(TYPES, (float('nan'), 0.0, 0.0), 10 * SECOND)
    player.play_in_time(2.0, 0.0, lambda _: [player.publishers['hand_pose'].publish(nowhere) for _ in range(10)])
    player.ros.spin_until(lambda: player.figure('hand_pose refused') == '2000 of 2000', 'all poses in the diagnostics')
    code, errors = player.stop()
    lines = [line for line in errors.splitlines() if 'expected a finite number' in line]
    assert code == 0 and 1 <= len(lines) <= 5, f'{len(lines)} lines'
    assert '(1 of 1 refused so far)' in lines[0]
    assert WARN in {each.level for each in player.statuses}
    assert player.predictions == []
