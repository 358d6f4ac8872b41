"""`convert`: motion capture in CSV tables to bags, one per recording, with the messages of a tracker and a perception node."""

from __future__ import annotations

import argparse
import re

from foc_ros.analysis.csv_recordings import Movement, RecordedScene, read_movements, read_scenes, write_movement
from foc_ros.analysis.recordings import TableRecording, read_tables
from foc_ros.core.errors import InputError, RecordingError, collect_all
from foc_ros.io.terminal import show_progress


def run(arguments: argparse.Namespace) -> int:
    """Convert the tables; all are checked before the first bag is written."""
    scenes, movements = _read(arguments)
    bags = {arguments.output / name: movement for name, movement in _name_bags(movements).items()}
    for bag in bags:
        if bag.exists():
            raise RecordingError(f'{bag}: exists already and is not overwritten; choose another --output')
    for bag, movement in show_progress(bags.items(), 'convert', len(bags)):
        write_movement(bag, movement, scenes[movement.name])
    hands = sum(len(each.stamps_ns) for each in movements)
    obstacles = [len(scenes[each.name].find_boxes(each.positions) or scenes[each.name].obstacles) for each in movements]
    count = ' to '.join(str(each) for each in sorted({min(obstacles), max(obstacles)}))
    print(f'{len(bags)} bags with {hands} hand poses and {count} obstacles written to {arguments.output}')
    return 0


def _read(arguments: argparse.Namespace) -> tuple[dict[str, RecordedScene], list[Movement]]:
    """Return the scene of each recording by its name, and all movements."""
    if arguments.obstacles is None and arguments.csv.is_dir():
        tables = read_tables(arguments.csv)
        return {name: each.scene for name, each in tables.items()}, collect_all(
            TableRecording.read_movement, [(each,) for each in tables.values()]
        )
    if arguments.obstacles is None:
        raise InputError('--obstacles', 'a table of obstacles, which may be without rows', 'nothing')
    reading = [(read_movements, arguments.csv), (read_scenes, arguments.obstacles, arguments.goals)]
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
