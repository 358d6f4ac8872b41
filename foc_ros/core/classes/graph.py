# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The visibility graph: the outlines' vertices, and the straight lines between them that a shortest path may follow.

A shortest path bends at vertices of outlines only, and touches the outline at both ends of each of its lines. Vertices inside
another outline and lines through one are left out, so outlines that overlap need no further care. What depends on the obstacles
alone is kept while these are the same, and so is what depends on them and on a goal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from foc_ros.core.types import Array, Record

from .outlines import KEPT, Flags, Outlines
from .sides import count_crossings

Rows = NDArray[np.intp]
Crossings = NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Nodes:
    """The v vertices of n outlines, those of the first outline first.

    points (v, 2) [m]; previous, following (v,): rows of the vertices before and after each on its outline; owner (v,): row of its
    outline; is_free (v,): whether it lies in no other outline.
    """

    outlines: Outlines
    points: Array
    previous: Rows
    following: Rows
    owner: Rows
    is_free: Flags

    @cached_property
    def offsets(self) -> Array:
        """The vertices relative to the centres of the obstacles (v, n, 2) [m]."""
        return self.points[:, None] - self.outlines.centre

    @cached_property
    def places(self) -> list[tuple[float, float]]:
        """The vertices as a list, which Python reads faster."""
        return list(map(tuple, self.points.tolist()))

    def touch(self, rows: Rows, points: Array) -> Flags:
        """Tell whether the lines from vertices (p,) to points (q, 2) leave its outline on one side, (p, q)."""
        at, left = self.points[rows], []
        for neighbour in (self.previous, self.following):
            edge = self.points[neighbour[rows]] - at
            aside = np.column_stack([edge[:, 1], -edge[:, 0]])
            left.append(aside @ points.T - (aside * at).sum(axis=1)[:, None])
        flags: Flags = left[0] * left[1] >= -1e-15  # on one side of the line, or on it [m^4]
        return flags

    def find_tangents(self) -> tuple[Rows, Rows]:
        """Return the rows at both ends of the lines that touch two outlines, whatever lies between."""
        pairs, free = [np.zeros((2, 0), dtype=np.intp)], np.flatnonzero(self.is_free)
        bounds = np.searchsorted(self.owner[free], np.arange(len(self.outlines) + 1)).tolist()
        # one outline after the other: arrays of all pairs would be large, which is slow
        for begin, end in pairwise(bounds):
            own, later = free[begin:end], free[end:]
            touches = self.touch(own, self.points[later]) & self.touch(later, self.points[own]).T
            row, column = np.nonzero(touches)
            pairs.append(np.array([own[row], later[column]]))
        tail, head = np.concatenate(pairs, axis=1)
        return tail, head


@dataclass(frozen=True, eq=False)
class Lines:
    """m lines from a point (2,) [m] to nodes of a graph.

    scale (n,): size of the outlines, as a multiple, at which none of them holds the point; nodes (m,); length (m,) [m]; crossings
    (m, n): how often each line, from the point on, crosses the ray of each centre.
    """

    point: Array
    scale: Array
    nodes: Rows
    length: Array
    crossings: Crossings


@dataclass(frozen=True, eq=False)
class Graph(Record):
    """A visibility graph: v nodes, and m lines between them, in the order of the nodes that they leave.

    first (v + 1,): the first line of each node; head (m,): node at the end of each line; length (m,) [m]; crossings (m, n): how
    often each line crosses the ray of each centre. Each line is there in both directions.
    """

    nodes: Nodes
    first: Rows
    head: Rows
    length: Array
    crossings: Crossings

    def join(self, point: Array) -> Lines:
        """Return the lines from a point (2,) [m] to the nodes of the graph that are visible from it."""
        nodes, outlines = self.nodes, self.nodes.outlines
        scale, free = outlines.measure_scale(point), np.flatnonzero(nodes.is_free)
        is_holding = (scale < 1.0)[nodes.owner[free]]
        rows = free[is_holding | nodes.touch(free, point[None])[:, 0]]
        rows = rows[~outlines.shrink(scale).block(np.broadcast_to(point, (len(rows), 2)), nodes.points[rows])]
        length = np.hypot(*(nodes.points[rows] - point).T)
        return Lines(point, scale, rows, length, count_crossings(point - outlines.centre, nodes.offsets[rows]))

    def measure_lengths(self, goal: Lines) -> list[float]:
        """Return the length of the shortest path from each node to a goal [m], infinite if there is none."""
        first = np.append(self.first, self.first[-1] + len(goal.nodes))
        head, length = np.append(self.head, goal.nodes), np.append(self.length, goal.length)
        length = np.maximum(length, 1e-12)  # vertices of different outlines may coincide
        lines = csr_matrix((length, head, first), shape=(len(first) - 1, len(first) - 1))
        lengths: list[float] = dijkstra(lines, indices=len(first) - 2)[:-1].tolist()
        return lengths


@lru_cache(maxsize=KEPT)
def build_graph(outlines: Outlines) -> Graph:
    """Build the visibility graph of outlines; the last graphs are kept."""
    points = outlines.vertices[np.arange(outlines.vertices.shape[1]) < outlines.count[:, None]]
    owner, number = np.repeat(np.arange(len(outlines)), outlines.count), np.arange(len(points))
    ends = np.cumsum(outlines.count) - 1
    begins = ends - outlines.count + 1
    following = np.where(number == ends[owner], begins[owner], number + 1)
    previous = np.where(number == begins[owner], ends[owner], number - 1)
    nodes = Nodes(outlines, points, previous, following, owner, ~outlines.hold(points, owner))
    edges = np.flatnonzero(nodes.is_free & nodes.is_free[nodes.following])  # of the outlines, whatever covers them in the middle
    tail, head = np.concatenate([nodes.find_tangents(), (edges, nodes.following[edges])], axis=1)
    is_open = ~outlines.block(nodes.points[tail], nodes.points[head])
    tail, head = tail[is_open], head[is_open]
    length = np.hypot(*(nodes.points[head] - nodes.points[tail]).T)
    crossings = count_crossings(nodes.offsets[tail], nodes.offsets[head])
    tails, heads = np.append(tail, head), np.append(head, tail)
    order = np.argsort(tails, kind='stable')
    first = np.searchsorted(tails[order], np.arange(len(nodes.points) + 1))
    return Graph(nodes, first, heads[order], np.append(length, length)[order], np.concatenate([crossings, -crossings])[order])
