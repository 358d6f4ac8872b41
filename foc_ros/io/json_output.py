# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Candidates and predictions as plain values for JSON, under the same names in all commands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import LEFT, Solution


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
    """Return the class, status, costs and path of a candidate; numbers that are not finite become null.

    effort [m^2/s^6], cost [m^2/s^5], tau [m^2], lambda [1/s^6]; mean and stddev (N + 1, 2) of the position [m]. Where the height
    over the plane is predicted, also height, height_velocity and height_stddev (N + 1,) [m, m/s].
    """
    solution, height = candidate.solution, candidate.height
    variances = np.diagonal(solution.covariance[:, :2, :2], axis1=1, axis2=2)
    values = {
        'label': candidate.label,
        'description': candidate.description,
        'goal': candidate.candidate.goal,
        'sides': {name: 'left' if side == LEFT else 'right' for name, side in candidate.sides.items()},
        'status': solution.status.value,
        'effort': solution.effort,
        'cost': candidate.cost,
        'eta': solution.eta,
        'tau': solution.tau,
        'lambda': solution.lam,
        'likelihood': candidate.likelihood,
        'qp_solves': solution.qp_solves,
        'mean': solution.path,
        'stddev': np.sqrt(np.maximum(variances, 0.0)),
    }
    if height is not None:
        values |= {'height': height.mean[:, 0], 'height_velocity': height.mean[:, 1], 'height_stddev': height.stddev}
    return {name: _make_plain(value) for name, value in values.items()}


def encode_solution(solution: Solution) -> dict[str, Any]:
    """Return what `encode_candidate` leaves out of a solution, whose units are those of :class:`Solution`; rows: the contacts."""
    contacts = zip(solution.multipliers, solution.equivalent_weights, strict=True)
    places = {name: getattr(solution, name) for name in ('eta_at', 'violation_at')}
    values = {
        'solve_ms': 1e3 * solution.solve_s,
        'velocity': solution.mean[:, 2:4],
        'message': solution.message,
        'costs': solution.costs,
        'eta_reachable': solution.eta_reachable,
        'violation': solution.violation,
        **{name: place and {'obstacle': place[0], 'step': place[1]} for name, place in places.items()},
        'rows': [
            {'obstacle': name, 'step': step, 'multiplier': multiplier, 'tau': tau, 'lambda': lam}
            for (name, step, multiplier), (tau, lam) in contacts
        ],
        'iterations': solution.iterations,
        'acceleration': solution.mean[:, 4:6] if solution.mean.shape[1] >= 6 else None,
        'control': solution.control,
        'covariance': solution.covariance,
    }
    return {name: _make_plain(value) for name, value in values.items()}


def _make_plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _make_plain(each) for name, each in value.items()}
    if isinstance(value, (list, np.ndarray)):
        return [_make_plain(each) for each in (value.tolist() if isinstance(value, np.ndarray) else value)]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
