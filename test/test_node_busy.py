# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A prediction that takes long: everything else is answered meanwhile, and nothing that is old or unwanted is published."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import ros_required  # noqa: F401
import pytest
from node_helpers import OK, WARN, Bench, begin, figures, hand_path, list_labels, stamps
from ros_helpers import Graph
from std_srvs.srv import SetBool, Trigger

from foc_ros.core import pipeline as computation
from foc_ros.core.deadline import Deadline
from foc_ros.ros import health


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

    def close(self) -> None:
        self._open.clear()


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    made = Gate()
    monkeypatch.setattr(computation, 'predict', made)
    yield made
    made.open()


def begin_to_predict(ros: Graph, **options: Any) -> tuple[Bench, list[Any]]:
    """Return a bench whose node computes a prediction, and the poses after the one from which it does."""
    bench, (first, *others) = begin(ros, **options), hand_path(20)
    bench.send('hand_pose', first)
    ros.spin_until(lambda: bench.node.is_busy, 'the begin of a prediction')
    return bench, others


def end(bench: Bench, gate: Gate) -> None:
    gate.open()
    bench.ros.spin_until(lambda: not bench.node.is_busy, 'the end of the prediction')
    bench.ros.spin_for(0.1)


def test_services_and_diagnostics_answer_during_a_prediction(ros: Graph, gate: Gate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(health, 'BUSY_S', 0.0)
    bench, poses = begin_to_predict(ros, estimator__hand_timeout_s=60.0)
    assert bench.call(SetBool, 'engage', data=True).success
    bench.take('hand_pose', *poses)
    status = bench.health()
    assert bench.node.is_busy and not bench.received['prediction']
    assert status.level == WARN and status.message.startswith('busy: a prediction has been computed for ')
    assert figures(status)['hand_pose refused'] == f'0 of {len(poses) + 1}'
    end(bench, gate)
    expected = stamps([hand_path(1)[0], poses[-1]])
    assert stamps(bench.wait_for('prediction', 2)) == expected, 'the next one is made from the newest pose'


def test_a_prediction_that_is_too_old_at_its_end_is_withheld(ros: Graph, gate: Gate) -> None:
    bench, poses = begin_to_predict(ros, estimator__hand_timeout_s=0.3)
    ros.spin_for(0.4)
    bench.take('hand_pose', poses[0])
    end(bench, gate)
    status = bench.health()
    assert not bench.received['prediction']
    assert (status.level, figures(status)['count predict_too_late']) == (WARN, '1')
    assert 'busy: the last prediction took until its hand pose was ' in status.message
    assert 'silent' not in status.message
    bench.move(poses[1:4])
    bench.wait_for('prediction', 1)
    assert bench.health().level == OK


INTERRUPTIONS = {
    'reset': lambda bench: bench.call(Trigger, 'reset'),
    'clutch': lambda bench: bench.call(SetBool, 'engage', data=False),
    'deactivation and activation': lambda bench: bench.change('deactivate', 'activate'),
    'cleaning up': lambda bench: bench.change('deactivate', 'cleanup', 'configure', 'activate'),
    'shutdown': lambda bench: bench.change('shutdown'),
}


@pytest.mark.parametrize('name', INTERRUPTIONS)
def test_nothing_that_was_computed_before_is_published_after(ros: Graph, gate: Gate, name: str) -> None:
    bench, _ = begin_to_predict(ros)
    INTERRUPTIONS[name](bench)
    assert gate.deadlines[0].has_passed, 'the computation is asked to end'
    end(bench, gate)
    assert not bench.received['prediction']
    assert figures(bench.health())['count predict_abandoned'] == '1'


def test_new_parameters_hold_from_the_next_prediction_on(ros: Graph, gate: Gate) -> None:
    bench, poses = begin_to_predict(ros)
    bench.take('hand_pose', poses[0])
    assert bench.set(homotopy__max_candidates=1).successful
    end(bench, gate)
    (table,) = bench.wait_for('likelihoods', 1)
    assert len(list_labels(table)) == 1
    assert stamps(bench.received['prediction']) == stamps(poses[:1])


def test_the_budget_is_the_deadline_of_a_live_prediction_and_so_is_the_end_of_the_node(ros: Graph, gate: Gate) -> None:
    bench, poses = begin_to_predict(ros, budget_s=0.05)
    assert gate.deadlines[0].left_s < 0.05
    end(bench, gate)
    assert figures(bench.health())['count predictions'] == '1'
    gate.close()
    bench.send('hand_pose', *poses[:4])
    ros.spin_until(lambda: len(gate.deadlines) == 2, 'another prediction')
    ros.nodes.remove(bench.node)
    ros.executor.remove_node(bench.node)
    bench.node.destroy_node()
    assert gate.deadlines[-1].has_passed and bench.node.is_busy_after(0.01)
    gate.open()
    assert not bench.node.is_busy_after(20.0)
