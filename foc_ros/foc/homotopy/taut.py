"""From ways to points: the straight runs and arcs of several ways laid end to end on one scale of length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from foc_ros.foc.records import Array

from .crossing import Complex
from .tangents import TURN
from .tries import Index
from .ways import BACK, Plan, Way


@dataclass(frozen=True, eq=False)
class Taut:
    """k paths laid end to end, each a run, an arc, a run, ...

    Per piece: at, where it begins on the scale [m]; begin, complex [m]; heading there, complex of length 1; bend [1/m],
    anticlockwise positive, 0 for runs. Per path: first and last piece; begins, where it begins on the scale [m]; length [m].
    """

    at: Array
    begin: Complex
    heading: Complex
    bend: Array
    first: Index
    last: Index
    begins: Array
    length: Array

    def points(self, along: Array) -> Complex:
        """Points at the lengths `along` (k, m) from the beginning of each path [m]; complex (k, m)."""
        along = along + self.begins[:, None]
        piece = np.searchsorted(self.at, along, side='right') - 1
        piece = np.minimum(np.maximum(piece, self.first[:, None]), self.last[:, None])
        step, bend = along - self.at[piece], self.bend[piece]
        curved = bend != 0.0
        turn = 1j * np.where(curved, bend, 1.0)
        points: Complex = self.begin[piece] + self.heading[piece] * np.where(curved, (np.exp(turn * step) - 1.0) / turn, step)
        return points


def taut(plan: Plan, found: Sequence[Way]) -> Taut:
    """Lay out ways through a plan."""
    at: list[float] = []
    begin: list[complex] = []
    heading: list[complex] = []
    bend: list[float] = []
    first: list[int] = []
    begins: list[float] = []
    scale = 0.0
    for way in found:
        first.append(len(at))
        begins.append(scale)
        for run, following in zip(way.runs, (*way.runs[1:], None), strict=True):
            at.append(scale)
            begin.append(plan.table.start[run])
            heading.append(plan.table.heading[run])
            bend.append(0.0)
            scale += plan.table.length[run]
            if following is not None:
                sense, radius = 2 * (plan.table.head[run] & 1) - 1, plan.roadmap.radius[plan.table.head[run] >> 1]
                angle = sense * (plan.table.leave[following] - plan.table.reach[run])
                at.append(scale)
                begin.append(plan.table.end[run])
                heading.append(plan.table.heading[run])
                bend.append(sense / radius)
                scale += radius * (angle + TURN if angle < -BACK else max(angle, 0.0))
    last = np.array([*first[1:], len(at)]) - 1
    length = np.diff([*begins, scale])
    return Taut(
        np.array(at),
        np.array(begin),
        np.array(heading),
        np.array(bend),
        np.array(first),
        last,
        np.array(begins),
        length,
    )


def progress(length: Array, speed: Array, duration_s: Array, steps: int) -> Array:
    """Path length at steps 0..N (k, N + 1) [m]: minimum jerk from the present speed along the path to rest at its end.

    s = L (10 t^3 - 15 t^4 + 6 t^5) + v T (t - 6 t^3 + 8 t^4 - 3 t^5) with t in [0, 1]. It would overshoot beyond v T = 2.5 L
    and begin backwards with v < 0, so v is held between. length, speed, duration_s: (k,) [m, m/s, s].
    """
    rest, carried = _shapes(steps)
    reach = (speed * duration_s).clip(0.0, 2.5 * length)
    along: Array = (length[:, None] * rest + reach[:, None] * carried).clip(0.0, length[:, None])
    return along


@lru_cache(maxsize=16)
def _shapes(steps: int) -> tuple[Array, Array]:
    t = np.linspace(0.0, 1.0, steps + 1)
    return t**3 * (10.0 + t * (6.0 * t - 15.0)), t * (1.0 + t**2 * (t * (8.0 - 3.0 * t) - 6.0))
