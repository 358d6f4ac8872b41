"""Where help is needed: the hand would come nearer to an obstacle than the clearance, if it went straight on.

All functions do nothing with a clearance of 0: then guidance draws to the paths everywhere, as far ahead as `lookahead_s`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import GuidanceConfig
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array, Obstacles

from .reference import normalize

INSTANTS = 13
"""Number of instants within the look-ahead at which the distance from the obstacles is computed."""


class Need(NamedTuple):
    """Where help is needed, and how much.

    time_s: how far ahead [s]; share in [0, 1]: of the clearance, which the hand lacks by then; normal (2,): outward unit normal
    of the obstacle that is nearest there, zeros without one.
    """

    time_s: float
    share: float
    normal: Array


def find_need(settings: GuidanceConfig, obstacles: Obstacles, position: Array, velocity: Array) -> Need:
    """Return where help is needed, and how much.

    The hand goes on at its velocity v for the look-ahead h at most. It is nearest to an obstacle at the time t*, at the distance
    d. The share of the clearance D that it lacks by then is

        t* = argmin_{0 <= t <= h} min_j d_j(x + t v),    n = clip((D - d) / D, 0, 1).
    """
    if not settings.clearance:
        return Need(settings.lookahead_s, 1.0, np.zeros(2))
    if not len(obstacles):
        return Need(0.0, 0.0, np.zeros(2))
    times = np.linspace(0.0, settings.lookahead_s, INSTANTS)
    points = position + times[:, None] * velocity
    offsets, distances = measure_offsets(points, obstacles)
    heights = distances - obstacles.radius
    instant, row = np.unravel_index(heights.argmin(), heights.shape)
    share = 1.0 - float(heights[instant, row]) / settings.clearance
    return Need(float(times[instant]), min(max(share, 0.0), 1.0), normalize(offsets[instant, row]))


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


def find_crossing(need: Need, errors: Array) -> NDArray[np.bool_]:
    """Return which errors e_i (c, 2) [m] lead across the nearest obstacle: e_i . m < 0 for its outward normal m.

    The hand, going straight on, passes that obstacle on one side, and the candidate on the other one. Before the obstacle is
    crossed a force to the other side leads into it. So it is the operator who changes the side.
    """
    crossing: NDArray[np.bool_] = errors @ need.normal < 0.0
    return crossing


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
