# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node and a substitute for a teleoperation stack, in two processes: engagement, handover, stale input, recovery."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ros_required  # noqa: F401
from rcl_interfaces.srv import SetParameters
from ros_helpers import Graph
from std_srvs.srv import SetBool

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / 'doc' / 'examples' / 'teleoperation_loop.py'
NODE = ['-m', 'foc_ros.ros.main', '--ros-args', '-r', 'hand_pose:=MTMR/measured_cp', '-p', 'scene.timeout_s:=0.5']
QUICK = ['-p', 'foc.steps:=20', '-p', 'homotopy.max_candidates:=2', '-p', 'rate_hz:=20.0']


@contextmanager
def running(ros: Graph, *command: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, *command], cwd=ROOT, env=ros.environment, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()


def set_obstacles(ros: Graph, client: Any, on: bool) -> None:
    from rclpy.parameter import Parameter

    request = SetParameters.Request(parameters=[Parameter('obstacles', value=on).to_parameter_msg()])
    assert ros.call(client, SetParameters, 'teleoperation/set_parameters', request).results[0].successful


def test_the_loop_is_engaged_handed_over_stale_and_recovered(ros: Graph) -> None:
    from diagnostic_msgs.msg import DiagnosticArray
    from std_msgs.msg import Float64

    client = ros.node('client')
    shares = ros.collect(client, Float64, 'teleoperation/share')
    health = ros.collect(client, DiagnosticArray, '/diagnostics')

    def share_is(high: bool, what: str) -> None:
        shares.clear()
        ros.spin_until(lambda: bool(shares) and (shares[-1].data > 0.05) == high, what, 40.0)

    def told(words: str) -> None:
        health.clear()
        ros.spin_until(lambda: bool(health) and words in health[-1].status[0].message, words)

    with running(ros, *NODE, *QUICK) as node, running(ros, str(EXAMPLE)) as stack:
        share_is(True, 'the operator is helped')
        ros.call(client, SetBool, 'foc/engage', SetBool.Request(data=False))
        share_is(False, 'the operator has the hand alone: disengaged')
        told('disengaged')
        ros.call(client, SetBool, 'foc/engage', SetBool.Request(data=True))
        share_is(True, 'the operator is helped again')
        set_obstacles(ros, client, on=False)
        share_is(False, 'the operator has the hand alone: the scene is stale')
        told('obstacles')
        assert health[-1].status[0].level == b'\x01'
        set_obstacles(ros, client, on=True)
        share_is(True, 'recovered')
        for process in (stack, node):
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=30)
            assert process.returncode == 0, errors
            assert 'Traceback' not in errors
