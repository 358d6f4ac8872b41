# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Launch files, layouts of viewers, and the permissions of a secured graph; and the bounds of files from outside."""

import json
import os
import re
import runpy
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from unittest.mock import MagicMock

import pytest
import yaml
from message_helpers import message_types

from foc_ros import replay
from foc_ros.core.config import Config, list_parameters
from foc_ros.core.errors import RecordingError
from foc_ros.io import csv_tables as tables
from foc_ros.io import documents
from foc_ros.io.documents import read_document
from foc_ros.io.topics import TYPES
from foc_ros.ros.messages.encode_markers import LIKELY, UNLIKELY
from foc_ros.ros.messages.encode_prediction import OUTPUTS, encode_outputs
from foc_ros.ros.messages.ranking import order_candidates

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


MODULES = [f'launch{part}' for part in ('', '.actions', '.launch_description_sources', '.substitutions')]
MODULES += [f'launch_ros{part}' for part in ('', '.actions', '.parameter_descriptions')]


@pytest.fixture
def describe(monkeypatch):
    """Return a function that runs a launch file, and returns its names; the calls of substitutes for launch are recorded."""

    def run(name):
        for module in MODULES:
            monkeypatch.setitem(sys.modules, module, MagicMock())
        names = runpy.run_path(str(ROOT / 'launch' / f'{name}.launch.py'))
        names['generate_launch_description']()
        return names, sys.modules['launch.actions']

    return run


def list_arguments(actions):
    return {each.args[0]: each.kwargs['default_value'] for each in actions.DeclareLaunchArgument.call_args_list}


def test_every_input_and_only_known_parameters_are_arguments(describe):
    names, actions = describe('foc')
    declared = list_arguments(actions)
    assert set(TYPES) <= set(declared)
    assert set(names['PARAMETERS']) <= {'autostart', *(each.name for each in list_parameters())}
    names['create_node'](MagicMock(launch_configurations=declared | {'plane': 'xz', 'autostart': 'false'}))
    node = sys.modules['launch_ros.actions'].Node.call_args.kwargs
    assert (node['package'], node['executable'], [*node['parameters'][-1]]) == ('foc_ros', 'foc_node', ['plane', 'autostart'])
    values = sys.modules['launch_ros.parameter_descriptions'].ParameterValue.call_args_list
    assert [(each.args[0], each.kwargs['value_type']) for each in values] == [('xz', str), ('false', bool)]


@pytest.mark.parametrize('name', ['two_arms', 'foc_rviz'])
def test_included_files_are_given_arguments_that_they_have_and_rviz_every_topic_of_its_configuration(describe, name):
    known = list_arguments(describe('foc')[1])
    _, actions = describe(name)
    sources = sys.modules['launch.launch_description_sources'].PythonLaunchDescriptionSource.call_args_list
    assert {Path(each.args[0]) for each in sources} == {ROOT / 'launch' / 'foc.launch.py'}
    for each in actions.IncludeLaunchDescription.call_args_list:
        assert {argument for argument, _ in each.kwargs.get('launch_arguments', [])} <= set(known)
    if name == 'foc_rviz':
        remapped = {source for source, _ in sys.modules['launch_ros.actions'].Node.call_args.kwargs['remappings']}
        lines = (ROOT / 'config' / 'foc.rviz').read_text('utf-8').splitlines()
        assert {line.partition('Value: ')[2] for line in lines if 'Value: /' in line} == remapped


@pytest.fixture
def prefix(tmp_path):
    """Return a prefix in which the package is found as pip and colcon install it, for `ros2 launch`."""
    pytest.importorskip('launch_ros', reason='optional message package: launch_ros')
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'foc_ros').touch()
    (tmp_path / 'lib').mkdir()
    (tmp_path / 'lib' / 'foc_ros').symlink_to(ROOT / 'scripts' / 'ros2_run')
    return tmp_path


@contextmanager
def launched(ros, prefix, name, *given):
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


