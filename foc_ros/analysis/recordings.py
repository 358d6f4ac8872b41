# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recordings of a folder, bags or CSV tables alike, as streams of recorded messages; and tables converted to bags."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

from foc_ros.core.errors import InputError, RecordingError, join_errors
from foc_ros.io.bags import BagReader, BagWriter, Item, check_bag, is_bag_file
from foc_ros.io.terminal import show_progress

from .csv_recordings import BrokenRecording, TableRecording, read_with_scenes
from .scenes import read_box_scenes, read_scenes

RECORDINGS, OBSTACLES, GOALS, LABELS = 'recordings.csv', 'obstacles.csv', 'goals.csv', 'labels.csv'
SCENES, TRIALS = 'scenes.csv', 'trials.csv'


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


Recording = BagRecording | TableRecording | BrokenRecording


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
        visible = [path for path in sorted(data.iterdir()) if not path.name.startswith('.')]
        # a directory with bag files but without metadata counts, so that it is reported as broken
        bags = [path for path in visible if any(map(is_bag_file, path.iterdir() if path.is_dir() else [path]))]
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

    table, obstacles, goals: the recordings and their scenes, or a folder of all three tables; output: folder for the bags. Raises
    RecordingError for a table that cannot be read and for a bag that exists, InputError for a table without one of obstacles.
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
