"""The account of a control: every term of its cost, what its contacts ask for, and what it falls short of."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled
from foc_ros.core.obstacles.chance_constraint import variances
from foc_ros.core.types import Array

from .contacts.contacts import Contacts
from .problem import Problem
from .qp import compute_depths, wanted_distance

NO_VIOLATION = 1e-7
"""Shortfall of a distance that is rounding [m]."""


def compute_cost_terms(problem: Problem, control: Array, mean: Array, covariance: Array, lam: float) -> dict[str, float]:
    """Return every term of J_aug by name [m^2/s^6]: effort, weighted mean errors and variances, and the lambda term.

    control (2N,); mean (N + 1, n) and covariance (N + 1, n, n) that follow from it.
    """
    mean_error, variance, summed = weigh_errors(mean, covariance, problem.goal, problem.end_weights, problem.way_weights)
    effort = float(control @ control)
    return {'effort': effort, 'mean_error': mean_error, 'variance': variance, 'lambda_variance': lam * summed}


@compiled
def weigh_errors(mean: Matrix, covariance: Tensor, goal: Vector, end: Vector, way: Vector) -> tuple[float, float, float]:
    """Return the squared errors of a mean (N + 1, n) and the variances, with weights (n,), and the sum of those of x and y."""
    times, n = mean.shape
    squared, variance, summed = 0.0, 0.0, 0.0
    for t in range(1, times):
        for i in range(n):
            weight = end[i] if t == times - 1 else way[i]
            squared += weight * (mean[t, i] - goal[i]) ** 2
            variance += weight * covariance[t, i, i]
        summed += covariance[t, 0, 0] + covariance[t, 1, 1]
    return squared, variance, summed


def compute_violation(problem: Problem, mean: Array, tau: float) -> tuple[float, tuple[int, int] | None]:
    """Return by how much a mean (N + 1, n) comes too near [m], and where: row of the obstacle and step (1..N) of the largest.

    Too near is less than sqrt(E[R^2] + tau) from a centre, or less than a hand that is leaving a margin has to keep; 0 and None
    where it never is.
    """
    missing, row, step = find_deepest(mean, problem.centres, wanted_distance(problem, tau))
    return (missing, (row, step)) if missing > NO_VIOLATION else (0.0, None)


@compiled
def find_deepest(mean: Matrix, centres: Tensor, wanted: Matrix) -> tuple[float, int, int]:
    """Return the largest `depths` of a mean (N + 1, n) [m], its circle, and its step 1..N."""
    depth = compute_depths(mean[1:, :2].copy(), centres, wanted)
    deepest, row, step = -np.inf, 0, 0
    for j in range(depth.shape[0]):
        for t in range(depth.shape[1]):
            if depth[j, t] > deepest:
                deepest, row, step = depth[j, t], j, t + 1
    return deepest, row, step


def equivalent_weights(problem: Problem, control: Array, contacts: Contacts, k: float) -> list[tuple[float, float]]:
    """Return the (tau [m^2], lambda [1/s^6]) of each contact, all at steps, that holds the surrogate at k.

    tau = k sqrt(Var[C]) is what E[C] has to be below zero by; lambda = y k |d| / sqrt(Var[C]), for a contact's force y [m/s^6],
    is what a variance along its normal, at its step, costs.
    """
    offset = problem.positions(control)[None] - problem.centres
    var = variances(offset, problem.position_variance(control), problem.size[1], problem.obstacles.centre_covariance)
    rows = contacts.obstacle, np.rint(contacts.time).astype(np.intp) - 1
    stddev, distance = np.sqrt(var[rows]), np.hypot(*offset[rows].T)
    lams = contacts.force * k * distance / np.maximum(stddev, 1e-12)
    return list(zip((k * stddev).tolist(), lams.tolist(), strict=True))
