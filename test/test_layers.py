"""Imports run downward only: the contracts of pyproject.toml hold, and would be seen if they did not."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('importlinter', reason='import-linter is not installed')

ROOT = Path(__file__).parents[1]


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    program = 'import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))'
    return subprocess.run([sys.executable, '-c', program], cwd=folder, capture_output=True, text=True, timeout=100, check=False)


def test_imports_run_downward() -> None:
    result = lint(ROOT)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(
    ('module', 'line'),
    [
        ('core/types.py', 'import rclpy'),
        ('core/predictor.py', 'from sensor_msgs.msg import PointCloud2'),
        ('core/likelihood.py', 'import rosbags'),
        ('core/obstacles/chance_constraint.py', 'from foc_ros.core import pipeline'),
        ('core/types.py', 'from foc_ros.core.estimation import duration'),
        ('core/homotopy/search.py', 'from foc_ros.core.ocp import problem'),
        ('io/bags.py', 'from foc_ros.ros import intake'),
        ('analysis/replay.py', 'from foc_ros.reporting import plots'),
        ('ros/parameters.py', 'from foc_ros.analysis import replay'),
    ],
)
def test_an_import_that_runs_upward_is_seen(tmp_path: Path, module: str, line: str) -> None:
    shutil.copy(ROOT / 'pyproject.toml', tmp_path)
    shutil.copytree(ROOT / 'foc_ros', tmp_path / 'foc_ros', ignore=shutil.ignore_patterns('__pycache__'))
    with (tmp_path / 'foc_ros' / module).open('a', encoding='utf-8') as file:
        file.write(f'{line}\n')
    result = lint(tmp_path)
    assert result.returncode == 1
    assert 'BROKEN' in result.stdout
