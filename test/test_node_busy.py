# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A prediction that takes long: everything else is answered meanwhile, and nothing that is old or unwanted is published."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
import ros_helpers

ros_helpers.require_ros()

from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState  # noqa: E402
from message_helpers import cloud, marker, marker_array, obstacle_table, pose_array  # noqa: E402
from node_helpers import GOALS, ROWS, TYPES, Bench, figures, hand_path, list_labels  # noqa: E402
from ros_helpers import Graph  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from test_node_faults import set_on  # noqa: E402

from foc_ros.core import pipeline as computation  # noqa: E402
from foc_ros.core.deadline import Deadline  # noqa: E402
from foc_ros.ros import health  # noqa: E402

OK, WARN = b'\x00', b'\x01'


class Gate:
    """In place of `predict`: waits until it is opened, then predicts. Attributes: deadlines, of the calls."""

    def __init__(self) -> None:
        self.deadlines: list[Any] = []
        self._real, self._open = computation.predict, threading.Event()

    def __call__(self, *arguments: Any) -> Any:
        self.deadlines.append(next(each for each in arguments if isinstance(each, Deadline)))
        assert self._open.wait(60.0)
        return self._real(*arguments)

    def open(self) -> None:
        self._open.set()


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    made = Gate()
    monkeypatch.setattr(computation, 'predict', made)
    yield made
    made.open()


def begin(bench: Bench) -> list[Any]:
    """Let the node begin a prediction; return the poses after the one from which it predicts."""
    bench.publish_scene()
    first, *others = hand_path(20)
    bench.send('hand_pose', first)
    bench.ros.spin_until(lambda: bench.node.is_busy, 'the begin of a prediction')
    return others


def take(bench: Bench, poses: list[Any]) -> None:
    """Publish poses, and spin until the node has taken them."""
    entry = bench.node._freshness.inputs['hand_pose']
    wanted = entry.received + len(poses)
    bench.send('hand_pose', *poses)
    bench.ros.spin_until(lambda: entry.received >= wanted, 'the poses')


def end(bench: Bench, gate: Gate) -> None:
    gate.open()
    bench.ros.spin_until(lambda: not bench.node.is_busy, 'the end of the prediction')
    bench.ros.spin_for(0.1)


