# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings in parallel by joblib: one function applied to many named items.

Where that happens is joblib's setting: this process unless :func:`open_workers`, or `joblib.parallel_config`, says otherwise.
What goes wrong with one item, an exception or a worker process that is killed, becomes the :class:`Failure` of this item alone.
"""

from __future__ import annotations

import os
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import closing, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, TypeVar

from joblib import Parallel, delayed, effective_n_jobs, parallel_config, register_parallel_backend
from joblib.parallel import ThreadingBackend

from foc_ros.core.errors import FocError, FocWarning, InputError, RecordingError, warn
from foc_ros.io.terminal import show_progress

T = TypeVar('T')
R = TypeVar('R')

CONNECT_S = 10.0
"""Time within which a scheduler and its first worker have to answer [s]."""
DASK = 'foc_ros.dask'
"""Name of :class:`DaskBackend` among the backends of joblib."""


_COUNTER: ContextVar[str | None] = ContextVar('_COUNTER', default=None)
"""File in which `count_prediction` counts."""


@dataclass(frozen=True)
class Failure:
    """Why an item has no result, in words."""

    reason: str


@contextmanager
def open_workers(count: int, scheduler: str | None = None) -> Iterator[None]:
    """Let :func:`run` use a number of worker processes, 1 for this one, or a Dask cluster; InputError where there is none."""
    with warnings.catch_warnings():
        # said by joblib where a command is interrupted
        warnings.filterwarnings('ignore', '.* tasks which were still being processed', UserWarning)
        if scheduler is None:
            with parallel_config('loky', n_jobs=count, initializer=_end_with, initargs=(os.getpid(),)):
                yield
        else:
            with _connect(scheduler) as client, parallel_config(DASK, client=client):
                yield


class DaskBackend(ThreadingBackend):
    """The backend of joblib for a Dask cluster: as many calls wait in threads as the cluster has.

    With joblib's own one a result that is lost with a killed worker never arrives (joblib 1.6, distributed 2026.8).
    """

    def __init__(self, client: Any = None, **options: Any) -> None:
        super().__init__(**options)
        self._client = client

    def __reduce__(self) -> tuple[Any, ...]:
        return DaskBackend, ()

    def effective_n_jobs(self, n_jobs: int) -> int:  # noqa: ARG002 (joblib's signature)
        """Return the number of calls at the same time, each in a thread; with a single one joblib would compute here."""
        return int(max(2, min(sum(self._client.nthreads().values()), 512)))

    def submit(self, func: Callable[[], Any], callback: Callable[[Any], None] | None = None) -> Any:
        """Schedule a call."""
        return super().submit(partial(self._compute, func), callback)

    def _compute(self, func: Callable[[], Any]) -> Any:
        # not pure: a call that is repeated would return the old task with its error
        return self._client.submit(func, pure=False).result()


register_parallel_backend(DASK, DaskBackend)


def run(
    function: Callable[[T], R], items: Sequence[tuple[str, T]], counter: str | None = None
) -> Iterator[tuple[str, R | Failure]]:
    """Apply a function to every item; yield names and results in the order of the items.

    function: importable by name where the workers are, and without a state of its own; items: names with arguments that can be
    pickled. A worker that is killed takes those beside it along. All that may have been at work is then computed again, one after
    the other, so that only the guilty one fails. counter: file of `count_prediction`. Raises RecordingError where the workers
    cannot go on.
    """
    done, at_work = 0, 2 * effective_n_jobs(None)
    while done < len(items):
        try:
            for result in _compute(function, [item for _, item in items[done:]], counter):
                done += 1
                yield items[done - 1][0], result
        except CancelledError as error:
            raise RecordingError('the Dask scheduler was lost before all recordings had their turn') from error
        except Exception:
            for name, item in items[done : done + at_work]:
                done += 1
                try:
                    (result,) = _compute(function, [item], counter)
                except Exception as error:
                    result = Failure(f'its worker process was lost ({type(error).__name__})')
                yield name, result


def _compute(function: Callable[[T], R], items: Sequence[T], counter: str | None) -> Iterator[R | Failure]:
    is_alone = len(items) == 1 and effective_n_jobs(None) > 1
    # in a process of its own, also alone; arrays are passed as they are, not as files
    parallel = Parallel(2 if is_alone else None, return_as='generator', batch_size=1, max_nbytes=None)
    with closing(parallel(delayed(_call_guarded)(function, item, counter) for item in items)) as found:
        for result, texts in found:
            for text in texts:
                warn(text)
            yield result


def collect(function: Callable[[T], R], items: Sequence[tuple[str, T]], description: str) -> tuple[list[R], dict[str, str]]:
    """Run with a progress bar; return the results in the order of the items, and the reason of every failure by name."""
    results: list[R] = []
    failed: dict[str, str] = {}
    with NamedTemporaryFile(prefix='foc_ros_') as file:
        found = run(function, items, file.name)
        for name, result in show_progress(found, description, len(items), lambda: Path(file.name).stat().st_size, is_stage=True):
            if isinstance(result, Failure):
                failed[name] = result.reason.removeprefix(f'{name}: ')
            else:
                results.append(result)
    return results, failed


def count_prediction() -> None:
    """Let the progress that is shown count one more prediction: by a byte in a file, if that is on this machine."""
    if (counter := _COUNTER.get()) is not None:
        with suppress(OSError):
            descriptor = os.open(counter, os.O_WRONLY | os.O_APPEND)
            os.write(descriptor, b'.')
            os.close(descriptor)


def collect_all(function: Callable[[T], R], items: Sequence[tuple[str, T]], description: str) -> list[R]:
    """Run with a progress bar and return every result; raise RecordingError where an item failed."""
    results, failed = collect(function, items, description)
    for name, reason in failed.items():
        raise RecordingError(f'{name}: {reason}')
    return results


def _call_guarded(function: Callable[[T], R], item: T, counter: str | None) -> tuple[R | Failure, list[str]]:
    """Return the result of an item, or its failure in words, as an exception may not survive pickling; and warnings."""
    _COUNTER.set(counter)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter('always', FocWarning)
        result: R | Failure
        try:
            result = function(item)
        except FocError as error:
            result = Failure(' '.join(str(error).split()))
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            words = f'{type(error).__name__}: {" ".join(str(error).split())} ({Path(place.filename).name}:{place.lineno})'
            result = Failure(words)
    return result, [str(each.message) for each in issued if issubclass(each.category, FocWarning)]


def _end_with(parent: int) -> None:
    """Let this process, a worker with or without work, end soon after its parent has ended, by whatever cause."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _connect(address: str) -> Any:
    """Return the client of a Dask scheduler with workers, as a context."""
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError('--scheduler', "Dask: pip install 'foc_ros[cluster]'", error) from error
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError('--scheduler', 'the address of a Dask scheduler, as in tcp://host:8786', address) from error
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except OSError as error:
        client.close()
        raise InputError('--scheduler', 'a Dask scheduler with workers', f'none at {address}') from error
    return client
