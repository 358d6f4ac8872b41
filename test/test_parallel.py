"""Recordings in parallel: results do not depend on the workers, and a killed worker fails one recording only."""

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import worker_tasks

from foc_ros.analysis.parallel import Failure, IsolatedProcessPool, open_executor, run
from foc_ros.cli.main import app
from foc_ros.cli.options import Study
from foc_ros.core.errors import InputError

ITEMS = [(f'r{number}', number) for number in range(8)]
SQUARES = [(name, number**2) for name, number in ITEMS]
KILLED = [(name, Failure('its worker process was killed') if number in (3, 5) else number**2) for name, number in ITEMS]


def parse_study(*given: str) -> Study:
    """Return the options of a study, as a command reads them."""
    _, bound, _ = app.parse_args(['simulate', *given], exit_on_error=False, print_error=False)
    return bound.arguments['study']


@pytest.mark.parametrize('count', [1, 2, 3])
def test_results_come_in_order_and_do_not_depend_on_the_number_of_workers(count: int) -> None:
    with open_executor(count) as executor:
        assert list(run(worker_tasks.squared, ITEMS, executor)) == SQUARES


def test_any_executor_can_be_used() -> None:
    with ThreadPoolExecutor(2) as executor:
        assert list(run(worker_tasks.squared, ITEMS, executor)) == SQUARES


@pytest.mark.parametrize('count', [1, 2])
def test_a_killed_worker_fails_what_it_was_doing_and_nothing_else(count: int) -> None:
    with IsolatedProcessPool(count) as pool:
        assert list(run(worker_tasks.deadly, ITEMS, pool)) == KILLED


def test_an_exception_is_the_failure_of_its_item() -> None:
    with IsolatedProcessPool(1) as pool:
        found = dict(run(worker_tasks.faulty, ITEMS[:4], pool))
    assert found['r0'] == 0 and found['r3'] == 3
    assert found['r1'] == Failure('number: expected another than 1, got 1')
    assert found['r2'].reason.startswith("KeyError: 'two' (worker_tasks.py:")


def test_an_argument_that_cannot_be_loaded_is_the_failure_of_its_item() -> None:
    with IsolatedProcessPool(1) as pool:
        found = dict(run(worker_tasks.squared, [('bad', worker_tasks.Unloadable()), ('good', 2)], pool))
    assert found['good'] == 4 and 'ValueError: invalid literal' in found['bad'].reason


def test_workers_run_concurrently(tmp_path: Path) -> None:
    with IsolatedProcessPool(2) as pool:
        assert len({pid for _, pid in run(worker_tasks.meet, [(str(n), str(tmp_path)) for n in range(2)], pool)}) == 2


def test_an_exception_that_leaves_the_context_kills_the_workers() -> None:
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _run_interrupted()
    assert time.monotonic() - began < 30.0


def test_workers_end_with_a_parent_that_is_killed() -> None:
    script = """if __name__ == '__main__':
        import os, worker_tasks
        from foc_ros.analysis.parallel import IsolatedProcessPool
        pool = IsolatedProcessPool(1)
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(worker_tasks.sleepy, 60.0).result()"""
    with subprocess.Popen([sys.executable, '-c', script], cwd=Path(__file__).parent, stdout=subprocess.PIPE, text=True) as parent:
        worker = int(parent.stdout.readline())
        parent.kill()
    deadline = time.monotonic() + 30.0
    while Path(f'/proc/{worker}').exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f'/proc/{worker}').exists()


def _run_interrupted() -> None:
    with IsolatedProcessPool(1) as pool:
        results = run(worker_tasks.sleepy, [('short', 0.0), ('long', 60.0), ('later', 60.0)], pool)
        assert next(results) == ('short', 0.0)
        raise KeyboardInterrupt


@pytest.mark.parametrize('given', [('--workers', '0'), ('--workers', '2000')])
def test_a_wrong_number_of_workers_is_refused(given: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r'--workers: expected a whole number in \[1, 1024\], got'):
        parse_study(*given)


def test_a_scheduler_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('distributed', reason='the extra cluster is not installed')
    monkeypatch.setattr('foc_ros.analysis.dask_cluster.CONNECT_S', 0.3)
    for address in ('tcp://127.0.0.1:9', 'nonsense://host'):
        with pytest.raises(InputError, match='--scheduler: expected the address of a Dask scheduler'):
            parse_study('--scheduler', address).open_executor()
