"""An executor of the workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar

from foc_ros.core.errors import InputError

P = ParamSpec('P')
T = TypeVar('T')

CONNECT_S = 10.0
"""How long a scheduler and its first worker may take to answer [s]."""
MOST_THREADS = 512


class Cluster(Executor):
    """As many calls at work as the cluster has threads; a call whose workers were killed raises KilledWorker.

    Dask's own executor is not used: a result that is lost with its worker, and then blamed for the next one's death, never
    arrives there (distributed 2026.8). Raises InputError where there is no scheduler, or none of its workers answers.
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
        self._threads = ThreadPoolExecutor(min(sum(self._client.nthreads().values()), MOST_THREADS))

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Take a call; see :class:`concurrent.futures.Executor`."""
        return self._threads.submit(self._on_cluster, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End; see :class:`concurrent.futures.Executor`."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        self._client.close()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Leave; by an exception, without waiting for what is at work."""
        self.shutdown(wait=kind is None, cancel_futures=kind is not None)

    def _on_cluster(self, fn: Callable[..., T], args: Any, kwargs: Any) -> T:
        # not pure: a task tried again would be the old one, with its error
        result: T = self._client.submit(fn, *args, **kwargs, pure=False).result()
        return result
