"""A taut path as straight runs and arcs, and the timed guess along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.foc.records import Array
from .roadmap import TURN, Complex, Roadmap
from .ways import BACK, Way


@dataclass(frozen=True, eq=False)
class TautPath:
    """Runs and arcs in turn: r, a, r, ..., r. Per piece: begin, complex [m]; at, path length there [m]; heading, complex of length 1;
    curvature [1/m], anticlockwise positive, 0 for runs. length: of the whole path [m].
    """

    begin: Complex
    at: Array
    heading: Complex
    curvature: Array
    length: float

    def point(self, along: Array) -> Complex:
        """Points at the path lengths `along` (m,) in [0, length] [m]; complex."""
        piece = np.searchsorted(self.at, along, side='right') - 1
        step, bend = along - self.at[piece], self.curvature[piece]
        arc = np.where(bend == 0.0, 1.0, bend)
        reach = np.where(bend == 0.0, step, (np.exp(1j * arc * step) - 1.0) / (1j * arc))
        points: Complex = self.begin[piece] + self.heading[piece] * reach
        return points

    def polyline(self) -> Complex:
        """Points at every joint and at least every quarter of a right angle along the arcs; complex."""
        ends = np.append(self.at[1:], self.length)
        parts = np.ceil(np.abs(self.curvature) * (ends - self.at) * 16.0 / TURN).astype(int).clip(1)
        along = np.concatenate([np.linspace(a, b, m, endpoint=False) for a, b, m in zip(self.at, ends, parts, strict=True)])
        return np.append(self.point(along), self.point(np.array([self.length])))


def taut_path(plan: Roadmap, way: Way) -> TautPath:
    """Lay out the runs of a way with the arcs between them."""
    runs = np.array(way.runs)
    circle, sense = plan.head[runs[:-1]] >> 1, 2.0 * (plan.head[runs[:-1]] & 1) - 1.0
    angle = sense * (plan.leave[runs[1:]] - plan.reach[runs[:-1]])
    angle = np.where(angle < -BACK, angle + TURN, angle).clip(0.0)
    lengths = np.zeros(2 * len(runs) - 1)
    lengths[::2], lengths[1::2] = plan.length[runs], plan.radius[circle] * angle
    begin = np.zeros(len(lengths), dtype=complex)
    begin[::2], begin[1::2] = plan.start[runs], plan.end[runs[:-1]]
    curvature = np.zeros(len(lengths))
    curvature[1::2] = sense / plan.radius[circle]
    heading = np.zeros(len(lengths), dtype=complex)
    heading[::2], heading[1::2] = plan.heading[runs], plan.heading[runs[:-1]]
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    return TautPath(begin, at[:-1], heading, curvature, float(at[-1]))


def progress(length: float, speed: float, duration_s: float, steps: int) -> Array:
    """Path length at steps 0..N: minimum jerk from the present speed along the path to rest at its end.

    s = L (10 t^3 - 15 t^4 + 6 t^5) + v T (t - 6 t^3 + 8 t^4 - 3 t^5) with t in [0, 1]. Beyond v T = 2.5 L it would overshoot, and it
    would turn back where v < 0, so v is held between. length [m]; speed [m/s]; returns (N + 1,) [m].
    """
    t = np.linspace(0.0, 1.0, steps + 1)
    carried = min(max(speed * duration_s, 0.0), 2.5 * length)
    along: Array = length * t**3 * (10.0 + t * (6.0 * t - 15.0)) + carried * t * (1.0 + t**2 * (t * (8.0 - 3.0 * t) - 6.0))
    return along.clip(0.0, length)