def names_of(node):
    return {f'{namespace.rstrip("/")}/{name}' for name, namespace in node.get_node_names_and_namespaces()}


def test_one_node_is_launched_with_its_topics_and_parameters(ros, prefix):
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


def test_two_arms_share_the_obstacles(ros, prefix):
    watcher = ros.node('watcher')
    with launched(ros, prefix, 'two_arms', 'right_hand:=/MTMX/measured_cp'):
        ros.spin_until(lambda: {'/left/foc', '/right/foc'} <= names_of(watcher), 'the nodes', 60.0)
        topics = {'/MTML/measured_cp': 1, '/MTMX/measured_cp': 1, '/obstacles': 2, '/left/goals': 1, '/right/goals': 1}
        ros.spin_until(lambda: {name: watcher.count_subscribers(name) for name in topics} == topics, 'the topics', 60.0)


CONFIG = ROOT / 'config'
TOPICS = {f'/{name}': kind for name, kind in TYPES.items()} | {f'/foc/{name}': kind for name, (kind, _) in OUTPUTS.items()}
LAYOUT = json.loads((CONFIG / 'foxglove.json').read_text('utf-8'))
SHOWN = {name: name for name in ('MarkerArray', 'PointCloud2', 'Path', 'PoseArray')} | {'Pose': 'PoseStamped'}


def test_rviz_shows_every_output_it_can_display():
    displays = yaml.safe_load((CONFIG / 'foc.rviz').read_text('utf-8'))['Visualization Manager']['Displays']
    shown = {}
    for display in displays:
        if 'Topic' in display:
            shown[display['Topic']['Value']] = SHOWN[display['Class'].split('/')[1]]
    assert {'/foc/prediction', '/foc/path', '/foc/markers', '/hand_pose', '/goals'} == set(shown)
    assert all(TOPICS[topic].endswith(f'/{kind}') for topic, kind in shown.items())
    cloud = next(each for each in displays if each['Class'].endswith('/PointCloud2'))
    assert cloud['Channel Name'] == 'likelihood'


def test_foxglove_shows_topics_of_the_node_in_its_panels_in_the_size_of_a_reach():
    layout, placed = LAYOUT, json.dumps(LAYOUT['layout'])
    assert set(re.findall(r'"(?:first|second)": "([^"]+)"', placed)) == set(layout['configById'])
    scene = layout['configById']['3D!foc']
    assert {'/foc/prediction', '/foc/path', '/foc/markers', '/hand_pose', '/goals'} <= set(scene['topics']) <= set(TOPICS)
    assert scene['topics']['/foc/prediction']['colorField'] == 'likelihood'
    assert TOPICS[scene['publish']['poseTopic']] == 'geometry_msgs/msg/PoseStamped'
    tables = [panel['topicToRender'] for name, panel in layout['configById'].items() if name.startswith('Diagnostic')]
    assert tables == ['/foc/likelihoods_by_name', '/diagnostics']
    # its defaults are those of a street: axes of 1 m, names of frames of 0.2 m, and a path as a band of 0.2 m
    topics, frames = scene['topics'], scene['scene']['transforms']
    sizes = [topics['/foc/path']['lineWidth'], topics['/hand_pose']['axisScale'], frames['axisScale']]
    sizes += topics['/goals']['arrowScale']
    assert topics['/goals']['type'] == 'arrow' and min(sizes) > 0.0 and max(sizes) <= 0.05 and not frames['showLabel']
    unlikely, likely = (bytes(round(255 * part) for part in colour).hex() for colour in (UNLIKELY, LIKELY))
    assert topics['/foc/prediction']['gradient'] == [f'#{unlikely}40', f'#{likely}ff'], 'the colours of the markers'


def find_values(message, path):
    """Return what a message path of Foxglove finds: fields, elements, and elements with a field of a value."""
    found = [message]
    for field, element, key, value in re.findall(r'\.(\w+)|\[(\d+|:)\]|\{(\w+)=="(\w+)"\}', path):
        if field:
            found = [getattr(each, field) for each in found]
        elif element:
            rows = slice(None) if element == ':' else slice(int(element), int(element) + 1)
            found = list(chain.from_iterable(each[rows] for each in found))
        else:
            found = [each for each in found if getattr(each, key) == value]
    return [float(each) for each in found]


