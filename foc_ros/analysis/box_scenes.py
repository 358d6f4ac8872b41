"""Scenes of boxes in space as a table: the boxes, walls and targets among which people reached, one scene for each recording.

The columns are `recording`, `object`, the centre `x_m`, `y_m`, `z_m`, and the full lengths along these axes `width_m`, `depth_m`
and `height_m`. The object `Target` is the goal of its recording, and no obstacle. Where a table of trials has the column
`object`, which is what the hand picked up, all objects that are picked up in any recording are goals, and obstacles as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from foc_ros.core.errors import RecordingError
from foc_ros.io.csv_tables import Column, Row, parse_rows, read_rows

from .csv_recordings import RecordedScene

TARGET = 'Target'
COLUMNS = tuple(Column(name) for name in ('x_m', 'y_m', 'z_m')) + tuple(
    Column(name, 0.0) for name in ('width_m', 'depth_m', 'height_m')
)


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
