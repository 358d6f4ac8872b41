"""The order in which every output lists the candidates, and what is said of each."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from foc_ros.core.errors import FocError
from foc_ros.core.types import PredictedCandidate, Prediction

MAX_NUMBER = 1e30
"""Beyond it a number is as good as infinite, and would be in a float32."""
MAX_RATIO = 1e9
"""Cost ratios end here: next to a candidate that costs nothing, every other is infinitely dear."""


@lru_cache(maxsize=1)
def ranked(prediction: Prediction) -> tuple[PredictedCandidate, ...]:
    """Return the solved outcomes: the one called most likely (which changes only by a margin), then by likelihood.

    Every output asks for them, so those of the last prediction are kept.

    Raises FocError, naming the candidate, for a number that is not finite or beyond MAX_NUMBER: none may leave.
    """
    for outcome in prediction.solved_candidates:
        solution = outcome.solution
        arrays = solution.mean, solution.covariance
        numbers = solution.effort, solution.eta, outcome.cost, outcome.likelihood
        # NaN goes through the maximum, and is not below anything
        if not all(largest <= MAX_NUMBER for largest in (*(np.abs(each).max() for each in arrays), *map(abs, numbers))):
            raise FocError(f'candidate {outcome.candidate.label}: the solution holds a number that is not finite')
    return tuple(sorted(prediction.solved_candidates, key=lambda outcome: outcome.candidate.label != prediction.most_likely))


def cost_ratios(outcomes: tuple[PredictedCandidate, ...]) -> list[float]:
    """Return each outcome's cost over the least: 1 for the best, at most MAX_RATIO."""
    costs = [outcome.cost for outcome in outcomes]
    least = min(costs, default=0.0)
    return [1.0 if cost <= least else min(cost / least, MAX_RATIO) if least > 0.0 else MAX_RATIO for cost in costs]
