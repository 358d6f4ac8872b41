# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`make setup`: what it installs and says, and how it names a Python that cannot be used. Nothing is installed here."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.skipif(shutil.which('make') is None, reason='make is not installed')


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a folder with the files that `make setup` reads."""
    folder = tmp_path / 'clone'
    folder.mkdir()
    for name in ('Makefile', 'setup.py', 'setup.cfg', 'pyproject.toml'):
        shutil.copy(ROOT / name, folder)
    return folder


def make(clone: Path, *arguments: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run make; path: a folder in which programs are found first."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(('MAKE', 'MFLAGS', 'VIRTUAL_ENV'))}
    environment['PATH'] = os.pathsep.join([*([] if path is None else [str(path)]), environment['PATH']])
    command = ['make', '--no-print-directory', *arguments]
    return subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True, timeout=100, check=False)


def write_program(file: Path, text: str) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f'#!/bin/sh\n{text}\n')
    file.chmod(0o755)
    return file


def test_a_python_that_is_not_there_is_named(clone: Path) -> None:
    result = make(clone, 'setup', 'PYTHON=no_such_python')
    assert result.returncode != 0
    assert 'make: there is no no_such_python; choose another, as in make setup PYTHON=python3.12\n' in result.stderr
    assert not (clone / '.venv').exists()


def test_an_inactive_shim_of_pyenv_is_named_with_what_to_do(clone: Path, tmp_path: Path) -> None:
    shim = write_program(tmp_path / 'shims' / 'python3.99', 'exit 127')
    write_program(tmp_path / 'shims' / 'pyenv', 'echo 3.99.1')
    result = make(clone, 'setup', 'PYTHON=python3.99', path=shim.parent)
    assert result.returncode != 0
    words = 'make: python3.99 is a shim of pyenv, and no active version has it; activate one that has: pyenv shell 3.99.1\n'
    assert words in result.stderr
    assert not (clone / '.venv').exists()


def test_an_old_python_is_refused_before_anything_is_made(clone: Path, tmp_path: Path) -> None:
    old = write_program(tmp_path / 'bin' / 'python3', 'case "$*" in *version_info*) exit 1;; -V) echo Python 3.10.2;; esac')
    result = make(clone, 'setup', f'PYTHON={old}')
    assert result.returncode != 0
    assert f'make: foc_ros needs Python 3.11 to 3.14, and {old} is Python 3.10.2; choose another' in result.stderr
    assert not (clone / '.venv').exists()


def list_commands(clone: Path, target: str) -> str:
    """Return what a target would run."""
    result = make(clone, '--dry-run', target)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_it_says_what_it_does(clone: Path) -> None:
    told = re.findall(r'echo [\'"](setup: \w+)', list_commands(clone, 'setup'))
    assert told == ['setup: creating', 'setup: installing', 'setup: ready']
    assert 'setup: ready; next: make demo' in list_commands(clone, 'setup')


def test_linters_and_peers_are_installed_by_their_targets_only(clone: Path) -> None:
    extras = {
        target: re.findall(r"'\.\[([\w,]+)\]'", list_commands(clone, target)) for target in ('setup', 'lint', 'doc', 'bench')
    }
    setup = 'ros,report,play,test'
    assert extras == {'setup': [setup], 'lint': [setup, 'lint'], 'doc': [setup, 'doc'], 'bench': [setup, 'bench']}
