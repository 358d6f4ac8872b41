# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The managed node: it predicts only while it is active; clutch, reset and parameters take effect between two predictions."""

import math
import threading
from typing import Any

import ros_required  # noqa: F401
import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetAvailableTransitions
from message_helpers import SECOND, cloud, obstacle_table
from node_helpers import OK, QUICK, ROWS, TYPES, WARN, Bench, begin, figures, hand_path, list_labels, stamps
from ros_helpers import graph
from std_srvs.srv import SetBool, Trigger

from foc_ros.core import pipeline as computation
from foc_ros.core.config import Config, flatten, replace_values
from foc_ros.core.deadline import Deadline
from foc_ros.ros import endpoints, health


def predicted(bench, poses):
    """Return how many predictions are made from poses."""
    before = int(figures(bench.health()).get('count predictions', 0))
    bench.move(poses)
    return int(figures(bench.health()).get('count predictions', 0)) - before


def told(bench):
    status = bench.health()
    return status.level, status.message


def test_a_managed_node_waits_for_configuration_and_activation(ros, monkeypatch):
    """A manager asks for transitions by label or by number; a configuration that failed can be repeated."""
    bench = Bench(ros, outputs=[], connected=False, autostart=False)
    assert bench.state == 'unconfigured'
    assert not bench.player.get_subscriptions_info_by_topic('hand_pose')
    assert told(bench) == (OK, 'unconfigured: nothing is predicted')
    with monkeypatch.context() as patch:
        patch.setattr(endpoints, 'create_subscriptions', lambda *_: 1 / 0)
        assert not bench.change('configure')
    assert bench.state == 'unconfigured'
    assert bench.change('configure')
    bench.connect()
    bench.publish_scene()
    assert predicted(bench, hand_path(4)) == 0
    assert told(bench) == (OK, 'inactive: nothing is predicted')
    assert bench.change(Transition.TRANSITION_ACTIVATE)
    assert bench.state == 'active'
    assert predicted(bench, hand_path(6)[4:]) == 1
    assert bench.change(Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP)
    assert bench.state == 'unconfigured'


def test_clutch_and_deactivation_keep_the_scene_and_reset_forgets_the_movement(ros):
    bench, poses = begin(ros), hand_path(30)
    engage = lambda data: bench.call(SetBool, 'engage', data=data)  # noqa: E731
    assert predicted(bench, poses[:4]) == 2
    assert bench.change('deactivate')
    assert predicted(bench, poses[4:8]) == 0
    answer = engage(True)
    assert (answer.success, answer.message) == (True, 'engaged, but inactive')
    assert predicted(bench, poses[8:10]) == 0
    assert bench.change('activate')
    assert predicted(bench, poses[10:12]) == 1
    answer = engage(False)
    assert (answer.success, answer.message) == (True, 'disengaged')
    assert predicted(bench, poses[12:16]) == 0
    assert told(bench) == (OK, 'disengaged')
    assert bench.change('deactivate', 'activate')
    assert predicted(bench, poses[16:20]) == 0, 'the clutch is kept'
    assert engage(True).message == 'engaged'
    bench.move(poses[20:22])
    assert stamps(bench.wait_for('prediction', 4))[-1] == stamps(poses)[20]
    assert bench.call(Trigger, 'reset').success
    assert bench.node.pipeline.hand_state is None
    bench.move(hand_path(1, start_s=9.9))
    assert stamps(bench.wait_for('prediction', 5))[-1] == round(9.9 * SECOND)


