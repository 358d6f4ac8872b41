# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Guidance of the node: its topics, its clutch, its diagnostics, and its rate while a prediction takes long."""

import dataclasses
import itertools
import os
import threading
import time
from typing import Any

import ros_required  # noqa: F401
import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, TwistStamped, Wrench, WrenchStamped
from message_helpers import SECOND, pose_stamped
from node_helpers import TYPES, Bench, figures
from play_helpers import until
from prediction_samples import predict_aside
from rclpy.parameter import Parameter
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool

from foc_ros.core import pipeline as pipelines
from foc_ros.core.config import Config
from foc_ros.core.guidance.guide import GuidanceOutput, GuidanceStatus
from foc_ros.core.hand import kalman
from foc_ros.core.types import HandSample
from foc_ros.ros import guidance
from foc_ros.ros.guidance import GuidanceLoop

GUIDED = {'guidance.enabled': True, 'guidance.clearance': 0.0, 'rate_hz': 25.0}
"""Guidance everywhere, so that a hand that leaves its path feels a force."""
LOAD_S = 0.03


def bow(tick):
    """Return a hand that passes the obstacle on the left, a little to and fro, and comes back after 1.2 s, again and again."""
    t = 0.01 * tick
    return 0.1 * abs((t + 1.2) % 2.4 - 1.2), 0.03 * np.sin(5.0 * t), 0.1


class Guided(Bench):
    """A bench with the outputs of guidance, and a scene; `wrenches`: with the time at which each arrived [s]."""

    def __init__(self, ros, **parameters):
        super().__init__(ros, outputs=('prediction', 'markers'), **GUIDED | parameters)
        self.tick = 0
        self.wrenches: list[tuple[float, Any]] = []
        keep = lambda message: self.wrenches.append((time.monotonic(), message))  # noqa: E731
        self.player.create_subscription(WrenchStamped, 'foc/guidance/wrench', keep, 1000)
        kinds = {'reference': PoseStamped, 'stiffness': Float64MultiArray, 'twist': TwistStamped, 'wrench_unstamped': Wrench}
        self.guided = {name: ros.collect(self.player, kind, f'foc/guidance/{name}') for name, kind in kinds.items()}
        self.commands = self.player.create_publisher(TwistStamped, 'command_twist', 10)
        guided = [each for name, each in self.node._outputs.items() if name.startswith('guidance/')]
        ends = *guided, self.commands
        ros.spin_until(lambda: all(each.get_subscription_count() for each in ends), 'the topics of guidance')
        self.publish_scene()

    @property
    def forces(self):
        return np.array([[each.wrench.force.x, each.wrench.force.y, each.wrench.force.z] for _, each in self.wrenches])

    def drive(self, count):
        """Move the hand on in real time, 100 poses a second."""
        due = time.monotonic()
        for _ in range(count):
            stamp_ns = round((10.0 + 0.01 * self.tick) * SECOND)
            self.publishers['hand_pose'].publish(pose_stamped(TYPES, bow(self.tick), stamp_ns))
            self.tick += 1
            due += 0.01
            while time.monotonic() < due:
                self.ros.executor.spin_once(timeout_sec=0.001)

    def drive_until(self, condition, what):
        """Move the hand on until a condition holds; fail after 20 s."""
        deadline = time.monotonic() + 20.0
        while not condition():
            assert time.monotonic() < deadline, f'waited 20 s for: {what}'
            self.drive(5)

    def feel_force(self):
        """Move the hand on until it feels a new force."""
        count = len(self.wrenches)
        self.drive_until(lambda: len(self.wrenches) > count and bool(self.forces[count:].any()), 'a force')

    def await_silence(self):
        """Move the hand on until nothing is published any more."""

        def is_silent():
            before = len(self.wrenches)
            self.drive(40)
            return len(self.wrenches) == before

        self.ros.spin_until(is_silent, 'zero is published until the ramp ends, and then nothing')

    def answer(self, x, y, frame_id='world'):
        """Return what the node makes of an operator's velocity command."""
        message = TwistStamped()
        message.header.frame_id = frame_id
        message.twist.linear.x, message.twist.linear.y, message.twist.linear.z = x, y, 0.01
        message.twist.angular.z = 0.5
        self.guided['twist'].clear()
        self.commands.publish(message)
        self.ros.spin_until(lambda: bool(self.guided['twist']), 'a command')
        return self.guided['twist'][-1].twist


