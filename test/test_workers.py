"""Recordings in parallel: the same results whoever computes them, and a dead worker costs one recording."""

import argparse
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import worker_tasks

from foc_ros.analysis.evaluation.lanes import IsolatedProcessPool
from foc_ros.analysis.evaluation.workers import Failure, add_worker_arguments, run, workers
from foc_ros.core.errors import InputError

ITEMS = [(f'r{number}', number) for number in range(8)]
SQUARES = [(name, number**2) for name, number in ITEMS]
KILLED = [(name, Failure('its worker process was killed') if number in (3, 5) else number**2) for name, number in ITEMS]


def _arguments(*given: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_worker_arguments(parser)
    return parser.parse_args(given)


@pytest.mark.parametrize('count', [1, 2, 3])
def test_results_come_in_order_and_do_not_depend_on_the_number_of_workers(count: int) -> None:
    with workers(_arguments('--workers', str(count))) as executor:
        assert list(run(worker_tasks.squared, ITEMS, executor)) == SQUARES


def test_any_executor_will_do() -> None:
    with ThreadPoolExecutor(2) as executor:
        assert list(run(worker_tasks.squared, ITEMS, executor)) == SQUARES


@pytest.mark.parametrize('count', [1, 2])
def test_a_killed_worker_fails_what_it_was_doing_and_nothing_else(count: int) -> None:
    with IsolatedProcessPool(count) as lanes:
        assert list(run(worker_tasks.deadly, ITEMS, lanes)) == KILLED


def test_an_exception_is_the_failure_of_its_item() -> None:
    with IsolatedProcessPool(1) as lanes:
        found = dict(run(worker_tasks.faulty, ITEMS[:4], lanes))
    assert found['r0'] == 0 and found['r3'] == 3
    assert found['r1'] == Failure('number: expected another than 1, got 1')
    assert found['r2'].reason.startswith("KeyError: 'two' (worker_tasks.py:")


def test_workers_work_at_the_same_time() -> None:
    with IsolatedProcessPool(2) as lanes:
        assert len({pid for _, pid in run(worker_tasks.worker_pid, ITEMS[:4], lanes)}) == 2


def test_left_by_an_exception_the_workers_are_killed() -> None:
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _interrupted()
    assert time.monotonic() - began < 30.0


def test_workers_end_with_a_parent_that_is_killed() -> None:
    script = """if __name__ == '__main__':
        import worker_tasks
        from foc_ros.analysis.evaluation.lanes import IsolatedProcessPool
        lanes = IsolatedProcessPool(1)
        print(lanes.submit(worker_tasks.worker_pid, 0).result(), flush=True)
        lanes.submit(worker_tasks.sleepy, 60.0).result()"""
    with subprocess.Popen([sys.executable, '-c', script], cwd=Path(__file__).parent, stdout=subprocess.PIPE, text=True) as parent:
        worker = int(parent.stdout.readline())
        parent.kill()
    deadline = time.monotonic() + 30.0
    while Path(f'/proc/{worker}').exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f'/proc/{worker}').exists()


def _interrupted() -> None:
    with IsolatedProcessPool(1) as lanes:
        results = run(worker_tasks.sleepy, [('short', 0.0), ('long', 60.0), ('later', 60.0)], lanes)
        assert next(results) == ('short', 0.0)
        raise KeyboardInterrupt


@pytest.mark.parametrize('given', [('--workers', '0'), ('--workers', '2000')])
def test_a_wrong_number_of_workers_is_refused(given: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r'--workers: expected a whole number in \[1, 1024\], got'):
        workers(_arguments(*given))


def test_a_scheduler_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('distributed', reason='the extra cluster is not installed')
    monkeypatch.setattr('foc_ros.analysis.evaluation.cluster.CONNECT_S', 0.3)
    for address in ('tcp://127.0.0.1:9', 'nonsense://host'):
        with pytest.raises(InputError, match='--scheduler: expected the address of a Dask scheduler'):
            workers(_arguments('--scheduler', address))
