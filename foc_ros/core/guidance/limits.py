"""Limits of the force: its size, its rate of change, and bounds that have to be kept later, wherever the hand goes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from foc_ros.core.config import GuidanceConfig
from foc_ros.core.types import Array

ROUNDING = 1e-9
"""Relative size of differences that are rounding errors."""


def find_largest_force(config: GuidanceConfig) -> float:
    """Return the largest force [N]: `f_max`, and not more than the slew limit reduces to zero within `ramp_s`."""
    return min(config.f_max, config.slew * config.ramp_s)


def shorten(vector: Array, length: float) -> Array:
    """Return a vector (2,) that is at most so long."""
    norm = float(np.hypot(*vector))
    return vector if norm <= length else vector * (length / norm)


def step_force(previous: Array, target: Array, most_change: float, find_bound: Callable[[Array], float]) -> Array:
    """Return the next force (2,) [N] on the way to a target, which changes by `most_change` [N] at most and keeps its bound.

    The bound of a force may depend on its direction. It is chosen so that a force that keeps its bound now, and becomes smaller
    in the same direction at the slew limit, keeps its bound later. So this is what happens where no other force is allowed.

    find_bound: returns the largest size [N] of a force in the direction of its argument.
    """
    wanted = shorten(target, find_bound(target))
    stepped = previous + shorten(wanted - previous, most_change)
    stepped = shorten(stepped, find_bound(stepped))
    if np.hypot(*(stepped - previous)) <= most_change * (1.0 + ROUNDING):
        return stepped
    return shorten(previous, max(float(np.hypot(*previous)) - most_change, 0.0))
