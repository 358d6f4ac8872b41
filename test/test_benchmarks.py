"""The program of the benchmark, with a row that compares the package with itself and so needs no peer."""

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / 'benchmarks'))

measurement = importlib.import_module('measurement')


def run(*options: str, **environment: str) -> subprocess.CompletedProcess:
    command = [sys.executable, str(ROOT / 'benchmarks' / 'run.py'), '--quick', *options]
    return subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)


def test_a_row_reports_times_ratio_and_agreement():
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


def test_a_row_that_cannot_be_measured_reports_the_error(tmp_path):
    (tmp_path / 'casadi.py').write_text("raise ImportError('the peer is missing')\n")
    done = run('--json', '--report', str(tmp_path / 'page.html'), '--only', 'cold_vs_ipopt', PYTHONPATH=str(tmp_path))
    assert done.returncode == 1
    (row,) = json.loads(done.stdout)
    assert row['name'] == 'cold_vs_ipopt'
    assert row['error'] == 'ImportError: the peer is missing'
    assert (row['agree'], row['met'], row['ratio']) == (False, False, None)
    page = (tmp_path / 'page.html').read_text(encoding='utf-8')
    assert '<p class="warning">cold_vs_ipopt: ImportError: the peer is missing</p>' in page
    assert '<tr><th>cold_vs_ipopt</th>' in page


def test_an_unknown_row_is_rejected():
    done = run('--only', 'warm_vs_hot')
    assert done.returncode == 2
    assert 'warm_vs_hot' in done.stderr


@pytest.mark.parametrize(
    ('ratio_of', 'target', 'ratio', 'is_met'),
    [
        ('peer / ours', measurement.at_least(2.0), 2.5, True),
        ('peer / ours', measurement.at_least(3.0), 2.5, False),
        ('ours / peer', measurement.at_most(0.4), 0.4, True),
        ('ours / peer', measurement.at_most(0.3), 0.4, False),
        ('peer / ours', None, 2.5, None),
    ],
)
def test_a_target_is_met_on_its_side_of_the_bound(ratio_of, target, ratio, is_met):
    ours, peer = measurement.Timing('a', 2.0), measurement.Timing('b', 5.0)
    agreement = measurement.Agreement(True, 'equal')
    result = measurement.Result(ours, peer, ratio_of, agreement, 1, target)
    assert (result.ratio, result.is_met) == (ratio, is_met)


def test_a_target_is_not_met_by_answers_that_disagree():
    timing = measurement.Timing('a', 1.0)
    agreement = measurement.Agreement(False, 'different')
    assert not measurement.Result(timing, timing, 'peer / ours', agreement, 1, measurement.at_least(0.5)).is_met


def test_tasks_are_timed_in_turn():
    calls = []
    times = measurement.time_in_turn({'a': lambda: calls.append('a'), 'b': lambda: calls.append('b')}, 2)
    assert calls == ['a', 'b'] * 3
    assert {name: len(each) for name, each in times.items()} == {'a': 2, 'b': 2}
