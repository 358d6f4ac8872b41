# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node as a process, as `ros2` tools use it: it starts or prints the reason why not, answers, and stops without an error."""

import signal
import sys
from pathlib import Path

import ros_required  # noqa: F401
import psutil
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from process_helpers import ROOT, ScenePlayer, ended, predict_once, running
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from ros_helpers import graph
from std_srvs.srv import SetBool

from foc_ros.core.config import list_parameters
from foc_ros.ros.isolated_node import reserve_domain
from foc_ros.ros.main import main


def entry_point(name):
    """Return the program that colcon has installed for `ros2 run`, or else the one that pip has installed."""
    from ament_index_python import get_package_prefix

    try:
        return str(Path(get_package_prefix('foc_ros')) / 'lib' / 'foc_ros' / name)
    except (LookupError, OSError):
        return str(Path(sys.executable).with_name(name))


@pytest.fixture(scope='module')
def client():
    """Yield a plain node beside the process of a node, for the tests that change nothing or set it back."""
    with graph() as created, running(created) as process:
        made = created.node('client')
        created.spin_until(lambda: 'foc' in made.get_node_names(), 'the node', 30.0)
        made.ask = lambda kind, name, request: created.call(made, kind, f'foc/{name}', request)
        made.graph = created
        yield made
        assert ended(process)[0] == 0


@pytest.mark.parametrize(
    ('command', 'number'),
    [([sys.executable, '-m', 'foc_ros', 'node'], signal.SIGINT), ([entry_point('foc_node')], signal.SIGTERM)],
    ids=['command', 'entry point'],
)
def test_a_working_node_stops_without_an_error(ros, command, number):
    with running(ros, command=command) as process:
        predict_once(ros)
        code, errors = ended(process, number)
    assert code == 0, errors
    assert 'Traceback' not in errors


def test_a_node_predicts_on_when_the_process_of_its_predictions_is_gone(ros):
    with running(ros) as process:
        player = predict_once(ros)
        for child in psutil.Process(process.pid).children():
            child.kill()
        player.predictions.clear()
        player.play_until(lambda: len(player.predictions) > 1, 'another prediction')
        code, errors = ended(process)
    assert code == 0, errors
    assert errors.count('foc_node: warning: the process of the predictions ended') == (sys.platform == 'linux')


def test_a_starting_node_stops_without_an_error_at_any_moment(ros):
    watcher = ros.node('watcher')
    with running(ros) as process:
        ros.spin_until(lambda: 'foc' in watcher.get_node_names(), 'the node', 30.0)
        process.send_signal(signal.SIGINT)
        code, errors = ended(process, signal.SIGTERM)  # a second one has no effect
    assert code == 0
    assert [line for line in errors.splitlines() if not line.startswith('[INFO]')] == []


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        ('--ros-args -p foc.eta:=2.0', 'foc_node: foc.eta: expected a number in [0, 0.999], got 2.0\n'),
        ('--ros-args -p rate_hz:=fast', "foc_node: rate_hz: expected a finite number in [0.1, 1000] Hz, got 'fast'\n"),
        ('--ros-args -p autostart:=maybe', "foc_node: autostart: expected true or false, got 'maybe'\n"),
        ('--ros-args --params-file /nowhere/at/all.yaml', '/nowhere/at/all.yaml'),
        ('--ros-args -p qos_overrides./obstacles.subscription.durability:=eternal', 'eternal'),
        ('--ros-args -p homotopy.library:=/nowhere/ways.json', 'foc_node: /nowhere/ways.json: cannot be read'),
        ('--ros-args --no-such-option', 'no-such-option'),
        ('--ros-args -p qqq:=1', 'foc_node: qqq: expected a known parameter, got 1\n'),
        ('--ros-args -p foc.etta:=0.5', 'foc_node: foc.etta: expected a known parameter (did you mean foc.eta?), got 0.5\n'),
        ('--fast', 'foc_node: unrecognized arguments: --fast (those of ROS follow --ros-args)\n'),
    ],
)
def test_a_node_that_cannot_start_prints_the_reason_in_one_line(capfd, monkeypatch, arguments, words):
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    with reserve_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        assert main(arguments.split()) == 2
    for number, handler in handlers.items():
        signal.signal(number, handler)
    errors = capfd.readouterr().err
    assert len([line for line in errors.splitlines() if line.startswith('foc_node: ')]) == 1
    assert words in errors and 'Traceback' not in errors


