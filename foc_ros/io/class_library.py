"""The class library as a JSON file of demonstrated homotopy classes; a file is written completely or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.errors import InputError, RecordingError
from foc_ros.core.homotopy.demonstrations import POINTS, Demonstration
from foc_ros.core.types import LEFT, RIGHT, Array

from .documents import read_document

SIDES = {'left': LEFT, 'right': RIGHT}
MOST_WAYS, MOST_OBSTACLES = 500, 4096
FARTHEST = 1e6
"""Largest coordinate [m]."""
LONGEST_S = 1e4
"""Longest recording [s]."""


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

    Raises RecordingError if the file cannot be written, InputError for too many demonstrations.
    """
    if len(ways) > MOST_WAYS:
        raise InputError(f'{file}: ways', f'at most {MOST_WAYS}', f'{len(ways)} with the new ones')
    document = {'ways': [_dump_demonstration(way) for way in ways]}
    unfinished = file.with_name(file.name + '.unfinished')
    try:
        unfinished.write_text(json.dumps(document, allow_nan=False) + '\n', encoding='utf-8')
        unfinished.replace(file)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise RecordingError(f'{file}: cannot be written: {error.strerror}') from error


def _dump_demonstration(way: Demonstration) -> dict[str, Any]:
    sides = {side: word for word, side in SIDES.items()}
    passed = [
        {'id': identity, 'x': x, 'y': y, 'side': sides[side]}
        for identity, (x, y), side in zip(way.ids, way.centre.tolist(), way.sides, strict=True)
    ]
    times = {} if way.times_s is None else {'times_s': way.times_s.tolist()}
    return {'frame_id': way.frame_id, 'passed': passed, 'path': way.path.tolist(), **times}


def _read_demonstration(field: str, way: object) -> Demonstration:
    if not isinstance(way, Mapping) or set(way) - {'times_s'} != {'frame_id', 'passed', 'path'}:
        raise InputError(field, 'exactly frame_id, passed, path and, for a recording, times_s', _shorten(way))
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
    points = np.array([_read_point(f'{field}.path[{k}]', point) for k, point in enumerate(path)])
    centre: Array = np.array([point for _, point, _ in rows], dtype=float).reshape(-1, 2)
    times_s = _read_times(f'{field}.times_s', way['times_s']) if 'times_s' in way else None
    return Demonstration(frame_id, ids, tuple(side for _, _, side in rows), centre, points, times_s)


def _read_times(field: str, times: object) -> Array:
    if not isinstance(times, list) or len(times) != POINTS:
        raise InputError(field, f'{POINTS} times', _shorten(times))
    if not all(_is_number(value, LONGEST_S) for value in times) or times[0] != 0 or not (np.diff(times) >= 0.0).all():
        raise InputError(field, f'numbers that rise from 0 to at most {LONGEST_S:g} s', _shorten(times))
    return np.array(times, dtype=float)


def _read_passed(field: str, row: object) -> tuple[str, tuple[float, float], int]:
    if not isinstance(row, Mapping) or set(row) != {'id', 'x', 'y', 'side'} or not isinstance(row['id'], str):
        raise InputError(field, 'id (a text), x, y and side', _shorten(row))
    if row['side'] not in ('left', 'right'):
        raise InputError(f'{field}.side', 'left or right', _shorten(row['side']))
    return row['id'], _read_point(field, [row['x'], row['y']]), SIDES[row['side']]


def _read_point(field: str, point: object) -> tuple[float, float]:
    if isinstance(point, list) and len(point) == 2 and all(_is_number(value, FARTHEST) for value in point):
        return float(point[0]), float(point[1])
    raise InputError(field, f'two numbers within {FARTHEST:g} m', _shorten(point))


def _is_number(value: object, largest: float) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and -largest <= value <= largest


def _shorten(value: object) -> str:
    return repr(value)[:100]
