# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The class library as a JSON file of demonstrated homotopy classes; a file is written completely or not at all."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.classes.library import MOST_STATES, POINTS, Demonstration, is_same_recording
from foc_ros.core.errors import InputError, RecordingError
from foc_ros.core.types import LEFT, RIGHT, Array

from .documents import MAX_BYTES, read_document

SIDES = {'left': LEFT, 'right': RIGHT}
MOST_WAYS, MOST_OBSTACLES = 500, 4096
FARTHEST = 1e6
"""Largest coordinate [m], and largest velocity [m/s]."""


def load_library(name: str) -> tuple[Demonstration, ...]:
    """Return the demonstrations of a library file, none for an empty name.

    Raises RecordingError if the file cannot be read, InputError, naming field, value and bound, if it is no library.
    """
    if not name:
        return ()
    document = read_document(Path(name))
    ways = document.get('ways') if isinstance(document, Mapping) else None
    if not isinstance(ways, list) or len(ways) > MOST_WAYS:
        got = f'{len(ways)} of them' if isinstance(ways, list) else type(ways).__name__
        raise InputError(f'{name}: ways', f'a list of at most {MOST_WAYS} ways', got)
    return tuple(_read_demonstration(f'{name}: ways[{k}]', way) for k, way in enumerate(ways))


def save_library(file: Path, ways: Sequence[Demonstration]) -> None:
    """Write a library, replacing the file.

    Raises RecordingError if the file cannot be written, InputError for more demonstrations than a library may hold.
    """
    if len(ways) > MOST_WAYS:
        raise InputError(f'{file}: ways', f'at most {MOST_WAYS}', f'{len(ways)} with the new ones')
    text = json.dumps({'ways': [_dump_demonstration(way) for way in ways]}, allow_nan=False) + '\n'
    if len(text) > MAX_BYTES:
        raise InputError(f'{file}: ways', f'at most {MAX_BYTES:,} bytes', f'{len(text):,} of {len(ways)} ways')
    unfinished = file.with_name(f'{file.name}.{os.getpid()}.unfinished')  # another process may write its own
    try:
        unfinished.write_text(text, encoding='utf-8')
        unfinished.replace(file)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise RecordingError(f'{file}: cannot be written: {error.strerror}') from error


def extend_library(file: Path, ways: Sequence[Demonstration]) -> int:
    """Add demonstrations to a library, which is made where there is none; return how many of them it did not contain.

    Processes that do so at once wait for each other, so that the file has what all of them add. Raises as `load_library` and
    `save_library` do.
    """
    with _lock(file.parent):
        given = load_library(str(file)) if file.exists() else ()
        new = [each for each in ways if not any(is_same_recording(each, known) for known in given)]
        save_library(file, [*given, *new])
    return len(new)


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Let one process at a time continue for a folder, where its system and its file system can; a lock ends with its process."""
    if sys.platform == 'win32':
        yield
        return
    import fcntl

    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _dump_demonstration(way: Demonstration) -> dict[str, Any]:
    sides = {side: word for word, side in SIDES.items()}
    passed = [
        {'id': identity, 'x': x, 'y': y, 'side': sides[side]}
        for identity, (x, y), side in zip(way.ids, way.centre.tolist(), way.sides, strict=True)
    ]
    states = {} if way.states is None else {'states': way.states.tolist()}
    return {'frame_id': way.frame_id, 'passed': passed, 'path': way.path.tolist(), **states}


def _read_demonstration(field: str, way: object) -> Demonstration:
    if not isinstance(way, Mapping) or set(way) - {'states'} != {'frame_id', 'passed', 'path'}:
        raise InputError(field, 'exactly frame_id, passed, path and, for a recording, states', _shorten(way))
    frame_id, passed, path = way['frame_id'], way['passed'], way['path']
    if not isinstance(frame_id, str):
        raise InputError(f'{field}.frame_id', 'a text', _shorten(frame_id))
    if not isinstance(passed, list) or len(passed) > MOST_OBSTACLES:
        raise InputError(f'{field}.passed', f'a list of at most {MOST_OBSTACLES} obstacles', _shorten(passed))
    if not isinstance(path, list) or len(path) != POINTS:
        raise InputError(f'{field}.path', f'{POINTS} points', _shorten(path))
    rows = [_read_passed(f'{field}.passed[{k}]', row) for k, row in enumerate(passed)]
    ids = tuple(identity for identity, _, _ in rows)
    if len(set(ids)) != len(ids):
        raise InputError(f'{field}.passed', 'each obstacle once', _shorten(ids))
    points = np.array([_read_numbers(f'{field}.path[{k}]', point, 2) for k, point in enumerate(path)])
    centre: Array = np.array([point for _, point, _ in rows], dtype=float).reshape(-1, 2)
    states = _read_states(f'{field}.states', way['states']) if 'states' in way else None
    return Demonstration(frame_id, ids, tuple(side for _, _, side in rows), centre, points, states)


def _read_states(field: str, states: object) -> Array:
    if not isinstance(states, list) or not 2 <= len(states) <= MOST_STATES:
        raise InputError(field, f'2 to {MOST_STATES} states', _shorten(states))
    return np.array([_read_numbers(f'{field}[{k}]', state, 4) for k, state in enumerate(states)])


def _read_passed(field: str, row: object) -> tuple[str, tuple[float, ...], int]:
    if not isinstance(row, Mapping) or set(row) != {'id', 'x', 'y', 'side'} or not isinstance(row['id'], str):
        raise InputError(field, 'id (a text), x, y and side', _shorten(row))
    if row['side'] not in ('left', 'right'):
        raise InputError(f'{field}.side', 'left or right', _shorten(row['side']))
    return row['id'], _read_numbers(field, [row['x'], row['y']], 2), SIDES[row['side']]


def _read_numbers(field: str, values: object, count: int) -> tuple[float, ...]:
    if isinstance(values, list) and len(values) == count and all(_is_number(value, FARTHEST) for value in values):
        return tuple(float(value) for value in values)
    raise InputError(field, f'{count} numbers within {FARTHEST:g}', _shorten(values))


def _is_number(value: object, largest: float) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and -largest <= value <= largest


def _shorten(value: object) -> str:
    return repr(value)[:100]
