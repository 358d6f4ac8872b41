# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program of the benchmark, with a row that compares the package with itself and so needs no peer."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / 'benchmarks'))


def run(*options: str, **environment: str) -> subprocess.CompletedProcess:
    command = [sys.executable, str(ROOT / 'benchmarks' / 'run.py'), '--quick', *options]
    return subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)


def test_a_row_reports_times_ratio_and_agreement():
    done = run('--json', '--only', 'far_obstacles')
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)
    assert row['name'] == 'far_obstacles'
    assert row['ratio'] == row['peer_ms'] / row['ours_ms'] > 0
    assert row['agree'] is True, row['agreement']
    assert row['repetitions'] > 0
    assert row['details']['solved'] == '4 of 4'


def test_a_row_that_cannot_be_measured_reports_the_error(tmp_path):
    (tmp_path / 'casadi.py').write_text("raise ImportError('the peer is missing')\n")
    done = run('--json', '--only', 'cold_circles_ipopt', PYTHONPATH=str(tmp_path))
    assert done.returncode == 1
    (row,) = json.loads(done.stdout)
    assert row['name'] == 'cold_circles_ipopt'
    assert row['error'] == 'ImportError: the peer is missing'
    assert (row['agree'], row['ratio']) == (False, None)


def test_an_unknown_row_is_rejected():
    done = run('--only', 'warm_vs_hot')
    assert done.returncode == 2
    assert 'warm_vs_hot' in done.stderr
