# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes for the tests of the homotopy classes, and a brute-force search for these that shares nothing with the package."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from foc_ros.core.classes import Search, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.shapes import make_box_polygon

CLEARANCE = 0.005
GOAL = np.array([0.35, 0.0])

ANY = 1e6
"""A detour that leaves out no class."""


def find(
    obstacles: Obstacles,
    goals=GOAL,
    hand=(0.0, 0.0),
    velocity=(0.0, 0.0),
    k=6,
    steps=100,
    previous=(),
    clearance=CLEARANCE,
    detour=ANY,
) -> Search:
    goals = np.asarray(goals, dtype=float).reshape(-1, 2)
    mean = np.array([*hand, *velocity, 0.0, 0.0])
    settings = HomotopyConfig(max_candidates=k, max_detour=detour, clearance=clearance)
    return search(mean, goals, obstacles, settings, [1.0] * len(goals), steps, previous)


def measure_clear(path: np.ndarray, obstacles: Obstacles, clearance: float = CLEARANCE) -> float:
    return float((measure_offsets(path, obstacles)[1] - obstacles.radius - clearance).min())


HAND = np.zeros(2)


def turn(points: np.ndarray, angle: float) -> np.ndarray:
    return points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def make_polygon(rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """The vertices and the radius of a circle, a capsule, a box, upright or turned, or a hull."""
    kind, yaw = rng.integers(5), rng.uniform(-np.pi, np.pi)
    if kind == 0:
        return np.zeros((1, 2)), rng.uniform(0.01, 0.035)
    if kind == 1:
        return turn(np.array([[1.0, 0.0], [-1.0, 0.0]]) * rng.uniform(0.01, 0.06), yaw), rng.uniform(0.004, 0.015)
    if kind < 4:
        return make_box_polygon(rng.uniform(0.02, 0.09, 2), yaw if kind == 2 else 0.0), rng.choice([0.0, 0.006])
    angle = np.sort(np.arange(5) * 2 * np.pi / 5 + rng.uniform(-0.5, 0.5, 5))
    points = rng.uniform(0.02, 0.05) * np.column_stack([np.cos(angle), np.sin(angle)])
    return points - points.mean(axis=0), rng.choice([0.0, 0.005])


def measure_distance(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Distance of points (..., 2) from a convex polygon (v, 2), 0 inside."""
    edge, start = np.roll(polygon, -1, axis=0) - polygon, points[..., None, :] - polygon
    share = np.clip((start * edge).sum(-1) / np.maximum((edge**2).sum(-1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(start - share[..., None] * edge, axis=-1).min(axis=-1)
    left = edge[:, 0] * start[..., 1] - edge[:, 1] * start[..., 0]
    return np.where((left > 0).all(axis=-1) & (len(polygon) > 2), 0.0, distance)


def round_off(polygon: np.ndarray, radius: float, corners: int) -> np.ndarray:
    """A polygon around a rounded polygon whose edges touch it, with about so many corners on its arcs."""
    if len(polygon) > 1:
        edge = np.roll(polygon, -1, axis=0) - polygon
        normal = np.arctan2(-edge[:, 0], edge[:, 1])
    else:
        normal = np.array([0.1234])
    points = []
    for k in range(len(polygon)):
        first = normal[k - 1]
        wide = (normal[k] - first) % (2 * np.pi) if len(polygon) > 1 else 2 * np.pi
        parts = max(int(np.ceil(wide / (2 * np.pi) * corners)), 1)
        angle = first + wide * (np.arange(parts) + 0.5) / parts
        ring = np.column_stack([np.cos(angle), np.sin(angle)]) / np.cos(wide / parts / 2)
        points.append(polygon[k] + radius * ring)
    return np.concatenate(points)


def random_shapes(rng: np.random.Generator, n: int, may_overlap: bool = False) -> Obstacles:
    """n shapes that hold neither hand nor goal, each with an own part between them, and no gap within a millimetre of closing."""
    while True:
        centre = np.column_stack([rng.uniform(0.06, 0.29, n), rng.uniform(-0.1, 0.1, n)])
        polygons, radius = zip(*[make_polygon(rng) for _ in range(n)], strict=True)
        placed = [polygon + at for polygon, at in zip(polygons, centre, strict=True)]
        size = np.array(radius) + CLEARANCE
        if any((measure_distance(np.array([HAND, GOAL]), each) < r + 1e-3).any() for each, r in zip(placed, size, strict=True)):
            continue
        gaps = [measure_gap(placed[i], placed[k]) - size[i] - size[k] for i in range(n) for k in range(i)]
        if all(abs(gap) > 1e-3 if may_overlap else gap > 1e-3 for gap in gaps):
            return make_obstacles(centre, radius, polygons=polygons)


def measure_gap(one: np.ndarray, other: np.ndarray) -> float:
    """Distance of two polygons, by points along the edges of each: 0 if they meet."""
    share = np.linspace(0.0, 1.0, 41)[:, None, None]
    along = [(a + share * (np.roll(a, -1, axis=0) - a)).reshape(-1, 2) for a in (one, other)]
    return float(min(measure_distance(along[0], other).min(), measure_distance(along[1], one).min()))


def shortest_by_pattern(
    obstacles: Obstacles, hand=HAND, goal=GOAL, clearance=CLEARANCE, corners: int = 64
) -> dict[tuple[int, ...], float]:
    """Length of the shortest path for each pattern of sides (+1 left, -1 right) on a visibility graph of polygons.

    The line from each centre to the left, as seen from the hand, counts crossings; one layer of the graph for each number of
    crossings of each line, from -1 to 1. A path that crosses the line once forwards more than backwards passes on the left.
    """
    along = (goal - hand) / np.hypot(*(goal - hand))
    axes = np.array([along, [-along[1], along[0]]])
    centre, end = (obstacles.centre - hand) @ axes.T, axes @ (goal - hand)
    bare = [(obstacles.vertices[k, : obstacles.corners[k]]) @ axes.T + centre[k] for k in range(len(obstacles))]
    outlines = [round_off(each, r + clearance, corners) for each, r in zip(bare, obstacles.radius, strict=True)]
    points = np.concatenate([[[0.0, 0.0], end], *outlines])
    outside = np.ones(len(points), dtype=bool)
    for each in outlines:
        outside &= ~is_inside(points, each)
    points = points[outside]
    a, b = np.triu_indices(len(points), 1)
    free = np.ones(len(a), dtype=bool)
    for each in outlines:
        free[free] = ~crosses(points[a[free]], points[b[free]], each)
    a, b = a[free], b[free]
    weight = np.hypot(*(points[a] - points[b]).T)
    x, y = centre.T
    before, after = points[a][:, :1] < x, points[b][:, :1] < x
    with np.errstate(divide='ignore', invalid='ignore'):
        height = points[a][:, 1:] + (x - points[a][:, :1]) * (points[b] - points[a])[:, 1:] / (points[b] - points[a])[:, :1]
    step = np.where(height > y, before.astype(int) - after, 0)
    n, m = len(centre), len(points)
    counts = np.array(np.meshgrid(*[[-1, 0, 1]] * n, indexing='ij')).reshape(n, -1).T if n else np.zeros((1, 0), int)
    radix = 3 ** np.arange(n)[::-1]
    rows, columns, weights = [], [], []
    for layer, count in enumerate(counts):
        for sign, (p, q) in ((1, (a, b)), (-1, (b, a))):
            reached = count + sign * step
            fits = (np.abs(reached) <= 1).all(axis=1)
            rows.append(layer * m + p[fits])
            columns.append(((reached[fits] + 1) @ radix) * m + q[fits])
            weights.append(weight[fits])
    graph = coo_matrix(
        (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=(len(counts) * m,) * 2
    ).tocsr()
    first = int(np.ones(n, dtype=int) @ radix) * m
    reached = dijkstra(graph, indices=first).reshape(len(counts), m)[:, 1]
    return {
        tuple(np.where(count > 0, 1, -1).tolist()): float(length)
        for count, length in zip(counts, reached, strict=True)
        if np.isfinite(length) and (count >= 0).all()
    }


def is_inside(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Whether points lie inside a convex polygon by more than a nanometre."""
    edge, start = np.roll(polygon, -1, axis=0) - polygon, points[:, None] - polygon
    left = (edge[:, 0] * start[..., 1] - edge[:, 1] * start[..., 0]) / np.hypot(*edge.T)
    return (left > 1e-9).all(axis=1)


def crosses(begin: np.ndarray, end: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Whether lines enter a convex polygon by more than a nanometre: each edge leaves a part of the line on its inner side."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    normal = np.column_stack([-edge[:, 1], edge[:, 0]]) / np.hypot(*edge.T)[:, None]
    offset = (normal * polygon).sum(axis=1) + 1e-9
    first, last = begin @ normal.T - offset, end @ normal.T - offset
    with np.errstate(divide='ignore', invalid='ignore'):
        share = first / (first - last)
    low = np.where((first <= 0) & (last > 0), share, 0.0).max(axis=1)
    high = np.where((first > 0) & (last <= 0), share, 1.0).min(axis=1)
    return ~((first <= 0) & (last <= 0)).any(axis=1) & (low < high - 1e-12)
