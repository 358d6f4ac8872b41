"""Points on the curve of clearance and precision that `lv` and `hc` walk along, each found from a neighbour's solution.

The clearance is kept between the steps too: a contact with a circle then slides on along it as the hand slows down, where rows at
the steps would make it jump from one pair of steps to the next, and the effort with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from foc_ros.core.deadline import Deadline
from foc_ros.core.ocp.contacts.checks import class_angles, find_crossings, is_fixed_point, is_in_class, merge_contacts
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.contacts.kkt_point import KktPoint, solve_kkt_point
from foc_ros.core.ocp.minimum_k import MinimumSafetyFactor, find_minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import NO_TIMES, effort_cost
from foc_ros.core.ocp.sqp import MAX_QPS, Converged, Jump, converge
from foc_ros.core.ocp.working_set import WorkingSet
from foc_ros.core.types import Array

STRIDE = 4.0
"""First look along the curve, in s: lambda grows by 16 from one to the next."""
SPAN = 60.0
"""The largest s in any case: without noise, say, when lambda weighs nothing."""
LARGEST_SHARE = 1e6
"""Where the walk ends: a variance weight so many times the effort is all that counts, and k has stopped growing."""
LEAPS = 8
"""How often more times are added for a mean that leaps over circles between the steps."""
FURTHER_QPS = 16
"""Linearisations after which no point is found by QPs along the curve; at its beginning there may be more."""


@dataclass(frozen=True)
class PenaltyPath:
    """tau = delta s [m^2], lambda = first_lambda growth^s."""

    delta: float
    growth: float
    first_lambda: float

    def at(self, s: float) -> tuple[float, float]:
        """Return (tau, lambda) at s >= 0."""
        return self.delta * s, self.first_lambda * self.growth**s

    def s_of(self, lam: float) -> float:
        """Return the s of a lambda on the curve."""
        return max(0.0, math.log(lam / self.first_lambda) / math.log(self.growth)) if lam > self.first_lambda > 0 else 0.0

    def end(self, problem: Problem) -> float:
        """Return the largest s worth trying."""
        variance = float(problem.summed_variance.max())
        if not self.first_lambda * variance > 0:
            return SPAN
        return min(max(STRIDE, math.log(LARGEST_SHARE / (self.first_lambda * variance)) / math.log(self.growth)), SPAN)


@dataclass(frozen=True, eq=False)
class PathPoint:
    """One converged solution on the curve: control (2N,), the contacts that hold it, the smallest k with its place.

    least: as of `least_k.smallest`; rough: held by the rows of QPs, and so perhaps slightly inside a circle between two of them.
    """

    s: float
    control: Array
    contacts: Contacts
    least: MinimumSafetyFactor
    rough: bool = False

    @property
    def k(self) -> float:
        """The k that it achieves."""
        return self.least[0]


class PathFollower:
    """Evaluates points, each from a neighbour's solution, and counts."""

    def __init__(self, problem: Problem, curve: PenaltyPath, deadline: Deadline, *, follows: bool) -> None:
        self.problem, self.curve, self.end, self.deadline = problem, curve, curve.end(problem), deadline
        self.follows = follows
        self.qp_solves = 0
        self.best: PathPoint | None = None

    def beginning(self, guess: Array, way: Array | None = None) -> PathPoint | None:
        """Converge at the beginning of the curve, from a guess (N, 2)."""
        return self.point(0.0, guess, WorkingSet(), way, thorough=True)

    def point(self, s: float, guess: Array, working: WorkingSet, way: Array | None, *, thorough: bool) -> PathPoint | None:
        """Converge at s from a guess (N, 2): by QPs, until sliding contacts find it from there; else where the QPs settle.

        way: the class that it has to be in, any if it is None; thorough: spare no effort.
        """
        tau, lam = self.curve.at(s)

        def jump(control: Array, contacts: Contacts) -> KktPoint | None:
            return solve_kkt_point(self.problem, control, merge_contacts(self.problem, contacts), tau, lam, way)

        found = self.sequence(guess, working, tau, lam, jump, thorough=thorough)
        if found is None or not found.stays:
            return None
        if found.jumped is not None:
            return self.reached(s, found.jumped)
        if way is not None and not is_in_class(self.problem, found.control, way):
            return None
        return self.reached(
            s, KktPoint(found.control, found.contacts, find_minimum_safety_factor(self.problem, found.control)), rough=True
        )

    def sequence(
        self, guess: Array, working: WorkingSet, tau: float, lam: float, jump: Jump, *, thorough: bool
    ) -> Converged | None:
        """Converge by QPs with rows at the steps, and at more times where the mean would leap over a circle between them."""
        most = MAX_QPS if thorough else FURTHER_QPS
        between = NO_TIMES
        for _ in range(LEAPS):
            found = converge(
                self.problem,
                guess,
                working,
                tau,
                lam,
                self.deadline,
                verified=False,
                between=between,
                most=most,
                thorough=thorough,
                jump=jump,
            )
            if found is None:
                return None
            self.qp_solves += found.qp_solves
            leaps = NO_TIMES if found.jumped is not None else find_crossings(self.problem, found.control, tau)
            if not len(leaps):
                return found
            most -= found.linearisations
            if most < 1:
                return None
            between, working = np.union1d(between, leaps), found.active.within(self.problem.horizon.steps)
        return None

    def beside(self, s: float, neighbour: PathPoint) -> PathPoint | None:
        """Converge at s from a neighbour, in its class: by Newton steps; by QPs where these fail, unless it only follows."""
        self.deadline.check()
        contacts = merge_contacts(self.problem, neighbour.contacts) if neighbour.rough else neighbour.contacts
        point = self.followed(s, neighbour.control, contacts)
        if point is not None or self.follows:
            return point
        guess, (working, _) = self.problem.positions(neighbour.control), contacts.rows(self.problem.horizon.steps)
        return self.point(s, guess, working, class_angles(self.problem, neighbour.control), thorough=False)

    def followed(self, s: float, control: Array, contacts: Contacts, way: Array | None = None) -> PathPoint | None:
        """Converge at s from a control (2N,) by Newton steps, in its class or that of a way."""
        found = solve_kkt_point(self.problem, control, contacts, *self.curve.at(s), way)
        return None if found is None else self.reached(s, found)

    def reached(self, s: float, found: KktPoint, *, rough: bool = False) -> PathPoint:
        """Return the point, and remember it if its k is the largest so far."""
        point = PathPoint(s, found.control, found.contacts, found.least, rough)
        self.best = point if self.best is None or point.k > self.best.k else self.best
        return point

    def verified(self, point: PathPoint) -> bool:
        """Whether the QP linearised at a point has the same solution."""
        self.qp_solves += 1
        tau, lam = self.curve.at(point.s)
        return is_fixed_point(self.problem, effort_cost(self.problem, lam), point.control, point.contacts, tau)
