# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings in parallel: one function applied to many named items.

That happens in this process, or in the executor that :func:`open_workers` opens: worker processes of loky, a part of joblib, or a
Dask cluster. Results do not depend on it. What goes wrong with one item, an exception or a worker process that is killed, becomes
the :class:`Failure` of this item alone.
"""

from __future__ import annotations

import os
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from joblib.externals.loky import get_reusable_executor

from foc_ros.core.errors import FocError, FocWarning, InputError, RecordingError, warn
from foc_ros.io.terminal import show_progress

T = TypeVar('T')
R = TypeVar('R')

CONNECT_S = 10.0
"""Time within which a scheduler and its first worker have to answer [s]."""
ONE_THREAD = {f'{name}_NUM_THREADS': '1' for name in ('OMP', 'OPENBLAS', 'MKL', 'BLIS', 'VECLIB', 'NUMEXPR')}
"""Environment of a worker process, beside which others work."""
MOST_AT_WORK = 64
"""Items that are computed one after the other where a worker was lost; with more workers, this may have to be repeated."""


@dataclass(frozen=True)
class Failure:
    """Why an item has no result, in words."""

    reason: str


_open_executor: ContextVar[Callable[[], Executor] | None] = ContextVar('executor', default=None)
"""Returns the executor, a new one where the last one has broken; None: this process computes."""


@contextmanager
def open_workers(count: int, scheduler: str | None = None) -> Iterator[None]:
    """Let :func:`run` use a number of worker processes, 1 for this one, or the Dask cluster of a scheduler.

    Raises InputError where there is no such cluster.
    """
    with ExitStack() as stack:
        open_executor: Callable[[], Executor] | None = None
        if scheduler is not None:
            # not pure: a call that is repeated would return the old task with its error
            open_executor = partial(stack.enter_context(_connect(scheduler)).get_executor, pure=False)
        elif count > 1:
            given = {'initializer': _end_with, 'initargs': (os.getpid(),), 'env': ONE_THREAD}
            open_executor = partial(get_reusable_executor, count, **given)
            stack.callback(lambda: get_reusable_executor(count, **given).shutdown(kill_workers=True))
        stack.callback(_open_executor.reset, _open_executor.set(open_executor))
        yield


def run(function: Callable[[T], R], items: Sequence[tuple[str, T]]) -> Iterator[tuple[str, R | Failure]]:
    """Apply a function to every item; yield names and results in the order of the items.

    A worker that is killed takes those beside it along. All that may have been at work is then computed again, one after the
    other, so that only the guilty one fails.

    function: importable by name where the workers are, and without a state of its own; items: names with arguments that can be
    pickled. Raises RecordingError where the workers cannot go on.
    """
    submitted: list[Answer[R]] = []
    for number, (name, item) in enumerate(items):
        if _open_executor.get() is None:
            result, texts = call_guarded(function, item)
        else:
            submitted = submitted or [_submit(function, each) for _, each in items]
            if _find_error(submitted[number]) is not None:
                _submit_lost(function, items, submitted)
            result, texts = submitted[number].result()
        for text in texts:
            warn(f'{name}: {text}')
        yield name, result


Answer = Future[tuple[R | Failure, list[str]]]
"""The result of an item and its warnings, or the error of a worker that was lost."""


def _submit(function: Callable[[T], R], item: T) -> Answer[R]:
    open_executor = _open_executor.get()
    assert open_executor is not None
    try:
        return open_executor().submit(call_guarded, function, item)
    except BrokenExecutor as error:  # it broke just now
        lost: Answer[R] = Future()
        lost.set_exception(error)
        return lost


def _submit_lost(function: Callable[[T], R], items: Sequence[tuple[str, T]], submitted: list[Answer[R]]) -> None:
    """Submit again what was lost with a worker, at first what may have been at work, which fails if it is lost once more."""
    wait(submitted)
    lost = [number for number, each in enumerate(submitted) if _find_error(each) is not None]
    for place, number in enumerate(lost):
        submitted[number] = _submit(function, items[number][1])
        if place < MOST_AT_WORK and (error := _find_error(submitted[number])) is not None:
            submitted[number] = Future()
            submitted[number].set_result((Failure(f'its worker process was lost ({type(error).__name__})'), []))


def _find_error(answer: Answer[Any]) -> BaseException | None:
    """Wait for an answer and return the error of its worker; raise RecordingError where all workers are lost."""
    try:
        return answer.exception()
    except CancelledError as error:
        raise RecordingError('the Dask scheduler was lost before all recordings had their turn') from error


def collect(function: Callable[[T], R], items: Sequence[tuple[str, T]], description: str) -> tuple[list[R], dict[str, str]]:
    """Run with a progress bar; return the results in the order of the items, and the reason of every failure by name."""
    results: list[R] = []
    failed: dict[str, str] = {}
    for name, result in show_progress(run(function, items), description, len(items)):
        if isinstance(result, Failure):
            failed[name] = result.reason
        else:
            results.append(result)
    return results, failed


def collect_all(function: Callable[[T], R], items: Sequence[tuple[str, T]], description: str) -> list[R]:
    """Run with a progress bar and return every result; raise RecordingError where an item failed."""
    results, failed = collect(function, items, description)
    if failed:
        raise RecordingError(': '.join(next(iter(failed.items()))))
    return results


def call_guarded(function: Callable[[T], R], item: T) -> tuple[R | Failure, list[str]]:
    """Return the result of an item, or its failure in words, as an exception may not survive pickling; and warnings."""
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
    """Let this worker process end soon after its parent has ended, by whatever cause; an interrupt is the parent's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

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
