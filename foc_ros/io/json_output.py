# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Candidates and predictions as plain values for JSON, under the same names in all commands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.core.prediction import HeightTrajectory, PredictedCandidate, Prediction
from foc_ros.core.solution import LEFT, Solution
from foc_ros.core.types import Array


def encode_prediction(prediction: Prediction) -> dict[str, Any]:
    """Return a prediction with all its candidates: the most likely first, as in the messages; unsolved ones last."""
    candidates = sorted(prediction.candidates, key=lambda each: each.candidate.label != prediction.most_likely)
    return {
        'stamp_ns': prediction.stamp_ns,
        'most_likely': prediction.most_likely,
        'unknown': prediction.unknown,
        'other': prediction.other,
        'goals': encode_goals(prediction),
        'candidates': [encode_candidate(each) for each in candidates],
    }


def encode_goals(prediction: Prediction) -> list[dict[str, Any]]:
    """Return name, position [m] and likelihood of each goal; the likelihood is null where nothing is known of it."""
    return [{'name': each.name, 'position': each.position.tolist(), 'likelihood': each.likelihood} for each in prediction.goals]


def encode_candidate(candidate: PredictedCandidate) -> dict[str, Any]:
    """Return the class, status, costs and path of a candidate.

    goal: row of its goal; effort [m^2/s^6], cost [m^2/s^5], tau [m^2], lambda [1/s^6]; mean and stddev (N + 1, 2) of the position
    [m] at steps 0..N. Where the height over the plane is predicted, also height, height_velocity and height_stddev (N + 1,) [m,
    m/s]. Numbers that are not finite become null.
    """
    solution = candidate.solution
    variances = np.diagonal(solution.covariance[:, :2, :2], axis1=1, axis2=2)
    return {
        'label': candidate.label,
        'description': candidate.description,
        'goal': candidate.candidate.goal,
        'sides': {name: 'left' if side == LEFT else 'right' for name, side in candidate.sides.items()},
        'status': solution.status.value,
        'effort': encode_number(solution.effort),
        'cost': encode_number(candidate.cost),
        'eta': encode_number(solution.eta),
        'tau': encode_number(solution.tau),
        'lambda': encode_number(solution.lam),
        'likelihood': encode_number(candidate.likelihood),
        'qp_solves': solution.qp_solves,
        'mean': encode_table(solution.path),
        'stddev': encode_table(np.sqrt(np.maximum(variances, 0.0))),
        **({} if candidate.height is None else _encode_height(candidate.height)),
    }


def _encode_height(height: HeightTrajectory) -> dict[str, Any]:
    columns = height.mean[:, 0], height.mean[:, 1], height.stddev
    names = 'height', 'height_velocity', 'height_stddev'
    return {name: [encode_number(value) for value in column.tolist()] for name, column in zip(names, columns, strict=True)}


def encode_solution(solution: Solution) -> dict[str, Any]:
    """Return what `encode_candidate` leaves out of a solution; units are those of :class:`Solution`.

    rows: the active contacts; velocity and acceleration (N + 1, 2), where acceleration is null if the state of the plant holds
    only position and velocity; covariance (N + 1, n, n) of the state; control (N, 2).
    """
    contacts = zip(solution.multipliers, solution.equivalent_weights, strict=True)
    has_acceleration = solution.mean.shape[1] >= 6
    return {
        'solve_ms': 1e3 * solution.solve_s,
        'velocity': encode_table(solution.mean[:, 2:4]),
        'message': solution.message,
        'costs': {name: encode_number(value) for name, value in solution.costs.items()},
        'eta_at': _encode_place(solution.eta_at),
        'eta_reachable': solution.eta_reachable,
        'violation': encode_number(solution.violation),
        'violation_at': _encode_place(solution.violation_at),
        'rows': [
            {
                'obstacle': name,
                'step': step,
                'multiplier': encode_number(multiplier),
                'tau': encode_number(tau),
                'lambda': encode_number(lam),
            }
            for (name, step, multiplier), (tau, lam) in contacts
        ],
        'iterations': solution.iterations,
        'acceleration': encode_table(solution.mean[:, 4:6]) if has_acceleration else None,
        'control': encode_table(solution.control),
        'covariance': [encode_table(each) for each in solution.covariance],
    }


def encode_number(value: float) -> float | None:
    """Return a number, None if it is not finite: JSON has no such numbers."""
    return float(value) if math.isfinite(value) else None


def encode_table(rows: Array) -> list[list[float | None]]:
    """Return an array (m, k) as lists of numbers."""
    return [[encode_number(value) for value in row] for row in rows.tolist()]


def _encode_place(place: tuple[str, float] | None) -> dict[str, Any] | None:
    return None if place is None else {'obstacle': place[0], 'step': place[1]}


def encode_guidance(stamp_ns: int, output: GuidanceOutput) -> dict[str, Any]:
    """Encode one update of guidance for JSON."""
    return {
        'stamp_ns': stamp_ns,
        'status': output.status.value,
        'force': output.force.tolist(),
        'reference': output.reference.tolist(),
        'stiffness': output.stiffness.tolist(),
        'agreement': output.agreement,
        'authority': output.authority,
        'tank_J': output.tank,
    }
