# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node needs what `package.xml` names and nothing else; whatever needs more says in one sentence what is missing."""

import json
import os
import re
import runpy
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

ROOT = Path(__file__).parents[1]
OPTIONAL = ('cyclopts', 'distributed', 'jinja2', 'joblib', 'matplotlib', 'mcap', 'pydantic', 'rich', 'rosbags', 'tornado')
"""Packages that are blocked below: as where only package.xml was installed."""
ROS = ('rclpy', 'ament_index_python', 'builtin_interfaces', 'rcl_interfaces', 'std_srvs', '*_msgs')
BLOCK = """
import importlib.util, sys
from fnmatch import fnmatchcase

class Blocker:
    names = {names!r}

    def blocks(self, name):
        return any(fnmatchcase(name.partition('.')[0], each) for each in self.names)

    def find_spec(self, name, path=None, target=None):
        if self.blocks(name):
            raise ModuleNotFoundError(f'{{name}} is blocked', name=name.partition('.')[0])

blocker = Blocker()
sys.meta_path.insert(0, blocker)
find, importlib.util.find_spec = importlib.util.find_spec, lambda name: None if blocker.blocks(name) else find(name)
"""


def read_requirements():
    """Return the names of what setup.py requires: `''` for all, otherwise by extra, in small letters."""
    given: dict[str, Any] = {}
    setuptools = SimpleNamespace(setup=given.update, find_packages=lambda **_: [])
    with mock.patch.dict(sys.modules, setuptools=setuptools):
        runpy.run_path(str(ROOT / 'setup.py'))
    lists = {'': given['install_requires'], **given['extras_require']}
    return {extra: {re.split('[^A-Za-z0-9-]', each)[0].lower() for each in needed} for extra, needed in lists.items()}


def list_keys():
    """Return the keys of package.xml for Python packages as names of the package index."""
    keys = {node.text for node in ET.parse(ROOT / 'package.xml').getroot().findall('exec_depend')}
    names = {key.removeprefix('python3-').removesuffix('-pip') for key in keys if key.startswith('python3-')}
    return {name.replace('yaml', 'pyyaml') for name in names}


def test_package_xml_and_the_optional_packages_are_all_requirements():
    required = read_requirements()
    assert list_keys() == {'numpy', 'piqp', 'pyyaml', 'qpsolvers', 'scipy'}
    assert not list_keys() & set(OPTIONAL)
    assert required[''] | required['report'] | required['play'] | required['cluster'] == list_keys() | set(OPTIONAL)


def run(program, names=OPTIONAL):
    command = [sys.executable, '-c', BLOCK.format(names=names) + program]
    return subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)


def test_a_command_names_the_packages_that_it_needs():
    result = run("from foc_ros.__main__ import main\nsys.exit(main(['solve', 'scene.yaml']))")
    assert result.returncode == 2
    names = 'cyclopts joblib mcap pydantic rich rosbags'
    assert result.stderr == f'foc_ros: this command needs packages that are not installed: pip install {names}\n'


def test_predictions_and_guidance_work_without_them_and_what_needs_them_says_so():
    program = """
import foc_ros
predictor = foc_ros.Predictor(foc_ros.Config())
predictor.set_goals([(0.3, 0.0)])
predictor.set_obstacles([foc_ros.Circle((0.15, 0.01), radius=0.03)])
for tick in range(31):
    t = 0.01 * tick
    prediction = predictor.update(t=t, position=(t**3, 0.1 * t**2))
print(len(prediction.candidates))
foc_ros.Guidance(foc_ros.Config())
for use in (lambda: list(foc_ros.replay('x.mcap')), foc_ros.solve((0.0, 0.0), (0.3, 0.0)).plot):
    try:
        use()
    except foc_ros.FocError as error:
        print(error)
for name in OPTIONAL:
    try:
        __import__(name)
    except ModuleNotFoundError as error:
        print(error)
"""
    result = run(f'OPTIONAL = {OPTIONAL!r}{program}')
    assert result.returncode == 0, result.stderr
    count, replay, plot, *blocked = result.stdout.splitlines()
    assert count == '2' and 'pip install mcap rosbags' in replay and "pip install 'foc_ros[report]'" in plot
    assert blocked == [f'{name} is blocked' for name in OPTIONAL]


def test_the_core_needs_neither_ros_nor_rosbags_and_a_replay_no_ros(tmp_path):
    (tmp_path / 'slow.yaml').write_text('/**: {ros__parameters: {rate_hz: 0.5, foc.steps: 10}}', 'utf-8')
    program = f"""
import importlib, pkgutil
import foc_ros.core
for module in pkgutil.walk_packages(foc_ros.core.__path__, 'foc_ros.core.'):
    importlib.import_module(module.name)
assert 'foc_ros.core.predict' in sys.modules
blocker.names = {ROS!r}
from foc_ros.cli.main import main
arguments = ['replay', 'foc_ros/recordings/reaching.mcap', '--json', '--params', {str(tmp_path / 'slow.yaml')!r}]
sys.exit(main(arguments))
"""
    result = run(program, ROS + OPTIONAL)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)['summary']['predictions'] >= 10


def test_the_node_needs_nothing_else_says_what_it_does_and_leaves_no_files_and_no_trace_in_the_graph(ros, tmp_path):
    """Started as by `ros2 run` and `ros2 launch`, by a file in `lib/foc_ros`, with an rclpy that has only its plain executor."""
    from process_helpers import ended, predict_once, running

    (tmp_path / 'site').mkdir()
    plain = "\nsys.modules['rclpy.experimental.events_executor'] = None\n"
    (tmp_path / 'site' / 'sitecustomize.py').write_text(BLOCK.format(names=OPTIONAL) + plain)
    path = os.pathsep.join([str(tmp_path / 'site'), str(ROOT), os.environ.get('PYTHONPATH', '')])
    command = [sys.executable, str(ROOT / 'scripts' / 'ros2_run' / 'foc_node'), '--ros-args', '-r', 'hand_pose:=MTMR/measured_cp']
    watcher, variables = ros.node('watcher'), {'ROS_LOG_DIR': str(tmp_path / 'log'), 'PYTHONPATH': path}
    with running(ros, command=command, cwd=tmp_path, **variables) as process:
        player = predict_once(ros, 'MTMR/measured_cp')
        code, errors = ended(process, signal.SIGINT)
    assert code == 0, errors
    assert player.predictions[0].width > 0
    lines = [line.partition('[foc]: ')[2] for line in errors.splitlines() if line.startswith('[INFO]')]
    assert lines[-2:] == [
        'ready, waiting for /MTMR/measured_cp; /obstacles or /obstacle_markers; /goals or /goal_pose',
        'predicting in frame world, plane xy',
    ]
    ros.spin_until(lambda: 'foc' not in watcher.get_node_names(), 'the end of the node in the graph', 30.0)
    assert sorted(each.name for each in tmp_path.iterdir()) == ['log', 'site']
