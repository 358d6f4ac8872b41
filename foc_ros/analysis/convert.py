"""Motion capture in CSV tables to bags, one per recording, with the messages of a tracker and a perception node."""

from __future__ import annotations

import re
from pathlib import Path

from foc_ros.core.errors import InputError, RecordingError, collect_all
from foc_ros.io.terminal import show_progress

from .csv_recordings import Movement, RecordedScene, read_movements, read_scenes, write_movement
from .recordings import TableRecording, read_tables


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
    return {each.name: scenes.find(each.name) for each in movements}, movements


def _name_bags(movements: list[Movement]) -> dict[str, Movement]:
    """Return the recordings by a name that is valid on any file system; raises RecordingError if two have the same name."""
    named: dict[str, Movement] = {}
    for movement in movements:
        name = re.sub(r'[^A-Za-z0-9._-]', '_', movement.name).lstrip('.-') or '_'
        if name in named:
            raise RecordingError(f'recordings {named[name].name!r} and {movement.name!r} would both be written to {name}')
        named[name] = movement
    return named
