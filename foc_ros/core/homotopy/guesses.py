"""The timed guesses of classes that were chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Points, PointTable, Vector, compiled_exactly
from foc_ros.core.types import Array, as_readonly

from .classes import Found
from .scene import SearchScene
from .taut import AT, HEADING_X, HEADING_Y, points_at, progress

SLOPE = 0.5
"""A hand in a margin leaves it by this much for each metre on its way, and enters the margin of its goal likewise."""


def guesses(scene: SearchScene, velocity: complex, chosen: Sequence[Found], duration_s: Sequence[float], steps: int) -> Array:
    """Return positions of each class at steps 0..N, (w, N + 1, 2) [m], read-only.

    duration_s: to each goal [s]. Along the taut path, clear of all circles; a path that begins or ends in a margin gets out of
    it and into it gradually, straight away from the obstacle, as far as other obstacles are not in the way.
    """
    if not chosen:
        return np.zeros((0, steps + 1, 2))
    pieces, goal = [one.pieces for one in chosen], [one.goal for one in chosen]
    points = followed(
        np.concatenate(pieces),
        np.array([len(each) for each in pieces]),
        np.array(goal),
        np.array(duration_s, dtype=float),
        velocity,
        steps,
        scene.centre,
        scene.wanted,
        scene.held,
        scene.near,
    )
    return as_readonly(points.view(float).reshape(len(chosen), steps + 1, 2))


@compiled_exactly
def out_of_margin(points: Points, along: Vector, centre: complex, wanted: float, held: bool, near: bool) -> Points:
    """Push points of a path out of a circle that was shrunk to let the hand out (held), the goal in (near), or both."""
    distance, pushed = np.abs(points - centre), points.copy()
    for i in range(len(points)):
        allowed = wanted
        if held:
            allowed = min(allowed, distance[0] + SLOPE * along[i])
        if near:
            allowed = min(allowed, distance[-1] + SLOPE * (along[-1] - along[i]))
        if 0.0 < distance[i] < allowed:
            pushed[i] = centre + (points[i] - centre) * (allowed / distance[i])
    return pushed


@compiled_exactly
def followed(
    pieces: Matrix,
    sizes: Indices,
    goal: Indices,
    duration_s: Vector,
    velocity: complex,
    steps: int,
    centre: Points,
    wanted: Vector,
    held: Flags,
    near: FlagTable,
) -> PointTable:
    """Return where a hand that follows each of w ways is at steps 0..N, (w, N + 1), complex [m].

    pieces: of the ways one after the other; sizes (w,): how many of each; goal (w,): numbers; duration_s (g,): to each goal [s];
    velocity: of the hand now [m/s]; centre, ..., near: of `Scene`.
    """
    points, begin = np.empty((len(goal), steps + 1), np.complex128), 0
    for way in range(len(goal)):
        laid = pieces[begin : begin + sizes[way]]
        begin += sizes[way]
        speed = laid[0, HEADING_X] * velocity.real + laid[0, HEADING_Y] * velocity.imag
        along = progress(laid[-1, AT], speed, duration_s[goal[way]], steps)
        points[way] = points_at(laid, along)
        for k in range(len(centre)):
            if held[k] or near[goal[way], k]:
                points[way] = out_of_margin(points[way], along, centre[k], wanted[k], held[k], near[goal[way], k])
    return points
