# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command lines of the documentation work as they stand: from a scene to a report, and a node beside a publisher."""

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from shown_commands import ENDLESS, NOT_RUN, PAGES, ROOT, find_commands, find_unknown_blocks, is_listed

from foc_ros.ros.isolated_node import reserve_domain

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

RUN = {page: [line for line in find_commands(page) if not is_listed(line, NOT_RUN)] for page in PAGES}
ENDLESS_S = 6
"""Time after which a line that runs until it is interrupted is interrupted."""
PAGE_S = 280
"""A page takes half a minute; this is for a busy machine."""
ROS_COMMANDS = ('foc_ros node', 'teleoperation_loop')


def test_every_pattern_is_shown_and_the_main_commands_are_run():
    shown = [line for page in PAGES for line in find_commands(page)]
    assert [pattern for pattern in (*NOT_RUN, *ENDLESS) if not any(is_listed(line, [pattern]) for line in shown)] == []
    run = [line for lines in RUN.values() for line in lines]
    assert len(run) >= 12
    for name in ('solve', 'convert', 'replay', 'node'):
        assert any(line.startswith(f'foc_ros {name} ') for line in run), f'no {name} is shown and run'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_block_is_of_a_known_kind(page):
    assert find_unknown_blocks(page) == []


@pytest.mark.timeout(PAGE_S + 20)
@pytest.mark.parametrize('page', [page for page in PAGES if RUN[page]], ids=lambda page: page.name)
def test_commands_work_as_shown(page, tmp_path):
    """The lines run in a clone that also contains the files that a user would bring."""
    if any(word in line for line in RUN[page] for word in ROS_COMMANDS) and find_spec('rclpy') is None:
        pytest.skip('rclpy is not installed')
    clone = make_clone(tmp_path / 'clone')
    done = run_lines(clone, RUN[page])
    assert done.returncode == 0, f'{done.stdout}\n{done.stderr}'
    check_outputs(page.name, clone, done.stdout)


def make_clone(clone):
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


def run_lines(clone, lines):
    """Run the lines in one shell, with their own ROS graph, and end the processes that they leave running."""
    # 124: the line was still running when it was interrupted
    run = [
        f'code=0; timeout -s INT {ENDLESS_S} {line} || code=$?; test $code = 124' if is_listed(line, ENDLESS) else line
        for line in lines
    ]
    script = '\n'.join(['set -euo pipefail', "trap 'kill $(jobs -p) 2>/dev/null || true; wait' EXIT", *run])
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    with reserve_domain() as domain:
        environment = os.environ | {'PATH': path, 'ROS_LOG_DIR': str(clone / 'log'), 'ROS_DOMAIN_ID': str(domain)}
        return subprocess.run(
            ['bash', '-c', script], cwd=clone, env=environment, capture_output=True, text=True, timeout=PAGE_S, check=False
        )


def check_outputs(page, clone, printed):
    if page in ('README.md', 'start.md'):
        numbers = json.loads((clone / 'report' / 'predictions.json').read_text('utf-8'))
        assert len(numbers['predictions']) > 20
        assert (clone / 'report' / 'index.html').exists()
        assert (clone / 'scene.png').exists()
    if page == 'start.md':
        shares = [
            int(line.rpartition(' ')[2].removesuffix('%')) for line in printed.splitlines() if 'following the prediction' in line
        ]
        assert shares and max(shares) > 10, printed


def test_a_line_that_fails_is_an_error(tmp_path):
    (tmp_path / 'clone').mkdir()
    assert run_lines(tmp_path / 'clone', ['foc_ros solve nothing.yaml']).returncode == 2
