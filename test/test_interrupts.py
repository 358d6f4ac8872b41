# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends a command at any moment, with exit code 130 and without a traceback."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LIMIT_S = 60.0


def test_an_import_is_left_at_once(tmp_path: Path) -> None:
    (tmp_path / 'endless.py').write_text('import signal\nsignal.raise_signal(signal.SIGINT)\nwhile True: pass\n')
    program = 'from foc_ros.cli.main import handle_interrupts\nwith handle_interrupts(): import endless'
    environment = os.environ | {'PYTHONPATH': f'{tmp_path}{os.pathsep}{ROOT}'}
    command = [sys.executable, '-c', program]
    ended = subprocess.run(command, env=environment, capture_output=True, timeout=LIMIT_S, check=False)
    assert (ended.returncode, ended.stderr) == (130, b'')


@pytest.mark.parametrize('turn', [0, 6])
def test_a_command_is_interrupted_at_any_moment(turn: int) -> None:
    """The moments lie in the imports, in the solve and in the sampling after it."""
    command = ['solve', 'doc/examples/scene.yaml', '--monte-carlo', '10000000']
    program = f'import sys\nfrom foc_ros.cli.main import main\nprint(flush=True)\nsys.exit(main({command}))'
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    with subprocess.Popen([sys.executable, '-c', program], cwd=ROOT, **pipes) as process:
        assert process.stdout.readline() == '\n'
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.02 + random.Random(turn).uniform(0.0, 0.25 * turn))
        process.send_signal(signal.SIGINT)
        try:
            _, errors = process.communicate(timeout=LIMIT_S)
        finally:
            process.kill()
    assert (process.returncode, errors) == (130, '')