def begin(ros, **parameters):
    bench = Guided(ros, **parameters)
    bench.drive(60)
    bench.feel_force()
    return bench


def test_guidance_is_published_only_while_it_is_enabled(ros):
    bench = Guided(ros, **{'guidance.enabled': False})
    assert 'guidance/wrench_unstamped' not in bench.node._outputs
    bench.drive(60)
    bench.wait_for('prediction', 1)
    assert not bench.wrenches
    assert figures(bench.health())['guidance'] == 'disabled'
    bench.node.set_parameters([Parameter('guidance.enabled', value=True)])
    bench.feel_force()
    bench.node.set_parameters([Parameter('guidance.enabled', value=False)])
    ros.spin_until(lambda: not bench.forces[-2:].any(), 'a force of zero, twice')
    bench.await_silence()


def test_the_outputs_agree_with_each_other(ros):
    bench = begin(ros, **{'guidance.unstamped': True})
    bench.drive(40)
    wrench = bench.wrenches[-1][1]
    assert wrench.header.frame_id == bench.received['prediction'][-1].header.frame_id
    assert not bench.forces[:, 2].any()
    unstamped = {(each.force.x, each.force.y, each.force.z) for each in bench.guided['wrench_unstamped']}
    assert len(unstamped & set(map(tuple, bench.forces))) > 3 and np.isfinite(list(unstamped)).all()
    matrix = np.array(bench.guided['stiffness'][-1].data).reshape(3, 3)
    assert matrix == pytest.approx(matrix.T) and not matrix[2].any()
    assert [each.size for each in bench.guided['stiffness'][-1].layout.dim] == [3, 3]
    assert bench.guided['reference'][-1].pose.position.z == pytest.approx(0.1)
    markers = [each for each in bench.received['markers'][-1].markers if each.ns == 'guidance']
    assert [each.type for each in markers] == [markers[0].ARROW, markers[0].SPHERE]
    values = figures(bench.health())
    assert values['guidance'] in ('guiding', 'stale')
    assert 0.0 <= float(values['authority']) <= 0.5 and 0.0 <= float(values['force_N']) <= 3.0
    assert 0.0 <= float(values['agreement']) <= 1.0 and 0.0 < float(values['tank_J']) <= 0.5


def test_the_clutch_releases_the_hand_and_guidance_falls_silent(ros):
    bench = begin(ros)
    bench.node._engage(SetBool.Request(data=False), SetBool.Response())
    # how long that takes is measured by scripts/stress.py rates
    bench.drive_until(lambda: not bench.forces[-2:].any(), 'a force of zero, twice')
    bench.await_silence()
    count = len(bench.wrenches)
    assert figures(bench.health())['guidance'] in ('released', 'stale')
    bench.node._engage(SetBool.Request(data=True), SetBool.Response())
    bench.drive_until(lambda: len(bench.wrenches) > count, 'guidance')


@pytest.mark.parametrize('transitions', [['shutdown'], ['deactivate', 'cleanup']])
def test_a_node_that_ends_leaves_no_force(ros, transitions):
    bench = begin(ros)
    bench.drive_until(lambda: np.hypot(*bench.forces[-1, :2]) > 0.1, 'a force')
    for each in transitions:
        getattr(bench.node, f'trigger_{each}')()
    assert bench.node._guidance.loop._thread is None
    ros.spin_until(lambda: not bench.forces[-2:].any(), 'a force of zero, twice', 5.0)


