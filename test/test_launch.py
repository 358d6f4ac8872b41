# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch files: what they declare, and what they start where `launch_ros` is installed."""

from __future__ import annotations

import os
import runpy
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import ros_helpers
from ros_helpers import Graph

from foc_ros.core.config import list_parameters
from foc_ros.io.topics import TYPES

ROOT = Path(__file__).parents[1]
STARTER = (
    'import sys\n'
    'from launch import LaunchService\n'
    'from launch.actions import IncludeLaunchDescription\n'
    'from launch import LaunchDescription\n'
    'from launch.launch_description_sources import PythonLaunchDescriptionSource\n'
    'given = [tuple(each.split(":=", 1)) for each in sys.argv[2:]]\n'
    'service = LaunchService()\n'
    'source = PythonLaunchDescriptionSource(sys.argv[1])\n'
    'service.include_launch_description(LaunchDescription([IncludeLaunchDescription(source, launch_arguments=given)]))\n'
    'sys.exit(service.run())\n'
)
"""What `ros2 launch` does."""


class Recorded:
    """In place of a class of launch: keeps what it was made with."""

    def __init__(self, *given: Any, **named: Any) -> None:
        self.given, self.named = given, named


NAMES = {
    'launch': ['LaunchContext', 'LaunchDescription'],
    'launch.actions': ['DeclareLaunchArgument', 'IncludeLaunchDescription', 'OpaqueFunction'],
    'launch.launch_description_sources': ['PythonLaunchDescriptionSource'],
    'launch.substitutions': ['LaunchConfiguration'],
    'launch_ros': [],
    'launch_ros.actions': ['Node'],
    'launch_ros.parameter_descriptions': ['ParameterValue'],
}


@pytest.fixture
def described(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that runs a launch file with substitutes for launch, and returns its names and its description."""
    for name, classes in NAMES.items():
        module = ModuleType(name)
        for each in classes:
            setattr(module, each, type(each, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, name, module)

    def run(name: str) -> tuple[dict[str, Any], list[Any]]:
        names = runpy.run_path(str(ROOT / 'launch' / f'{name}.launch.py'))
        return names, names['generate_launch_description']().given[0]

    return run


def arguments(actions: list[Any]) -> dict[str, str]:
    return {each.given[0]: each.named['default_value'] for each in actions if type(each).__name__ == 'DeclareLaunchArgument'}


def test_every_input_and_only_known_parameters_are_arguments(described: Any) -> None:
    names, actions = described('foc')
    declared = arguments(actions)
    assert set(TYPES) <= set(declared)
    assert set(names['PARAMETERS']) <= {'autostart', *(each.name for each in list_parameters())}
    context = type('Context', (), {'launch_configurations': declared | {'plane': 'xz', 'autostart': 'false'}})
    (node,) = names['create_node'](context)
    assert (node.named['package'], node.named['executable']) == ('foc_ros', 'foc_node')
    (overrides,) = node.named['parameters']
    assert {name: (each.given[0], each.named['value_type']) for name, each in overrides.items()} == {
        'plane': ('xz', str),
        'autostart': ('false', bool),
    }


@pytest.mark.parametrize('name', ['two_arms', 'foc_rviz'])
def test_included_files_are_given_arguments_that_they_have(described: Any, name: str) -> None:
    known = arguments(described('foc')[1])
    _, actions = described(name)
    included = [each for each in actions if type(each).__name__ == 'IncludeLaunchDescription']
    assert included
    for each in included:
        assert Path(each.given[0].given[0]) == ROOT / 'launch' / 'foc.launch.py'
        assert {argument for argument, _ in each.named.get('launch_arguments', [])} <= set(known)


def test_rviz_is_remapped_to_every_topic_of_its_configuration(described: Any) -> None:
    _, actions = described('foc_rviz')
    remapped = {source for source, _ in actions[-1].named['remappings']}
    lines = (ROOT / 'config' / 'foc.rviz').read_text('utf-8').splitlines()
    assert {line.partition('Value: ')[2] for line in lines if 'Value: /' in line} == remapped


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """Return a prefix in which the package is found as pip and colcon install it."""
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'foc_ros').touch()
    (tmp_path / 'lib').mkdir()
    (tmp_path / 'lib' / 'foc_ros').symlink_to(ROOT / 'scripts' / 'ros2_run')
    return tmp_path


@contextmanager
def launched(ros: Graph, prefix: Path, name: str, *given: str) -> Iterator[subprocess.Popen[str]]:
    environment = ros.environment | {
        'AMENT_PREFIX_PATH': os.pathsep.join([str(prefix), os.environ['AMENT_PREFIX_PATH']]),
        'PATH': os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']]),
        'PYTHONPATH': os.pathsep.join([str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])]),
    }
    command = [sys.executable, '-c', STARTER, str(ROOT / 'launch' / f'{name}.launch.py'), *given]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            output = process.communicate(timeout=30)[0]
    assert 'process has finished cleanly' in output, output


def names_of(node: Any) -> set[str]:
    return {f'{namespace.rstrip("/")}/{name}' for name, namespace in node.get_node_names_and_namespaces()}


def test_one_node_is_launched_with_its_topics_and_parameters(ros: Graph, prefix: Path) -> None:
    ros_helpers.require_ros()
    pytest.importorskip('launch_ros', reason='optional message package: launch_ros')
    from rcl_interfaces.srv import GetParameters

    watcher = ros.node('watcher')
    given = ('namespace:=arm', 'hand_pose:=/MTMR/measured_cp', 'plane:=xz', f'params_file:={ROOT}/config/foc.yaml')
    with launched(ros, prefix, 'foc', *given):
        ros.spin_until(lambda: '/arm/foc' in names_of(watcher), 'the node', 60.0)
        ros.spin_until(lambda: watcher.count_subscribers('/MTMR/measured_cp') == 1, 'its hand', 60.0)
        ros.spin_until(lambda: watcher.count_subscribers('/arm/obstacles') == 1, 'its obstacles')
        request = GetParameters.Request(names=['plane', 'rate_hz', 'autostart'])
        values = ros.call(watcher, GetParameters, '/arm/foc/get_parameters', request).values
        assert (values[0].string_value, values[1].double_value, values[2].bool_value) == ('xz', 50.0, True)


def test_two_arms_share_the_obstacles(ros: Graph, prefix: Path) -> None:
    ros_helpers.require_ros()
    pytest.importorskip('launch_ros', reason='optional message package: launch_ros')
    watcher = ros.node('watcher')
    with launched(ros, prefix, 'two_arms', 'right_hand:=/MTMX/measured_cp'):
        ros.spin_until(lambda: {'/left/foc', '/right/foc'} <= names_of(watcher), 'the nodes', 60.0)
        topics = {'/MTML/measured_cp': 1, '/MTMX/measured_cp': 1, '/obstacles': 2, '/left/goals': 1, '/right/goals': 1}
        ros.spin_until(lambda: {name: watcher.count_subscribers(name) for name in topics} == topics, 'the topics', 60.0)
