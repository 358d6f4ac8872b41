"""The quadratic programme of one linearisation, built apart from its solution.

minimise 1/2 u' diag(hessian) u - linear' u + sum_r (goal_rows u - target)_r^2 / (2 softness_r) (an equality where softness is 0)
subject to sum_q coefficient[j, t, q] maps[q, t] u >= limit[j, t] for every obstacle j and step t.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .problem import Problem
from .records import Array


@dataclass(frozen=True, eq=False)
class Cost:
    """What is minimised, and the goal.

    hessian (2N,) > 0; linear (2N,), None for zero; goal_rows (r, 2N) with their targets and softness (r,).

    With H diagonal, the control that meets only the goal is known in closed form, and so is P, by which rows M press on it:
    P = H^-1 - H^-1 E'(E H^-1 E' + softness)^-1 E H^-1, E the goal rows.
    """

    hessian: Array
    linear: Array | None
    goal_rows: Array
    goal_targets: Array
    softness: Array

    @cached_property
    def _factors(self) -> tuple[Array, Array, Array]:
        """H^-1 (2N,), root L (r, r) of (E H^-1 E' + softness)^-1 = L'L, and L E H^-1 (r, 2N).

        By eigenvalues, kept from zero: a Hessian over many orders of magnitude leaves no Cholesky factor.
        """
        inverse = 1.0 / self.hessian
        weighted = self.goal_rows * inverse
        gram = weighted @ self.goal_rows.T
        gram.flat[:: len(gram) + 1] += self.softness
        # unit diagonal: the goal rows mix metres, metres per second and their like
        scale = 1.0 / np.sqrt(gram.diagonal())
        gram *= scale[:, None] * scale
        values, vectors = np.linalg.eigh(gram)
        root = vectors.T / np.sqrt(np.maximum(values, 1e-14 * values[-1]))[:, None] * scale
        return inverse, root, root @ weighted

    @cached_property
    def goal_control(self) -> Array:
        """The minimiser without obstacle rows, (2N,)."""
        inverse, root, factor = self._factors
        if self.linear is None:
            control: Array = (root @ self.goal_targets) @ factor
            return control
        free = inverse * self.linear
        return free + (root @ (self.goal_targets - self.goal_rows @ free)) @ factor

    def pressed(self, rows: Array) -> Array:
        """Return M P for rows M (k, 2N): what each row's multiplier does to the control."""
        inverse, _, factor = self._factors
        control: Array = rows * inverse - (rows @ factor.T) @ factor
        return control


@dataclass(frozen=True, eq=False)
class ReachingQP:
    """A cost and obstacle rows: maps (q, N, 2N), coefficients (m, N, q) and limits (m, N), m obstacles."""

    cost: Cost
    maps: Array
    coefficients: Array
    limits: Array

    def row_values(self, control: Array) -> Array:
        """Left-hand side of every obstacle row, (m, N)."""
        values: Array = np.einsum('jtq,qt->jt', self.coefficients, self.maps @ control)
        return values

    def rows(self, obstacle: NDArray[np.intp], step: NDArray[np.intp]) -> Array:
        """Return obstacle rows (k, 2N) for k pairs of obstacle and step index."""
        rows: Array = np.einsum('kq,qku->ku', self.coefficients[obstacle, step], self.maps[:, step])
        return rows


def effort_cost(problem: Problem, lam: float) -> Cost:
    """Return J_aug: H = 2 (1 + variance weights + lambda sum_t (V_xx + V_yy)) (paper, equation 16), with the problem's goal."""
    return Cost(2.0 * (1.0 + problem.weighted_variance + lam * problem.summed_variance), None, *problem.goal_rows)


def half_planes(problem: Problem, guess: Array, tau: float, *, literal: bool = False) -> tuple[Array, Array]:
    """Linearise |p - o|^2 >= E[R^2] + tau at a guess (N, 2): unit normals (m, N, 2) and limits (m, N) on normal . (S u) [m].

    literal: the paper's E[C] + tau <= 0 divided by 2 |d|; its plane lies (reach^2 + d^2) / (2 d) from the centre, d = |guess -
    centre|. Otherwise the plane with the same normal that touches the circle: the two agree at a solution, where the
    constraint is
    active, and the touching one cuts less off before it, so a far obstacle is never in the way. Both stay outside the circle.
    """
    offset = guess - problem.centres
    distance = np.hypot(offset[..., 0], offset[..., 1])
    if not distance.all():  # a guess on a centre has no normal: take the left of the y axis
        offset[distance == 0] = (0.0, 1.0)
        distance[distance == 0] = 1.0
    offset /= distance[..., None]
    reach = wanted_distance(problem, tau)
    clearance = (reach**2 + distance**2) / (2 * distance) if literal else reach
    return offset, np.einsum('jti,jti->jt', offset, problem.centres_from_free) + clearance


def wanted_distance(problem: Problem, tau: float) -> Array:
    """Distance from each centre that the mean has to keep, (m, 1) or (m, N) [m]: sqrt(E[R^2] + tau).

    Less where the hand is nearer now: what is missing now may be missing still, falling to zero over the recovery time as a
    minimum-jerk movement does, so that the problem asks for a way out, not for a jump.
    """
    reach = np.sqrt(problem.size[0] + tau)[:, None]
    missing = reach - problem.distance_now[:, None]
    if problem.recovery_s <= 0 or missing.max(initial=0.0) <= 0:
        return reach
    distance: Array = reach - np.maximum(missing, 0.0) * problem.recovery_left
    return distance


def clearance_qp(problem: Problem, cost: Cost, guess: Array, tau: float, *, literal: bool = False) -> ReachingQP:
    """Build the paper's reformulated problem (equation 16) at a guess (N, 2): E[C] + tau <= 0; its lambda is in the cost."""
    normals, limits = half_planes(problem, guess, tau, literal=literal)
    return ReachingQP(cost, problem.position_map, normals, limits)
