"""Arcs along shapes, from the end of one straight run to the beginning of the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Vector, compiled_exactly, compiled_exactly_with_caller
from foc_ros.core.obstacles.boundary import Place, measure_arc

from .runs import Runs
from .tangents import Outlines


class Arcs(NamedTuple):
    """Pairs of runs between which a path follows an arc, in the order of the first run.

    first (m + 1,): the first pair of each of the first runs; after (t,): the second runs; step (t,): lengths of the arc and of
    the second run together [m].
    """

    first: Indices
    after: Indices
    step: Vector


@compiled_exactly_with_caller
def measure_arc_between(outlines: Outlines, runs: Runs, before: int, after: int) -> tuple[float, bool]:
    """Return the length [m] of the arc from a run to the next, and whether it passes the beginning of the boundary."""
    node = runs.head[before]
    row = node >> 1
    reach = Place(runs.reach_vertex[before], runs.reach_angle[before])
    leave = Place(runs.leave_vertex[after], runs.leave_angle[after])
    return measure_arc(outlines.polygons, outlines.boundaries, row, outlines.radius[row], reach, leave, 2 * (node & 1) - 1)


@compiled_exactly
def find_arcs(outlines: Outlines, runs: Runs, first_run: Indices, begin: int) -> Arcs:
    """Find the arcs from the ends of the runs from a row on, up to where the next shape covers the boundary."""
    rows = len(runs.head) - begin
    first, most = np.zeros(rows + 1, np.intp), 0
    for before in range(begin, len(runs.head)):
        node = runs.head[before]
        if node < len(first_run) - 1:
            most += first_run[node + 1] - first_run[node]
    after, step, count = np.empty(most, np.intp), np.empty(most), 0
    for row in range(rows):
        before, node = begin + row, runs.head[begin + row]
        if node < len(first_run) - 1:
            for following in range(first_run[node], first_run[node + 1]):
                length, _ = measure_arc_between(outlines, runs, before, following)
                if length <= runs.clear_length[before]:
                    after[count], step[count] = following, length + runs.length[following]
                    count += 1
        first[row + 1] = count
    return Arcs(first, after[:count], step[:count])
