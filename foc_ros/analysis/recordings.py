# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recordings of a folder, bags or CSV tables alike, as streams of recorded messages; and tables converted to bags.

A table of motion capture gives the messages that a tracker and a perception node would have sent.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from filecmp import cmp
from functools import partial
from heapq import merge
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from foc_ros.core.errors import FocError, InputError, RecordingError, collect, join_errors, warn
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.io import topics
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter, Item, check_bag, is_bag_file
from foc_ros.io.csv_tables import Column, Row, parse_rows, read_rows
from foc_ros.io.terminal import show_progress
from foc_ros.ros.messages.encode_inputs import encode_boxes, encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RosbagsTypes

from .scenes import POSITION, FindScene, RecordedScene, check_not_empty, read_box_scenes, read_scenes

RECORDINGS, OBSTACLES, GOALS, LABELS = 'recordings.csv', 'obstacles.csv', 'goals.csv', 'labels.csv'
SCENES, TRIALS = 'scenes.csv', 'trials.csv'
FRAME = 'world'
EPOCH_NS = NANOSECONDS
"""Stamp of t_s = 0. It is not 0, which means `not set` in a message."""
TIME_UNITS = {'ns': 1e-9, 'us': 1e-6, 'ms': 1e-3, 'min': 60.0, 'h': 3600.0, 'days': 86400.0}
LENGTH_UNITS = {'cm': 1e-2, 'mm': 1e-3, 'um': 1e-6}
Doubt = tuple[str, str, str]
"""What is doubted, what is wrong with it, and the reason."""


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
    """One recording of a table: stamps [ns] that never fall, positions (n, 3) [m], and the scene."""

    name: str
    stamps_ns: tuple[int, ...]
    positions: Array
    scene: RecordedScene

    @property
    def goal(self) -> int | None:
        """Row of the goal that was reached, None where no table says it."""
        return self.scene.goal

    def items(self) -> Iterator[Item]:
        """Yield the messages that `convert` writes, in the order of their stamps."""
        types, boxes, scene = RosbagsTypes(TYPESTORE), self.scene.find_boxes(self.positions), self.scene

        def list_scenes() -> Iterator[tuple[int, str, Any]]:
            # twice a second, for the first time before the first hand pose
            for stamp_ns in range(self.stamps_ns[0] - NANOSECONDS // 10, self.stamps_ns[-1] + 1, NANOSECONDS // 2):
                if boxes:
                    yield stamp_ns, topics.MARKERS, encode_boxes(types, stamp_ns, FRAME, boxes)
                else:
                    yield stamp_ns, topics.CLOUD, encode_obstacles(types, stamp_ns, FRAME, scene.obstacles)
                if scene.goals is not None:
                    yield stamp_ns, topics.GOALS, encode_goals(types, stamp_ns, FRAME, scene.goals)

        poses = (
            (stamp_ns, topics.HAND, encode_hand_pose(types, stamp_ns, FRAME, position))
            for stamp_ns, position in zip(self.stamps_ns, self.positions, strict=True)
        )
        for stamp_ns, role, message in merge(list_scenes(), poses, key=lambda each: each[0]):
            yield Item(role, f'/{role}', stamp_ns, message, b'')


@dataclass(frozen=True)
class BrokenRecording:
    """A recording whose rows of a table cannot be used; other recordings are not affected."""

    name: str
    error: RecordingError
    goal: ClassVar[None] = None

    def items(self) -> Iterator[Item]:
        """Raise the error of the rows."""
        raise self.error


Recording = BagRecording | TableRecording | BrokenRecording


def find_recordings(data: Path) -> dict[str, Recording]:
    """Return the recordings of a folder of tables or of bags, or a bag, by name; RecordingError where it is none of these."""
    if (data / RECORDINGS).exists():
        for bag in _find_bags(data):
            warn(f'{bag}: left out, because the recordings of this folder are those of {RECORDINGS}')
        return dict(read_tables(data))
    if data.is_file() or ((data / 'metadata.yaml').exists() and any(map(is_bag_file, data.iterdir()))):
        check_bag(data)
        bags = [data.resolve()]
    elif data.is_dir():
        bags = _find_bags(data)
    else:
        raise RecordingError(f'{data}: no such file or directory')
    if not bags:
        raise RecordingError(f'{data}: expected bags, or {RECORDINGS} with {GOALS} or {SCENES}, got neither')
    return {path.name: BagRecording(path.name, path) for path in _leave_out_copies(bags)}


def _find_bags(folder: Path) -> list[Path]:
    """Return the bags in a folder; a directory with bag files but without metadata counts, so that it is reported as broken."""
    visible = [path for path in sorted(folder.iterdir()) if not path.name.startswith('.')]
    return [path for path in visible if any(map(is_bag_file, path.iterdir() if path.is_dir() else [path]))]


def _leave_out_copies(bags: Iterable[Path]) -> Iterator[Path]:
    """Yield the bags; warn of those with the same files as one before, which would count twice, and leave them out."""
    of_sizes: dict[tuple[int, ...], list[list[Path]]] = {}
    for bag in bags:
        files = [path for path in sorted(bag.iterdir()) if is_bag_file(path)] if bag.is_dir() else [bag]
        known = of_sizes.setdefault(tuple(path.stat().st_size for path in files), [])
        same = next((each for each in known if all(map(partial(cmp, shallow=False), files, each))), None)
        if same is None:
            known.append(files)
            yield bag
        else:
            warn(f'{bag}: left out, because it is a copy of {same[0]}')


def group_by_operator(found: Mapping[str, Recording]) -> dict[str, list[Recording]]:
    """Return the recordings of each operator, whose name is that of the recording up to its last underscore, in their order."""
    groups: dict[str, list[Recording]] = {}
    for name, recording in found.items():
        groups.setdefault(name.rpartition('_')[0], []).append(recording)
    return groups


def read_tables(data: Path) -> dict[str, TableRecording | BrokenRecording]:
    """Return the recordings of a folder of tables by name; raises RecordingError, see :func:`read_with_scenes`."""
    scenes, trials, obstacles = data / SCENES, data / TRIALS, data / OBSTACLES
    if scenes.exists():
        read = partial(read_box_scenes, scenes, trials if trials.exists() else None)
    else:
        read = partial(read_scenes, obstacles if obstacles.exists() else None, data / GOALS)
    return read_with_scenes(data / RECORDINGS, read, data)


def convert_tables(table: Path, obstacles: Path | None, goals: Path | None, output: Path) -> str:
    """Convert the tables, all of which are checked before the first bag is written; return in words what was written.

    table: the recordings, or a folder of all tables. Raises RecordingError for a table that cannot be read and for a bag that
    exists, InputError for a table without one of obstacles.
    """
    if obstacles is None and not table.is_dir():
        raise InputError('--obstacles', 'a table of obstacles, which may be without rows', 'nothing')
    found = read_tables(table) if obstacles is None else read_with_scenes(table, partial(read_scenes, obstacles, goals), table)
    broken = [each.error for each in found.values() if isinstance(each, BrokenRecording)]
    if broken:
        raise join_errors(broken)
    recordings = [each for each in found.values() if isinstance(each, TableRecording)]
    bags: dict[Path, TableRecording] = {}
    for each in recordings:
        name = re.sub(r'[^A-Za-z0-9._-]', '_', each.name).lstrip('.-') or '_'  # valid on any file system
        if (bag := output / name) in bags:
            raise RecordingError(f'recordings {bags[bag].name!r} and {each.name!r} would both be written to {name}')
        bags[bag] = each
    for bag in bags:
        if bag.exists():
            raise RecordingError(f'{bag}: exists already and is not overwritten; choose another --output')
    for bag, each in show_progress(bags.items(), 'convert', len(bags)):
        with BagWriter(bag) as writer:
            for item in each.items():
                writer.write(item.topic, item.message, item.log_ns)
    hands = sum(len(each.stamps_ns) for each in recordings)
    numbers = [len(each.scene.find_boxes(each.positions) or each.scene.obstacles) for each in recordings]
    count = ' to '.join(str(each) for each in sorted({min(numbers), max(numbers)}))
    return f'{len(bags)} bags with {hands} hand poses and {count} obstacles written to {output}'


def read_with_scenes(file: Path, read: Callable[[], FindScene], data: Path) -> dict[str, TableRecording | BrokenRecording]:
    """Return the recordings of a table in the order of their first rows, with the scenes that are read; data: for warnings.

    Raises one RecordingError for the errors of all tables if a table has no scenes or no recording that can be used.
    """
    errors: list[FocError] = []
    find, found = collect(errors, read), dict[str, list[Row]]()
    known, rows = len(errors), read_rows(file, ('recording', 't_s', 'x_m', 'y_m'), ('z_m',))
    collect(errors, parse_rows, rows, lambda row: found.setdefault(row.read_name('recording'), []).append(row))
    if len(errors) == known:
        collect(errors, check_not_empty, file, found)
    _warn_of_doubts(file, {name: _doubt_samples(rows) for name, rows in found.items()})
    samples = {name: _parse_samples(rows) for name, rows in found.items()}
    failures = [each for each in samples.values() if isinstance(each, RecordingError)]
    if find is None or errors or len(failures) == len(found):
        raise join_errors([*errors, *failures])
    recordings: dict[str, TableRecording | BrokenRecording] = {}
    for name, each in samples.items():
        if isinstance(each, RecordingError):
            recordings[name] = BrokenRecording(name, each)
        else:
            stamps_ns = tuple(EPOCH_NS + round(t_s * NANOSECONDS) for t_s in each[:, 0].tolist())
            recordings[name] = TableRecording(name, stamps_ns, each[:, 1:], find(name))
    _warn_of_doubts(data, {name: _doubt_scene(each) for name, each in recordings.items() if isinstance(each, TableRecording)})
    return recordings


def _parse_samples(table: Iterable[Row]) -> Array | RecordingError:
    """Return time [s] and position [m] of each row (n, 4), or the error of a cell out of bounds or of time that runs backward."""
    samples: list[list[float]] = []

    def parse(row: Row) -> None:
        # a stamp has 31 bits for seconds; in a recording of more than a day, two clocks are mixed up
        bounds = (samples[-1][0], samples[0][0] + 86400.0) if samples else (0.0, 2e9)
        samples.append(row.read_numbers(Column('t_s', *bounds), *POSITION))

    try:
        parse_rows(table, parse)
    except RecordingError as error:
        return error
    return np.array(samples)


def _doubt_samples(rows: Sequence[Row]) -> Iterator[Doubt]:
    """Yield times or positions that cannot be in s and m, or that repeat, also in rows that cannot be used because of that."""
    columns = [column for column in ('t_s', 'x_m', 'y_m', 'z_m') if column in rows[0].cells]
    numbers = np.array([[row.parse_number(column) for column in columns] for row in rows])
    steps = np.diff(numbers[np.isfinite(numbers).all(axis=1)], axis=0)
    forward, repeated = steps[steps[:, 0] > 0.0], int((steps[:, 0] == 0.0).sum())
    if 2 * repeated >= len(steps) > 1:
        yield 't_s', 'repeats', f'{repeated} of {len(steps)} rows have the time of the row before'
    elif len(steps) > 1 and len(forward):
        step_s = float(np.median(forward[:, 0]))
        speed = float(np.quantile(np.linalg.norm(forward[:, 1:], axis=1) / forward[:, 0], 0.99))
        if not 1e-4 <= step_s <= 1.0:  # of a tracker
            unit = _find_nearest_unit(TIME_UNITS, step_s, 0.01)
            yield 't_s', f'seems to be in {unit}', f'the median time between two poses is {step_s:.3g} s'
        elif speed > 20.0:  # beyond that of any hand
            unit = _find_nearest_unit(LENGTH_UNITS, speed, 0.5)
            yield 'the position', f'seems to be in {unit}', f'the hand moves at {speed:.3g} m/s'


def _doubt_scene(recording: TableRecording) -> Iterator[Doubt]:
    """Yield goals or obstacles that are all too far from the hand, or too large, to be in m.

    Positions that are in another unit themselves are not doubted again: their movement is larger by the same factor.
    """
    low, high, scene = recording.positions.min(axis=0), recording.positions.max(axis=0), recording.scene
    extent, least = (
        max(float(np.linalg.norm(high - low)), 0.1),
        min((max(row[3], *row[6:8]) for row in scene.obstacles), default=0.0),
    )
    for kind, rows in (('goals', scene.goals), ('obstacles', scene.obstacles)):
        places = np.array([row[:3] for row in (() if rows is None else rows)]).reshape(-1, 3)
        gap = float(np.linalg.norm(places - np.clip(places, low, high), axis=1).min(initial=math.inf))
        if max(10.0, 20.0 * extent) < gap < math.inf:
            words = f'seem to be in {_find_nearest_unit(LENGTH_UNITS, gap, extent)}'
            yield f'the {kind}', words, f'the nearest is {gap:.3g} m from the movement of the hand'
        elif kind == 'obstacles' and least > max(1.0, 10.0 * extent):
            words = f'seem to be in {_find_nearest_unit(LENGTH_UNITS, least, 0.1 * extent)}'
            yield 'the sizes of the obstacles', words, f'the smallest is {least:.3g} m'


def _find_nearest_unit(units: Mapping[str, float], value: float, usual: float) -> str:
    return min(units, key=lambda each: abs(math.log(value * units[each] / usual)))


def _warn_of_doubts(file: Path, doubts: Mapping[str, Iterable[Doubt]]) -> None:
    """Warn once of what is doubted in several recordings, given by their names."""
    grouped: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, found in doubts.items():
        for what, words, reason in found:
            grouped.setdefault((what, words), []).append((name, reason))
    for (what, words), ((name, reason), *rest) in grouped.items():
        others = f' and {len(rest)} others' if rest else ''
        warn(f'{file}: {what} of recording {name}{others} {words}: {reason}')
