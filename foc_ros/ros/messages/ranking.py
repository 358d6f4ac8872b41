# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The order of the candidates in every output, their cost ratios, their names in words, and their curves."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from foc_ros.core.errors import FocError
from foc_ros.core.plant.response import compute_curve
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import describe_class, name_goal
from foc_ros.core.types import Array

MAX_NUMBER = 1e30
"""Largest number that is published; a larger one is an error of the solver, or infinite as a float32."""
MAX_RATIO = 1e9
"""Largest cost ratio, also that to a candidate without cost."""
MOST_LETTERS, MOST_NAME_LETTERS = 60, 20
"""Most letters of a class beside a picture, and of the name of its goal: longer words would leave no room for the picture."""


@lru_cache(maxsize=1)
def order_candidates(prediction: Prediction) -> tuple[PredictedCandidate, ...]:
    """Return the candidates with a likelihood: the one called most likely (which changes only by a margin), then by likelihood.

    Cached for the last prediction. Raises FocError, naming the candidate, for a number that is not finite or beyond MAX_NUMBER.
    """
    for outcome in prediction.candidates_with_likelihood:
        solution = outcome.solution
        heights = () if outcome.height is None else (outcome.height.mean, outcome.height.covariance)
        arrays = solution.mean, solution.covariance, *heights
        numbers = solution.effort, solution.eta, outcome.cost, outcome.likelihood
        # the maximum of an array with a NaN is NaN, and no comparison with NaN is true
        if not all(largest <= MAX_NUMBER for largest in (*(np.abs(each).max() for each in arrays), *map(abs, numbers))):
            raise FocError(f'candidate {outcome.candidate.label}: the solution holds a number that is not finite')
    return tuple(
        sorted(prediction.candidates_with_likelihood, key=lambda outcome: outcome.candidate.label != prediction.most_likely)
    )


def compute_cost_ratios(outcomes: tuple[PredictedCandidate, ...]) -> list[float]:
    """Return each candidate's cost divided by the least one: 1 for the best, at most MAX_RATIO."""
    costs = [outcome.cost for outcome in outcomes]
    least = min(costs, default=0.0)
    return [1.0 if cost <= least else min(cost / least, MAX_RATIO) if least > 0.0 else MAX_RATIO for cost in costs]


def describe_candidate(outcome: PredictedCandidate, goals: int, most: int | None = None) -> str:
    """Return the class of a candidate in words, with its goal if there are several goals; most: letters to which they are cut."""
    candidate = outcome.candidate
    goal = candidate.goal_name or name_goal(candidate.goal)
    if most is not None:
        goal = cut(goal, MOST_NAME_LETTERS)
    words = describe_class(candidate.sides, goal if goals > 1 else '')
    return words if most is None else cut(words, most)


def cut(words: str, most: int) -> str:
    """Return words of at most so many letters: longer ones end with dots."""
    return words if len(words) <= most else f'{words[: most - 3]}...'


def find_drawn_curve(outcome: PredictedCandidate) -> Array:
    """Return the mean path of a candidate as a smooth curve (m, 2) [m]; where there is none, the guess of the search."""
    solution = outcome.solution
    if not len(solution.mean) or not np.isfinite(solution.mean).all():
        return outcome.candidate.guess
    return compute_curve(solution.path, solution.mean[:, 2:4], solution.dt)


def find_drawn_curves(outcomes: Sequence[PredictedCandidate]) -> Array:
    """Return the mean paths of k candidates with a likelihood as smooth curves (m, k, 2) [m]; k > 0."""
    mean, dt = np.stack([each.mean for each in outcomes], axis=1), np.array([[each.solution.dt] for each in outcomes])
    return compute_curve(mean[..., :2], mean[..., 2:4], dt)