def test_commands_are_blended_and_pass_unchanged_without_guidance(ros):
    bench = begin(ros)

    def is_blended():
        """Whether guidance turns a command now; it never makes it faster, nor changes what is not in the plane."""
        twist = bench.answer(0.0, 0.1)
        assert np.hypot(twist.linear.x, twist.linear.y) <= 0.1 + 1e-9
        assert (twist.linear.z, twist.angular.z) == (0.01, 0.5)
        return twist.linear.x > 0.001

    # a hand that was silent on a busy machine, or is at a fork, is not guided for a moment
    bench.drive_until(is_blended, 'a command that is blended')
    assert bench.answer(0.0, 0.1, 'elsewhere').linear.x == 0.0
    bench.drive_until(is_blended, 'a command that is blended')
    assert bench.answer(np.nan, 0.1).linear.y == 0.1
    assert bench.answer(np.inf, 0.1).linear.y == 0.1
    ros.spin_until(lambda: not bench.forces[-1].any(), 'the hand is released')
    ros.spin_until(lambda: bench.answer(0.0, 0.1).linear.x == 0.0, 'the command alone')
    assert bench.answer(0.0, 0.1).linear.x == 0.0


def test_neither_a_slow_prediction_nor_an_error_stops_guidance(ros, monkeypatch):
    """The prediction keeps the global lock for 30 ms; there are more forces than predictions."""
    run, guide, failures = pipelines.PredictionTask.run, guidance.guide, list[Exception]()

    def run_slowly(task):
        end = time.monotonic() + LOAD_S
        while time.monotonic() < end:
            sum(range(100))
        return run(task)

    def fail_once(*arguments):
        if failures:
            raise failures.pop()
        return guide(*arguments)

    monkeypatch.setattr(pipelines.PredictionTask, 'run', run_slowly)
    monkeypatch.setattr(guidance, 'guide', fail_once)
    bench = begin(ros, **{'guidance.rate_hz': 50.0})
    bench.wrenches.clear()
    bench.received['prediction'].clear()
    bench.drive(100)
    bench.wait_for('prediction', 1)
    assert len(bench.wrenches) > len(bench.received['prediction'])
    failures.append(ValueError('for this test'))
    bench.drive_until(lambda: not failures, 'an update')
    assert int(figures(bench.health())['count internal_errors']) == 1
    bench.wrenches.clear()
    bench.drive_until(lambda: bool(bench.wrenches), 'guidance')


@pytest.mark.parametrize('seconds', [-5.0, 0.02, 1.0], ids=['stamps go back', 'jump', 'gap'])
def test_a_hand_that_restarts_elsewhere_takes_nothing_from_the_tank_and_is_not_guided_by_what_was_predicted_before(seconds):
    config = Config().with_values({'guidance.enabled': True, 'guidance.clearance': 0.0})
    published: list[GuidanceOutput] = []
    loop = GuidanceLoop(config, lambda output, _: published.append(output), lambda _: None, lambda _: None)
    loop.set_released(False)
    state, now_s = None, 100.0

    def move(position, stamps):
        """Move the hand, and update guidance twice after each of its poses."""
        nonlocal state, now_s
        for stamp_s in stamps:
            state = kalman.update(state, HandSample(round(stamp_s * SECOND), np.array(position)), config.estimator).state
            loop.note_hand(state, now_s)
            for _ in range(2):
                loop.update(now_s)
                now_s += 0.005

    move((0.0, 0.0), [10.0])
    loop.note_prediction(predict_aside(), now_s)
    move((0.0, 0.0), 10.0 + 0.01 * np.arange(1, 20))
    assert published[-1].force[1] > 2.0
    guided = len(published)
    move((0.0, 0.4), 10.19 + seconds + 0.01 * np.arange(14))  # 0.4 m in the direction of the force
    assert {each.status for each in published[guided + 2 :]} == {GuidanceStatus.NO_PREDICTION}
    sizes = np.hypot(*np.array([each.force for each in published[guided - 1 :]]).T)
    assert sizes[-1] == 0.0 and np.abs(np.diff(sizes)).max() <= config.guidance.slew * 0.005 * (1 + 1e-9)
    assert min(each.tank for each in published) > 0.4


