"""The timed guesses of classes that were chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.foc.records import Array

from .classes import Found
from .crossing import Complex
from .scene import Scene
from .taut import followed

SLOPE = 0.5
"""A hand in a margin leaves it by this much for each metre on its way, and enters the margin of its goal likewise."""


def guesses(
    scene: Scene, velocity: complex, chosen: Sequence[Found], duration_s: Sequence[float], steps: int
) -> list[tuple[Array, float]]:
    """Return positions at steps 0..N of each class, (N + 1, 2) [m], and the length of its taut path [m].

    duration_s: to each goal [s]. Along the taut path, clear of all circles; a path that begins or ends in a margin gets out of
    it and into it gradually, straight away from the obstacle, as far as other obstacles are not in the way.
    """
    paths = []
    for one in chosen:
        table, radius = one.plan.table, one.plan.roadmap.circles.radius
        points, along, length = followed(
            table.head, table.spans, table.places, radius, one.way.runs, velocity, duration_s[one.goal], steps
        )
        points = _out_of_margins(scene, one.goal, points, along)
        points.flags.writeable = False
        paths.append((points.view(float).reshape(-1, 2), length))
    return paths


def _out_of_margins(scene: Scene, goal: int, points: Complex, along: Array) -> Complex:
    """Push points out of the circles that were shrunk to let the hand out and the goal in."""
    for row in (scene.held | scene.near[goal]).nonzero()[0]:
        from_centre = points - scene.centre[row]
        distance = np.abs(from_centre)
        allowed = np.full(len(points), scene.wanted[row])
        if scene.held[row]:
            allowed = np.minimum(allowed, distance[0] + SLOPE * along)
        if scene.near[goal, row]:
            allowed = np.minimum(allowed, distance[-1] + SLOPE * (along[-1] - along))
        short = (distance < allowed) & (distance > 0.0)
        points = np.where(
            short, scene.centre[row] + from_centre * np.where(short, allowed, 1.0) / np.where(short, distance, 1.0), points
        )
    return points