def test_services_and_diagnostics_answer_during_a_prediction(ros: Graph, gate: Gate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(health, 'BUSY_S', 0.0)
    bench = Bench(ros, parameters={'estimator.hand_timeout_s': 60.0})
    poses = begin(bench)
    assert ros.call(bench.player, SetBool, 'foc/engage', SetBool.Request(data=True)).success
    take(bench, poses)
    status = bench.health()
    assert bench.node.is_busy and not bench.received['prediction']
    assert status.level == WARN
    assert status.message.startswith('busy: a prediction has been computed for ')
    assert figures(status)['hand_pose refused'] == f'0 of {len(poses) + 1}'
    end(bench, gate)
    stamps = [each.header.stamp for each in bench.wait_for('prediction', 2)]
    assert stamps == [hand_path(1)[0].header.stamp, poses[-1].header.stamp], 'the next one is made from the newest pose'


def test_poses_in_the_queue_are_no_silence(ros: Graph) -> None:
    """Whatever kept the node from taking its messages, its diagnostics do not blame the hand."""
    bench = Bench(ros, parameters={'estimator.hand_timeout_s': 0.3})
    bench.publish_scene()
    first, second = hand_path(2)
    bench.move([first])
    ros.spin_for(0.4)
    assert 'hand_pose silent' in bench.health().message
    bench.send('hand_pose', second)
    bench.node._publish_health()
    ros.spin_until(lambda: len(bench.diagnostics) > 1, 'diagnostics')
    assert 'silent' not in bench.diagnostics[-1].status[0].message


def test_a_prediction_that_is_too_old_at_its_end_is_withheld(ros: Graph, gate: Gate) -> None:
    bench = Bench(ros, parameters={'estimator.hand_timeout_s': 0.3})
    poses = begin(bench)
    ros.spin_for(0.4)
    take(bench, poses[:1])
    end(bench, gate)
    status = bench.health()
    assert not bench.received['prediction']
    assert (status.level, figures(status)['count predict_too_late']) == (WARN, '1')
    assert 'busy: the last prediction took until its hand pose was ' in status.message
    assert 'silent' not in status.message
    bench.move(poses[1:4])
    bench.wait_for('prediction', 1)
    assert bench.health().level == OK


def change(bench: Bench, *labels: str) -> None:
    for label in labels:
        request = ChangeState.Request(transition=Transition(label=label))
        assert bench.ros.call(bench.player, ChangeState, 'foc/change_state', request).success


INTERRUPTIONS = {
    'reset': lambda bench: bench.ros.call(bench.player, Trigger, 'foc/reset', Trigger.Request()),
    'clutch': lambda bench: bench.ros.call(bench.player, SetBool, 'foc/engage', SetBool.Request(data=False)),
    'deactivation': lambda bench: change(bench, 'deactivate'),
    'deactivation and activation': lambda bench: change(bench, 'deactivate', 'activate'),
    'cleaning up': lambda bench: change(bench, 'deactivate', 'cleanup', 'configure', 'activate'),
    'shutdown': lambda bench: change(bench, 'shutdown'),
}


@pytest.mark.parametrize('name', INTERRUPTIONS)
def test_nothing_that_was_computed_before_is_published_after(ros: Graph, gate: Gate, name: str) -> None:
    bench = Bench(ros)
    begin(bench)
    INTERRUPTIONS[name](bench)
    assert gate.deadlines[0].has_passed, 'the computation is asked to end'
    end(bench, gate)
    assert not bench.received['prediction']
    assert figures(bench.health())['count predict_abandoned'] == '1'


def test_new_parameters_hold_from_the_next_prediction_on(ros: Graph, gate: Gate) -> None:
    bench = Bench(ros)
    poses = begin(bench)
    take(bench, poses[:1])
    assert set_on(bench, homotopy__max_candidates=1).successful
    end(bench, gate)
    (table,) = bench.wait_for('likelihoods', 1)
    assert len(list_labels(table)) == 1
    assert bench.received['prediction'][0].header.stamp == poses[0].header.stamp


def test_the_budget_is_the_deadline_of_a_live_prediction(ros: Graph, gate: Gate) -> None:
    bench = Bench(ros, parameters={'budget_s': 0.05})
    begin(bench)
    assert gate.deadlines[0].left_s < 0.05
    end(bench, gate)
    assert figures(bench.health())['count predictions'] == '1'


def test_a_node_that_is_destroyed_ends_its_prediction(ros: Graph, gate: Gate) -> None:
    bench = Bench(ros)
    begin(bench)
    ros.nodes.remove(bench.node)
    ros.executor.remove_node(bench.node)
    bench.node.destroy_node()
    assert gate.deadlines[0].has_passed
    assert bench.node.is_busy_after(0.01)
    gate.open()
    assert not bench.node.is_busy_after(20.0)


def test_an_empty_marker_array_that_was_sent_once_does_not_block(ros: Graph) -> None:
    bench = Bench(ros, parameters={'scene.timeout_s': 1.0})
    bench.deliver('obstacle_markers', marker_array(TYPES))
    ros.spin_for(1.1)
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.deliver('obstacles', cloud(TYPES, obstacle_table(ROWS), 0))
    bench.move(hand_path(1))
    bench.wait_for('prediction', 1)


def test_reset_removes_silent_sources(ros: Graph) -> None:
    bench, poses = Bench(ros, parameters={'scene.timeout_s': 1.0}), hand_path(4)
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, (0.15, 0.2, 0.0), stamp_ns=0)))
    bench.deliver('goals', pose_array(TYPES, GOALS))
    ros.spin_for(1.1)
    bench.deliver('obstacles', cloud(TYPES, obstacle_table(ROWS), 0))
    bench.move(poses[:2])
    assert 'obstacle_markers silent for' in bench.health().message
    answer = ros.call(bench.player, Trigger, 'foc/reset', Trigger.Request())
    assert answer.message.startswith('the movement is forgotten, the scene is kept')
    assert set(bench.node.pipeline.scene.sources) == {'cloud'}
    bench.move(poses[2:])
    bench.wait_for('prediction', 1)
