#!/usr/bin/env python3
"""Make doc/examples/*.csv: two movements of the packaged recording as motion-capture tables, for `convert`.

python scripts/make_example_tables.py [DIRECTORY]
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from make_demo_recording import OBSTACLES

from foc_ros.core.config import Config
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, Array, HandSample
from foc_ros.io.bags import BagReader
from foc_ros.reporting.views import HandTrajectory, build_hand_trajectory
from foc_ros.ros.intake import Intake

ROOT = Path(__file__).resolve().parents[1]
RECORDING, EXAMPLES = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap', ROOT / 'doc' / 'examples'
MOVEMENTS = (4, 6)
"""Rows of the movements of the recording that are written."""
LEAD_NS, EVERY = 200_000_000, 2
"""Time by which a table begins before its movement, and the number of samples of which one is kept: 50 per second."""


def main() -> None:
    """Write recordings.csv, obstacles.csv and goals.csv into the directory given on the command line."""
    parser = argparse.ArgumentParser(description='Make the tables of doc/examples.')
    parser.add_argument('directory', nargs='?', type=Path, default=EXAMPLES)
    directory = parser.parse_args().directory
    hand, goals = read()
    spans = hand.find_movements(Config().estimator.onset_speed)
    samples = []
    for name, number in zip('ab', MOVEMENTS, strict=True):
        begin_ns, end_ns = spans[number][0] - LEAD_NS, spans[number][1]
        rows = hand.between(begin_ns, end_ns)
        for stamp, (x, y) in list(zip(hand.stamps_ns[rows], hand.positions[rows], strict=True))[::EVERY]:
            samples.append((name, f'{(stamp - begin_ns) / NANOSECONDS:.3f}', f'{x:.4f}', f'{y:.4f}'))
    obstacles = [
        (str(name), *(f'{value:.4f}' for value in (x, y, radius, stddev, *box)))
        for x, y, _, radius, stddev, name, *box in OBSTACLES
    ]
    _write(directory / 'recordings.csv', ('recording', 't_s', 'x_m', 'y_m'), samples)
    columns = ('id', 'x_m', 'y_m', 'radius_m', 'radius_stddev_m', 'size_x_m', 'size_y_m', 'yaw_rad')
    _write(directory / 'obstacles.csv', columns, obstacles)
    _write(directory / 'goals.csv', ('x_m', 'y_m'), [tuple(f'{value:.4f}' for value in goal) for goal in goals])


def read() -> tuple[HandTrajectory, Array]:
    """Return the hand and the goals of the recording, decoded as in the node."""
    intake = Intake(Pipeline(Config()))
    samples: list[HandSample] = []
    with BagReader(RECORDING) as reader:
        for item in reader:
            intake.take(item.role, item.message)
            if intake.sample is not None and (not samples or intake.sample is not samples[-1]):
                samples.append(intake.sample)
    assert intake.pipeline.scene.goals is not None
    return build_hand_trajectory(samples), intake.pipeline.scene.goals


def _write(file: Path, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    with file.open('w', newline='', encoding='utf-8') as stream:
        csv.writer(stream, lineterminator='\n').writerows([columns, *rows])


if __name__ == '__main__':
    main()
