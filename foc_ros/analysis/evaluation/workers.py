"""Recordings in parallel: one function over many named items, behind a `concurrent.futures.Executor`.

Results come in the items' order and do not depend on who computed them, so neither do they on the number of workers. What goes
wrong with one item is that item's :class:`Failure`, by its name: an exception, or a worker process that was killed.
"""

from __future__ import annotations

import argparse
import os
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from foc_ros.core.errors import FocError, InputError, RecordingError
from foc_ros.io.terminal import track

from .cluster import Cluster
from .lanes import IsolatedProcessPool

T = TypeVar('T')
R = TypeVar('R')

MOST_WORKERS = 1024


@dataclass(frozen=True)
class Failure:
    """Why an item has no result, in words."""

    reason: str


def run(function: Callable[[T], R], items: Sequence[tuple[str, T]], executor: Executor) -> Iterator[tuple[str, R | Failure]]:
    """Yield the name and the result of every item, in their order.

    function: importable by name where the workers are, and without a state of its own; items: names with arguments that can be
    pickled. Raises RecordingError where the executor gave up.
    """
    futures = [executor.submit(guarded, function, item) for _, item in items]
    try:
        for (name, item), future in zip(items, futures, strict=True):
            try:
                yield name, future.result()
            except BrokenExecutor:
                yield name, Failure('its worker process was killed')
            except CancelledError as error:
                raise RecordingError(f'{name}: the executor gave up before its turn') from error
            except Exception:
                yield name, _alone(function, item, futures, executor)
    finally:
        for future in futures:
            future.cancel()


def collected(
    function: Callable[[T], R], items: Sequence[tuple[str, T]], executor: Executor, words: str
) -> tuple[list[R], dict[str, str]]:
    """Run with a progress bar of these words; return the results in the items' order, and why other items have none, by name."""
    results: list[R] = []
    failed: dict[str, str] = {}
    for name, result in track(run(function, items, executor), words, len(items)):
        if isinstance(result, Failure):
            failed[name] = result.reason
        else:
            results.append(result)
    return results, failed


def guarded(function: Callable[[T], R], item: T) -> R | Failure:
    """Return the function's result, or its failure in words: an exception may not survive pickling, and would break its pool."""
    try:
        return function(item)
    except FocError as error:
        return Failure(' '.join(str(error).split()))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return Failure(f'{type(error).__name__}: {" ".join(str(error).split())} ({Path(place.filename).name}:{place.lineno})')


def _alone(function: Callable[[T], R], item: T, futures: Sequence[Future[R | Failure]], executor: Executor) -> R | Failure:
    """Compute an item again with nobody beside it.

    A Dask scheduler blames a worker's death on all that was waiting there; alone, only the guilty one fails again.
    """
    wait(futures)
    try:
        return executor.submit(guarded, function, item).result()
    except Exception as error:
        return Failure(f'its worker was lost: {type(error).__name__}: {" ".join(str(error).split())}')


def add_worker_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare who does the work."""
    who = parser.add_mutually_exclusive_group()
    words = 'worker processes (default: one for each core that this process may use)'
    who.add_argument('--workers', type=int, default=len(os.sched_getaffinity(0)), metavar='N', help=words)
    who.add_argument('--scheduler', metavar='ADDRESS', help='a Dask scheduler whose workers do it instead (extra: cluster)')


def workers(arguments: argparse.Namespace) -> Executor:
    """Return the executor that `add_worker_arguments` declared, a context to leave. Raises InputError where there is none."""
    if arguments.scheduler is not None:
        return Cluster(arguments.scheduler)
    if not 1 <= arguments.workers <= MOST_WORKERS:
        raise InputError('--workers', f'a whole number in [1, {MOST_WORKERS}]', arguments.workers)
    return IsolatedProcessPool(arguments.workers)
