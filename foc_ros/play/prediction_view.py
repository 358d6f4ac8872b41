"""A message of `~/prediction` as the plain values that the page draws; a class keeps its colour while it is followed."""

from __future__ import annotations

from typing import Any

import numpy as np

from foc_ros.core.types import Array
from foc_ros.reporting.drawing import CLASSES, ELLIPSES_PER_CANDIDATE, STDDEVS, compute_ellipse_axes
from foc_ros.reporting.report_data import PATH_POINTS, select_evenly
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW

DECIMALS = 5
"""Lengths are sent in hundredths of a millimetre."""


class Slots:
    """Gives each class a slot of letter and colour, which it keeps while it is among the candidates."""

    def __init__(self) -> None:
        self._slots: dict[int, int] = {}
        self._free = list(range(CLASSES))

    def assign(self, ways: list[int]) -> list[int | None]:
        """Return the slots of the present classes; a class that finds none has None."""
        for way in set(self._slots) - set(ways):
            self._free.append(self._slots.pop(way))  # the slot that has been free for longest is used first
        for way in ways:
            if way not in self._slots and self._free:
                self._slots[way] = self._free.pop(0)
        return [self._slots.get(way) for way in ways]


def view_candidates(cloud: Any, slots: Slots) -> list[dict[str, Any]]:
    """Return the candidates of a prediction on the plane xy, the most likely one first.

    Each has its slot, way, goal and likelihood, whether it is compromised, its path [m], and ellipses of the standard deviation
    that motor noise causes [m]: x, y, greater and smaller half axis, and the angle of the greater one [rad].
    """
    rows = np.frombuffer(cloud.data, dtype=CLOUD_ROW)
    starts = np.flatnonzero(np.diff(rows['candidate'].astype(int), prepend=-1))
    parts = np.split(rows, starts[1:]) if len(rows) else []
    given = slots.assign([int(part['way'][0]) for part in parts])
    return [
        {
            'slot': slot,
            'way': int(part['way'][0]),
            'goal': int(part['goal'][0]),
            'likelihood': round(float(part['likelihood'][0]), 4),
            'compromised': bool(part['compromised'][0]),
            'path': _round(np.column_stack([part[axis] for axis in 'xy'])[select_evenly(len(part), PATH_POINTS)]),
            'ellipses': _round(_compute_ellipses(part[select_evenly(len(part), ELLIPSES_PER_CANDIDATE + 1)[1:]])),
        }
        for part, slot in zip(parts, given, strict=True)
    ]


def _compute_ellipses(rows: Any) -> Array:
    xx, xy, yy = (rows[f'motor_{pair}'].astype(float) for pair in ('xx', 'xy', 'yy'))
    covariance = np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1)
    greater, smaller, angle = compute_ellipse_axes(covariance)
    return np.column_stack([rows['x'], rows['y'], STDDEVS * greater, STDDEVS * smaller, np.radians(angle)])


def _round(values: Array) -> list[list[float]]:
    rounded: list[list[float]] = np.round(values.astype(float), DECIMALS).tolist()
    return rounded
