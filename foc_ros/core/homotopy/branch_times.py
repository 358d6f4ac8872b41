"""Branch times: when predicted paths separate at an obstacle, which says how far ahead a choice lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacles.chance_constraint import centre_trajectories
from foc_ros.core.obstacles.rounded_polygon import measure_offsets
from foc_ros.core.types import Array, Obstacles, PredictedCandidate, Record

from .sides import compute_swept_angles


@dataclass(frozen=True, eq=False)
class BranchTimes(Record):
    """When k paths separate.

    after_s (k, k): time until two of them separate [s], infinite for paths that never separate, and on the diagonal. path_class
    (k,): paths with equal numbers pass all obstacles on the same sides, though they may lead to different goals.
    """

    after_s: Array
    path_class: NDArray[np.intp]

    def take(self, rows: NDArray[np.intp]) -> BranchTimes:
        """Return the branch times of some of the paths."""
        return BranchTimes(self.after_s[np.ix_(rows, rows)], self.path_class[rows])


def compute_branch_times(outcomes: Sequence[PredictedCandidate], obstacles: Obstacles) -> BranchTimes:
    """Compute when the mean paths of candidates separate; obstacles: where they are now.

    Two paths from one hand pass an obstacle on different sides if the angles that they sweep about it differ by more than half a
    turn. They separate at the first such obstacle, when the first of the two is nearest to it. A parabola through three
    steps gives this time, so that it does not jump.
    """
    if not outcomes:
        return BranchTimes(np.zeros((0, 0)), np.zeros(0, dtype=np.intp))
    angles, times = [], []
    for solution in [outcome.solution for outcome in outcomes]:
        centre = centre_trajectories(obstacles.centre, solution.dt * obstacles.velocity, len(solution.mean) - 1)
        angles.append(compute_swept_angles(solution.path, centre))
        _, distance = measure_offsets(solution.path, obstacles, centre)
        times.append(solution.dt * _find_minima(distance))
    swept, passing_s = np.array(angles), np.array(times)
    is_opposite = np.abs(swept[:, None] - swept) > np.pi
    after_s = np.where(is_opposite, np.minimum(passing_s[:, None], passing_s), np.inf).min(axis=2, initial=np.inf)
    return BranchTimes(after_s, np.isinf(after_s).argmax(axis=1))


def _find_minima(distance: Array) -> Array:
    """Return where the distances (N + 1, n) at steps are smallest, in steps (n,)."""
    row, column = distance.argmin(axis=0), np.arange(distance.shape[1])
    inner = np.clip(row, 1, len(distance) - 2)
    before, here, after = (distance[inner + step, column] for step in (-1, 0, 1))
    bend = before - 2.0 * here + after
    offset = 0.5 * (before - after) / np.where(bend > 0.0, bend, np.inf)
    minima: Array = np.where(bend > 0.0, np.clip(inner + np.clip(offset, -1.0, 1.0), 0.0, len(distance) - 1.0), row)
    return minima
