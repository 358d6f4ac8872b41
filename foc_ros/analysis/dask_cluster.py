"""An executor whose calls are computed by the workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, TypeVar

from foc_ros.core.errors import InputError

R = TypeVar('R')

CONNECT_S = 10.0
"""Time within which a scheduler and its first worker have to answer [s]."""
MAX_THREADS = 512


class DaskExecutor(Executor):
    """As many concurrent calls as the cluster has threads; a call whose workers were killed raises KilledWorker.

    Each call waits in a thread of its own. The executor of Dask is not used, because a result that is lost with its worker, and
    then blamed for the death of the next one, never arrives there (distributed 2026.8). Raises InputError where there is no
    scheduler, or none of its workers answers.
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError as error:
            raise InputError('--scheduler', "Dask: pip install 'foc_ros[cluster]'", error) from error
        try:
            self._client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError('--scheduler', 'the address of a Dask scheduler, as in tcp://host:8786', address) from error
        try:
            self._client.wait_for_workers(1, timeout=CONNECT_S)
        except OSError as error:
            self._client.close()
            raise InputError('--scheduler', 'a Dask scheduler with workers', f'none at {address}') from error
        self._threads = ThreadPoolExecutor(min(sum(self._client.nthreads().values()), MAX_THREADS))

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Schedule a call; see :class:`concurrent.futures.Executor`."""
        # not pure: a call that is repeated would return the old task with its error
        return self._threads.submit(lambda: self._client.submit(fn, *args, **kwargs, pure=False).result())

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Close the connection; see :class:`concurrent.futures.Executor`."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        self._client.close()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.shutdown(wait=kind is None, cancel_futures=kind is not None)
