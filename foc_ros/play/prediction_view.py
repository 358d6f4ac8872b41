"""A message of `~/prediction` as the plain values that the page draws; a class keeps its colour while it is followed."""

from __future__ import annotations

from typing import Any

import numpy as np

from foc_ros.core.types import Array
from foc_ros.reporting.draw import ELLIPSES_PER_CANDIDATE, STDDEVS, compute_ellipse_axes
from foc_ros.reporting.encode import PATH_POINTS, select_evenly
from foc_ros.reporting.views import SLOTS
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW

DECIMALS = 5
"""Lengths are sent in hundredths of a millimetre."""


class Slots:
    """Gives each class a slot of letter and colour, which it keeps while it is among the candidates."""

    def __init__(self) -> None:
        self._slots: dict[int, int] = {}
        self._free = list(range(SLOTS))

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

    Each has its slot, way, goal and likelihood, whether it is compromised, its path [m], and ellipses of one standard deviation,
    motor: of the motor noise, total: of the position, for the most likely one only. An ellipse has x, y, greater and smaller half
    axis [m], and the angle of the greater one [rad].
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
            'motor': _compute_ellipses(part, 'motor_'),
            'total': [] if rank else _compute_ellipses(part, ''),
        }
        for rank, (part, slot) in enumerate(zip(parts, given, strict=True))
    ]


def _compute_ellipses(rows: Any, prefix: str) -> list[list[float]]:
    """Return ellipses along a path, of the covariance whose columns have a prefix."""
    chosen = rows[select_evenly(len(rows), ELLIPSES_PER_CANDIDATE + 1)[1:]]
    xx, xy, yy = (chosen[prefix + pair].astype(float) for pair in ('xx', 'xy', 'yy'))
    greater, smaller, angle = compute_ellipse_axes(np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1))
    return _round(np.column_stack([chosen['x'], chosen['y'], STDDEVS * greater, STDDEVS * smaller, np.radians(angle)]))


def _round(values: Array) -> list[list[float]]:
    rounded: list[list[float]] = np.round(values.astype(float), DECIMALS).tolist()
    return rounded