def test_a_request_that_rclpy_cannot_handle_does_not_end_the_node(client):
    impossible = client.create_client(SetParameters, 'foc/set_parameters')
    client.graph.spin_until(impossible.service_is_ready, 'the service')
    impossible.call_async(SetParameters.Request(parameters=[Parameter(name='rate_hz', value=ParameterValue(type=99))]))
    client.graph.spin_for(0.2)
    answer = client.ask(GetParameters, 'get_parameters', GetParameters.Request(names=['rate_hz']))
    assert answer.values[0].double_value == 50.0


def test_every_parameter_is_listed_described_read_and_set(client):
    known = {parameter.name: parameter for parameter in list_parameters()}
    listed = client.ask(ListParameters, 'list_parameters', ListParameters.Request()).result.names
    assert {*known, 'autostart', 'use_sim_time', 'qos_overrides./obstacles.subscription.durability'} <= set(listed)
    answer = client.ask(DescribeParameters, 'describe_parameters', DescribeParameters.Request(names=listed))
    described = {each.name: each for each in answer.descriptors}
    for name, parameter in known.items():
        bound, descriptor = parameter.bound, described[name]
        assert descriptor.description and descriptor.read_only == bound.read_only
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        assert [(each.from_value, each.to_value) for each in ranges] == [(bound.low, bound.high)] * (bound.low is not None)
    values = client.ask(GetParameters, 'get_parameters', GetParameters.Request(names=listed)).values
    assert len(values) == len(listed) and all(value.type for value in values)
    again = [Parameter(name=name, value=value) for name, value in zip(listed, values, strict=True)]
    results = client.ask(SetParameters, 'set_parameters', SetParameters.Request(parameters=again)).results
    for name, result in zip(listed, results, strict=True):
        read_only = described[name].read_only
        assert result.successful != read_only, f'{name}: {result.reason}'
        assert not read_only or 'read-only' in result.reason


def test_a_node_that_is_killed_and_started_again(ros):
    with running(ros) as process:
        predict_once(ros)
        process.send_signal(signal.SIGKILL)
        assert process.wait(30) == -signal.SIGKILL
    first = ros.nodes.pop()
    ros.executor.remove_node(first)
    first.destroy_node()
    with running(ros, '--ros-args', '-p', 'rate_hz:=10.0', '-p', 'foc.steps:=20') as process:
        player = ScenePlayer(ros)
        fine = b'\x00', 'predicting'
        heard = lambda: fine in [(each.level, each.message) for each in player.statuses]  # noqa: E731
        player.play_until(heard, 'a second of predictions without a fault')
        assert ended(process)[0] == 0


EXAMPLE = [sys.executable, str(ROOT / 'doc' / 'examples' / 'teleoperation_loop.py')]
NODE = ['--ros-args', '-r', 'hand_pose:=MTMR/measured_cp', '-p', 'scene.timeout_s:=0.5']
QUICK = ['-p', 'foc.steps:=20', '-p', 'homotopy.max_candidates:=2', '-p', 'rate_hz:=20.0']


def set_obstacles(ros, client, on):
    from rclpy.parameter import Parameter

    request = SetParameters.Request(parameters=[Parameter('obstacles', value=on).to_parameter_msg()])
    assert ros.call(client, SetParameters, 'teleoperation/set_parameters', request).results[0].successful


def test_the_loop_is_engaged_handed_over_stale_and_recovered(ros):
    from std_msgs.msg import Float64

    client = ros.node('client')
    shares = ros.collect(client, Float64, 'teleoperation/share')
    health = ros.collect(client, DiagnosticArray, '/diagnostics')

    def share_is(high, what):
        shares.clear()
        ros.spin_until(lambda: bool(shares) and (shares[-1].data > 0.05) == high, what, 40.0)

    def told(words):
        health.clear()
        ros.spin_until(lambda: bool(health) and words in health[-1].status[0].message, words)

    with running(ros, *NODE, *QUICK) as node, running(ros, command=EXAMPLE) as stack:
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
            code, errors = ended(process)
            assert code == 0 and 'Traceback' not in errors, errors
