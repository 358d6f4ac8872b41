# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The scenes of recordings in CSV tables: circles and boxes in the plane with goals, or boxes in space.

Boxes in space are a table of their own: the boxes, walls and targets among which people reached, one scene for each recording.
The object `Target` is the goal of its recording, and no obstacle. Where a table of trials has the column `object`, which is what
the hand picked up, all objects that are picked up in any recording are goals, and obstacles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sized
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from foc_ros.core.errors import RecordingError, collect_all
from foc_ros.core.types import Array
from foc_ros.io.csv_tables import Column, Row, parse_rows, read_rows
from foc_ros.ros.messages.decode_point_cloud import MAX_ROWS
from foc_ros.ros.messages.decode_poses import MAX_GOALS

SIZES = ('size_x_m', 'size_y_m')
POSITION = (Column('x_m'), Column('y_m'), Column('z_m', default=0.0))
EXTENT = tuple(Column(name, 0.0, default=0.0) for name in ('radius_m', 'radius_stddev_m', *SIZES))
BOX = [*map(Column, ('x_m', 'y_m', 'z_m')), *(Column(name, 0.0) for name in ('width_m', 'depth_m', 'height_m'))]
TARGET = 'Target'
NO_GOAL = -1
"""Row of a goal that is not in the list: the movement ends with its recording."""


@dataclass(frozen=True)
class RecordedScene:
    """What a recording took place in.

    obstacles: rows of `encode_obstacles`; goals (g, 3) [m], None where they are unknown; boxes: by name, instead of the rows, x,
    y, z of the centre and the full lengths along these axes [m]; goal: row of the goal that was reached, `NO_GOAL` if it is not
    among them, None where no table says it.
    """

    obstacles: tuple[tuple[float, ...], ...] = ()
    goals: Array | None = None
    boxes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    goal: int | None = None

    def find_boxes(self, positions: Array) -> dict[str, tuple[float, ...]]:
        """Return the boxes at the median height of a hand at positions (n, 3) [m]: a ceiling or a table top is no obstacle."""
        height = float(np.median(positions[:, 2]))
        return {name: box for name, box in self.boxes.items() if abs(box[2] - height) < box[5] / 2.0}


FindScene = Callable[[str], RecordedScene]
"""Returns the scene of a recording by its name; raises RecordingError where a table does not have its goal."""


def read_scenes(obstacles: Path | None, goals: Path | None) -> FindScene:
    """Read the tables of obstacles and of goals; a column `recording` gives each recording its own rows."""
    readers = [(read_obstacles, obstacles), (read_goals, goals)]
    rows, targets = collect_all(lambda read, file: {} if file is None else read(file), readers)

    def find(name: str) -> RecordedScene:
        own = rows.get('', rows.get(name, ()))
        if goals is None:
            return RecordedScene(own)
        if '' not in targets and name not in targets:
            raise RecordingError(f'recording {name!r}: the table of goals has no row for it')
        return RecordedScene(own, targets.get('', targets.get(name)))

    return find


def read_obstacles(file: Path) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Return obstacles by recording as rows x, y, z, radius, radius_stddev, id, size_x, size_y, yaw, possibly none.

    Ids default to the position in the rows of the recording.
    """
    found: dict[str, dict[int, tuple[float, ...]]] = {}

    def parse(row: Row) -> None:
        rows = found.setdefault(row.read_name('recording'), {})
        x, y, z, radius, stddev, *size, yaw = row.read_numbers(*POSITION, *EXTENT, Column('yaw_rad', default=0.0))
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
        lambda row: found.setdefault(row.read_name('recording'), []).append(tuple(row.read_numbers(*POSITION))),
    )
    _check_length(file, found, MAX_GOALS)
    check_not_empty(file, found)
    return {name: np.array(goals) for name, goals in found.items()}


def read_box_scenes(file: Path, trials: Path | None) -> FindScene:
    """Read a table of boxes in space; trials: that of trials, which may say what was picked up."""
    boxes, picked = read_boxes(file), read_picked(trials) if trials is not None else {}

    def find(name: str) -> RecordedScene:
        own = boxes.get(name, {})
        if not picked and TARGET not in own:
            raise RecordingError(f'{file}: no row of recording {name!r} has the object {TARGET}')
        if not picked:
            return RecordedScene(goals=np.array([own[TARGET][:3]]), boxes={key: box for key, box in own.items() if key != TARGET})
        offered, found = [each for each in own if each in picked.values()], picked.get(name)
        if found not in offered:
            raise RecordingError(f'{file}: no row of recording {name!r} has the object {found}, which was picked up')
        return RecordedScene(goals=np.array([own[each][:3] for each in offered]), boxes=own, goal=offered.index(found))

    return find


def read_picked(file: Path) -> Mapping[str, str]:
    """Return the object that was picked up by recording, from a table of trials; empty without the column `object`."""
    found: dict[str, str] = {}

    def parse(row: Row) -> None:
        if name := row.read_name('object'):
            found[row.cells['recording']] = name

    parse_rows(read_rows(file, ('recording',)), parse)
    return found


def read_boxes(file: Path) -> Mapping[str, Mapping[str, tuple[float, ...]]]:
    """Return centre (3) and full lengths (3) [m] of each object by recording and name."""
    found: dict[str, dict[str, tuple[float, ...]]] = {}

    def parse(row: Row) -> None:
        boxes, name = found.setdefault(row.read_name('recording'), {}), row.read_name('object')
        if name in boxes:
            raise row.make_error('object', 'another name than the rows above of this recording')
        boxes[name] = tuple(row.read_numbers(*BOX))

    parse_rows(read_rows(file, ('recording', 'object', *(each.name for each in BOX))), parse)
    return found


def _check_length(file: Path, found: Mapping[str, Sized], most: int) -> None:
    if any(len(rows) > most for rows in found.values()):
        raise RecordingError(f'{file}: expected at most {most:,} rows, got more')


def check_not_empty(file: Path, found: Sized) -> None:
    """Raise RecordingError for a table without rows."""
    if not found:
        raise RecordingError(f'{file}: expected at least one row, got none')
