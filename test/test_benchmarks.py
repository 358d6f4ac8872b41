"""The benchmark's harness, on a row that compares us with ourselves and needs no peer."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def run(*options: str, **environment: str) -> subprocess.CompletedProcess:
    command = [sys.executable, str(ROOT / 'benchmarks' / 'run.py'), '--quick', *options]
    return subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)


def test_a_row_tells_its_times_their_ratio_and_whether_the_answers_agree():
    done = run('--json', '--only', 'warm_vs_cold')
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)
    assert row['name'] == 'warm_vs_cold'
    assert row['ratio'] == row['peer_ms'] / row['ours_ms'] > 0
    assert row['agree'] is True, row['agreement']
    assert row['repetitions'] > 0
    assert row['target'] == '≥ 4'
    assert row['met'] is (row['ratio'] >= 4)
    assert row['details']['qps_warm'] < row['details']['qps_cold']


def test_a_row_that_cannot_be_measured_says_why(tmp_path):
    (tmp_path / 'casadi.py').write_text("raise ImportError('no such peer here')\n")
    done = run('--json', '--report', str(tmp_path / 'page.html'), '--only', 'cold_vs_ipopt', PYTHONPATH=str(tmp_path))
    assert done.returncode == 1
    (row,) = json.loads(done.stdout)
    assert row['name'] == 'cold_vs_ipopt'
    assert row['error'] == 'ImportError: no such peer here'
    assert (row['agree'], row['met'], row['ratio']) == (False, False, None)
    page = (tmp_path / 'page.html').read_text(encoding='utf-8')
    assert '<p class="warning">cold_vs_ipopt: ImportError: no such peer here</p>' in page
    assert '<tr><th>cold_vs_ipopt</th>' in page


def test_an_unknown_row_is_refused():
    done = run('--only', 'warm_vs_hot')
    assert done.returncode == 2
    assert 'warm_vs_hot' in done.stderr
