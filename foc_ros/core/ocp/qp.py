# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The QPs of one iteration of the solver, for several problems at once, by their duals.

With the gradient c of ln J, a Hessian H = D + B'CB of a diagonal D and a few rows B, rows E of the goal, and contacts with
margins g, gradients A and rates r = -dg/dk, each QP is

    minimise  1/2 p'H p + c'p + rate (k_wanted - k)+ + floor (-k)+   subject to  E p = 0,  g + A p - r (k - k_now) >= 0.

Everything that it takes is a Gram matrix, in the metric of D, of what is left of the rows B, A and c when the goal is met. In the
root of the part of B the Hessian has the eigenvalues of I + L'CL; small ones are raised, so that there is a minimum.
The dual has one unknown y >= 0 for each contact, and k is in it as a budget: r'y <= rate, beyond which each unit costs k_wanted.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from foc_ros.core.types import Array

from .backend import Answer, DenseQP
from .gradients import FACTORS, Gradients
from .margin import Indices

LEAST_CURVATURE = 0.1
"""Least eigenvalue of the Hessian relative to its diagonal part: with less, a step leaves the place where margins are known."""
SOFT = 1e-11
"""Part of its length by which a contact row gives way: at the goal no control may move it."""
JITTER = 1e-9
"""Added to squares of unit length, where rows depend on each other."""


class Backend(Protocol):
    """A solver of quadratic programmes."""

    def __call__(self, qp: DenseQP, /) -> Answer:
        """Return the answer to a QP."""


class Quadratic(NamedTuple):
    """The objective of r problems about their controls, and their goals.

    gradient, diagonal (r, 2N): of ln J; soft_rows (r, s, 2N) and soft_weights (r, s): rows with a square in the cost, and their
    second derivatives; goal_rows (r, e, 2N): of unit length, or zero where a problem has fewer.
    """

    gradient: Array
    diagonal: Array
    soft_rows: Array
    soft_weights: Array
    goal_rows: Array


class Rows(NamedTuple):
    """Contacts by problem: row of the problem and place among its contacts, (q,) each.

    width: the most contacts of any problem; problems: their number.
    """

    problem: Indices
    slot: Indices
    width: int
    problems: int

    def spread(self, values: Array) -> Array:
        """Return values (q, ...) of contacts by problem, (r, width, ...), zero where a problem has fewer."""
        spread = np.zeros((self.problems, self.width, *values.shape[1:]))
        spread[self.problem, self.slot] = values
        return spread


def number_rows(problem: Indices, count: int) -> Rows:
    """Return contacts of `count` problems by problem; they come in any order."""
    order, sizes = np.argsort(problem, kind='stable'), np.bincount(problem, minlength=count)
    first = np.cumsum(sizes) - sizes
    slot = np.empty(len(problem), dtype=np.intp)
    slot[order] = np.arange(len(problem)) - first[problem[order]]
    return Rows(problem, slot, int(sizes.max(initial=0)), count)


class ReducedQP:
    """The QPs of r problems, reduced to their Gram matrices.

    Parameters
    ----------
    quadratic : Quadratic
        The objectives and goals.
    rows : Rows
        The contacts.
    gradients : Gradients
        Margins at the contacts, linearised.
    multipliers : Array
        What is known of the multipliers, (q,): they give the margins their weight in the Hessian.
    """

    def __init__(self, quadratic: Quadratic, rows: Rows, gradients: Gradients, multipliers: Array) -> None:
        held = multipliers > 0.0
        diagonal = quadratic.diagonal.copy()
        np.add.at(diagonal, rows.problem[held], multipliers[held, None] * gradients.diagonal)
        numbered = number_rows(rows.problem[held], rows.problems)
        bends, curvature = _stack_bends(quadratic, numbered, gradients, multipliers[held])
        length = np.sqrt((bends**2 / diagonal[:, None]).sum(axis=2))
        bends = bends / np.where(length > 0.0, length, 1.0)[..., None]
        curvature *= length[:, :, None] * length[:, None, :]
        self.rows, self.contact_rows, bent = rows, rows.spread(gradients.gradient), bends.shape[1]
        stack = np.concatenate((bends, self.contact_rows, quadratic.gradient[:, None]), axis=1)
        self.soften = SOFT * (self.contact_rows**2 / diagonal[:, None]).sum(axis=2)
        self._scaled, gram = _meet_goal(stack, diagonal, quadratic.goal_rows)
        self._lower = np.linalg.cholesky(gram[:, :bent, :bent] + JITTER * np.eye(bent))
        values, self._vectors = np.linalg.eigh(self._lower.swapaxes(1, 2) @ curvature @ self._lower)
        self._share = (1.0 - 1.0 / np.maximum(1.0 + values, LEAST_CURVATURE))[..., None]
        self._side = self._vectors.swapaxes(1, 2) @ np.linalg.solve(self._lower, gram[:, :bent, bent:])
        self.gram = gram[:, bent:, bent:] - self._side.swapaxes(1, 2) @ (self._share * self._side)

    def find_step(self, multipliers: Array) -> Array:
        """Return the steps (r, 2N) that belong to multipliers (r, width)."""
        pushes = np.concatenate((multipliers, -np.ones((len(multipliers), 1))), axis=1)[..., None]
        bends = -np.linalg.solve(self._lower.swapaxes(1, 2), self._vectors @ (self._share * (self._side @ pushes)))
        step: Array = (np.concatenate((bends, pushes), axis=1).swapaxes(1, 2) @ self._scaled)[:, 0]
        return step


