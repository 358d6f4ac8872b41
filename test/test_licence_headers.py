# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every source file begins with its licence in the form of SPDX, after the line that names its interpreter."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEADER = ['SPDX-FileCopyrightText: 2026 the foc_ros developers', 'SPDX-License-Identifier: Apache-2.0']
COMMENTS = {'.py': '#', '.sh': '#', '.js': '//', '': '#'}
"""How a comment begins, by the ending of the file; without one, only what begins with `#!` is a source."""


def list_sources() -> list[Path]:
    """Return the sources that git knows; a link to another file is none."""
    listed = subprocess.run(['git', 'ls-files', '-z', '--cached'], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip('not a git checkout: the list of files is unknown')
    files = [ROOT / name for name in listed.stdout.split('\0') if name]
    files = [file for file in files if file.suffix in COMMENTS and file.is_file() and not file.is_symlink()]
    return [file for file in files if file.suffix or file.read_bytes()[:2] == b'#!']


def test_every_source_begins_with_its_licence() -> None:
    sources = list_sources()
    assert {'setup.py', 'run', 'player.js', 'colcon_check', '__main__.py'} <= {file.name for file in sources}
    for file in sources:
        lines = [line for line in file.read_text('utf-8').splitlines()[:3] if not line.startswith('#!')]
        header = [f'{COMMENTS[file.suffix]} {line}' for line in HEADER]
        assert lines[:2] == header, f'{file.relative_to(ROOT)} does not begin with {HEADER}'
