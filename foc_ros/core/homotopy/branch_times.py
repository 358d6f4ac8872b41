"""When predicted ways part: the choices that are still open, and how far ahead they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacles.chance_constraint import centre_trajectories
from foc_ros.core.types import Array, Obstacles, PredictedCandidate, Record

from . import compute_swept_angles


@dataclass(frozen=True, eq=False)
class BranchTimes(Record):
    """How k ways part.

    after_s (k, k): seconds from now until two of them part, infinite where they never do, as on the diagonal; way (k,): those
    with the same number pass all obstacles on the same sides, though they may lead to different goals.
    """

    after_s: Array
    way: NDArray[np.intp]

    def take(self, rows: NDArray[np.intp]) -> BranchTimes:
        """Return how some of the ways part."""
        return BranchTimes(self.after_s[np.ix_(rows, rows)], self.way[rows])


def compute_branch_times(outcomes: Sequence[PredictedCandidate], obstacles: Obstacles) -> BranchTimes:
    """Return how the mean paths of outcomes part; obstacles: where they are now.

    Two paths from one hand pass an obstacle on different sides where the angles that they sweep about it differ by more than half
    a turn. They part at the first obstacle of which that is true, when the first of them is nearest to it.
    """
    if not outcomes:
        return BranchTimes(np.zeros((0, 0)), np.zeros(0, dtype=np.intp))
    seen = [_seen(outcome, obstacles) for outcome in outcomes]
    swept, passing = np.array([each[0] for each in seen]), np.array([each[1] for each in seen])
    aside = np.abs(swept[:, None] - swept) > np.pi
    after_s = np.where(aside, np.minimum(passing[:, None], passing), np.inf).min(axis=2, initial=np.inf)
    return BranchTimes(after_s, np.isinf(after_s).argmax(axis=1))


def _seen(outcome: PredictedCandidate, obstacles: Obstacles) -> tuple[Array, Array]:
    """Return the angle (n,) [rad] that the mean path sweeps about each obstacle, and when (n,) [s] it is nearest to it."""
    solution = outcome.solution
    where = centre_trajectories(obstacles.centre, solution.dt * obstacles.velocity, len(solution.mean) - 1)
    apart = solution.path[:, None] - where
    return compute_swept_angles(solution.path, where), solution.times[(apart**2).sum(axis=2).argmin(axis=0)]
