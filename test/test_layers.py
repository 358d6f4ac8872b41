"""Imports run downward only: the contracts of pyproject.toml hold, and a violation is detected."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('importlinter', reason='import-linter is not installed')

ROOT = Path(__file__).parents[1]
VIOLATIONS = {
    'core/types.py': ['rclpy', 'foc_ros.core.hand.duration'],
    'core/predict.py': ['sensor_msgs'],
    'core/likelihood.py': ['rosbags'],
    'core/obstacles/risk.py': ['foc_ros.core.pipeline'],
    'core/classes/search.py': ['foc_ros.core.ocp.problem'],
    'io/bags.py': ['foc_ros.ros.intake'],
    'analysis/replay.py': ['foc_ros.reporting.draw'],
    'ros/parameters.py': ['foc_ros.analysis.replay'],
}
"""Imports by module that a contract forbids."""


def run_linter(folder: Path) -> subprocess.CompletedProcess[str]:
    program = 'import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))'
    return subprocess.run([sys.executable, '-c', program], cwd=folder, capture_output=True, text=True, timeout=100, check=False)


def test_imports_run_downward() -> None:
    result = run_linter(ROOT)
    assert result.returncode == 0, result.stdout


@pytest.fixture(scope='module')
def broken(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return what the linter prints about a copy of the package that contains all violations."""
    folder = tmp_path_factory.mktemp('broken')
    shutil.copy(ROOT / 'pyproject.toml', folder)
    shutil.copytree(ROOT / 'foc_ros', folder / 'foc_ros', ignore=shutil.ignore_patterns('__pycache__'))
    for module, names in VIOLATIONS.items():
        with (folder / 'foc_ros' / module).open('a', encoding='utf-8') as file:
            file.writelines(f'import {name}\n' for name in names)
    result = run_linter(folder)
    assert result.returncode == 1
    return result.stdout


@pytest.mark.parametrize(('module', 'name'), [(module, name) for module, names in VIOLATIONS.items() for name in names])
def test_an_upward_import_is_detected(broken: str, module: str, name: str) -> None:
    importer = 'foc_ros.' + module.removesuffix('.py').replace('/', '.')
    assert re.search(rf'{re.escape(importer)} -> {re.escape(name)} \(l', broken)
