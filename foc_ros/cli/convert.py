"""`convert`: motion capture in CSV tables to bags, one per recording, with the messages of a tracker and a perception node."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from foc_ros.analysis.csv_recordings import Movement, read_goals, read_movements, read_obstacles, write_movement
from foc_ros.core.errors import RecordingError
from foc_ros.io.terminal import show_progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument('csv', type=Path, metavar='CSV', help='recordings: columns recording, t_s, x_m, y_m[, z_m]')
    words = 'columns x_m, y_m, radius_m[, radius_stddev_m, id, z_m]'
    parser.add_argument('--obstacles', type=Path, metavar='CSV', required=True, help=words)
    parser.add_argument('--goals', type=Path, metavar='CSV', help='columns x_m, y_m[, z_m]')
    parser.add_argument('--output', type=Path, metavar='DIR', required=True, help='directory for the bags, one per recording')


def run(arguments: argparse.Namespace) -> int:
    """Convert the tables; all are checked before the first bag is written."""
    movements = read_movements(arguments.csv)
    obstacles = read_obstacles(arguments.obstacles)
    goals = None if arguments.goals is None else read_goals(arguments.goals)
    bags = {arguments.output / name: movement for name, movement in _name_bags(movements).items()}
    for bag in bags:
        if bag.exists():
            raise RecordingError(f'{bag}: exists already and is not overwritten; choose another --output')
    for bag, movement in show_progress(bags.items(), 'convert', len(bags)):
        write_movement(bag, movement, obstacles, goals)
    count = sum(len(movement.stamps_ns) for movement in movements)
    print(f'{len(bags)} bags with {count} hand poses and {len(obstacles)} obstacles written to {arguments.output}')
    return 0


def _name_bags(movements: list[Movement]) -> dict[str, Movement]:
    """Return the recordings by a name that is valid on any file system; raises RecordingError if two have the same name."""
    named: dict[str, Movement] = {}
    for movement in movements:
        name = re.sub(r'[^A-Za-z0-9._-]', '_', movement.name).lstrip('.-') or '_'
        if name in named:
            raise RecordingError(f'recordings {named[name].name!r} and {movement.name!r} would both be written to {name}')
        named[name] = movement
    return named
