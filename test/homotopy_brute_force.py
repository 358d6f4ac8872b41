"""Brute-force search for homotopy classes: the shortest path for every pattern of sides on a visibility graph of polygons."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

CORNERS = 24
"""Corners of the polygon round each circle: its edges touch the circle, so arcs come out up to 0.6 % too long."""


def shortest_by_pattern(hand, goal, centre, radius) -> dict[tuple[int, ...], float]:
    """Length of the shortest path for each pattern of sides (+1 left, -1 right) that a path can take, over all 2^n patterns.

    centre (n, 2), radius (n,) with the clearance in it; every foot lies between hand and goal. One layer of the graph for each
    pattern; an edge that crosses the line from a centre to the left flips that obstacle's bit, and odd means passed on the left.
    """
    along = (np.asarray(goal, float) - hand) / np.hypot(*(np.asarray(goal, float) - hand))
    turn = np.array([along, [-along[1], along[0]]])
    end, middle = turn @ (np.asarray(goal, float) - hand), (np.asarray(centre, float) - hand) @ turn.T
    points = _vertices(end, middle, np.asarray(radius, float))
    a, b = np.triu_indices(len(points), 1)
    free = _free(points[a], points[b], middle, radius)
    a, b = a[free], b[free]
    weight = np.hypot(*(points[a] - points[b]).T)
    flips = _flips(points[a], points[b], middle) @ (1 << np.arange(len(middle)))
    layers = np.arange(1 << len(middle))[:, None]
    rows, columns = layers * len(points) + a, (layers ^ flips) * len(points) + b
    graph = coo_matrix(
        (np.tile(weight, len(layers)), (rows.ravel(), columns.ravel())), shape=(layers.size * len(points),) * 2
    ).tocsr()
    reached = dijkstra(graph, directed=False, indices=0).reshape(len(layers), len(points))[:, 1]
    return {_pattern(layer, len(middle)): float(reached[layer]) for layer in range(len(layers)) if np.isfinite(reached[layer])}


def _pattern(layer: int, n: int) -> tuple[int, ...]:
    return tuple(1 if layer >> k & 1 else -1 for k in range(n))


def _vertices(end, centre, radius):
    angle = 0.1234 + 2 * np.pi * np.arange(CORNERS) / CORNERS
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) / np.cos(np.pi / CORNERS)
    corners = (centre[:, None] + radius[:, None, None] * ring).reshape(-1, 2)
    outside = (np.hypot(*(corners[:, None] - centre).transpose(2, 0, 1)) > radius * (1 - 1e-9)).all(axis=1)
    return np.concatenate([[[0.0, 0.0], end], corners[outside]])


def _free(a, b, centre, radius):
    step = b - a
    share = np.clip(((centre - a[:, None]) * step[:, None]).sum(2) / (step**2).sum(1)[:, None], 0.0, 1.0)
    nearest = a[:, None] + share[..., None] * step[:, None]
    return (np.hypot(*(centre - nearest).transpose(2, 0, 1)) > radius * (1 - 1e-9)).all(axis=1)


def _flips(a, b, centre):
    x, y = centre.T
    before, after = a[:, :1] < x, b[:, :1] < x
    with np.errstate(divide='ignore', invalid='ignore'):
        height = a[:, 1:] + (x - a[:, :1]) * (b[:, 1:] - a[:, 1:]) / (b[:, :1] - a[:, :1])
    return ((before != after) & (height > y)).astype(int)
