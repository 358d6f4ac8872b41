"""What a control achieves: the surrogate at its own mean, for every obstacle and step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .chance import CERTAIN_K, eta_of_k, k_at
from .problem import Problem
from .records import Array


@dataclass(frozen=True, eq=False)
class Assessment:
    """k achieved per obstacle and step (m, N), infinite where the hand is still leaving a margin; relaxed: whose margins.

    between: the smallest k between the steps, with its obstacle row and time in steps, where it was looked for and is smaller.
    """

    k: Array
    relaxed: tuple[str, ...]
    between: tuple[float, int, float] | None = None

    @cached_property
    def smallest_k(self) -> float:
        """The k that holds everywhere; CERTAIN_K where there is no obstacle."""
        if self.between is not None:
            return self.between[0]
        return min(float(self.k.min(initial=CERTAIN_K)), CERTAIN_K)

    @property
    def eta(self) -> float:
        """The eta that holds everywhere."""
        return eta_of_k(self.smallest_k)

    @property
    def place(self) -> tuple[int, float] | None:
        """Obstacle row and time in steps where eta is attained; None without obstacles."""
        if self.between is not None:
            return self.between[1:]
        if self.k.size == 0:
            return None
        row, column = np.unravel_index(int(self.k.argmin()), self.k.shape)
        return int(row), int(column) + 1.0


def assess(problem: Problem, control: Array) -> Assessment:
    """Evaluate k = -E[C] / sqrt(Var[C]) linearised at the control's own mean (paper, equation 8). control: stacked (2N,)."""
    k = k_at(
        problem.positions(control),
        problem.position_variance(control),
        problem.centres,
        *problem.size,
        problem.obstacles.centre_covariance,
    )
    k[np.arange(1, problem.horizon.steps + 1) < problem.leaving[:, None]] = np.inf
    return Assessment(k, tuple(np.array(problem.obstacles.ids, dtype=object)[problem.inside_margin]))
