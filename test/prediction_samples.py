# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions made by hand, for tests of what is done with them."""

from dataclasses import replace
from typing import Any

import numpy as np

from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import Candidate, Solution, Status

STEPS, DT = 4, 0.05


def outcome(
    label: str = 'goal0:+l1', likelihood: float = 0.6, bend: float = 0.1, cost: float = 2.0, **changes: Any
) -> PredictedCandidate:
    """Return a candidate from (0, 0) to (0.3, 0) that bends to the left; changes: to the solution."""
    shape = np.sin(np.linspace(0, np.pi, STEPS + 1))
    mean = np.zeros((STEPS + 1, 6))
    mean[:, 0], mean[:, 1] = np.linspace(0, 0.3, STEPS + 1), bend * shape
    mean[:, 2], mean[:, 3] = 1.5, bend * np.cos(np.linspace(0, np.pi, STEPS + 1))
    covariance = np.zeros((STEPS + 1, 6, 6))
    covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 0, 1], covariance[:, 1, 0] = 4e-6, 9e-6, 1e-6, 1e-6
    numbers = {'control': np.ones((STEPS, 2)), 'effort': 20.0, 'costs': {'effort': 20.0}, 'tau': 0.0, 'lam': 1.0, 'eta': 0.93}
    arrays, cost_of_it = {'mean': mean, 'covariance': covariance}, {'qp_solves': 5, 'solve_s': 0.002}
    solution = replace(Solution(Status.SOLVED, 'as wanted', DT, **arrays, **numbers, **cost_of_it), **changes)
    side = 1 if bend > 0 else -1
    candidate = Candidate(label, 0, (('1', side),), mean[:, :2].copy(), 0.31)
    return PredictedCandidate(
        candidate, solution, {'1': side}, cost, likelihood if solution.status in (Status.SOLVED, Status.COMPROMISED) else 0.0
    )


def prediction(*outcomes: PredictedCandidate, stamp_ns: int = 5_000_000_000, **changes: Any) -> Prediction:
    """Return a prediction of these outcomes, the first being the most likely."""
    solved = [each.candidate.label for each in outcomes if each.has_likelihood]
    values = {'frame_id': 'world', 'height': 0.2, 'most_likely': solved[0] if solved else None, 'obstacles': OBSTACLES}
    return Prediction(stamp_ns=stamp_ns, candidates=outcomes, **(values | changes))


def three_ways() -> Prediction:
    return prediction(
        outcome('goal0:+l1', 0.7, 0.1, 2.0),
        outcome('goal0:-l1', 0.3, -0.1, 5.0, eta=0.91),
        outcome('goal0:+l2', bend=0.2, status=Status.INFEASIBLE),
    )


def predict_aside(**changes: Any) -> Prediction:
    """Return a prediction of one certain and precise path along x, at y = 5 cm; changes: to the prediction."""
    candidate = outcome('goal0:', 1.0)
    mean = candidate.mean.copy()
    mean[:, :2] = np.column_stack([np.linspace(0.0, 0.3, len(mean)), np.full(len(mean), 0.05)])
    solution = replace(candidate.solution, mean=mean, covariance=np.zeros((len(mean), 6, 6)))
    return prediction(replace(candidate, solution=solution), **changes)


OBSTACLES = make_obstacles([[0.1, 0.0], [0.2, 0.1]], [0.03, 0.02], [0.005, 0.0])
