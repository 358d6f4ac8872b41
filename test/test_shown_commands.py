"""What the documentation shows works by copy and paste: from a scene to a report, and a node beside a publisher."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from ros_helpers import free_domain
from shown_commands import ENDLESS, NOT_RUN, PAGES, ROOT, commands, other_shell_blocks

pytest.importorskip('matplotlib', reason='matplotlib is not installed')
pytest.importorskip('plotly', reason='plotly is not installed')

RUN = {page: [line for line in commands(page) if line not in NOT_RUN] for page in PAGES}
PATIENCE_S = 6
"""How long a line that runs until it is interrupted is left running."""
PAGE_S = 280
"""A page takes half a minute; this is for a machine that is busy with other things."""
WANT_ROS = ('foc_ros node', 'teleoperation_loop')


def test_every_command_is_run_or_listed() -> None:
    shown = [line for page in PAGES for line in commands(page)]
    listed = {*NOT_RUN, *ENDLESS}
    assert listed <= set(shown), f'listed but not shown: {listed - set(shown)}'
    run = [line for lines in RUN.values() for line in lines]
    assert len(run) + sum(line in NOT_RUN for line in shown) == len(shown)
    assert len(run) >= 12
    for name in ('solve', 'convert', 'replay', 'node'):
        assert any(line.startswith(f'foc_ros {name} ') for line in run), f'no {name} is shown and run'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_no_block_escapes_the_rule(page: Path) -> None:
    assert other_shell_blocks(page) == []


@pytest.mark.timeout(PAGE_S + 20)
@pytest.mark.parametrize('page', [page for page in PAGES if RUN[page]], ids=lambda page: page.name)
def test_commands_work_as_shown(page: Path, tmp_path: Path) -> None:
    """In a clone, where the README's files lie that a user would bring."""
    if any(word in line for line in RUN[page] for word in WANT_ROS) and find_spec('rclpy') is None:
        pytest.skip('rclpy is not installed')
    clone = stocked(tmp_path / 'clone')
    done = shell(clone, RUN[page])
    assert done.returncode == 0, f'{done.stdout}\n{done.stderr}'
    check_what_came(page.name, clone, done.stdout)


def stocked(clone: Path) -> Path:
    """Return a clone with the files that the pages call the user's own."""
    clone.mkdir()
    for name in ('doc', 'config', 'scripts', 'foc_ros', 'Makefile', 'setup.py', 'test', 'pyproject.toml'):
        (clone / name).symlink_to(ROOT / name)
    (clone / '.venv' / 'bin').mkdir(parents=True)
    (clone / '.venv' / 'bin' / 'python').symlink_to(sys.executable)
    for name in ('recordings.csv', 'obstacles.csv', 'goals.csv', 'scene.yaml'):
        shutil.copy(ROOT / 'doc' / 'examples' / name, clone)
    shutil.copy(ROOT / 'config' / 'foc.yaml', clone)
    tables = ['recordings.csv', '--obstacles', 'obstacles.csv', '--goals', 'goals.csv', '--output', 'made']
    subprocess.run([sys.executable, '-m', 'foc_ros', 'convert', *tables], cwd=clone, check=True, capture_output=True)
    (clone / 'made' / 'a').rename(clone / 'my_bag')
    return clone


def shell(clone: Path, lines: list[str]) -> subprocess.CompletedProcess[str]:
    """Run the lines in one shell and in a ROS graph of their own; what they leave running ends with it."""
    # 124: it was still running when its time was over
    run = [
        f'code=0; timeout -s INT {PATIENCE_S} {line} || code=$?; test $code = 124' if line in ENDLESS else line for line in lines
    ]
    script = '\n'.join(['set -euo pipefail', "trap 'kill $(jobs -p) 2>/dev/null || true; wait' EXIT", *run])
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    with free_domain() as domain:
        environment = os.environ | {'PATH': path, 'ROS_LOG_DIR': str(clone / 'log'), 'ROS_DOMAIN_ID': str(domain)}
        return subprocess.run(
            ['bash', '-c', script], cwd=clone, env=environment, capture_output=True, text=True, timeout=PAGE_S, check=False
        )


def check_what_came(page: str, clone: Path, told: str) -> None:
    if page in ('README.md', 'start.md'):
        numbers = json.loads((clone / 'report' / 'predictions.json').read_text('utf-8'))
        assert len(numbers['predictions']) > 20
        assert (clone / 'report' / 'index.html').exists()
        assert (clone / 'scene.png').exists()
    if page == 'start.md':
        leaning = [int(line.rpartition(' ')[2].removesuffix('%')) for line in told.splitlines() if 'leaning on' in line]
        assert leaning and max(leaning) > 10, told


def test_a_line_that_fails_is_noticed(tmp_path: Path) -> None:
    (tmp_path / 'clone').mkdir()
    assert shell(tmp_path / 'clone', ['foc_ros solve nothing.yaml']).returncode == 2
