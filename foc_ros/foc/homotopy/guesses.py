"""The timed guesses of classes that were chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.foc.records import Array

from .classes import Found
from .crossing import Complex
from .scene import Scene
from .taut import progress, taut

SLOPE = 0.5
"""A hand in a margin leaves it by this much for each metre on its way, and enters the margin of its goal likewise."""


def guesses(
    scene: Scene, velocity: complex, chosen: Sequence[Found], duration_s: Array, steps: int
) -> tuple[list[Array], list[float]]:
    """Return positions at steps 0..N of each class, (N + 1, 2) [m], and the lengths of their taut paths [m].

    duration_s: to each goal [s]. Along the taut path, clear of all circles; a path that begins or ends in a margin gets out of
    it and into it gradually, straight away from the obstacle, as far as other obstacles are not in the way.
    """
    paths: dict[int, Array] = {}
    lengths: dict[int, float] = {}
    for plan in {id(found.plan): found.plan for found in chosen}.values():
        rows = [k for k, found in enumerate(chosen) if found.plan is plan]
        path = taut(plan, [chosen[k].way for k in rows])
        speed = (path.heading[path.first] * velocity.conjugate()).real
        along = progress(path.length, speed, duration_s[[chosen[k].goal for k in rows]], steps)
        for k, points, done, length in zip(rows, path.points(along), along, path.length.tolist(), strict=True):
            paths[k] = _out_of_margins(scene, chosen[k].goal, points, done).view(float).reshape(-1, 2)
            lengths[k] = length
    return [paths[k] for k in range(len(chosen))], [lengths[k] for k in range(len(chosen))]


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
