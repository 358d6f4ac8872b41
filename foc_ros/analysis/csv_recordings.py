# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motion capture in CSV tables, as the messages that a tracker and a perception node would have sent."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, field
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.errors import FocError, RecordingError, collect, collect_all, join_errors, warn
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.io.bags import TYPESTORE, BagWriter
from foc_ros.io.csv_tables import Column, Row, parse_rows, read_rows
from foc_ros.ros.messages.decode_point_cloud import MAX_ROWS
from foc_ros.ros.messages.decode_poses import MAX_GOALS
from foc_ros.ros.messages.encode_inputs import encode_boxes, encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RosbagsTypes

FRAME = 'world'
SIZES = ('size_x_m', 'size_y_m')
POSITION = (Column('x_m'), Column('y_m'), Column('z_m', default=0.0))
EXTENT = tuple(Column(name, 0.0, default=0.0) for name in ('radius_m', 'radius_stddev_m', *SIZES))
YAW = Column('yaw_rad', default=0.0)
EPOCH_NS = NANOSECONDS
"""Stamp of t_s = 0. It is not 0, which means `not set` in a message."""
LATEST_S, LONGEST_S = 2e9, 86400.0
"""Bounds on a time (a stamp has 31 bits for seconds) and on a recording's length (beyond a day, two clocks are mixed up) [s]."""
SHORTEST_STEP_S, LONGEST_STEP_S, FASTEST = 1e-4, 1.0, 20.0
"""Median times between two poses that a tracker has [s], and a speed that no hand has [m/s]; beyond them, a unit is wrong."""
USUAL_STEP_S, USUAL_SPEED = 0.01, 0.5
"""Step [s] and speed [m/s] with which units of time and length are compared."""
FARTHEST_SCENE_M, FARTHEST_EXTENTS = 10.0, 20.0
"""Distance of the nearest goal or obstacle from a movement [m], and in its own extents; beyond both, a unit is wrong."""
SHORTEST_EXTENT_M = 0.1
"""Extent of a movement [m] for which a shorter one counts where a distance is compared with it."""
FEWEST_STEPS = 2
"""Steps from which the unit of a recording can be told."""
TIME_UNITS = {'ns': 1e-9, 'us': 1e-6, 'ms': 1e-3, 'min': 60.0, 'h': 3600.0, 'days': 86400.0}
LENGTH_UNITS = {'cm': 1e-2, 'mm': 1e-3, 'um': 1e-6}
NO_GOAL = -1
"""Row of a goal that is not in the list: the movement ends with its recording."""
SCENE_PERIOD_NS, SCENE_LEAD_NS = NANOSECONDS // 2, NANOSECONDS // 10
"""The scene is sent twice a second, for the first time a tenth of a second before the first hand pose."""


@dataclass(frozen=True)
class Movement:
    """One recording: stamps [ns] that never fall, and positions (n, 3) [m]."""

    name: str
    stamps_ns: tuple[int, ...]
    positions: Array


def read_movements(file: Path) -> list[Movement]:
    """Return the recordings in the order of their first rows; within one recording, time must not run backward."""
    found: dict[str, list[Row]] = {}
    errors: list[FocError] = []
    collect(errors, _group_rows, file, found)
    warn_of_doubts(file, found)
    movements = [collect(errors, parse_movement, name, rows) for name, rows in found.items()]
    if errors:
        raise join_errors(errors)
    return [each for each in movements if each is not None]


def read_movement_rows(file: Path) -> dict[str, list[Row]]:
    """Return the rows of each recording, at least one, in the order of their first rows."""
    found: dict[str, list[Row]] = {}
    _group_rows(file, found)
    return found


def _group_rows(file: Path, found: dict[str, list[Row]]) -> None:
    """Add the rows of each recording, in the order of their first rows, also where it raises RecordingError for other rows."""
    parse_rows(
        read_rows(file, ('recording', 't_s', 'x_m', 'y_m'), ('z_m',)),
        lambda row: found.setdefault(_read_recording(row), []).append(row),
    )
    _check_not_empty(file, found)


def parse_movement(name: str, table: Iterable[Row]) -> Movement:
    """Return one recording from its rows; raises RecordingError for a cell out of bounds and for time that runs backward."""
    samples: list[tuple[float, ...]] = []

    def parse(row: Row) -> None:
        bounds = (samples[-1][0], samples[0][0] + LONGEST_S) if samples else (0.0, LATEST_S)
        samples.append(tuple(row.read_numbers(Column('t_s', *bounds), *POSITION)))

    parse_rows(table, parse)
    return Movement(name, tuple(EPOCH_NS + round(each[0] * NANOSECONDS) for each in samples), np.array(samples)[:, 1:])


