"""The program as a process: exit codes, errors in one line, and no unnecessary imports."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from foc_ros.cli import main as command_line
from foc_ros.core.errors import InputError

ROOT = Path(__file__).parents[1]


def started(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', 'foc_ros', *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=100, check=False, **options)


@pytest.mark.parametrize(
    ('arguments', 'line'),
    [
        ([], 'foc_ros: the following arguments are required: command'),
        (['fly'], 'foc_ros: argument command: invalid choice'),
        (['convert'], 'foc_ros convert: the following arguments are required: CSV, --obstacles, --output'),
        (['replay', 'bag', '--fast'], 'foc_ros replay: unrecognized arguments: --fast'),
        (['replay', 'no_such_bag'], 'foc_ros replay: no_such_bag: no such file or directory'),
    ],
)
def test_wrong_arguments_exit_2_with_one_line(arguments: list[str], line: str) -> None:
    result = started(*arguments)
    assert result.returncode == 2
    assert result.stdout == ''
    assert result.stderr.startswith(line) and result.stderr.count('\n') == 1


def test_help_names_every_command_and_imports_nothing_heavy() -> None:
    program = (
        'import sys\nfrom foc_ros.cli.main import main\ntry:\n main(["--help"])\nfinally:\n'
        ' print("heavy:", sorted({"numpy", "rclpy", "rosbags", "rich", "piqp"} & set(sys.modules)))'
    )
    result = subprocess.run([sys.executable, '-c', program], cwd=ROOT, capture_output=True, text=True, timeout=100, check=False)
    assert result.returncode == 0, result.stderr
    assert all(f'  {name} ' in result.stdout for name in command_line.COMMANDS)
    assert 'heavy: []' in result.stdout


class Fake:
    """A command with a given outcome."""

    def __init__(self, outcome: int | BaseException) -> None:
        self.outcome = outcome

    def add_arguments(self, parser: object) -> None:
        pass

    def run(self, arguments: object) -> int:
        if isinstance(self.outcome, BaseException):
            raise self.outcome
        return self.outcome


@pytest.mark.parametrize(
    ('outcome', 'code', 'line'),
    [
        (0, 0, ''),
        (3, 3, ''),
        (InputError('start', 'two\n  numbers', 'one'), 2, 'foc_ros solve: start: expected two numbers, got one\n'),
        (KeyboardInterrupt(), 130, ''),
    ],
)
def test_exit_codes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], outcome: int | BaseException, code: int, line: str
) -> None:
    monkeypatch.setattr(command_line, 'import_module', lambda name, package: Fake(outcome))
    assert command_line.main(['solve']) == code
    assert capsys.readouterr() == ('', line)


def test_arguments_of_node_are_passed_to_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []

    class Node(Fake):
        def run(self, arguments: object) -> int:
            taken.append(arguments.rest)
            return 0

    monkeypatch.setattr(command_line, 'import_module', lambda name, package: Node(0))
    ros = ['--ros-args', '-r', 'hand_pose:=/PSM1/measured_cp', '-p', 'rate_hz:=20.0', '--params-file', 'foc.yaml']
    assert command_line.main(['node', *ros]) == 0
    assert taken == [ros]


def test_a_closed_standard_output_gives_no_traceback() -> None:
    program = (
        'import sys\nfrom foc_ros.cli import main as command_line\n'
        'class Loud:\n'
        ' add_arguments = staticmethod(lambda parser: None)\n'
        ' @staticmethod\n'
        ' def run(arguments):\n'
        '  for _ in range(100000): print("x" * 100)\n'
        '  return 0\n'
        'command_line.import_module = lambda name, package: Loud\n'
        'sys.exit(command_line.main(["solve"]))'
    )
    reading, writing = os.pipe()
    os.close(reading)
    try:
        result = subprocess.run(
            [sys.executable, '-c', program], cwd=ROOT, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=100, check=False
        )
    finally:
        os.close(writing)
    assert (result.returncode, result.stderr) == (141, '')
