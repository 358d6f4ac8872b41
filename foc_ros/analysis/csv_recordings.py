# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motion capture in CSV tables, as the messages that a tracker and a perception node would have sent."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.errors import FocError, RecordingError, collect, warn
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.io.bags import TYPESTORE
from foc_ros.io.csv_tables import Column, Row, parse_rows, read_rows
from foc_ros.ros.messages.encode_inputs import encode_boxes, encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RosbagsTypes

from .scenes import POSITION, RecordedScene, check_not_empty, read_recording

FRAME = 'world'
EPOCH_NS = NANOSECONDS
"""Stamp of t_s = 0. It is not 0, which means `not set` in a message."""
LENGTH_UNITS = {'cm': 1e-2, 'mm': 1e-3, 'um': 1e-6}
Doubt = tuple[str, str, str]
"""What is doubted, what is wrong with it, and the reason."""


@dataclass(frozen=True)
class Movement:
    """One recording: stamps [ns] that never fall, and positions (n, 3) [m]."""

    name: str
    stamps_ns: tuple[int, ...]
    positions: Array


def read_movements(file: Path, errors: list[FocError]) -> dict[str, Movement | RecordingError]:
    """Return the recordings in the order of their first rows, or the error of their rows; append those of the table."""
    found: dict[str, list[Row]] = {}
    rows = read_rows(file, ('recording', 't_s', 'x_m', 'y_m'), ('z_m',))
    known = len(errors)
    collect(errors, parse_rows, rows, lambda row: found.setdefault(read_recording(row), []).append(row))
    if len(errors) == known:
        collect(errors, check_not_empty, file, found)
    _warn_once_for_each(file, ((name, doubt) for name, rows in found.items() if (doubt := _find_doubt(rows))))
    return {name: _parse_movement(name, rows) for name, rows in found.items()}


def _parse_movement(name: str, table: Iterable[Row]) -> Movement | RecordingError:
    """Return one recording from its rows, or the error of a cell out of bounds or of time that runs backward."""
    samples: list[list[float]] = []

    def parse(row: Row) -> None:
        # a stamp has 31 bits for seconds; in a recording of more than a day, two clocks are mixed up
        bounds = (samples[-1][0], samples[0][0] + 86400.0) if samples else (0.0, 2e9)
        samples.append(row.read_numbers(Column('t_s', *bounds), *POSITION))

    try:
        parse_rows(table, parse)
    except RecordingError as error:
        return error
    return Movement(name, tuple(EPOCH_NS + round(each[0] * NANOSECONDS) for each in samples), np.array(samples)[:, 1:])


def _find_doubt(rows: Sequence[Row]) -> Doubt | None:
    """Find times or positions that cannot be in s and m, or that repeat, also in rows that cannot be used because of that."""
    columns = [column for column in ('t_s', 'x_m', 'y_m', 'z_m') if column in rows[0].cells]
    numbers = np.array([[row.parse_number(column) for column in columns] for row in rows])
    steps = np.diff(numbers[np.isfinite(numbers).all(axis=1)], axis=0)
    forward, repeated = steps[steps[:, 0] > 0.0], int((steps[:, 0] == 0.0).sum())
    if len(steps) < 2:
        return None
    if 2 * repeated >= len(steps):
        return 't_s', 'repeats', f'{repeated} of {len(steps)} rows have the time of the row before'
    if not len(forward):
        return None
    step_s = float(np.median(forward[:, 0]))
    if not 1e-4 <= step_s <= 1.0:  # of a tracker
        units = {'ns': 1e-9, 'us': 1e-6, 'ms': 1e-3, 'min': 60.0, 'h': 3600.0, 'days': 86400.0}
        words = f'seems to be in {_find_nearest_unit(units, step_s, 0.01)}'
        return 't_s', words, f'the median time between two poses is {step_s:.3g} s'
    speed = float(np.quantile(np.linalg.norm(forward[:, 1:], axis=1) / forward[:, 0], 0.99))
    if speed <= 20.0:  # beyond that of any hand
        return None
    return 'the position', f'seems to be in {_find_nearest_unit(LENGTH_UNITS, speed, 0.5)}', f'the hand moves at {speed:.3g} m/s'


