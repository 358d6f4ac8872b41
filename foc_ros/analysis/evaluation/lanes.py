"""An executor of worker processes of which one can die without the others.

In a `ProcessPoolExecutor` a killed worker breaks the pool: all that was waiting fails, and nobody knows whose fault it was. Here
every worker is a pool of its own, so what fails is what that worker was doing, and its lane goes on with a new one.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import get_context, parent_process
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

P = ParamSpec('P')
T = TypeVar('T')


class IsolatedProcessPool(Executor):
    """A number of worker processes, started when they are needed.

    A call whose worker is killed raises BrokenProcessPool from its future; no other call is touched. Left by an exception, the
    context kills its workers.
    """

    def __init__(self, count: int) -> None:
        self._threads = ThreadPoolExecutor(count)
        self._own = threading.local()
        self._pools: list[ProcessPoolExecutor] = []
        self._pids: set[int] = set()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Take a call; see :class:`concurrent.futures.Executor`."""
        return self._threads.submit(self._in_process, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End; see :class:`concurrent.futures.Executor`."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        for pool in self._pools:
            pool.shutdown(wait, cancel_futures=cancel_futures)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> bool | None:
        if error is not None:
            self._threads.shutdown(wait=False, cancel_futures=True)
            for pid in tuple(self._pids):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        self.shutdown()
        return None

    def _in_process(self, fn: Callable[..., T], args: Any, kwargs: Any) -> T:
        if getattr(self._own, 'pool', None) is None:
            self._own.pool, self._own.pid = self._worker()
        try:
            result: T = self._own.pool.submit(fn, *args, **kwargs).result()
        except BrokenExecutor:
            self._pids.discard(self._own.pid)
            self._own.pool = None
            raise
        return result

    def _worker(self) -> tuple[ProcessPoolExecutor, int]:
        """Start a process."""
        # spawned: a fork of a process with threads may hang, and would inherit what this one has computed so far
        pool = ProcessPoolExecutor(1, get_context('spawn'), _begin)
        self._pools.append(pool)
        pid = pool.submit(os.getpid).result()
        self._pids.add(pid)
        return pool, pid


def _begin() -> None:
    """Make a worker of this process: an interrupt from the terminal is its parent's affair, and it ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