def test_cleaning_up_forgets_all_but_the_parameters(ros):
    bench = begin(ros, 2, outputs=[], foc__eta=0.7)
    bench.send('hand_pose', *hand_path(50))
    bench.send('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
    bench.node.trigger_deactivate()
    bench.node.trigger_cleanup()
    ros.spin_for(0.2)
    assert not bench.node.pipeline.scene.sources, 'messages that wait are left'
    ros.spin_until(lambda: not bench.publishers['hand_pose'].get_subscription_count(), 'the end of the subscription')
    assert bench.change('configure')
    bench.connect()
    assert bench.node.pipeline.config.foc.eta == 0.7
    assert bench.change('activate')
    bench.publish_scene()
    assert predicted(bench, hand_path(2)) == 1


def test_an_impossible_transition_is_refused_by_an_answer(ros):
    bench = begin(ros, outputs=[])
    for label in ('activate', 'cleanup', 'no such transition'):
        assert not bench.change(label)
        assert bench.state == 'active'
    assert predicted(bench, hand_path(2)) == 1
    found = bench.call(GetAvailableTransitions, 'get_available_transitions').available_transitions
    assert 'deactivate' in [each.transition.label for each in found]
    assert bench.change('shutdown')
    assert bench.state == 'finalized'
    assert not bench.change('configure')
    assert bench.health().message == 'finalized: nothing is predicted'


def test_parameters_change_together_and_without_a_missed_prediction(ros):
    bench, poses = begin(ros), hand_path(20)
    bench.move(poses[:10])
    assert bench.set(foc__eta=0.7, likelihood__beta=1, homotopy__max_candidates=1).successful
    bench.move(poses[10:])
    tables = bench.wait_for('likelihoods', 10)
    assert bench.node.pipeline.config == replace_values(
        Config(), QUICK | {'foc.eta': 0.7, 'likelihood.beta': 1.0, 'homotopy.max_candidates': 1}
    )
    assert [len(list_labels(table)) for table in tables] == [2] * 5 + [1] * 5
    assert isinstance(bench.node.get_parameter('likelihood.beta').value, float)


@pytest.fixture(scope='module')
def unchanged():
    """Yield a node whose parameters no test changes."""
    with graph() as created:
        yield Bench(created, outputs=[])


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        ({'foc__eta': 2.0}, 'foc.eta out of range'),
        ({'foc__eta': math.nan}, 'foc.eta out of range'),
        ({'foc__strategy': 'best'}, "foc.strategy: expected one of lv, hc, optimal, algorithm1, fixed, got 'best'"),
        ({'foc__steps': 20.5}, 'Wrong parameter type'),
        ({'plane': 'xz'}, 'read-only parameter: plane'),
        ({'foc__etta': 0.5}, 'foc.etta'),
        ({'foc__strategy': None}, 'cannot be undeclared'),
    ],
)
def test_a_refused_value_changes_nothing_and_names_the_reason(unchanged, values, words):
    before = unchanged.node.pipeline.config
    result = unchanged.set(rate_hz=25.0, **values)
    assert not result.successful
    assert words in result.reason
    assert unchanged.node.pipeline.config is before
    assert {name: unchanged.node.get_parameter(name).value for name in flatten(before)} == flatten(before)


class Gate:
    """In place of `predict`: waits until it is opened, then predicts. Attributes: deadlines, of the calls."""

    def __init__(self):
        self.deadlines: list[Any] = []
        self._real, self._open = computation.predict, threading.Event()

    def __call__(self, *arguments):
        self.deadlines.append(next(each for each in arguments if isinstance(each, Deadline)))
        assert self._open.wait(60.0)
        return self._real(*arguments)

    def open(self):
        self._open.set()

    def close(self):
        self._open.clear()


@pytest.fixture
def gate(monkeypatch):
    made = Gate()
    monkeypatch.setattr(computation, 'predict', made)
    yield made
    made.open()


def begin_to_predict(ros, gate, **options):
    """Return a bench whose node computes a prediction, and the poses after the one from which it does."""
    bench, (first, *others) = begin(ros, **options), hand_path(20)
    bench.send('hand_pose', first)
    ros.spin_until(lambda: bool(gate.deadlines), 'the begin of a prediction')
    return bench, others


def end(bench, gate):
    gate.open()
    bench.ros.spin_until(lambda: not bench.node.is_busy, 'the end of the prediction')
    bench.ros.spin_for(0.1)


def test_services_and_diagnostics_answer_during_a_prediction(ros, gate, monkeypatch):
    monkeypatch.setattr(health, 'BUSY_S', 0.0)
    bench, poses = begin_to_predict(ros, gate, estimator__hand_timeout_s=60.0)
    assert bench.call(SetBool, 'engage', data=True).success
    bench.take('hand_pose', *poses)
    status = bench.health()
    assert bench.node.is_busy and not bench.received['prediction']
    assert status.level == WARN and status.message.startswith('busy: a prediction has been computed for ')
    assert figures(status)['hand_pose refused'] == f'0 of {len(poses) + 1}'
    end(bench, gate)
    expected = stamps([hand_path(1)[0], poses[-1]])
    assert stamps(bench.wait_for('prediction', 2)) == expected, 'the next one is made from the newest pose'


def test_a_prediction_that_is_too_old_at_its_end_is_withheld(ros, gate, clock):
    bench, poses = begin_to_predict(ros, gate, estimator__hand_timeout_s=0.3)
    clock.now_s += 0.4
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
def test_nothing_that_was_computed_before_is_published_after(ros, gate, name):
    bench, _ = begin_to_predict(ros, gate)
    INTERRUPTIONS[name](bench)
    assert gate.deadlines[0].has_passed, 'the computation is asked to end'
    end(bench, gate)
    assert not bench.received['prediction']
    assert figures(bench.health())['count predict_abandoned'] == '1'


def test_new_parameters_hold_from_the_next_prediction_on(ros, gate):
    bench, poses = begin_to_predict(ros, gate)
    bench.take('hand_pose', poses[0])
    assert bench.set(homotopy__max_candidates=1).successful
    end(bench, gate)
    (table,) = bench.wait_for('likelihoods', 1)
    assert len(list_labels(table)) == 1
    assert stamps(bench.received['prediction']) == stamps(poses[:1])


def test_the_budget_is_the_deadline_of_a_live_prediction_and_so_is_the_end_of_the_node(ros, gate):
    bench, poses = begin_to_predict(ros, gate, budget_s=0.05)
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
