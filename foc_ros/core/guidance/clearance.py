"""Where help is needed: the hand would come nearer to an obstacle than the clearance, if it went straight on.

All functions do nothing with a clearance of 0: then guidance draws to the paths everywhere, as far ahead as `lookahead_s`.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.config import GuidanceConfig
from foc_ros.core.obstacles.rounded_polygon import measure_offsets
from foc_ros.core.types import Array, Obstacles

INSTANTS = 13
"""Number of instants within the look-ahead at which the distance from the obstacles is computed."""


def find_need(settings: GuidanceConfig, obstacles: Obstacles, position: Array, velocity: Array) -> tuple[float, float]:
    """Return how far ahead help is needed [s], and how much, in [0, 1].

    The hand goes on at its velocity v for the look-ahead h at most. It is nearest to an obstacle at the time t*, at the distance
    d. The need is the share of the clearance D that it lacks by then:

        t* = argmin_{0 <= t <= h} min_j d_j(x + t v),    n = clip((D - d) / D, 0, 1).
    """
    if not settings.clearance:
        return settings.lookahead_s, 1.0
    if not len(obstacles):
        return 0.0, 0.0
    times = np.linspace(0.0, settings.lookahead_s, INSTANTS)
    points = position + times[:, None] * velocity
    heights = (measure_offsets(points, obstacles)[1] - obstacles.radius).min(axis=1)
    nearest = int(heights.argmin())
    need = 1.0 - float(heights[nearest]) / settings.clearance
    return float(times[nearest]), min(max(need, 0.0), 1.0)


def keep_clear(settings: GuidanceConfig, obstacles: Obstacles, points: Array) -> Array:
    """Return points (c, 2) of the paths moved outward by what they lack of the clearance D, added over the obstacles.

        x <- x + sum_j max(D - d_j(x), 0) n_j(x),

    with the distance d_j and the outward normal n_j. Between two obstacles this leads to the middle. A predicted path may be as
    near to an obstacle as the noise of the operator allows, which is nearer than a force should lead.
    """
    if not settings.clearance or not len(obstacles):
        return points
    offsets, distances = measure_offsets(points, obstacles)
    normals = offsets / np.where(distances == 0.0, 1.0, distances)[..., None]
    lacking = np.maximum(settings.clearance - (distances - obstacles.radius), 0.0)
    moved: Array = points + (lacking[..., None] * normals).sum(axis=1)
    return moved


def saturate(settings: GuidanceConfig, errors: Array, need: float) -> Array:
    """Return errors e_i (c, 2) [m] that are not longer than what the hand lacks of the clearance D: e <- e min(1, n D / |e|).

    A longer force would lead the hand farther than it has to go. An unlikely candidate far away, such as that on the other side
    of an obstacle, does not outweigh a likely one nearby.
    """
    if not settings.clearance:
        return errors
    sizes = np.maximum(np.hypot(errors[:, 0], errors[:, 1]), 1e-12)
    saturated: Array = errors * np.minimum(need * settings.clearance / sizes, 1.0)[:, None]
    return saturated
