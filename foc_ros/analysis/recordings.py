# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recordings of a folder, bags or CSV tables alike, as streams of recorded messages; and tables converted to bags.

Scenes of boxes in space are a table of their own: the boxes, walls and targets among which people reached, one scene for each
recording. The columns are `recording`, `object`, the centre `x_m`, `y_m`, `z_m`, and the full lengths along these axes `width_m`,
`depth_m` and `height_m`. The object `Target` is the goal of its recording, and no obstacle. Where a table of trials has
the column `object`, which is what the hand picked up, all objects that are picked up in any recording are goals, and obstacles.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from foc_ros.analysis.csv_recordings import (
    Movement,
    RecordedScene,
    SceneTables,
    parse_movement,
    read_movement_rows,
    read_movements,
    read_scenes,
    recorded_messages,
    warn_of_doubts,
    warn_of_far_scenes,
    write_movement,
)
from foc_ros.core.errors import FocError, InputError, RecordingError, collect, collect_all, join_errors
from foc_ros.io.bags import BagReader, Item, check_bag, is_bag_file
from foc_ros.io.csv_tables import Column, Row, parse_rows, read_rows
from foc_ros.io.terminal import show_progress

RECORDINGS, OBSTACLES, GOALS, LABELS = 'recordings.csv', 'obstacles.csv', 'goals.csv', 'labels.csv'
SCENES, TRIALS = 'scenes.csv', 'trials.csv'
TARGET = 'Target'
COLUMNS = tuple(Column(name) for name in ('x_m', 'y_m', 'z_m')) + tuple(
    Column(name, 0.0) for name in ('width_m', 'depth_m', 'height_m')
)


@dataclass(frozen=True)
class BagRecording:
    """A bag; path: its directory, or one file."""

    name: str
    path: Path
    goal: ClassVar[None] = None

    def items(self) -> Iterator[Item]:
        """Yield the recorded messages; raises RecordingError, also for a recording of which only a part can be read."""
        with BagReader(self.path, is_whole=True) as reader:
            yield from reader


@dataclass(frozen=True)
class TableRecording:
    """One recording of a table; movement: the movement, or the error of its rows; other recordings are not affected."""

    name: str
    movement: Movement | RecordingError
    scene: RecordedScene

    @property
    def goal(self) -> int | None:
        """Row of the goal that was reached, None where no table says it."""
        return self.scene.goal

    def read_movement(self) -> Movement:
        """Return the movement of the hand; raises RecordingError."""
        if isinstance(self.movement, RecordingError):
            raise self.movement
        return self.movement

    def items(self) -> Iterator[Item]:
        """Yield the messages that `convert` would write; raises RecordingError."""
        for stamp_ns, topic, message in recorded_messages(self.read_movement(), self.scene):
            yield Item(topic.removeprefix('/'), topic, stamp_ns, message, b'')


Recording = BagRecording | TableRecording


def find_recordings(data: Path) -> dict[str, Recording]:
    """Return the recordings of a folder by name.

    data: a folder with recordings.csv, and either goals.csv and, where there are obstacles, obstacles.csv, or scenes.csv with the
    boxes of each recording; a folder of bags; or a bag. Raises RecordingError where it is none of these.
    """
    if (data / RECORDINGS).exists():
        return dict(read_tables(data))
    if data.is_file() or ((data / 'metadata.yaml').exists() and any(map(is_bag_file, data.iterdir()))):
        check_bag(data)
        bags = [data.resolve()]
    elif data.is_dir():
        bags = [path for path in sorted(data.iterdir()) if _may_be_bag(path)]
    else:
        raise RecordingError(f'{data}: no such file or directory')
    if not bags:
        raise RecordingError(f'{data}: expected bags, or {RECORDINGS} with {GOALS} or {SCENES}, got neither')
    return {path.name: BagRecording(path.name, path) for path in bags}


def group_by_operator(found: Mapping[str, Recording]) -> dict[str, list[Recording]]:
    """Return the recordings of each operator, whose name is that of the recording up to its last underscore, in their order."""
    groups: dict[str, list[Recording]] = {}
    for name, recording in found.items():
        groups.setdefault(name.rpartition('_')[0], []).append(recording)
    return groups


def read_tables(data: Path) -> dict[str, TableRecording]:
    """Return the recordings of a folder of tables by name.

    Raises one RecordingError for the errors of all tables if a table has no scenes or no recording that can be used.
    """
    errors: list[FocError] = []
    scenes = collect(errors, _read_scenes, data)
    rows = collect(errors, read_movement_rows, data / RECORDINGS) or {}
    warn_of_doubts(data / RECORDINGS, rows)
    movements = {name: _parse_movement(name, each) for name, each in rows.items()}
    failures = [each for each in movements.values() if isinstance(each, RecordingError)]
    if scenes is None or len(failures) == len(movements):
        raise join_errors([*errors, *failures])
    found = {name: TableRecording(name, movement, scenes.find(name)) for name, movement in movements.items()}
    warn_of_far_scenes(data, [(each.movement, each.scene) for each in found.values() if isinstance(each.movement, Movement)])
    return found


def _parse_movement(name: str, rows: Iterable[Row]) -> Movement | RecordingError:
    try:
        return parse_movement(name, rows)
    except RecordingError as error:
        return error


def _read_scenes(data: Path) -> SceneTables | BoxScenes:
    if (data / SCENES).exists():
        return BoxScenes(data / SCENES, read_picked(data / TRIALS) if (data / TRIALS).exists() else {})
    return read_scenes(data / OBSTACLES if (data / OBSTACLES).exists() else None, data / GOALS)


