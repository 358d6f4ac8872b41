"""The homotopy classes of the paths to one goal, in the order of their rank, with their names.

A graph of all obstacles would be slow in a crowd. There the graph begins with the obstacles that are likely to matter, and grows
until no obstacle outside can change the answer.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.kernels import Indices, Vector
from foc_ros.core.obstacles.rounded_polygon import Polygons, find_offsets
from foc_ros.core.types import LEFT, RIGHT, Array

from .guesses import TautPath, lay_out
from .path_search import PathQuery, find_shortest_paths
from .search_scene import SearchScene
from .sides import compute_swept_angles
from .tangent_graph import TangentGraph, build_tangent_graph, connect_hand
from .tangents import GRAZE

FEW, MOST = 16, 64
"""So many shapes are always in the graph together; a graph grows up to the larger number."""
CLOSE = 1.02
"""Excess of the shapes that the graph of a crowd begins with: the best paths through a crowd are nearly straight."""
GROWTH = 4.0
"""A larger graph takes at least this times as long to build; it is not begun if there is less time left."""
FINENESS = 257
"""Number of points at which a path is compared with shapes that are not in its graph."""
NANO = 1e9


class PathClass(NamedTuple):
    """A homotopy class, represented by its shortest path, which consists of some runs of a graph.

    key, length plus what coasting adds, to the nanometre [m], and label: by these, classes rank. goal: row; course: the label
    without the goal; sides: LEFT or RIGHT by id, in the order of the label.
    """

    key: float
    label: str
    goal: int
    course: str
    sides: tuple[tuple[str, int], ...]
    graph: TangentGraph
    runs: tuple[int, ...]

    def lay_out(self) -> TautPath:
        """Return the shortest path."""
        return lay_out(self.graph, self.runs)


class ClassQuery(NamedTuple):
    """Which classes to find.

    goal: row; ids (n,) of the obstacles; velocity (2,): of the hand [m/s]; max_states: number that a path search may look at;
    expected: number of classes that are likely to be asked for; deadline: after it no graph grows, and no path search begins.
    """

    goal: int
    ids: tuple[str, ...]
    velocity: Array
    max_states: int
    expected: int
    deadline: Deadline = NEVER


class PartialGraph(NamedTuple):
    """The tangent graph of some of the obstacles.

    goal: row of the goal in the graph; rows: obstacles in the graph; others: those that are not; named: rows of the obstacles
    that the names to the goal contain, in their order; limit: length of a path that may touch one of the others [m]; max_key:
    bound on the paths to find [m], finite if there will be a larger graph beyond.
    """

    graph: TangentGraph
    goal: int
    rows: list[int]
    others: Indices
    named: list[int]
    limit: float
    max_key: float


def name_course(sides: Sequence[tuple[str, int]]) -> str:
    """Return the part of a label that says on which side each obstacle is passed."""
    return ''.join([('+' if side == LEFT else '-') + identity for identity, side in sides])


def find_classes(scene: SearchScene, query: ClassQuery, notes: Counter[str], is_due: bool = False) -> Iterator[PathClass]:
    """Yield each class to a goal once, in the order of their rank.

    notes: counts of what is decided, see `search.Search`; is_due: whether to look for the first class whatever the time.
    """
    named = sorted(np.flatnonzero(scene.is_named[query.goal]).tolist(), key=query.ids.__getitem__)
    # a graph for all goals costs less than one for each, but is too large a step between two looks at the clock
    is_shared = query.deadline.at is None
    excess = scene.excess.min(axis=0) if is_shared else scene.excess[query.goal]
    nearest: list[int] = np.argsort(excess, kind='stable').tolist()
    rows, given = _choose_shapes(excess if is_shared else None, named, nearest), set[str]()
    while True:
        together = len(scene.goals) if is_shared else max(1, MOST // max(len(rows), 1))
        before_s = query.deadline.left_s
        partial = _build_partial_graph(scene, excess, query.goal, sorted(rows), named, together)
        built_s = before_s - query.deadline.left_s
        most = _count_classes(partial)
        for found in _find_named_paths(scene, partial, query, notes):
            if found.course in given:
                continue
            met = _find_met(scene, found, partial.others) if found.key >= partial.limit else []
            is_late = query.deadline.left_s < built_s and (bool(given) or not is_due)
            if met and len(rows) < MOST and not is_late:
                rows = [*rows, *met]
                break
            given.add(found.course)
            notes['left_out'] += bool(met)
            if is_late or not met:
                yield found
            if len(given) == most:
                return
        else:
            if math.isinf(partial.max_key):
                return
            if query.deadline.left_s < GROWTH * built_s and (given or not is_due):
                notes['search_late'] += 1
                return
            rows = nearest[: min(2 * len(rows), MOST)]


def _choose_shapes(excess: Vector | None, named: list[int], nearest: list[int]) -> list[int]:
    """Return the rows to begin with: all of a few obstacles, the named ones of many if they are few, or the close ones.

    excess: None for a small first step, where time is limited.
    """
    rows, close = {*named, *nearest[: FEW // 2]}, 0 if excess is None else int((excess < CLOSE).sum())
    return list(rows) if len(rows) <= FEW < len(nearest) else nearest[: min(max(close, FEW), MOST)]


def _build_partial_graph(
    scene: SearchScene, excess: Vector, goal: int, rows: list[int], named: list[int], together: int
) -> PartialGraph:
    """Build the graph of some obstacles for one goal; a graph without all named ones is one to grow, up to MOST.

    excess (n,): see `SearchScene`; together: number of goals that share a graph.
    """
    first = goal // together * together
    shapes = scene.centre[rows], scene.radius[goal, rows], *scene.take_polygons(goal, rows)
    points = scene.goals[first : first + together], scene.hand
    graph = _build_graph(*[array.tobytes() for array in (*shapes, *points)])
    others = np.delete(np.arange(len(scene.centre)), rows)
    limit = float(excess[others].min(initial=np.inf)) * math.dist(scene.goals[goal], scene.hand)
    is_enough = len(rows) >= MOST or set(rows).issuperset(named)
    return PartialGraph(graph, goal - first, rows, others, named, limit, np.inf if is_enough else limit)


@lru_cache(maxsize=4)
def _build_graph(centre: bytes, radius: bytes, vertices: bytes, corners: bytes, goals: bytes, hand: bytes) -> TangentGraph:
    """Build the graph of some shapes with a hand; kept for the other goals of the same search."""
    points = np.frombuffer(centre).reshape(-1, 2), np.frombuffer(radius), np.frombuffer(goals).reshape(-1, 2)
    n = len(points[1])
    polygons = Polygons(np.frombuffer(vertices).reshape(n, -1 if n else 1, 2), np.frombuffer(corners, dtype=np.intp))
    return connect_hand(build_tangent_graph(*points, polygons), np.frombuffer(hand))


def _count_classes(partial: PartialGraph) -> int:
    """Return the largest number of classes: two for each cluster of named shapes that overlap."""
    clusters = {
        cluster for row, cluster in zip(partial.rows, partial.graph.shapes.cluster.tolist(), strict=True) if row in partial.named
    }
    return 1 << len(clusters) + len(set(partial.named).difference(partial.rows))


def _find_named_paths(scene: SearchScene, partial: PartialGraph, query: ClassQuery, notes: Counter[str]) -> Iterator[PathClass]:
    """Yield the classes of the paths over a graph, by their rank. A class may come again if the graph lacks named shapes."""
    place = {row: place for place, row in enumerate(partial.rows)}
    held = [row for row in partial.named if row in place]
    bearing_change, is_complete = scene.bearing_change[query.goal, held], len(held) == len(partial.named)
    paths = PathQuery(
        partial.goal,
        query.velocity,
        np.array([place[row] for row in held], dtype=np.intp),
        bearing_change,
        is_complete,
        partial.max_key,
        query.max_states,
        _count_classes(partial) if is_complete else query.max_states,
    )
    for tied in find_shortest_paths(partial.graph, paths, query.expected, notes, query.deadline):
        classes = []
        for key, runs, swept in tied:
            angles = dict(zip(held, swept, strict=True))
            if not is_complete:
                points = lay_out(partial.graph, runs).space_points(FINENESS)
                by_points = compute_swept_angles(points, scene.centre[partial.named]).tolist()
                angles = dict(zip(partial.named, by_points, strict=True)) | angles
            sides = tuple([(query.ids[row], LEFT if angles[row] < 0.0 else RIGHT) for row in partial.named])
            course, rank = name_course(sides), round(key * NANO) / NANO
            classes.append(PathClass(rank, f'goal{query.goal}:{course}', query.goal, course, sides, partial.graph, runs))
        yield from sorted(classes, key=lambda found: found[:2])


def _find_met(scene: SearchScene, found: PathClass, others: Indices) -> list[int]:
    """Return those of other obstacles (rows) that a path meets."""
    points = found.lay_out().space_points(FINENESS)
    _, distance = find_offsets(points, scene.centre[None, others], scene.take_polygons(found.goal, others))
    is_met = distance < scene.radius[found.goal, others] - GRAZE
    met: list[int] = others[is_met.any(axis=0)].tolist()
    return met