def test_the_state_is_told_without_a_force_and_the_clutch_fills_the_tank():
    config = Config().with_values({'guidance.enabled': True})
    loop = GuidanceLoop(config, lambda *_: None, lambda _: None, lambda _: None)

    def tell(now_s):
        loop.update(now_s)
        return loop.describe()

    assert tell(100.0)['guidance'] == 'no hand yet'
    hand = kalman.update(None, HandSample(SECOND, np.array([0.1, 0.0])), config.estimator).state
    loop.note_hand(hand, 100.0)
    assert tell(100.005)['guidance'] == 'released'
    loop.set_released(False)
    assert tell(100.01)['guidance'] == 'no_prediction'
    assert loop.output is not None and loop.output.position.tolist() == [0.1, 0.0]
    loop.note_prediction(predict_aside(), 100.0)
    loop._state = dataclasses.replace(loop._state, energy=0.01)
    told = tell(100.015)
    assert (told['guidance'], told['tank_J']) == ('guiding', '0.0100')
    loop.set_released(True)
    told = [tell(100.02 + 0.005 * tick) for tick in range(5)]
    assert [each['guidance'] for each in told] == ['released'] * 5
    assert told[-1]['tank_J'] == '0.5000'


PRIORITY_CONFIG = Config().with_values({'guidance.enabled': True, 'guidance.realtime_priority': 7})


def make_loop(warn=lambda _: None):
    return GuidanceLoop(PRIORITY_CONFIG, lambda *_: None, lambda _: None, warn)


@pytest.mark.parametrize('error', [PermissionError(1, 'Operation not permitted'), AttributeError('not on this system')])
def test_a_priority_that_is_not_permitted_is_told_once(monkeypatch, error):
    def refuse(*_):
        raise error

    monkeypatch.setattr(os, 'sched_setscheduler', refuse)
    told: list[str] = []
    loop = make_loop(told.append)
    for each in (0, 50, 50, 60):
        loop._set_priority(each)
    assert loop._priority == 0
    assert len(told) == 1
    assert all(word in told[0] for word in ('50', 'not permitted', 'rtprio', 'guidance.realtime_priority'))


def test_the_thread_of_guidance_has_it_while_guidance_is_enabled(monkeypatch):
    asked: list[tuple[str, int]] = []
    monkeypatch.setattr(
        os, 'sched_setscheduler', lambda _, __, to: asked.append((threading.current_thread().name, to.sched_priority))
    )
    loop = make_loop()

    def wait_for(*priorities):
        until(lambda: asked == [('guidance', each) for each in priorities], 'the priorities', 10.0)

    loop.start()
    try:
        wait_for(7)
        loop.reconfigure(Config())
        wait_for(7, 0)
        loop.reconfigure(PRIORITY_CONFIG)
        wait_for(7, 0, 7)
    finally:
        loop.stop()


def test_a_late_update_leaves_the_processor_to_others(monkeypatch):
    """The thread has a priority before all others, so that it must sleep between updates that take longer than their period."""
    updates: list[tuple[float, float]] = []

    def update_slowly(_, now_s):
        time.sleep(0.02)  # four periods
        updates.append((now_s, time.monotonic()))

    monkeypatch.setattr(GuidanceLoop, 'update', update_slowly)
    loop = make_loop()
    loop.start()
    until(lambda: len(updates) >= 5, 'five updates', 10.0)
    loop.stop()
    pauses = [began - ended for (_, ended), (began, _) in itertools.pairwise(updates)]
    assert min(pauses) > 0.09 / PRIORITY_CONFIG.guidance.rate_hz