def _may_be_bag(path: Path) -> bool:
    """Tell bags from other files; a directory with bag files but without metadata counts, so that it is reported as broken."""
    if path.name.startswith('.'):
        return False
    return is_bag_file(path) or (path.is_dir() and any(map(is_bag_file, path.iterdir())))


class BoxScenes:
    """The scenes of a table by recording; a wrong table raises RecordingError.

    picked: the object that was picked up, by recording; empty where the recordings end at a target.
    """

    def __init__(self, file: Path, picked: Mapping[str, str] = MappingProxyType({})) -> None:
        self._file, self._picked = file, picked
        self._boxes = read_boxes(file)

    def find(self, name: str) -> RecordedScene:
        """Return the scene of a recording; raises RecordingError where the table does not have its goal."""
        boxes = self._boxes.get(name, {})
        if self._picked:
            found, offered = self._picked.get(name), {*self._picked.values()} & {*boxes}
            if found not in offered:
                raise RecordingError(f'{self._file}: no row of recording {name!r} has the object {found}, which was picked up')
            objects = [each for each in boxes if each in offered]
            return RecordedScene(goals=np.array([boxes[each][:3] for each in objects]), boxes=boxes, goal=objects.index(found))
        if TARGET not in boxes:
            raise RecordingError(f'{self._file}: no row of recording {name!r} has the object {TARGET}')
        goals = np.array([boxes[TARGET][:3]])
        return RecordedScene(goals=goals, boxes={key: box for key, box in boxes.items() if key != TARGET})


def read_picked(file: Path) -> Mapping[str, str]:
    """Return the object that was picked up by recording, from a table of trials; empty without the column `object`."""
    found: dict[str, str] = {}

    def parse(row: Row) -> None:
        if row.cells.get('object') == '':
            raise row.make_error('object', 'a name')
        if 'object' in row.cells:
            found[row.cells['recording']] = row.cells['object']

    parse_rows(read_rows(file, ('recording',)), parse)
    return found


def read_boxes(file: Path) -> Mapping[str, Mapping[str, tuple[float, ...]]]:
    """Return centre (3) and full lengths (3) [m] of each object by recording and name."""
    found: dict[str, dict[str, tuple[float, ...]]] = {}

    def parse(row: Row) -> None:
        for column in ('recording', 'object'):
            if not row.cells[column]:
                raise row.make_error(column, 'a name')
        boxes, name = found.setdefault(row.cells['recording'], {}), row.cells['object']
        if name in boxes:
            raise row.make_error('object', 'another name than the rows above of this recording')
        boxes[name] = tuple(row.read_numbers(*COLUMNS))

    parse_rows(read_rows(file, ('recording', 'object', *(each.name for each in COLUMNS))), parse)
    return found


def convert_tables(table: Path, obstacles: Path | None, goals: Path | None, output: Path) -> str:
    """Convert the tables, all of which are checked before the first bag is written; return in words what was written.

    Parameters
    ----------
    table, obstacles, goals
        The recordings and their scenes, or a folder of all three tables.
    output
        Folder for the bags.

    Raises
    ------
    RecordingError
        For a table that cannot be read, and for a bag that exists.
    InputError
        For a table of recordings without one of obstacles.
    """
    scenes, movements = _read(table, obstacles, goals)
    bags = {output / name: movement for name, movement in _name_bags(movements).items()}
    for bag in bags:
        if bag.exists():
            raise RecordingError(f'{bag}: exists already and is not overwritten; choose another --output')
    for bag, movement in show_progress(bags.items(), 'convert', len(bags)):
        write_movement(bag, movement, scenes[movement.name])
    hands = sum(len(each.stamps_ns) for each in movements)
    numbers = [len(scenes[each.name].find_boxes(each.positions) or scenes[each.name].obstacles) for each in movements]
    count = ' to '.join(str(each) for each in sorted({min(numbers), max(numbers)}))
    return f'{len(bags)} bags with {hands} hand poses and {count} obstacles written to {output}'


def _read(table: Path, obstacles: Path | None, goals: Path | None) -> tuple[dict[str, RecordedScene], list[Movement]]:
    """Return the scene of each recording by its name, and all movements."""
    if obstacles is None and table.is_dir():
        tables = read_tables(table)
        movements = collect_all(TableRecording.read_movement, [(each,) for each in tables.values()])
        return {name: each.scene for name, each in tables.items()}, movements
    if obstacles is None:
        raise InputError('--obstacles', 'a table of obstacles, which may be without rows', 'nothing')
    reading = [(read_movements, table), (read_scenes, obstacles, goals)]
    movements, scenes = collect_all(lambda read, *files: read(*files), reading)
    found = {each.name: scenes.find(each.name) for each in movements}
    warn_of_far_scenes(table, [(each, found[each.name]) for each in movements])
    return found, movements


def _name_bags(movements: list[Movement]) -> dict[str, Movement]:
    """Return the recordings by a name that is valid on any file system; raises RecordingError if two have the same name."""
    named: dict[str, Movement] = {}
    for movement in movements:
        name = re.sub(r'[^A-Za-z0-9._-]', '_', movement.name).lstrip('.-') or '_'
        if name in named:
            raise RecordingError(f'recordings {named[name].name!r} and {movement.name!r} would both be written to {name}')
        named[name] = movement
    return named