def warn_of_doubts(file: Path, found: Mapping[str, Sequence[Row]]) -> None:
    """Warn of recordings whose times or positions cannot be in s and m, or whose times repeat; once for each kind of doubt.

    The rows of each recording are given, also those that cannot be used: a bound that they exceed may be due to their unit.
    """
    doubts: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, rows in found.items():
        columns = [column for column in ('t_s', 'x_m', 'y_m', 'z_m') if column in rows[0].cells]
        doubt, reason = _find_doubt(np.array([[row.parse_number(column) for column in columns] for row in rows]))
        if reason:
            doubts.setdefault(doubt, []).append((name, reason))
    _warn_once_for_each(file, doubts)


def warn_of_far_scenes(file: Path, recorded: Iterable[tuple[Movement, RecordedScene]]) -> None:
    """Warn of recordings whose goals or obstacles are all so far from the hand that they cannot be in m; once for each kind.

    Positions that are in another unit themselves give no second warning here: their movement is larger by the same factor.
    """
    doubts: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for movement, scene in recorded:
        low, high = movement.positions.min(axis=0), movement.positions.max(axis=0)
        extent = max(float(np.linalg.norm(high - low)), SHORTEST_EXTENT_M)
        for kind, rows in (('goals', scene.goals), ('obstacles', scene.obstacles)):
            places = np.array([row[:3] for row in (() if rows is None else rows)]).reshape(-1, 3)
            gaps = np.linalg.norm(places - np.clip(places, low, high), axis=1)
            gap = float(gaps.min(initial=math.inf))
            if max(FARTHEST_SCENE_M, FARTHEST_EXTENTS * extent) < gap < math.inf:
                words = f'seem to be in {_find_nearest_unit(LENGTH_UNITS, gap, extent)}'
                reason = f'the nearest is {gap:.3g} m from the movement of the hand'
                doubts.setdefault((f'the {kind}', words), []).append((movement.name, reason))
    _warn_once_for_each(file, doubts)


def _warn_once_for_each(file: Path, doubts: Mapping[tuple[str, str], Sequence[tuple[str, str]]]) -> None:
    """Warn once of each doubt: what is doubted and what is wrong with it, with the names and reasons of recordings."""
    for (what, words), doubted in doubts.items():
        name, reason = doubted[0]
        others = f' and {len(doubted) - 1} others' if doubted[1:] else ''
        warn(f'{file}: {what} of recording {name}{others} {words}: {reason}')


def _find_doubt(rows: Array) -> tuple[tuple[str, str], str]:
    """Return a column with what is wrong with it, and the reason; empty texts if the numbers can be right.

    rows (n, 3) or (n, 4): time [s] and position [m], NaN where there is no number.
    """
    steps = np.diff(rows[np.isfinite(rows).all(axis=1)], axis=0)
    steps_s, is_moving_on = steps[:, 0], steps[:, 0] > 0.0
    repeated = int((steps_s == 0.0).sum())
    if len(steps_s) >= FEWEST_STEPS and 2 * repeated >= len(steps_s):
        return ('t_s', 'repeats'), f'{repeated} of {len(steps_s)} rows have the time of the row before'
    if len(steps_s) < FEWEST_STEPS or not is_moving_on.any():
        return ('', ''), ''
    step_s = float(np.median(steps_s[is_moving_on]))
    if not SHORTEST_STEP_S <= step_s <= LONGEST_STEP_S:
        words = f'seems to be in {_find_nearest_unit(TIME_UNITS, step_s, USUAL_STEP_S)}'
        return ('t_s', words), f'the median time between two poses is {step_s:.3g} s'
    speed = float(np.quantile(np.linalg.norm(steps[is_moving_on, 1:], axis=1) / steps_s[is_moving_on], 0.99))
    if speed <= FASTEST:
        return ('', ''), ''
    words = f'seems to be in {_find_nearest_unit(LENGTH_UNITS, speed, USUAL_SPEED)}'
    return ('the position', words), f'the hand moves at {speed:.3g} m/s'


def _find_nearest_unit(units: Mapping[str, float], value: float, usual: float) -> str:
    """Return the unit in which a value is nearest to a usual one, by their ratio."""
    return min(units, key=lambda each: abs(math.log(value * units[each] / usual)))


@dataclass(frozen=True)
class RecordedScene:
    """What a recording took place in.

    obstacles: rows of `encode_obstacles`; goals (g, 3) [m], None where they are unknown; boxes: by name, instead of the rows,
    x, y, z of the centre and the full lengths along these axes [m]; goal: row of the goal that was reached, `NO_GOAL` if it is
    not among them, None where no table says it.
    """

    obstacles: tuple[tuple[float, ...], ...] = ()
    goals: Array | None = None
    boxes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    goal: int | None = None

    def find_boxes(self, positions: Array) -> dict[str, tuple[float, ...]]:
        """Return the boxes at the median height of a hand at positions (n, 3) [m]: a ceiling or a table top is no obstacle."""
        height = float(np.median(positions[:, 2]))
        return {name: box for name, box in self.boxes.items() if abs(box[2] - height) < box[5] / 2.0}


