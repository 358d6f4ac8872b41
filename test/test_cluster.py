"""A Dask cluster of two worker processes on this machine gives the same results; a killed worker fails one recording only."""

from collections.abc import Iterator

import pytest
import worker_tasks
from test_parallel import ITEMS, SQUARES

from foc_ros.analysis.parallel import Failure, open_executor, run
from foc_ros.core.errors import InputError, RecordingError

distributed = pytest.importorskip('distributed', reason='the extra cluster is not installed')


@pytest.fixture(scope='module')
def address() -> Iterator[str]:
    import dask

    # a task is given up after its second death, not its fourth: the test is shorter
    settings = {'distributed.scheduler.allowed-failures': 1, 'distributed.worker.multiprocessing-method': 'spawn'}
    with (
        dask.config.set(settings),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=':0') as cluster,
    ):
        yield cluster.scheduler_address


def test_the_cluster_gives_the_same_results(address: str) -> None:
    with open_executor(1, address) as executor:
        assert list(run(worker_tasks.squared, ITEMS, executor)) == SQUARES


def test_a_killed_worker_of_the_cluster_fails_what_it_was_doing_and_nothing_else(address: str) -> None:
    with open_executor(1, address) as executor:
        found = dict(run(worker_tasks.deadly, ITEMS, executor))
    for name, square in SQUARES:
        if name in ('r3', 'r5'):
            assert isinstance(found[name], Failure) and 'KilledWorker' in found[name].reason
        else:
            assert found[name] == square


def test_a_scheduler_that_dies_ends_the_run_in_words() -> None:
    local = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=':0')
    with local as cluster, open_executor(1, cluster.scheduler_address) as executor:
        results = run(worker_tasks.sleepy, [('a', 0.0), ('b', 1.0), ('c', 1.0)], executor)
        assert next(results) == ('a', 0.0)
        cluster.close()
        with pytest.raises(RecordingError, match='the executor gave up before its turn'):
            list(results)


def test_a_scheduler_without_workers_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('foc_ros.analysis.dask_cluster.CONNECT_S', 0.3)
    refused = pytest.raises(InputError, match='--scheduler: expected a Dask scheduler with workers, got none at')
    with distributed.LocalCluster(n_workers=0, dashboard_address=':0') as cluster, refused:
        open_executor(1, cluster.scheduler_address)
