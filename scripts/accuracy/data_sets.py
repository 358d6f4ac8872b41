"""The recordings on which predictions are measured: of the demo, and of folders such as D3IL and HLP where they are present."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foc_ros.analysis.csv_recordings import RecordedScene, read_movement_rows
from foc_ros.analysis.recordings import RECORDINGS, Recording, TableRecording, find_recordings
from foc_ros.io.csv_tables import Row, read_rows

from .page import ROOT

SCENES = 'scenes.csv'
DEMO = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
SHARED = ROOT.parent / 'shared' / 'data'
HAND_RADIUS_M = 0.0125
"""Radius of the sphere that the people of HLP moved."""
PARTS = 100
"""Ids of the circles of box b begin at PARTS * b, with the circle in its middle."""


@dataclass(frozen=True)
class DataSet:
    """Recordings by name; asked: ids of the obstacles whose sides make up a homotopy class, None for all."""

    name: str
    recordings: dict[str, Recording]
    asked: frozenset[str] | None = None

    def thin(self, every: int) -> DataSet:
        """Return the data set with every n-th recording only."""
        return DataSet(self.name, dict(list(self.recordings.items())[::every]), self.asked)


def find_data_sets() -> list[Path]:
    """Return the packaged recording, and the folders of D3IL and HLP beside the checkout where they are present."""
    return [DEMO, *(SHARED / name for name in ('d3il_avoiding', 'hlp_reaching') if (SHARED / name).exists())]


def load_data_set(data: Path) -> DataSet:
    """Return the recordings of a bag or folder; boxes of a table scenes.csv become chains of circles."""
    if not (data / SCENES).exists():
        return DataSet(data.stem, find_recordings(data))
    tables, scenes = read_movement_rows(data / RECORDINGS), _read_scenes(data / SCENES)
    recordings: dict[str, Recording] = {name: _make_recording(name, rows, scenes[name]) for name, rows in tables.items()}
    middles = frozenset(str(PARTS * box) for box in range(max(len(each) for each in scenes.values())))
    return DataSet(data.stem, recordings, middles)


def _read_scenes(file: Path) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in read_rows(file, ('recording', 'object', 'x_m', 'y_m', 'width_m', 'depth_m')):
        found.setdefault(row.cells['recording'], []).append(row)
    return found


def _make_recording(name: str, rows: list[Row], scene: list[Row]) -> TableRecording:
    boxes = [row for row in scene if row.cells['object'].startswith('Obstacle')]
    circles = [circle for number, row in enumerate(boxes) for circle in chain_circles(_read_box(row), number)]
    goals = [[row.read_number('x_m'), row.read_number('y_m'), 0.0] for row in scene if row.cells['object'] == 'Target']
    return TableRecording(name, tuple(rows), RecordedScene(tuple(circles), np.array(goals)))


def _read_box(row: Row) -> tuple[float, float, float, float]:
    x, y, width, depth = (row.read_number(column) for column in ('x_m', 'y_m', 'width_m', 'depth_m'))
    return x, y, width, depth


def chain_circles(box: tuple[float, float, float, float], number: int) -> list[tuple[float, ...]]:
    """Return circles (x, y, z, radius, radius_stddev, id) along the longer axis of a box (x, y, width, depth) [m].

    They are as wide as the box, half as far apart as they are wide or nearer, and wider by the radius of the hand.
    """
    x, y, width, depth = box
    half, length = min(width, depth) / 2.0, abs(width - depth)
    count = 2 * int(np.ceil(length / 2.0 / half)) + 1
    offsets = sorted(np.linspace(-length / 2.0, length / 2.0, count), key=abs) if count > 1 else [0.0]
    along = np.array([1.0, 0.0] if width >= depth else [0.0, 1.0])
    return [
        (x + offset * along[0], y + offset * along[1], 0.0, half + HAND_RADIUS_M, 0.0, PARTS * number + part)
        for part, offset in enumerate(offsets)
    ]
