"""The account of a control: every term of its cost, what its contacts ask for, and what it falls short of."""

from __future__ import annotations

import numpy as np

from .chance import variance
from .contacts import Contacts
from .problem import Problem
from .qp import depths, wanted_distance
from .records import Array

NO_VIOLATION = 1e-7
"""Shortfall of a distance that is rounding [m]."""


def costs(problem: Problem, control: Array, mean: Array, covariance: Array, lam: float) -> dict[str, float]:
    """Return every term of J_aug by name [m^2/s^6]: effort, weighted mean errors and variances, and the lambda term.

    control (2N,); mean (N + 1, n) and covariance (N + 1, n, n) that follow from it.
    """
    variances = np.diagonal(covariance, axis1=1, axis2=2)[1:]
    squared_error = (mean[1:] - problem.goal) ** 2
    way, end = problem.way_weights, problem.end_weights
    return {
        'effort': float(control @ control),
        'mean_error': float((squared_error[:-1] @ way).sum() + squared_error[-1] @ end),
        'variance': float((variances[:-1] @ way).sum() + variances[-1] @ end),
        'lambda_variance': float(lam * variances[:, :2].sum()),
    }


def shortfall(problem: Problem, positions: Array, tau: float) -> tuple[float, tuple[int, int] | None]:
    """Return by how much a mean (N, 2) comes too near [m], and where: row of the obstacle and step (1..N) of the largest.

    Too near is less than sqrt(E[R^2] + tau) from a centre, or less than a hand that is leaving a margin has to keep; 0 and None
    where it never is.
    """
    missing = depths(positions, problem.centres, wanted_distance(problem, tau))
    if missing.max(initial=0.0) <= NO_VIOLATION:
        return 0.0, None
    row, column = np.unravel_index(int(missing.argmax()), missing.shape)
    return float(missing[row, column]), (int(row), int(column) + 1)


def asked_for(problem: Problem, control: Array, contacts: Contacts, k: float) -> list[tuple[float, float]]:
    """Return the (tau [m^2], lambda [1/s^6]) of each contact, all at steps, that holds the surrogate at k.

    tau = k sqrt(Var[C]) is what E[C] has to be below zero by; lambda = y k |d| / sqrt(Var[C]), for a contact's force y [m/s^6],
    is what a variance along its normal, at its step, costs.
    """
    offset = problem.positions(control)[None] - problem.centres
    var = variance(offset, problem.position_variance(control), problem.size[1], problem.obstacles.centre_covariance)
    rows = contacts.obstacle, np.rint(contacts.time).astype(np.intp) - 1
    stddev, distance = np.sqrt(var[rows]), np.hypot(*offset[rows].T)
    lams = contacts.force * k * distance / np.maximum(stddev, 1e-12)
    return list(zip((k * stddev).tolist(), lams.tolist(), strict=True))