def warn_of_far_scenes(file: Path, recorded: Iterable[tuple[Movement, RecordedScene]]) -> None:
    """Warn of recordings whose goals or obstacles are all too far from the hand, or too large, to be in m; once for each kind.

    Positions that are in another unit themselves give no second warning here: their movement is larger by the same factor.
    """
    doubts: list[tuple[str, Doubt]] = []
    for movement, scene in recorded:
        low, high = movement.positions.min(axis=0), movement.positions.max(axis=0)
        extent = max(float(np.linalg.norm(high - low)), 0.1)
        for kind, rows in (('goals', scene.goals), ('obstacles', scene.obstacles)):
            places = np.array([row[:3] for row in (() if rows is None else rows)]).reshape(-1, 3)
            gap = float(np.linalg.norm(places - np.clip(places, low, high), axis=1).min(initial=math.inf))
            if max(10.0, 20.0 * extent) < gap < math.inf:
                words = f'seem to be in {_find_nearest_unit(LENGTH_UNITS, gap, extent)}'
                reason = f'the nearest is {gap:.3g} m from the movement of the hand'
                doubts.append((movement.name, (f'the {kind}', words, reason)))
            elif kind == 'obstacles' and (least := _find_least_size(scene)) > max(1.0, 10.0 * extent):
                words = f'seem to be in {_find_nearest_unit(LENGTH_UNITS, least, 0.1 * extent)}'
                doubts.append((movement.name, ('the sizes of the obstacles', words, f'the smallest is {least:.3g} m')))
    _warn_once_for_each(file, doubts)


def _find_least_size(scene: RecordedScene) -> float:
    """Return the radius or the larger length of the smallest obstacle [m], 0 if there is none."""
    return min((max(row[3], *row[6:8]) for row in scene.obstacles), default=0.0)


def _warn_once_for_each(file: Path, doubts: Iterable[tuple[str, Doubt]]) -> None:
    """Warn once of what is doubted in several recordings, given with their names."""
    grouped: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, (what, words, reason) in doubts:
        grouped.setdefault((what, words), []).append((name, reason))
    for (what, words), ((name, reason), *rest) in grouped.items():
        others = f' and {len(rest)} others' if rest else ''
        warn(f'{file}: {what} of recording {name}{others} {words}: {reason}')


def _find_nearest_unit(units: Mapping[str, float], value: float, usual: float) -> str:
    """Return the unit in which a value is nearest to a usual one, by their ratio."""
    return min(units, key=lambda each: abs(math.log(value * units[each] / usual)))


def recorded_messages(movement: Movement, scene: RecordedScene) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages of a bag as (stamp [ns], topic, message), in the order of their stamps."""
    types, boxes = RosbagsTypes(TYPESTORE), scene.find_boxes(movement.positions)

    def list_scenes() -> Iterator[tuple[int, str, Any]]:
        # twice a second, for the first time before the first hand pose
        for stamp_ns in range(movement.stamps_ns[0] - NANOSECONDS // 10, movement.stamps_ns[-1] + 1, NANOSECONDS // 2):
            if boxes:
                yield stamp_ns, '/obstacle_markers', encode_boxes(types, stamp_ns, FRAME, boxes)
            else:
                yield stamp_ns, '/obstacles', encode_obstacles(types, stamp_ns, FRAME, scene.obstacles)
            if scene.goals is not None:
                yield stamp_ns, '/goals', encode_goals(types, stamp_ns, FRAME, scene.goals)

    poses = (
        (stamp_ns, '/hand_pose', encode_hand_pose(types, stamp_ns, FRAME, position))
        for stamp_ns, position in zip(movement.stamps_ns, movement.positions, strict=True)
    )
    return merge(list_scenes(), poses, key=lambda each: each[0])
