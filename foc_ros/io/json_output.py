"""Outcomes as plain values for JSON: the same names wherever the program prints them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from foc_ros.core.types import LEFT, Array, PredictedCandidate, Prediction, Solution


def candidate_answer(outcome: PredictedCandidate) -> dict[str, Any]:
    """Return one candidate: which way round, how it ended, its costs, and mean and standard deviation of the path.

    goal: position of its goal in the list of goals; effort [m^2/s^6], cost [m^2/s^5], tau [m^2]; mean (N + 1, 2) and stddev
    (N + 1, 2) [m] at steps 0..N. A number that is not finite is null.
    """
    solution = outcome.solution
    numbers = {
        'effort': solution.effort,
        'cost': outcome.cost,
        'eta': solution.eta,
        'tau': solution.tau,
        'lambda': solution.lam,
        'likelihood': outcome.likelihood,
    }
    variances = np.diagonal(solution.covariance[:, :2, :2], axis1=1, axis2=2)
    return {
        'label': outcome.candidate.label,
        'goal': outcome.candidate.goal,
        'sides': {identity: 'left' if side == LEFT else 'right' for identity, side in outcome.sides.items()},
        'status': solution.status.value,
        **{name: number(value) for name, value in numbers.items()},
        'qp_solves': solution.qp_solves,
        'mean': table(solution.path),
        'stddev': table(np.sqrt(np.maximum(variances, 0.0))),
    }


def solution_account(solution: Solution) -> dict[str, Any]:
    """Return all the rest of a solution: words, every term of the cost, where eta is attained, what holds it, the whole state.

    Units: those of :class:`Solution`. rows: the contacts that hold it; covariance (N + 1, n, n) at steps 0..N; control (N, 2).
    """
    held = zip(solution.multipliers, solution.held, strict=True)
    return {
        'message': solution.message,
        'costs': {name: number(value) for name, value in solution.costs.items()},
        'eta_at': _place(solution.eta_at),
        'eta_reachable': solution.eta_reachable,
        'violation': number(solution.violation),
        'violation_at': _place(solution.violation_at),
        'rows': [
            {'obstacle': identity, 'step': step, 'multiplier': number(value), 'tau': number(tau), 'lambda': number(lam)}
            for (identity, step, value), (tau, lam) in held
        ],
        'iterations': solution.iterations,
        'acceleration': table(solution.mean[:, 4:6]),
        'control': table(solution.control),
        'covariance': [table(each) for each in solution.covariance],
    }


def _place(place: tuple[str, float] | None) -> dict[str, Any] | None:
    return None if place is None else {'obstacle': place[0], 'step': place[1]}


def prediction_answer(prediction: Prediction) -> dict[str, Any]:
    """Return one prediction with all its candidates: the most likely first, as in the messages; those not solved last."""
    outcomes = sorted(prediction.candidates, key=lambda outcome: outcome.candidate.label != prediction.most_likely)
    return {
        'stamp_ns': prediction.stamp_ns,
        'most_likely': prediction.most_likely,
        'candidates': [candidate_answer(outcome) for outcome in outcomes],
    }


def number(value: float) -> float | None:
    """Return a number as JSON can hold it: null where it is not finite."""
    return float(value) if math.isfinite(value) else None


def table(rows: Array) -> list[list[float | None]]:
    """Return an array (m, k) as lists of numbers."""
    return [[number(value) for value in row] for row in rows.tolist()]
