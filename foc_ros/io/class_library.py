# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The class library as a JSON file of demonstrated homotopy classes; a file is written completely or not at all."""

from __future__ import annotations

import json
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from foc_ros.core.classes.library import MOST_STATES, POINTS, Demonstration, is_same_recording
from foc_ros.core.errors import InputError, RecordingError
from foc_ros.core.solution import LEFT, RIGHT
from foc_ros.core.support import check_array

from .documents import MAX_BYTES, read_document
from .outputs import lock_folder, write_whole

SIDES = {'left': LEFT, 'right': RIGHT}
MOST_WAYS, MOST_OBSTACLES = 500, 4096


def load_library(name: str) -> tuple[Demonstration, ...]:
    """Return the demonstrations of a library file, none for an empty name; RecordingError or InputError where it is none."""
    if not name:
        return ()
    document = read_document(Path(name))
    ways = document.get('ways') if isinstance(document, Mapping) else None
    if not isinstance(ways, list) or len(ways) > MOST_WAYS:
        got = f'{len(ways)} of them' if isinstance(ways, list) else type(ways).__name__
        raise InputError(f'{name}: ways', f'a list of at most {MOST_WAYS} ways', got)
    return tuple(_read_demonstration(f'{name}: ways[{k}]', way) for k, way in enumerate(ways))


def save_library(file: Path, ways: Sequence[Demonstration]) -> None:
    """Write a library, replacing the file; RecordingError if that is impossible, InputError for more than it may hold."""
    if len(ways) > MOST_WAYS:
        raise InputError(f'{file}: ways', f'at most {MOST_WAYS}', f'{len(ways)} with the new ones')
    words, rows = {side: word for word, side in SIDES.items()}, []
    for way in ways:
        passed = [
            {'id': identity, 'x': x, 'y': y, 'side': words[side]}
            for identity, (x, y), side in zip(way.ids, way.centre.tolist(), way.sides, strict=True)
        ]
        states = {} if way.states is None else {'states': way.states.tolist()}
        rows.append({'frame_id': way.frame_id, 'passed': passed, 'path': way.path.tolist(), **states})
    text = json.dumps({'ways': rows}, allow_nan=False) + '\n'
    if len(text) > MAX_BYTES:
        raise InputError(f'{file}: ways', f'at most {MAX_BYTES:,} bytes', f'{len(text):,} of {len(ways)} ways')
    if file.exists() and not file.is_file():
        raise RecordingError(f'{file}: cannot be written: it is no regular file')
    try:
        with write_whole(file) as unfinished:
            unfinished.write_text(text, encoding='utf-8')
    except OSError as error:
        raise RecordingError(f'{file}: cannot be written: {error.strerror}') from error


def extend_library(file: Path, ways: Sequence[Demonstration]) -> int:
    """Add demonstrations to a library, made where there is none; return how many are new. Other processes wait meanwhile."""
    with lock_folder(file.resolve().parent):
        given = load_library(str(file)) if file.exists() else ()
        new = [each for each in ways if not any(is_same_recording(each, known) for known in given)]
        save_library(file, [*given, *new])
    return len(new)


def _read_demonstration(field: str, way: object) -> Demonstration:
    if not isinstance(way, Mapping) or set(way) - {'states'} != {'frame_id', 'passed', 'path'}:
        raise InputError(field, 'exactly frame_id, passed, path and, for a recording, states', reprlib.repr(way))
    if not isinstance(way['frame_id'], str):
        raise InputError(f'{field}.frame_id', 'a text', repr(way['frame_id']))
    passed = way['passed']
    if not isinstance(passed, list) or len(passed) > MOST_OBSTACLES:
        raise InputError(f'{field}.passed', f'a list of at most {MOST_OBSTACLES} obstacles', reprlib.repr(passed))
    for row, each in enumerate(passed):
        if not isinstance(each, Mapping) or set(each) != {'id', 'x', 'y', 'side'} or not isinstance(each['id'], str):
            raise InputError(f'{field}.passed[{row}]', 'id (a text), x, y and side', reprlib.repr(each))
        if each['side'] not in ('left', 'right'):
            raise InputError(f'{field}.passed[{row}].side', 'left or right', reprlib.repr(each['side']))
    ids = tuple(each['id'] for each in passed)
    if len(set(ids)) != len(ids):
        raise InputError(f'{field}.passed', 'each obstacle once', reprlib.repr(ids))
    centre = check_array(f'{field}.passed', [(each['x'], each['y']) for each in passed] or np.zeros((0, 2)), (None, 2))
    states = check_array(f'{field}.states', way['states'], (None, 4)) if 'states' in way else None
    if states is not None and not 2 <= len(states) <= MOST_STATES:
        raise InputError(f'{field}.states', f'2 to {MOST_STATES} states', len(states))
    path = check_array(f'{field}.path', way['path'], (POINTS, 2))
    return Demonstration(way['frame_id'], ids, tuple(SIDES[each['side']] for each in passed), centre, path, states)
