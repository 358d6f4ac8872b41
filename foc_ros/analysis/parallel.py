"""Recordings in parallel: one function applied to many named items by worker processes or by a Dask cluster.

Results come in the order of the items and do not depend on the number of workers. What goes wrong with one item, an exception or
a worker process that is killed, becomes the :class:`Failure` of this item alone.
"""

from __future__ import annotations

import os
import pickle
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future, wait
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessPool

from foc_ros.core.errors import FocError, FocWarning, RecordingError, warn
from foc_ros.io.terminal import show_progress

from .dask_cluster import DaskExecutor

T = TypeVar('T')
R = TypeVar('R')


@dataclass(frozen=True)
class Failure:
    """Why an item has no result, in words."""

    reason: str


class IsolatedProcessPool(Executor):
    """A number of worker processes, of which one can die without the others.

    In a `ProcessPoolExecutor` a killed worker breaks the pool. Here its call alone raises `pebble.ProcessExpired`, and a new
    worker takes its place. When the context is left by an exception, the workers are killed; they also end with their parent.
    """

    def __init__(self, count: int) -> None:
        # spawned: a fork of a process with threads may hang, and would inherit what this one has computed so far
        self._pool = ProcessPool(count, initializer=_end_with_parent, context=get_context('spawn'))

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Schedule a call; see :class:`concurrent.futures.Executor`."""
        # pickled here and loaded in the call: a worker that could not load its task would die, and its future never end
        future: Future[R] = self._pool.schedule(_call_pickled, args=[pickle.dumps((fn, args, kwargs))])
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers; see :class:`concurrent.futures.Executor`."""
        if cancel_futures:
            self._pool.stop()  # type: ignore[no-untyped-call]
        else:
            self._pool.close()  # type: ignore[no-untyped-call]
        if wait:
            self._pool.join()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.shutdown(cancel_futures=kind is not None)


def _call_pickled(pickled: bytes) -> Any:
    function, args, kwargs = pickle.loads(pickled)  # noqa: S301 (our own)
    return function(*args, **kwargs)


def _end_with_parent() -> None:
    """Let this worker process end as soon as its parent has ended, by whatever cause."""
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def run(function: Callable[[T], R], items: Sequence[tuple[str, T]], executor: Executor) -> Iterator[tuple[str, R | Failure]]:
    """Apply a function to every item; yield names and results in the order of the items.

    function: importable by name where the workers are, and without a state of its own; items: names with arguments that can be
    pickled. Raises RecordingError where the executor gave up.
    """
    futures = [executor.submit(call_guarded, function, item) for _, item in items]
    try:
        for (name, item), future in zip(items, futures, strict=True):
            try:
                result, texts = future.result()
            except ProcessExpired:
                result, texts = Failure('its worker process was killed'), []
            except CancelledError as error:
                raise RecordingError(f'{name}: the executor gave up before its turn') from error
            except Exception:
                result, texts = _run_alone(function, item, futures, executor)
            for text in texts:
                warn(f'{name}: {text}')
            yield name, result
    finally:
        for future in futures:
            future.cancel()


def collect(
    function: Callable[[T], R], items: Sequence[tuple[str, T]], executor: Executor, description: str
) -> tuple[list[R], dict[str, str]]:
    """Run with a progress bar; return the results in the order of the items, and the reason of every failure by name."""
    results: list[R] = []
    failed: dict[str, str] = {}
    for name, result in show_progress(run(function, items, executor), description, len(items)):
        if isinstance(result, Failure):
            failed[name] = result.reason
        else:
            results.append(result)
    return results, failed


def collect_all(function: Callable[[T], R], items: Sequence[tuple[str, T]], executor: Executor, description: str) -> list[R]:
    """Run with a progress bar and return every result; raise RecordingError where an item failed."""
    results, failed = collect(function, items, executor, description)
    for name, reason in failed.items():
        raise RecordingError(f'{name}: {reason}')
    return results


def call_guarded(function: Callable[[T], R], item: T) -> tuple[R | Failure, list[str]]:
    """Return the result of a function, or its failure in words, as an exception may not survive pickling, and its warnings."""
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


def _run_alone(
    function: Callable[[T], R], item: T, futures: Sequence[Future[Any]], executor: Executor
) -> tuple[R | Failure, list[str]]:
    """Compute an item again after all others.

    A Dask scheduler blames the death of a worker on all tasks that waited there; alone, only the guilty one fails again.
    """
    wait(futures)
    try:
        return executor.submit(call_guarded, function, item).result()
    except Exception as error:
        return Failure(f'its worker was lost: {type(error).__name__}: {" ".join(str(error).split())}'), []


def open_executor(workers: int, scheduler: str | None = None) -> Executor:
    """Return the executor of a number of worker processes, or of the Dask cluster of a scheduler, as a context.

    Raises InputError where there is no such cluster.
    """
    return IsolatedProcessPool(workers) if scheduler is None else DaskExecutor(scheduler)
