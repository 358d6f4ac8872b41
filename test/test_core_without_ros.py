# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The numeric core imports no ROS, and a recording is replayed without an installed ROS."""

import json
import subprocess
import sys
from pathlib import Path

BLOCKED = ('rclpy', 'ament_index_python', 'builtin_interfaces', 'rcl_interfaces', 'std_srvs')

BLOCK = f"""
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        root = name.partition('.')[0]
        if root in BLOCKED or root.endswith('_msgs'):
            raise ModuleNotFoundError(f'{{name}} is blocked', name=name)

BLOCKED = {{*{BLOCKED!r}}}
sys.meta_path.insert(0, Blocker())
"""

IMPORT_ALL = """
import importlib, pkgutil
import foc_ros.core
names = [module.name for module in pkgutil.walk_packages(foc_ros.core.__path__, 'foc_ros.core.')]
for name in names:
    importlib.import_module(name)
assert 'foc_ros.core.predict' in names, names
"""

PREDICT = """
import numpy as np
from foc_ros.core.config import Config
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.predict import predict
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.types import HandState
hand = HandState(0, np.zeros(6), np.zeros((6, 6)))
scene = make_obstacles([[0.15, 0.0]], [0.03], 0.002)
prediction, _ = predict(Config(), hand, scene, np.array([[0.3, 0.0]]), NO_TRACKS)
sides = sorted(outcome.sides['0'] for outcome in prediction.solved_candidates)
assert sides == [-1, 1], sides
"""


def run(program: str, *blocked: str) -> subprocess.CompletedProcess[str]:
    """Run a program in a Python in which ROS and the packages `blocked` cannot be imported."""
    block = BLOCK + f'BLOCKED |= {set(blocked)!r}\n' if blocked else BLOCK
    return subprocess.run([sys.executable, '-c', block + program], capture_output=True, text=True, timeout=100, check=False)


def test_core_imports_and_predicts_without_ros_and_rosbags() -> None:
    result = run(IMPORT_ALL + PREDICT, 'rosbags', 'rich', 'matplotlib')
    assert result.returncode == 0, result.stderr


def test_replay_runs_without_ros(tmp_path: Path) -> None:
    (tmp_path / 'slow.yaml').write_text('/**: {ros__parameters: {rate_hz: 1.0, foc.steps: 10}}', 'utf-8')
    program = f"""
from foc_ros.cli.main import main
from importlib.resources import files
bag = files('foc_ros') / 'recordings' / 'reaching.mcap'
sys.exit(main(['replay', str(bag), '--params', {str(tmp_path / 'slow.yaml')!r}, '--json']))
"""
    result = run(program)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)['summary']['predictions'] >= 20
