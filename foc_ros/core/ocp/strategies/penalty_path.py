"""Points on the penalty path that `lv` and `hc` follow: pairs (tau, lambda), each solved from the solution of a neighbour.

The clearance is kept between the steps too, by contacts that slide along obstacles: see `contacts`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from foc_ros.core.deadline import Deadline
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.contacts.kkt_point import (
    KktPoint,
    compute_class_angles,
    find_crossings,
    is_fixed_point,
    is_in_class,
    solve_kkt_point,
)
from foc_ros.core.ocp.minimum_safety_factor import find_minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import NO_TIMES
from foc_ros.core.ocp.sqp import MAX_QPS, SqpOptions, SqpResult, converge
from foc_ros.core.ocp.working_set import WorkingSet
from foc_ros.core.types import Array

STRIDE = 4.0
"""First stride along the path, in s: with a growth of 2, lambda grows by 16."""
LONGEST_PATH = 60.0
"""The largest s in any case, for instance without noise, when lambda weighs nothing."""
LARGEST_SHARE = 1e6
"""Weight of the variances relative to the effort at which the path ends: nothing else counts then, and k has stopped growing."""
MAX_CROSSINGS = 8
"""Largest number of rounds in which times are added, for a mean that crosses obstacles between the steps."""
SHARPEST = 3e-3
"""Least distance that the mean keeps from a polygon, relative to the scene: at a corner itself the boundary has no normal."""
FURTHER_QPS = 16
"""Linearisations after which the QPs are given up at a point further along the path; at its beginning there may be more."""


@dataclass(frozen=True)
class PenaltyPath:
    """tau = delta s [m^2], lambda = first_lambda growth^s [1/s^6]."""

    delta: float
    growth: float
    first_lambda: float

    def at(self, s: float) -> tuple[float, float]:
        """Return (tau, lambda) at s >= 0."""
        return self.delta * s, self.first_lambda * self.growth**s

    def s_of(self, lam: float) -> float:
        """Return the s of a lambda on the path."""
        return max(0.0, math.log(lam / self.first_lambda) / math.log(self.growth)) if lam > self.first_lambda > 0 else 0.0

    def find_end(self, problem: Problem) -> float:
        """Return the largest s that is tried."""
        variance = float(problem.terms.cost.summed_variance.max())
        if not self.first_lambda * variance > 0:
            return LONGEST_PATH
        return min(max(STRIDE, math.log(LARGEST_SHARE / (self.first_lambda * variance)) / math.log(self.growth)), LONGEST_PATH)


@dataclass(frozen=True, eq=False)
class PathPoint:
    """A solution at s. has_rows: its contacts are rows of QPs, so that it may be a little inside an obstacle between steps."""

    s: float
    solution: KktPoint
    has_rows: bool = False

    @property
    def k(self) -> float:
        """The minimum safety factor."""
        return self.solution.minimum.k

    @cached_property
    def effort(self) -> float:
        """Control effort [m^2/s^6]."""
        return float(self.solution.control @ self.solution.control)


class PathFollower:
    """Solves points on a path, each from a neighbour, remembers them and the one with the largest k, and counts QPs.

    newton_only: whether a neighbour's solution is followed by Newton steps alone, without QPs where these fail.
    """

    def __init__(self, problem: Problem, path: PenaltyPath, deadline: Deadline, *, newton_only: bool) -> None:
        self.problem, self.path, self.end, self.deadline = problem, path, path.find_end(problem), deadline
        self.newton_only = newton_only
        self.qp_solves = 0
        self.best: PathPoint | None = None
        self.points: list[PathPoint] = []
        smallest = float(problem.size[0].min(initial=math.inf))
        self.least_tau = max((SHARPEST * problem.extent) ** 2 - smallest, 0.0)
        self.class_angles: Array | None = None

    def weights_at(self, s: float) -> tuple[float, float]:
        """Return (tau, lambda) at s, with the least tau that gives sharp corners a normal."""
        tau, lam = self.path.at(s)
        return max(tau, self.least_tau), lam

    def solve_first(self, guess: Array, class_angles: Array | None = None) -> PathPoint | None:
        """Solve at the beginning of the path, from a guess (N, 2), in a homotopy class if its angles (m,) are given."""
        return self._solve_by_qps(0.0, guess, WorkingSet(), class_angles, thorough=True)

    def solve_beside(self, s: float, neighbour: PathPoint) -> PathPoint | None:
        """Solve at s from a neighbour, in its class: by Newton steps; by QPs where these fail, unless it is `newton_only`."""
        self.deadline.check()
        control, contacts, _ = neighbour.solution
        merged = contacts.merge(self.problem.first_alike) if neighbour.has_rows else contacts
        point = self.solve_by_newton(s, control, merged, self.class_angles)
        if point is not None or self.newton_only:
            return point
        guess, (working, _) = self.problem.positions(control), merged.rows(self.problem.horizon.steps)
        return self._solve_by_qps(s, guess, working, self.class_angles, thorough=False)

    def solve_by_newton(
        self, s: float, control: Array, contacts: Contacts, class_angles: Array | None = None
    ) -> PathPoint | None:
        """Solve at s from a control (2N,) by Newton steps, in its class or that of given angles (m,)."""
        found = solve_kkt_point(self.problem, control, contacts, *self.weights_at(s), class_angles)
        return None if found is None else self._remember(PathPoint(s, found))

    def is_verified(self, point: PathPoint) -> bool:
        """Tell whether the QP linearised at a point has the same solution."""
        self.qp_solves += 1
        return is_fixed_point(self.problem, point.solution.control, point.solution.contacts, *self.weights_at(point.s))

    def _solve_by_qps(
        self, s: float, guess: Array, working: WorkingSet, class_angles: Array | None, *, thorough: bool
    ) -> PathPoint | None:
        """Solve at s from a guess (N, 2) by QPs, until Newton steps lead from one of them to a solution, or the QPs settle.

        thorough: spare no effort, and return the solution of the last QP where they do not settle, which keeps clear as well.
        """
        found = self._run_qps(s, guess, working, class_angles, thorough=thorough)
        if found is None or not (found.stays or thorough):
            return None
        if found.jumped is not None:
            return self._remember(PathPoint(s, found.jumped))
        if class_angles is not None and not is_in_class(self.problem, found.control, class_angles):
            return None
        minimum = find_minimum_safety_factor(self.problem, found.control, between_steps=True)
        return self._remember(PathPoint(s, KktPoint(found.control, found.contacts, minimum), has_rows=True))

    def _run_qps(
        self, s: float, guess: Array, working: WorkingSet, class_angles: Array | None, *, thorough: bool
    ) -> SqpResult | None:
        """Solve QPs until they converge, with rows at steps and halfway between; where the mean crosses one, add rows there."""
        problem, (tau, lam) = self.problem, self.weights_at(s)
        left, between = MAX_QPS if thorough else FURTHER_QPS, np.arange(1.5, problem.horizon.steps)

        def jump(control: Array, contacts: Contacts) -> KktPoint | None:
            return solve_kkt_point(problem, control, contacts.merge(problem.first_alike), tau, lam, class_angles)

        run = partial(SqpOptions, verified=False, thorough=thorough, jump=jump)
        for _ in range(MAX_CROSSINGS):
            found = converge(problem, guess, working, tau, lam, self.deadline, run(between=between, max_qps=left))
            if found is None:
                return None
            self.qp_solves += found.qp_solves
            crossings = NO_TIMES if found.jumped is not None else find_crossings(problem, found.control, tau)
            if not len(crossings):
                return found
            left -= found.linearisations
            if left < 1:
                return None
            between, working = np.union1d(between, crossings), found.active.within(problem.horizon.steps)
        return None

    def _remember(self, point: PathPoint) -> PathPoint:
        """Return the point, and remember it; the first one defines the homotopy class of all."""
        if self.class_angles is None:
            self.class_angles = compute_class_angles(self.problem, point.solution.control)
        self.points.append(point)
        self.best = point if self.best is None or point.k > self.best.k else self.best
        return point