@dataclass(frozen=True)
class SceneTables:
    """Rows of obstacles and of goals by recording; those of the empty name hold for every recording."""

    obstacles: Mapping[str, tuple[tuple[float, ...], ...]]
    goals: Mapping[str, Array] | None

    def find(self, name: str) -> RecordedScene:
        """Return the scene of a recording; raises RecordingError where a table of goals has none for it."""
        rows = self.obstacles.get('', self.obstacles.get(name, ()))
        if self.goals is None:
            return RecordedScene(rows)
        goals = self.goals.get('', self.goals.get(name))
        if goals is None:
            raise RecordingError(f'recording {name!r}: the table of goals has no row for it')
        return RecordedScene(rows, goals)


def read_scenes(obstacles: Path | None, goals: Path | None) -> SceneTables:
    """Read the tables of obstacles and of goals; a column `recording` gives each recording its own rows.

    Raises one RecordingError for the errors of both.
    """
    readers = [(read_obstacles, obstacles), (read_goals, goals)]
    tables = collect_all(lambda read, file: None if file is None else read(file), readers)
    return SceneTables(tables[0] or {}, tables[1])


def read_obstacles(file: Path) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Return obstacles by recording as rows x, y, z, radius, radius_stddev, id, size_x, size_y, yaw, possibly none.

    Ids default to the position in the rows of the recording. There are at most as many as a message may contain.
    """
    found: dict[str, dict[int, tuple[float, ...]]] = {}

    def parse(row: Row) -> None:
        rows = found.setdefault(_read_recording(row), {})
        x, y, z, radius, stddev, *size, yaw = row.read_numbers(*POSITION, *EXTENT, YAW)
        identity = row.read_integer('id', -(2**31), 2**31 - 1, default=len(rows))
        if identity in rows:
            raise row.make_error('id', 'another id than the rows above')
        if SIZES[0] in row.cells and not any((radius, *size)):
            raise row.make_error(SIZES[0], 'a size or a radius > 0')
        rows[identity] = (x, y, z, radius, stddev, identity, *size, yaw)

    optional = ('recording', 'z_m', 'radius_stddev_m', *SIZES, 'yaw_rad', 'id')
    parse_rows(read_rows(file, ('x_m', 'y_m', 'radius_m'), optional, {'radius_m': SIZES}), parse)
    _check_length(file, found, MAX_ROWS)
    return {name: tuple(rows.values()) for name, rows in found.items()}


def read_goals(file: Path) -> dict[str, Array]:
    """Return goals (g, 3) [m] by recording, at least one and at most as many as a message may contain."""
    found: dict[str, list[tuple[float, ...]]] = {}
    parse_rows(
        read_rows(file, ('x_m', 'y_m'), ('recording', 'z_m')),
        lambda row: found.setdefault(_read_recording(row), []).append(tuple(row.read_numbers(*POSITION))),
    )
    _check_length(file, found, MAX_GOALS)
    _check_not_empty(file, found)
    return {name: np.array(goals) for name, goals in found.items()}


def write_movement(bag: Path, movement: Movement, scene: RecordedScene) -> None:
    """Write one bag with hand poses, obstacles and, where there are any, goals, in the order of their stamps."""
    with BagWriter(bag) as writer:
        for stamp_ns, topic, message in recorded_messages(movement, scene):
            writer.write(topic, message, stamp_ns)


def recorded_messages(movement: Movement, scene: RecordedScene) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages of a bag as (stamp [ns], topic, message), in the order of their stamps."""
    types, boxes = RosbagsTypes(TYPESTORE), scene.find_boxes(movement.positions)

    def list_scenes() -> Iterator[tuple[int, str, Any]]:
        for stamp_ns in range(movement.stamps_ns[0] - SCENE_LEAD_NS, movement.stamps_ns[-1] + 1, SCENE_PERIOD_NS):
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


def _read_recording(row: Row) -> str:
    """Return the recording of a row, an empty text if the table does not have the column."""
    if row.cells.get('recording') == '':
        raise row.make_error('recording', 'a name')
    return row.cells.get('recording', '')


def _check_length(file: Path, found: Mapping[str, Sized], most: int) -> None:
    if any(len(rows) > most for rows in found.values()):
        raise RecordingError(f'{file}: expected at most {most:,} rows, got more')


def _check_not_empty(file: Path, found: Any) -> None:
    if not found:
        raise RecordingError(f'{file}: expected at least one row, got none')
