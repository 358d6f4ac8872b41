"""The quadratic programme of one linearisation, built apart from its solution.

minimise 1/2 u' diag(hessian) u - linear' u + sum_r (goal_rows u - target)_r^2 / (2 softness_r) (an equality where softness is 0)
subject to sum_q coefficient[j, t, q] maps[q, t] u >= limit[j, t] for every obstacle j and step t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .problem import Problem
from .records import Array


@dataclass(frozen=True, eq=False)
class ReachingQP:
    """A QP in the stacked control u (2N,).

    hessian (2N,) > 0; linear (2N,); goal_rows (r, 2N), goal_targets (r,), softness (r,) >= 0; maps (q, N, 2N), coefficients
    (m, N, q) and limits (m, N): the obstacle rows, m obstacles.
    """

    hessian: Array
    linear: Array
    goal_rows: Array
    goal_targets: Array
    softness: Array
    maps: Array
    coefficients: Array
    limits: Array

    def row_values(self, control: Array) -> Array:
        """Left-hand side of every obstacle row, (m, N)."""
        values: Array = np.einsum('jtq,qt->jt', self.coefficients, self.maps @ control)
        return values

    def rows(self, obstacle: Array, step: Array) -> Array:
        """Return obstacle rows (k, 2N) for k pairs of obstacle and step index."""
        rows: Array = np.einsum('kq,qku->ku', self.coefficients[obstacle, step], self.maps[:, step])
        return rows


def hessian(problem: Problem, lam: float) -> Array:
    """Diagonal of the Hessian of J_aug, (2N,): 2 (1 + variance weights + lambda sum_t (V_xx + V_yy)) (paper, equation 14)."""
    diagonal: Array = 2.0 * (1.0 + problem.weighted_variance + lam * problem.summed_variance)
    return diagonal


def half_planes(problem: Problem, guess: Array, tau: float, *, literal: bool = False) -> tuple[Array, Array]:
    """Linearise |p - o|^2 >= E[R^2] + tau at a guess (N, 2): unit normals (m, N, 2) and limits (m, N) on normal . p [m].

    literal: the paper's E[C] + tau <= 0 divided by 2 |d|; its plane lies (reach^2 + d^2) / (2 d) from the centre, d = |guess -
    centre|. Otherwise the plane with the same normal that touches the circle: the two agree at a solution, where the constraint is
    active, and the touching one cuts less off before it, so fewer relinearisations are needed. Both stay outside the circle.
    """
    offset = guess[None] - problem.centres
    distance = np.sqrt(np.einsum('jti,jti->jt', offset, offset))
    normal = np.where(distance[..., None] > 0, offset / np.where(distance > 0, distance, 1.0)[..., None], [0.0, 1.0])
    reach = np.sqrt(problem.size[0] + tau)[:, None] - recovery_allowance(problem, tau)
    clearance = (reach**2 + distance**2) / (2 * np.maximum(distance, 1e-12)) if literal else reach
    return normal, np.einsum('jti,jti->jt', normal, problem.centres) + clearance


def recovery_allowance(problem: Problem, tau: float) -> Array:
    """How much nearer than the wanted distance the hand may be, (m, N) [m].

    Zero unless the hand is inside now: then what is missing now, falling to zero linearly over the recovery time, so that the
    problem asks for a way out, not for a jump.
    """
    wanted = np.sqrt(problem.size[0] + tau)
    away = np.sqrt(((problem.initial_mean[:2] - problem.obstacles.centre) ** 2).sum(axis=1))
    times = problem.horizon.dt * np.arange(1, problem.horizon.steps + 1)
    left = np.maximum(0.0, 1.0 - times / problem.recovery_s) if problem.recovery_s > 0 else np.zeros_like(times)
    allowance: Array = np.maximum(0.0, wanted - away)[:, None] * left[None, :]
    return allowance


def clearance_qp(problem: Problem, guess: Array, tau: float, lam: float, *, literal: bool = False) -> ReachingQP:
    """Build the paper's reformulated problem (equation 14) at a guess (N, 2): E[C] + tau <= 0 everywhere, lambda on the variance."""
    normal, limit = half_planes(problem, guess, tau, literal=literal)
    rows, targets, softness = problem.goal_rows
    free = np.einsum('jti,ti->jt', normal, problem.free[1:, :2])
    diagonal = hessian(problem, lam)
    return ReachingQP(diagonal, np.zeros_like(diagonal), rows, targets, softness, problem.position_map, normal, limit - free)
