# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings in parallel: results do not depend on the workers, and a killed worker fails one recording only."""

import os
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import psutil
import pytest
import worker_tasks
from play_helpers import has_ended, until
from test_evaluate import evaluate, write_three

from foc_ros.analysis.parallel import Failure, open_workers, run
from foc_ros.cli.main import app
from foc_ros.core.errors import InputError, RecordingError

ITEMS = [(f'r{number}', number) for number in range(8)]
SQUARES = [(name, number**2) for name, number in ITEMS]
LIMIT_S = 60.0


def parse_study(*given):
    """Return the options of a study, as a command reads them."""
    _, bound, _ = app.parse_args(['simulate', *given], exit_on_error=False, print_error=False)
    return bound.arguments['study']


@pytest.mark.parametrize('count', [None, 1, 2, 3])
def test_results_come_in_order_and_an_exception_is_the_failure_of_its_item_whatever_the_workers(count):
    with nullcontext() if count is None else open_workers(count):
        assert list(run(worker_tasks.squared, ITEMS)) == SQUARES
        found = dict(run(worker_tasks.faulty, ITEMS[:4]))
        ((_, number),) = run(worker_tasks.process_id, [('alone', None)])
    assert (number == os.getpid()) == (count in (None, 1)), 'a single worker is this process'
    assert found['r0'] == 0 and found['r3'] == 3
    assert found['r1'] == Failure('number: expected another than 1, got 1')
    assert found['r2'].reason.startswith("KeyError: 'two' (worker_tasks.py:")


@pytest.fixture(scope='module')
def cluster_address():
    """Yield the address of a Dask cluster of two worker processes on this machine."""
    dask = pytest.importorskip('dask', reason='the extra cluster is not installed')
    distributed = pytest.importorskip('distributed', reason='the extra cluster is not installed')
    # a task is given up after its second death, not its fourth: the test is shorter
    settings = {'distributed.scheduler.allowed-failures': 1, 'distributed.worker.multiprocessing-method': 'spawn'}
    with (
        dask.config.set(settings),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=':0') as cluster,
    ):
        yield cluster.scheduler_address


def test_an_evaluation_is_the_same_with_one_worker_with_two_and_on_a_cluster(tmp_path, cluster_address):
    data = write_three(tmp_path / 'data')
    answers = [evaluate(data, workers=each) for each in ('--workers=1', '--workers=2', f'--scheduler={cluster_address}')]
    assert answers[0] == answers[1] == answers[2]


@pytest.mark.parametrize(('is_cluster', 'error'), [(False, 'TerminatedWorkerError'), (True, 'KilledWorker')])
def test_a_killed_worker_fails_what_it_was_doing_and_nothing_else(request, is_cluster, error):
    with open_workers(1, request.getfixturevalue('cluster_address')) if is_cluster else open_workers(2):
        found = dict(run(worker_tasks.deadly, ITEMS))
    failure = Failure(f'its worker process was lost ({error})')
    assert found == {name: failure if name in ('r3', 'r5') else square for name, square in SQUARES}


def start_workers(folder):
    """Return a command that waits for two of its three workers, and the processes of all."""
    folder.mkdir()
    script = f"""if __name__ == '__main__':
        import worker_tasks
        from foc_ros.analysis.parallel import open_workers, run
        from foc_ros.__main__ import handle_interrupts
        with handle_interrupts(), open_workers(3):
            list(run(worker_tasks.wait_here, [(name, {str(folder)!r}) for name in 'ab']))"""
    pipes = {'stderr': subprocess.PIPE, 'text': True, 'start_new_session': True}
    process = subprocess.Popen([sys.executable, '-c', script], cwd=Path(__file__).parent, **pipes)
    until(lambda: len(list(folder.iterdir())) == 2, 'two workers')
    workers = [
        each.pid for each in psutil.Process(process.pid).children() if 'loky.backend.popen_loky_posix' in ' '.join(each.cmdline())
    ]
    assert len(workers) == 3
    return process, workers


def test_workers_end_with_a_parent_that_is_killed_or_interrupted_at_its_terminal(tmp_path):
    folders = tmp_path / 'killed', tmp_path / 'interrupted'
    (killed, orphans), (interrupted, workers) = map(start_workers, folders)
    killed.kill()
    killed.communicate()
    os.killpg(interrupted.pid, signal.SIGINT)
    _, errors = interrupted.communicate(timeout=LIMIT_S)
    until(lambda: all(map(has_ended, orphans + workers)), 'the end of the workers')
    assert errors.rstrip().endswith('KeyboardInterrupt'), 'the traceback of the command, which its program does not print'
    assert 'Warning' not in errors and errors.count('Traceback') == 1


def test_a_scheduler_that_is_not_there_or_has_no_workers_is_refused(monkeypatch):
    distributed = pytest.importorskip('distributed', reason='the extra cluster is not installed')
    monkeypatch.setattr('foc_ros.analysis.parallel.CONNECT_S', 0.3)
    for address in ('tcp://127.0.0.1:9', 'nonsense://host'):
        refused = pytest.raises(InputError, match='--scheduler: expected the address of a Dask scheduler')
        with refused, parse_study('--scheduler', address).open_workers():
            pass
    with distributed.LocalCluster(n_workers=0, dashboard_address=':0') as cluster:
        refused = pytest.raises(InputError, match='--scheduler: expected a Dask scheduler with workers, got none at')
        with refused, open_workers(1, cluster.scheduler_address):
            pass


def test_a_scheduler_that_dies_ends_the_run_in_words():
    distributed = pytest.importorskip('distributed', reason='the extra cluster is not installed')
    local = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=':0')
    with local as cluster, open_workers(1, cluster.scheduler_address):
        results = run(worker_tasks.sleepy, [('a', 0.0), ('b', 1.0), ('c', 1.0)])
        assert next(results) == ('a', 0.0)
        cluster.close()
        with pytest.raises(RecordingError, match='the Dask scheduler was lost before all recordings had their turn'):
            list(results)
