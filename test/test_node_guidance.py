"""Guidance of the node: its topics, its clutch, its diagnostics, and its rate while a prediction takes long."""

from __future__ import annotations

import time

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, pose_stamped  # noqa: E402
from node_helpers import TYPES, Bench, figures  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.core import pipeline as pipelines  # noqa: E402
from foc_ros.ros import guidance_loop  # noqa: E402

GUIDED = {'guidance.enabled': True, 'guidance.clearance': 0.0, 'rate_hz': 25.0}
"""Guidance everywhere, so that a hand that leaves its path feels a force."""
LOAD_S = 0.03
RAMP_S = 0.1


def bow(tick: int) -> tuple[float, float, float]:
    """Return a hand that passes the obstacle on the left, a little to and fro."""
    t = 0.01 * tick
    return 0.1 * t, 0.03 * np.sin(5.0 * t), 0.1


class Guided(Bench):
    """A bench with the outputs of guidance; `wrenches`: with the time at which each arrived [s]."""

    def __init__(self, ros: Graph, **parameters: object) -> None:
        from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
        from std_msgs.msg import Float64MultiArray

        super().__init__(ros, outputs=('prediction', 'markers'), parameters=GUIDED | parameters)
        self.wrenches: list[tuple[float, object]] = []
        keep = lambda message: self.wrenches.append((time.monotonic(), message))  # noqa: E731
        self.player.create_subscription(WrenchStamped, 'foc/guidance/wrench', keep, 1000)
        self.references = ros.collect(self.player, PoseStamped, 'foc/guidance/reference')
        self.stiffness = ros.collect(self.player, Float64MultiArray, 'foc/guidance/stiffness')
        self.twists = ros.collect(self.player, TwistStamped, 'foc/guidance/twist')
        self.commands = self.player.create_publisher(TwistStamped, 'command_twist', 10)
        publishers = self.node._guidance.publishers.values()
        ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers), 'the outputs of guidance')
        ros.spin_until(lambda: bool(self.commands.get_subscription_count()), 'the command')

    @property
    def forces(self):
        return np.array([[each.wrench.force.x, each.wrench.force.y, each.wrench.force.z] for _, each in self.wrenches])

    def drive(self, count: int, first: int = 0) -> None:
        """Move the hand in real time, 100 poses a second."""
        begin = time.monotonic()
        for tick in range(first, first + count):
            self.publishers['hand_pose'].publish(pose_stamped(TYPES, bow(tick), round((10.0 + 0.01 * tick) * SECOND)))
            while time.monotonic() < begin + 0.01 * (tick - first + 1):
                self.ros.executor.spin_once(timeout_sec=0.001)

    def command(self, x: float, y: float, frame_id: str = 'world') -> None:
        from geometry_msgs.msg import TwistStamped

        message = TwistStamped()
        message.header.frame_id = frame_id
        message.twist.linear.x, message.twist.linear.y, message.twist.linear.z = x, y, 0.01
        message.twist.angular.z = 0.5
        self.commands.publish(message)


def begin(ros: Graph, **parameters: object) -> Guided:
    bench = Guided(ros, **parameters)
    bench.publish_scene()
    bench.drive(60)
    ros.spin_until(lambda: bool(len(bench.wrenches)) and bench.forces.any(), 'a force')
    return bench


def test_a_node_that_is_a_predictor_only_publishes_no_guidance(ros: Graph) -> None:
    bench = Guided(ros, **{'guidance.enabled': False})
    bench.publish_scene()
    bench.drive(30)
    bench.wait_for('prediction', 1)
    assert not bench.wrenches
    assert figures(bench.health())['guidance'] == 'disabled'