def test_the_plots_of_foxglove_find_the_likelihoods_of_goals_and_paths():
    prediction = next(iter(replay(ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap', Config())))
    made = encode_outputs(prediction, 'xy', message_types('rosbags'))
    expected = {goal.name: [goal.likelihood] for goal in prediction.goals} | {'unknown': [prediction.unknown]}
    expected |= {f'path {rank}': [each.likelihood] for rank, each in enumerate(order_candidates(prediction))}
    assert len(prediction.goals) == 2 and len(expected) >= 7 and prediction.unknown > 0.0
    table = LAYOUT['configById']['DiagnosticStatusPanel!classes']
    shown = [each for each in made['likelihoods_by_name'].status if each.name == table['selectedName']]
    assert [(each.hardware_id, each.values[0].key) for each in shown] == [(table['selectedHardwareId'], prediction.most_likely)]
    plots = [panel for name, panel in LAYOUT['configById'].items() if name.startswith('Plot!')]
    lines = [line for panel in plots for line in panel['paths']]
    assert {line['label'] for line in lines} == {*(f'goal{i}' for i in range(4)), *(f'path {i}' for i in range(4)), 'unknown'}
    for line in lines:
        topic, path = re.fullmatch(r'/foc/(\w+)(.*)', line['value']).groups()
        assert find_values(made[topic], path) == pytest.approx(expected.get(line['label'], []), abs=1e-5)


PERMISSIONS = ROOT / 'config' / 'sros2_policy.xml'


@pytest.mark.parametrize(
    ('read', 'size', 'words'),
    [
        (read_document, documents.MAX_BYTES, '5,000,000 bytes'),
        (lambda file: next(tables.read_rows(file, ('t_s',))), tables.MAX_BYTES, '1,000,000,000 bytes, got 1,000,000,001'),
    ],
    ids=['document', 'table'],
)
def test_a_file_larger_than_any_scene_or_table_is_refused(tmp_path, read, size, words):
    with (tmp_path / 'large').open('wb') as opened:
        opened.truncate(size + 1)
    with pytest.raises(RecordingError, match=f'expected at most {words}'):
        read(tmp_path / 'large')


def allowed(kind, action):
    profile = ET.parse(PERMISSIONS).getroot().find(".//profile[@node='foc']")
    groups = [each for each in profile.findall(kind) if each.get(action) == 'ALLOW']
    return {each.text.strip() for group in groups for each in group}


def test_the_permissions_are_those_that_the_node_needs(ros):
    """The node needs all of them, and no others; the topic of a goal from its first prediction on."""
    from foc_ros.ros.endpoints import MOST_GOAL_TOPICS
    from foc_ros.ros.node import FocNode

    node = ros.add(FocNode(context=ros.context))

    def names(found):
        return {name.replace('/foc/', '~/') if name.startswith('/foc/') else name.removeprefix('/') for name, _ in found}

    goals = {f'~/goal_likelihood/goal{row}' for row in range(MOST_GOAL_TOPICS)}
    published = names(node.get_publisher_names_and_types_by_node('foc', '/')) | goals
    subscribed = names(node.get_subscriber_names_and_types_by_node('foc', '/'))
    services = names(node.get_service_names_and_types_by_node('foc', '/'))
    absolute = {'rosout', 'parameter_events', 'diagnostics', 'clock'}
    assert allowed('topics', 'publish') == {f'/{name}' if name in absolute else name for name in published}
    # the node subscribes to the clock if use_sim_time is set
    assert allowed('topics', 'subscribe') - {'/clock'} == {f'/{name}' if name in absolute else name for name in subscribed}
    assert allowed('services', 'reply') == services
    assert allowed('services', 'request') == set()
