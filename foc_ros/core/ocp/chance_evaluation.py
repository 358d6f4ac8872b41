"""What a control achieves: the surrogate at its own mean, for every obstacle and step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.obstacles.chance_constraint import CERTAIN_K, eta_of_k, safety_factors_at
from foc_ros.core.types import Array

from .problem import Problem


@dataclass(frozen=True, eq=False)
class Assessment:
    """The k that holds everywhere, CERTAIN_K where there is no obstacle; where it is attained; whose margins do not count yet.

    place: obstacle row and time in steps, None without obstacles; relaxed: obstacles whose margins the hand is still leaving.
    """

    smallest_k: float
    place: tuple[int, float] | None
    relaxed: tuple[str, ...]

    @property
    def eta(self) -> float:
        """The eta that holds everywhere."""
        return eta_of_k(self.smallest_k)


def evaluate_chance_constraint(problem: Problem, control: Array) -> Assessment:
    """Evaluate `achieved` at the control's own mean, at the steps. control: stacked (2N,)."""
    k = evaluate_safety_factors(problem, control)
    if not k.size:
        return assessed(problem, CERTAIN_K, (0, 1.0))
    row, column = np.unravel_index(int(k.argmin()), k.shape)
    return assessed(problem, min(float(k[row, column]), CERTAIN_K), (int(row), int(column) + 1.0))


def assessed(problem: Problem, smallest_k: float, place: tuple[int, float]) -> Assessment:
    """Return the assessment of a smallest k at an obstacle row and time in steps."""
    if not len(problem.obstacles):
        return Assessment(smallest_k, None, ())
    inside = zip(problem.obstacles.ids, problem.inside_margin.tolist(), strict=True)
    return Assessment(smallest_k, place, tuple(identity for identity, is_inside in inside if is_inside))


def evaluate_safety_factors(problem: Problem, control: Array) -> Array:
    """Return k = -E[C] / sqrt(Var[C]) per obstacle and step (m, N), linearised at the mean of a control (2N,).

    It is infinite where the hand is still leaving a margin (paper, equation 8).
    """
    k = safety_factors_at(
        problem.positions(control),
        problem.position_variance(control),
        problem.centres,
        *problem.size,
        problem.obstacles.centre_covariance,
    )
    k[np.arange(1, problem.horizon.steps + 1) < problem.leaving[:, None]] = np.inf
    return k
