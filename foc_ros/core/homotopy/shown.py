"""What a way that the search did not find needs to be a candidate as those it found: their names and their timing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.types import Array, Candidate, Obstacles

from .scene import scene
from .taut import progress


def named_obstacles(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> list[set[str]]:
    """Return who takes part in the names of the ways from a hand (2,) [m] to each goal (g, 2) [m], by id.

    previous: the candidates of the tick before.
    """
    view = scene(complex(*hand), goals[:, 0] + 1j * goals[:, 1], obstacles, clearance, previous)
    return [{obstacles.ids[row] for row in np.flatnonzero(named)} for named in view.named]


def timed(path: Array, velocity: Array, duration_s: float, steps: int) -> Array:
    """Return positions at steps 0..N along a path (m, 2) [m], m >= 2, timed as the guesses of the search are; (N + 1, 2) [m]."""
    step = np.diff(path, axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*step.T))])
    heading = step[0] / max(float(np.hypot(*step[0])), np.finfo(float).tiny)
    at = progress(float(along[-1]), float(heading @ velocity), duration_s, steps)
    return np.column_stack([np.interp(at, along, axis) for axis in path.T])
