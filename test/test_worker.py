# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The process that computes the predictions of the node."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CASES = Path(__file__).with_name('worker_cases.py')


@pytest.mark.skipif(sys.platform != 'linux', reason='elsewhere predictions are computed in the process of the node')
def test_it_keeps_its_promises():
    """In a new pytest: it is forked from a process with one thread, as the node does, and not from one with those of DDS."""
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', '-n0', str(CASES)]
    ended = subprocess.run(
        command, capture_output=True, text=True, timeout=120.0, check=False, env=os.environ | {'OPENBLAS_NUM_THREADS': '1'}
    )
    assert ended.returncode == 0, ended.stdout
    assert ' passed' in ended.stdout and 'skipped' not in ended.stdout
