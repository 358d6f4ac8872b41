"""The tangent graph: a shortest path among shapes consists of straight runs that touch shapes, joined by arcs along them."""

from __future__ import annotations

from functools import lru_cache
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, compiled_exactly, freeze
from foc_ros.core.obstacles.boundary import tabulate_boundaries
from foc_ros.core.obstacles.rounded_polygon import Polygons
from foc_ros.core.types import Array, as_readonly

from .arcs import Arcs, find_arcs
from .overlaps import Shapes, build_shapes
from .runs import Runs, find_runs
from .tangents import Outlines


class TangentGraph(NamedTuple):
    """Outlines of shapes, g goals and the hand, runs in the order of the nodes that they leave, and arcs between them.

    ends (e,): nodes at which runs may end; first_run (2 n + 1,): the first run from each node; the runs from the last of these
    on leave the hand. rest (g, m): least length of a path from the end of each run to each goal [m], infinite if there is none.
    """

    outlines: Outlines
    shapes: Shapes
    ends: Indices
    runs: Runs
    arcs: Arcs
    first_run: Indices
    rest: Matrix


def build_tangent_graph(centre: Array, radius: Array, goals: Array, polygons: Polygons | None = None) -> TangentGraph:
    """Build the graph of shapes (n, 2), (n,) and goals (g, 2) [m], without a hand; polygons: circles if not given.

    The last graphs are kept, for scenes in which only the hand moves.
    """
    vertices, corners = polygons or _make_points(len(radius))
    return _build_from_bytes(centre.tobytes(), radius.tobytes(), goals.tobytes(), vertices.tobytes(), corners.tobytes())


def connect_hand(graph: TangentGraph, hand: Array) -> TangentGraph:
    """Return the graph with the runs from a hand (2,) [m] to all shapes and goals."""
    centre, m = graph.outlines.centre.copy(), len(graph.runs.head)
    centre[-1] = hand
    outlines = graph.outlines._replace(centre=as_readonly(centre))
    tail = np.full(len(graph.ends), 2 * len(centre) - 1)
    found = find_runs(outlines, graph.shapes, tail, graph.ends)
    runs = freeze(Runs._make([np.concatenate(pair) for pair in zip(graph.runs, found, strict=True)]))
    arcs = freeze(find_arcs(outlines, runs, graph.first_run, m))
    rest = np.concatenate((graph.rest, measure_rest_from_hand(graph, arcs, found.head)), axis=1)
    first = np.concatenate((graph.arcs.first, arcs.first[1:] + len(graph.arcs.after)))
    arcs = freeze(Arcs(first, np.concatenate((graph.arcs.after, arcs.after)), np.concatenate((graph.arcs.step, arcs.step))))
    return graph._replace(outlines=outlines, runs=runs, arcs=arcs, rest=as_readonly(rest))


@lru_cache(maxsize=8)
def _build_from_bytes(centre: bytes, radius: bytes, goals: bytes, vertices: bytes, corners: bytes) -> TangentGraph:
    n, points = len(radius) // 8, len(goals) // 16
    polygons = Polygons(np.frombuffer(vertices).reshape(n, -1 if n else 1, 2), np.frombuffer(corners, dtype=np.intp))
    outlines = _make_outlines(np.frombuffer(centre + goals).reshape(-1, 2), np.frombuffer(radius), polygons)
    shapes = freeze(build_shapes(outlines, n))
    nodes = np.flatnonzero(np.repeat(shapes.is_outer, 2))
    ends = np.append(nodes, 2 * (n + np.arange(points)) + 1)
    runs = freeze(find_runs(outlines, shapes, *_list_pairs(nodes, ends)))
    first_run = np.searchsorted(runs.tail, np.arange(2 * n + 1))
    arcs = find_arcs(outlines, runs, first_run, 0)
    rest = measure_rest(freeze(arcs), runs.head, 2 * (n + np.arange(points)) + 1)
    return freeze(TangentGraph(outlines, shapes, ends, runs, arcs, first_run, rest))


def _make_points(count: int, most: int = 1) -> Polygons:
    return Polygons(np.zeros((count, most, 2)), np.ones(count, dtype=np.intp))


def _make_outlines(centre: Array, radius: Array, polygons: Polygons) -> Outlines:
    """Return the outlines of shapes and goals, and of a hand that has no place yet."""
    rows = len(centre) + 1 - len(radius)
    points = _make_points(rows, polygons.vertices.shape[1])
    together = freeze(Polygons._make([np.concatenate(pair) for pair in zip(polygons, points, strict=True)]))
    centres, radii = np.concatenate((centre, np.zeros((1, 2)))), np.concatenate((radius, np.zeros(rows)))
    return freeze(Outlines(centres, radii, together, tabulate_boundaries(together)))


def _list_pairs(nodes: Indices, ends: Indices) -> tuple[Indices, Indices]:
    """List the nodes at both ends of possible runs from nodes (k,) to ends (e,), in the order of the first."""
    tail, head = np.repeat(nodes, len(ends)), np.tile(ends, len(nodes))
    is_pair = tail >> 1 != head >> 1
    return tail[is_pair], head[is_pair]


@compiled_exactly
def measure_rest(arcs: Arcs, head: Indices, goals: Indices) -> Matrix:
    """Return the least lengths (g, m) [m] of the paths from the ends of the runs to the nodes of goals: Dijkstra's algorithm.

    head (m,): nodes at the ends of the runs. A kernel, as this takes 10 us and SciPy 170 us.
    """
    m, rest = len(head), np.full((len(goals), len(head)), np.inf)
    # the runs before each run
    first, before, step = np.zeros(m + 2, np.intp), np.empty(len(arcs.after), np.intp), np.empty(len(arcs.after))
    for after in arcs.after:
        first[after + 2] += 1
    first = np.cumsum(first)
    for run in range(m):
        for arc in range(arcs.first[run], arcs.first[run + 1]):
            row = first[arcs.after[arc] + 1]
            before[row], step[row] = run, max(arcs.step[arc], 0.0)
            first[arcs.after[arc] + 1] += 1
    for goal in range(len(goals)):
        frontier = [(0.0, 0) for _ in range(0)]
        for run in range(m):
            if head[run] == goals[goal]:
                rest[goal, run] = 0.0
                heappush(frontier, (0.0, run))
        while frontier:
            length, run = heappop(frontier)
            if length > rest[goal, run]:
                continue
            for row in range(first[run], first[run + 1]):
                longer = length + step[row]
                if longer < rest[goal, before[row]]:
                    rest[goal, before[row]] = longer
                    heappush(frontier, (longer, before[row]))
    return rest


@compiled_exactly
def measure_rest_from_hand(graph: TangentGraph, arcs: Arcs, head: Indices) -> Matrix:
    """Return the least lengths (g, h) [m] of the paths from the ends of the runs that leave the hand to the goals.

    graph: without the hand; arcs: from the ends of the h runs; head (h,): nodes at these ends.
    """
    rest = np.full((len(graph.rest), len(head)), np.inf)
    for goal in range(len(graph.rest)):
        for row in range(len(head)):
            if head[row] == 2 * (len(graph.shapes.extent) + goal) + 1:
                rest[goal, row] = 0.0
            for arc in range(arcs.first[row], arcs.first[row + 1]):
                rest[goal, row] = min(rest[goal, row], arcs.step[arc] + graph.rest[goal, arcs.after[arc]])
    return rest
