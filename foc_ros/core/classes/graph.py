"""The visibility graph: the outlines' vertices, and the straight lines between them that a shortest path may follow.

A shortest path bends at vertices of outlines only, and touches the outline at both ends of each of its lines. Vertices inside
another outline and lines through one are left out, so outlines that overlap need no further care. What depends on the obstacles
alone is kept while these are the same, and so is what depends on them and on a goal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from foc_ros.core.types import Array, Record

from .outlines import Flags, Outlines
from .sides import count_crossings

Rows = NDArray[np.intp]

BOTH_SIDES = 1e-15
"""Product of two cross products [m^4] up to which the neighbours of a vertex count as being on one side of a line, or on it."""
SHORTEST = 1e-12
"""Least length of a line [m]: vertices of different outlines may coincide."""


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
    crossings: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Graph(Record):
    """Nodes are the vertices of the outlines, those of the first outline first; m lines join them, each in both directions.

    points, before, after (v, 2): each node, and the vertices before and after it [m]; owner (v,): row of its outline; is_free
    (v,): whether it lies in no other outline. centre (n, 2): of the obstacles [m]. first (v + 1,): the first line of each node;
    head (m,): node at the end of each line; length (m,) [m]; crossings (m, n): of the ray of each centre.
    """

    outlines: Outlines
    centre: Array
    points: Array
    before: Array
    after: Array
    owner: Rows
    is_free: Flags
    first: Rows
    head: Rows
    length: Array
    crossings: NDArray[np.int8]

    @cached_property
    def lists(self) -> tuple[list[int], list[int], list[float]]:
        """The first line of each node, and the heads and lengths of the lines, as lists, which Python reads faster."""
        return self.first.tolist(), self.head.tolist(), self.length.tolist()

    def join(self, point: Array) -> Lines:
        """Return the lines from a point (2,) [m] to the nodes of the graph that are visible from it."""
        scale = self.outlines.measure_scale(point)
        is_holding = (scale < 1.0)[self.owner]
        nodes = np.flatnonzero(self.is_free & (is_holding | self._touches(slice(None), self.points - point)))
        begin = np.broadcast_to(point, (len(nodes), 2))
        nodes = nodes[~self.outlines.shrink(scale).block(begin, self.points[nodes]).any(axis=1)]
        length = np.hypot(*(self.points[nodes] - point).T)
        crossings = count_crossings(np.broadcast_to(point - self.centre, (len(nodes), *self.centre.shape)), self._offsets[nodes])
        return Lines(point, scale, nodes, length, crossings)

    def measure_rest(self, goal: Lines) -> list[float]:
        """Return the length of the shortest path from each node to a goal [m], infinite if there is none."""
        count = len(self.points)
        first = np.append(self.first, self.first[-1] + len(goal.nodes))
        head, length = np.append(self.head, goal.nodes), np.append(self.length, goal.length)
        lines = csr_matrix((np.maximum(length, SHORTEST), head, first), shape=(count + 1, count + 1))
        rest: list[float] = dijkstra(lines, indices=count)[:-1].tolist()
        return rest

    @cached_property
    def _offsets(self) -> Array:
        """The nodes relative to the centres (v, n, 2) [m]."""
        return self.points[:, None] - self.centre

    def _touches(self, nodes: Rows | slice, line: Array) -> Flags:
        """Tell whether lines (m, 2) through nodes (m,) leave the rest of the node's outline on one side."""
        after, before = self.after[nodes] - self.points[nodes], self.before[nodes] - self.points[nodes]
        left = line[:, 0] * after[:, 1] - line[:, 1] * after[:, 0]
        other = line[:, 0] * before[:, 1] - line[:, 1] * before[:, 0]
        flags: Flags = left * other >= -BOTH_SIDES
        return flags


@lru_cache(maxsize=4)
def build_graph(outlines: Outlines) -> Graph:
    """Build the visibility graph of outlines; the last graphs are kept.

    Parameters
    ----------
    outlines : Outlines
        The n outlines.

    Returns
    -------
    Graph
        The graph.
    """
    most, centre = outlines.vertices.shape[1], outlines.centre
    is_vertex, n = np.arange(most) < outlines.count[:, None], len(outlines)
    points, owner = outlines.vertices[is_vertex], np.repeat(np.arange(n), outlines.count)
    starts = np.cumsum(outlines.count) - outlines.count
    place = np.arange(len(points)) - starts[owner]
    following, previous = (starts[owner] + (place + step) % outlines.count[owner] for step in (1, -1))
    is_covered = outlines.holds(points)
    is_covered[np.arange(len(points)), owner] = False
    none, is_free = np.zeros(0, dtype=np.intp), ~is_covered.any(axis=1)
    graph = Graph(
        outlines, centre, points, points[previous], points[following], owner, is_free, none, none, none, np.zeros((0, n), np.int8)
    )
    free = np.flatnonzero(is_free)
    tail, head = (free[each] for each in np.nonzero(owner[free][:, None] < owner[free]))
    line = points[head] - points[tail]
    touching = np.flatnonzero(graph._touches(tail, line) & graph._touches(head, line))
    edges = free[is_free[following[free]]]
    tail, head = np.append(tail[touching], edges), np.append(head[touching], following[edges])
    is_open = ~outlines.block(points[tail], points[head]).any(axis=1)
    tail, head = tail[is_open], head[is_open]
    length = np.hypot(*(points[head] - points[tail]).T)
    crossings = count_crossings(graph._offsets[tail], graph._offsets[head])
    order = np.argsort(np.append(tail, head), kind='stable')
    first = np.searchsorted(np.append(tail, head)[order], np.arange(len(points) + 1))
    return Graph(
        outlines,
        centre,
        points,
        graph.before,
        graph.after,
        owner,
        is_free,
        first,
        np.append(head, tail)[order],
        np.append(length, length)[order],
        np.concatenate([crossings, -crossings])[order],
    )
