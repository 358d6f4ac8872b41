"""Ctrl-C ends a command at any moment, with exit code 130 and without a traceback."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

from foc_ros.cli import interrupts
from foc_ros.cli.interrupts import handle_interrupts

ROOT = Path(__file__).parents[1]
LIMIT_S = 60.0


def wait_for_interrupt() -> None:
    deadline = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline:
        pass


def test_an_interrupt_is_raised_and_the_usual_handler_comes_back() -> None:
    before = signal.getsignal(signal.SIGALRM)
    with pytest.raises(KeyboardInterrupt), handle_interrupts():
        signal.raise_signal(signal.SIGINT)
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM)) == (signal.default_int_handler, before)
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


def test_an_interrupt_waits_for_the_end_of_code_without_a_file() -> None:
    """Named tuples are constructed by such code."""
    reached = []
    code = compile('signal.raise_signal(signal.SIGINT)\nreached.append(True)', '<string>', 'exec')
    with pytest.raises(KeyboardInterrupt), handle_interrupts():  # noqa: PT012
        exec(code, {'signal': signal, 'reached': reached})
        wait_for_interrupt()
    assert reached == [True]


def test_an_interrupt_waits_for_the_end_of_an_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'slowly_imported.py').write_text('import signal\nsignal.raise_signal(signal.SIGINT)\nis_complete = True\n')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt), handle_interrupts():  # noqa: PT012
        import_module('slowly_imported')
        wait_for_interrupt()
    assert sys.modules.pop('slowly_imported').is_complete


def test_an_import_that_does_not_end_is_left(tmp_path: Path) -> None:
    (tmp_path / 'endless.py').write_text('import signal\nsignal.raise_signal(signal.SIGINT)\nwhile True: pass\n')
    program = 'from foc_ros.cli.interrupts import handle_interrupts\nwith handle_interrupts(): import endless'
    environment = os.environ | {'PYTHONPATH': f'{tmp_path}{os.pathsep}{ROOT}'}
    command = [sys.executable, '-c', program]
    ended = subprocess.run(command, env=environment, capture_output=True, timeout=LIMIT_S, check=False)
    assert (ended.returncode, ended.stderr) == (130, b'')


def test_an_interrupt_that_was_swallowed_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, 'REPEATED_S', 0.01)
    with pytest.raises(KeyboardInterrupt), handle_interrupts():  # noqa: PT012
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            wait_for_interrupt()


def test_an_interrupt_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with handle_interrupts():
            signal.raise_signal(signal.SIGINT)
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def catches(process: subprocess.Popen[str], number: int) -> bool:
    """Return whether a process has a handler for a signal."""
    lines = Path(f'/proc/{process.pid}/status').read_text('ascii').splitlines()
    mask = next(int(line.split()[1], 16) for line in lines if line.startswith('SigCgt'))
    return bool(mask >> (number - 1) & 1)


@pytest.mark.parametrize('turn', range(4))
def test_a_command_is_interrupted_at_any_moment(turn: int) -> None:
    """The moments lie in the imports, in the solve and in the sampling after it."""
    command = [sys.executable, '-m', 'foc_ros', 'solve', 'doc/examples/scene.yaml', '--monte-carlo', '10000000']
    pipes = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.PIPE, 'text': True}
    with subprocess.Popen(command, cwd=ROOT, **pipes) as process:
        deadline = time.monotonic() + LIMIT_S
        while not catches(process, signal.SIGALRM):
            assert process.poll() is None and time.monotonic() < deadline
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(random.Random(turn).uniform(0.0, 0.5 * turn) + 1e-6)
        process.send_signal(signal.SIGINT)
        try:
            _, errors = process.communicate(timeout=LIMIT_S)
        finally:
            process.kill()
    assert (process.returncode, errors) == (130, '')