def test_guidance_updates_only_while_it_is_enabled(ros: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    updates, update = [], guidance_loop.GuidanceLoop.update

    def count(self: guidance_loop.GuidanceLoop, now_s: float) -> None:
        updates.append(now_s)
        update(self, now_s)

    monkeypatch.setattr(guidance_loop.GuidanceLoop, 'update', count)
    bench = Guided(ros, **{'guidance.enabled': False})
    bench.publish_scene()
    bench.drive(60)
    assert not updates
    bench.node.set_parameters([Parameter('guidance.enabled', value=True)])
    bench.drive(40, 60)
    assert updates and bench.forces.any()
    bench.node.set_parameters([Parameter('guidance.enabled', value=False)])
    ros.spin_until(lambda: not bench.forces[-2:].any(), 'a force of zero, twice')
    ros.spin_for(0.1)
    updates.clear()
    bench.drive(20, 100)
    assert not updates


def test_the_outputs_agree_with_each_other(ros: Graph) -> None:
    bench = begin(ros)
    bench.drive(40, 60)
    wrench = bench.wrenches[-1][1]
    assert wrench.header.frame_id == bench.received['prediction'][-1].header.frame_id
    assert not bench.forces[:, 2].any()
    matrix = np.array(bench.stiffness[-1].data).reshape(3, 3)
    assert matrix == pytest.approx(matrix.T) and not matrix[2].any()
    assert [each.size for each in bench.stiffness[-1].layout.dim] == [3, 3]
    assert bench.references[-1].pose.position.z == pytest.approx(0.1)
    markers = [each for each in bench.received['markers'][-1].markers if each.ns == 'guidance']
    assert len(markers) == 2
    values = figures(bench.health())
    assert values['guidance'] in ('guiding', 'stale')
    assert 0.0 <= float(values['agreement']) <= 1.0 and 0.0 < float(values['tank_J']) <= 0.5


def test_the_clutch_releases_the_hand_within_the_ramp_and_guidance_falls_silent(ros: Graph) -> None:
    from std_srvs.srv import SetBool

    bench = begin(ros)
    bench.node._engage(SetBool.Request(data=False), SetBool.Response())
    released = time.monotonic()
    bench.drive(40, 60)
    after = [(at, force) for (at, _), force in zip(bench.wrenches, bench.forces, strict=True) if at > released]
    zeros = [at - released for at, force in after if not force.any()]
    assert zeros[0] <= RAMP_S + 0.2  # the target of 20 ms beyond the ramp is measured by scripts/measure_guidance.py
    count = len(bench.wrenches)
    bench.drive(60, 80)
    assert len(bench.wrenches) == count, 'zero is published until the ramp ends, and then nothing'
    assert figures(bench.health())['guidance'] in ('released', 'stale')
    bench.node._engage(SetBool.Request(data=True), SetBool.Response())
    bench.drive(80, 120)
    assert len(bench.wrenches) > count


def test_a_silent_hand_is_released(ros: Graph) -> None:
    bench = begin(ros)
    ros.spin_until(lambda: figures(bench.health())['guidance'] == 'stale', 'the hand is stale')
    ros.spin_until(lambda: not bench.forces[-1].any(), 'the force is zero')
    ros.spin_until(lambda: time.monotonic() - bench.wrenches[-1][0] > 0.3, 'nothing is published for a hand that is stale')
    assert not bench.forces[-1].any()


def test_deactivation_releases_the_hand_and_clean_up_ends_the_thread(ros: Graph) -> None:
    bench = begin(ros)
    bench.node.trigger_deactivate()
    ros.spin_until(lambda: not bench.forces[-1].any(), 'the force is zero')
    bench.node.trigger_cleanup()
    assert bench.node._guidance.loop._thread is None


def test_commands_are_blended_and_pass_unchanged_without_guidance(ros: Graph) -> None:
    bench = begin(ros)

    def answer(x: float, y: float, **rest: str):
        bench.twists.clear()
        bench.command(x, y, **rest)
        ros.spin_until(lambda: bool(bench.twists), 'a command')
        return bench.twists[-1].twist

    bench.drive(10, 60)
    blended = answer(0.0, 0.1)
    assert blended.linear.x > 0.001 and np.hypot(blended.linear.x, blended.linear.y) <= 0.1 + 1e-9
    assert (blended.linear.z, blended.angular.z) == (0.01, 0.5)
    assert answer(0.0, 0.1, frame_id='elsewhere').linear.x == 0.0
    ros.spin_until(lambda: not bench.forces[-1].any(), 'the hand is released')
    ros.spin_for(0.3)
    assert answer(0.0, 0.1).linear.x == 0.0


def test_a_slow_prediction_does_not_delay_guidance(ros: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    """The prediction keeps the global lock for 30 ms; the periods are compared with each other, not with the clock."""
    run = pipelines.PredictionTask.run

    def run_slowly(task: pipelines.PredictionTask):
        end = time.monotonic() + LOAD_S
        while time.monotonic() < end:
            sum(range(100))
        return run(task)

    monkeypatch.setattr(pipelines.PredictionTask, 'run', run_slowly)
    bench = begin(ros, **{'guidance.rate_hz': 50.0})
    bench.wrenches.clear()
    bench.drive(100, 60)
    count = len(bench.wrenches)
    assert count > 15, 'fewer than a third of the updates of one second'


def test_an_error_of_guidance_is_reported_and_guidance_goes_on(ros: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    bench, guide, failures = begin(ros), guidance_loop.guide, [ValueError('for this test')]

    def fail_once(*arguments: object):
        if failures:
            raise failures.pop()
        return guide(*arguments)

    monkeypatch.setattr(guidance_loop, 'guide', fail_once)
    bench.drive(40, 60)
    assert not failures
    assert int(figures(bench.health())['count internal_errors']) == 1
    bench.wrenches.clear()
    bench.drive(20, 100)
    assert bench.wrenches