def _stack_bends(quadratic: Quadratic, held: Rows, gradients: Gradients, multipliers: Array) -> tuple[Array, Array]:
    """Return the rows B (r, f, 2N) and the matrices C (r, f, f): of the contacts that hold the mean off, then of soft goals."""
    count, size = quadratic.gradient.shape
    width, soft = FACTORS * held.width, quadratic.soft_weights.shape[1]
    weights = np.zeros((count, held.width, FACTORS, held.width, FACTORS))
    weights[held.problem, held.slot, :, held.slot] = multipliers[:, None, None] * gradients.weights
    curvature = np.zeros((count, width + soft, width + soft))
    curvature[:, :width, :width] = weights.reshape(count, width, width)
    place = np.arange(width, width + soft)
    curvature[:, place, place] = quadratic.soft_weights
    factors = held.spread(gradients.factors).reshape(count, width, size)
    return np.concatenate((factors, quadratic.soft_rows), axis=1), curvature


def _meet_goal(stack: Array, diagonal: Array, goal: Array) -> tuple[Array, Array]:
    """Return what is left of rows (r, n, 2N) when the goal is met, over the diagonal, and its Gram matrix (r, n, n)."""
    scaled = goal / diagonal[:, None]
    square = scaled @ goal.swapaxes(1, 2)
    # of a goal that a few steps cannot meet, or of which rows are missing, what there is
    largest = np.einsum('bii->bi', square).max(axis=1)[:, None, None]
    is_missing = (goal == 0.0).all(axis=2).astype(float)
    square += (1e-12 + is_missing)[..., None] * largest * np.eye(goal.shape[1])
    for _ in range(2):  # what the first leaves would move the goal for a contact at it
        stack = stack - np.linalg.solve(square, scaled @ stack.swapaxes(1, 2)).swapaxes(1, 2) @ goal
    left = stack / diagonal[:, None]
    return left, left @ stack.swapaxes(1, 2)


def solve_dual(backend: Backend, square: Array, linear: Array, rate: Array, wanted_k: float, worth: float, floor: float) -> Array:
    """Return the multipliers (n,) of one QP.

    Parameters
    ----------
    backend : Backend
        The solver.
    square : Array
        Gram matrix of the contacts, (n, n).
    linear : Array
        Margins at the least cost and the wanted k, (n,) [m].
    rate : Array
        r = -dg/dk, (n,) [m].
    wanted_k, worth, floor : float
        Wanted safety factor; worth of a unit of it, and of one below zero.

    Returns
    -------
    Array
        y that minimises 1/2 y'Ky + linear'y + wanted_k (r'y - worth)+ with 0 <= y and r'y <= floor. The last unknown is the part
        of r'y beyond the worth.
    """
    n = len(linear)
    unit = 1.0 / np.sqrt(np.maximum(np.diag(square), np.finfo(float).tiny))
    size = max(float(np.abs(linear * unit).max()), 1e-12)
    budget = rate * unit * size
    scale = max(float(budget.max()), 1e-12)
    P = np.zeros((n + 1, n + 1))
    P[:n, :n] = square * unit[:, None] * unit + 1e-10 * np.eye(n)
    P[n, n] = 1e-12
    c = np.concatenate((linear * unit / size, [wanted_k * scale / size**2]))
    G = np.zeros((2, n + 1))
    G[0, :n], G[0, n], G[1, n] = -budget / scale, 1.0, -1.0
    answer = backend(DenseQP(P, c, None, None, G, np.array([-worth / scale, -floor / scale]), np.zeros(n + 1)))
    multipliers: Array = np.maximum(answer.x[:n], 0.0) * unit * size
    return multipliers
