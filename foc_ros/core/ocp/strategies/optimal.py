"""Strategy `optimal`: the least effort at a safety factor k, between the steps too, and the k that is worth its effort.

For each k there is a least effort E(k), found by Newton steps on the surrogate itself (`contacts.surrogate_newton`) from the
solution at another k. It begins at the k of the least effort that keeps the mean out of the obstacles, and rises with k. A class
keeps the wanted k where that is worth its effort, else the k at which

    d ln J / dk = shortfall / beta,   J = fixed_cost + dt E,

where beta ln J + shortfall max(0, k_wanted - k) is least (`SafetyPreference`). The left side grows with k in all scenes tried, so
that the search ends as soon as it is larger than the right side, and no larger k is tried. With an infinite shortfall the wanted
k counts alone, and a class whose k ends below it is out of reach.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from foc_ros.core.classes import compute_swept_angles
from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.kernels import freeze
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.contacts.kkt_point import compute_class_angles
from foc_ros.core.ocp.contacts.surrogate_newton import Preference
from foc_ros.core.ocp.contacts.surrogate_point import SurrogatePoint, solve_surrogate_point
from foc_ros.core.ocp.minimum_safety_factor import find_minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.warm_start import Start, correct_to_goal
from foc_ros.core.types import Array, Status

from . import StrategyResult, find_best_effort
from .penalty_path import PathFollower, PathPoint, PenaltyPath

LEAST_EFFORT = PenaltyPath(delta=1.0, growth=1.0, first_lambda=0.0)
"""The path on which only the effort counts, and s is tau: at its beginning the mean just touches the obstacles."""
ROUNDINGS = (1.0, 0.25, 0.05)
"""Parts of the clearance for the wanted k with which Newton steps begin where they do not lead on from the least effort."""
CLOSE = 5e-6
"""Relative excess over the wanted k that is aimed at."""
SHARES = 1.0, 0.75, 0.5, 0.35, 0.25
"""Parts of k that are tried from the least effort: k rises again from there."""
EVEN = 1e-4
"""Relative difference of the slope from the one that is worth it at which both are the same."""
FOLLOW_SHARE = 0.5
"""Part of the time left that an earlier solution may take; then the search begins again."""
NEARLY = 0.6
"""Part of the slope that is worth it from which Newton steps are tried that have k as an unknown."""
WARM_STRIDE, COLD_STRIDE = 0.6, 0.4
"""First strides in k, if they are not too long; from an earlier solution it is shorter, the nearer the slope is to that which is
worth it."""
TRIES, WARM_TRIES = 8, 1
"""Number of larger k that may fail if another search goes on from the result: in general, and from an earlier solution for one
raise."""
NARROW = 0.02
"""Bracket in k at which the search ends."""


def solve_optimal(problem: Problem, start: Start, _: FocConfig, deadline: Deadline = NEVER) -> StrategyResult:
    """Find a local minimum from a start.

    Where another search goes on from the result, one that runs out of time has the k that it has reached.
    """
    search, is_late = _Search(problem, deadline), False
    try:
        status = search.run(start)
    except OutOfTimeError:
        if search.best is None:
            raise
        status, is_late = search.judge() if search.raises < math.inf else Status.DEADLINE, True
    point = search.best
    if status is Status.ITERATION_LIMIT:
        assert start.control is not None
        message = 'the earlier solution does not lead to one now'
        control = correct_to_goal(problem, start.control, start.positions, start.contacts.time)
        return StrategyResult(status, message, control, aims_at_eta=False)
    if point is None or status is Status.INFEASIBLE:
        return find_best_effort(problem, start, qp_solves=search.qp_solves, deadline=deadline)
    minimum, found = find_minimum_safety_factor(problem, point.control, between_steps=True), problem.risk
    reached = found.find_probability(minimum.k)
    messages = {
        Status.SOLVED: 'solved',
        Status.ETA_UNREACHABLE: f'eta {problem.eta:g} is out of reach: the largest found is {reached:.4g}'
        if search.is_hard
        else f'eta {reached:.4g} only: more would cost more than likelihood.shortfall, or is out of reach',
    }
    message = f'out of time, with eta {reached:.4g} reached' if is_late else messages[status]
    weights = compute_equivalent_weights(point)
    return StrategyResult(
        status,
        message,
        point.control,
        point.contacts,
        qp_solves=search.qp_solves,
        minimum=minimum,
        equivalent_weights=weights,
        is_complete=search.is_complete and not is_late,
    )


def compute_equivalent_weights(point: SurrogatePoint) -> list[tuple[float, float]]:
    """Return the (tau [m^2], lambda [1/s^6]) of each contact with which it would hold the surrogate at k.

    tau = k sqrt(Var[C]) is by how much E[C] has to be below zero; lambda = y k |d| / sqrt(Var[C]), for a multiplier y [m/s^6], is
    the cost of a variance along the normal of the contact, at its time.
    """
    lams = point.contacts.multiplier * point.k * point.distance / point.stddev
    return list(zip((point.k * point.stddev).tolist(), lams.tolist(), strict=True))


def extrapolate(before: SurrogatePoint, last: SurrogatePoint, k: float) -> tuple[Array, Contacts]:
    """Return the control and contacts for a k on the secant through two points: the predictor of a numerical continuation.

    Contacts are those of the last point, extrapolated where both points have the same ones and multipliers stay positive.
    """
    if last.k == before.k:
        return last.control, last.contacts
    share, (obstacle, time, multiplier) = (k - last.k) / (last.k - before.k), last.contacts
    control = last.control + share * (last.control - before.control)
    if not np.array_equal(obstacle, before.contacts.obstacle):
        return control, last.contacts
    times = np.clip(time + share * (time - before.contacts.time), 1.0, len(control) // 2)
    multipliers = multiplier + share * (multiplier - before.contacts.multiplier)
    return control, freeze(Contacts(obstacle, times, np.where(multipliers > 0.0, multipliers, multiplier)))


class _Search:
    """Looks for the k that is worth its effort, from the least effort up, or from an earlier solution."""

    def __init__(self, problem: Problem, deadline: Deadline) -> None:
        self.problem, self.deadline, self.qp_solves = problem, deadline, 0
        self.best: SurrogatePoint | None = None
        self.wanted = problem.wanted_k * (1.0 + CLOSE)
        self.raises, self.tries, self.is_complete = math.inf, math.inf, True
        wish = problem.preference
        self.is_hard = math.isinf(wish.shortfall)
        rate = wish.shortfall / wish.beta if wish.beta > 0.0 else math.inf
        self.rate, self.preference = rate, Preference(rate, wish.fixed_cost, wish.dt)
        self.angles = np.zeros(0)

    def run(self, start: Start) -> Status:
        """Leave the best point in `best`; return how the search ended."""
        if not self.is_hard and start.raises < math.inf:
            self.raises, self.tries = start.raises, TRIES if start.control is None or start.raises > 1 else WARM_TRIES
        if not self.follow_in_time(start):
            if start.control is not None and not start.is_unfinished:
                return Status.ITERATION_LIMIT
            return self.judge() if self.begin(start) else Status.INFEASIBLE
        assert self.best is not None
        is_known = self.is_hard and start.safety_factor < self.problem.wanted_k and not start.is_unfinished
        if self.is_cheap(self.best) and not is_known:  # that no larger k is in reach
            self.raise_k(WARM_STRIDE * (1.0 - self.slope(self.best) / self.rate))
        return self.judge()

    def judge(self) -> Status:
        """Return the status of the best point."""
        assert self.best is not None
        if self.best.k >= self.wanted:
            return Status.SOLVED
        return Status.ETA_UNREACHABLE

    def follow_in_time(self, start: Start) -> bool:
        """Follow an earlier solution, if there is one, and leave time to begin again; tell whether that worked."""
        whole, self.deadline = self.deadline, self.deadline.take_share(FOLLOW_SHARE)
        try:
            return start.control is not None and self.follow(start)
        except OutOfTimeError:
            return False
        finally:
            self.deadline = whole

    def follow(self, start: Start) -> bool:
        """Follow an earlier solution, to the k that is worth its effort now if possible; tell whether that worked."""
        assert start.control is not None
        problem = self.problem
        positions = np.concatenate((problem.initial_mean[None, :2], start.positions))
        self.angles = compute_swept_angles(positions, problem.centre_trajectories)
        contacts = start.contacts.merge(problem.first_alike)
        control = correct_to_goal(problem, start.control, start.positions, contacts.time)
        point = self.solve(control, contacts, min(start.safety_factor, self.wanted))
        point = None if point is None else self.settle_k(point)
        if point is None or not 0.0 <= point.k <= self.wanted:
            return False
        self.best = point
        return True

    def begin(self, start: Start) -> bool:
        """Find the least effort that keeps the mean out of the obstacles, and raise k; tell whether there is a path.

        Where Newton steps on the surrogate do not lead on from the least effort, as at a sharp corner, they begin at the solution
        that keeps the distance of the wanted k, or a part of it.
        """
        problem, tried = self.problem, list[SurrogatePoint]()
        follower = PathFollower(problem, LEAST_EFFORT, self.deadline, newton_only=False)
        first = follower.solve_first(start.positions, self.angles if len(self.angles) else None)
        if first is not None and not len(self.angles):
            self.angles = compute_class_angles(problem, first.solution.control)
        for at in self.approach(follower, first) if first is not None else ():
            control, contacts, minimum = at.solution
            contacts = contacts.merge(problem.first_alike) if at.has_rows else contacts
            if at is first:
                unknown = np.full(len(contacts.time), np.nan)
                self.best = SurrogatePoint(control, contacts, minimum.k, 0.0, float(control @ control), unknown, unknown)
            found = self.solve_below(control, contacts, min(max(minimum.k, 0.0), self.wanted))
            if found is not None:
                self.best = self.settle_k(found)
                is_stuck = self.raise_k(COLD_STRIDE)
                tried.append(self.best)
                if not is_stuck:
                    break
        self.qp_solves += follower.qp_solves
        self.best = max(tried, key=lambda point: point.k, default=self.best)
        return self.best is not None

    def is_cheap(self, point: SurrogatePoint) -> bool:
        """Tell whether a larger k would be worth its effort at a point."""
        return point.k < self.wanted and self.slope(point) < self.rate * (1.0 - EVEN)

    def approach(self, follower: PathFollower, first: PathPoint) -> Iterator[PathPoint]:
        """Yield points near which there may be a solution: the first, then those that keep a part of the distance.

        With noise of the variance s^2, E[C] + k sqrt(Var[C]) = 0 at the distance d = k s + sqrt(k^2 s^2 + E[R^2]), so that k
        takes the clearance term tau = d^2 - E[R^2] = 2 k s d.
        """
        yield first
        variance = float(self.problem.position_variance(first.solution.control)[:2].sum(axis=0).max())
        margin, square = self.wanted * math.sqrt(variance), float(self.problem.size[0].max(initial=0.0))
        for share in ROUNDINGS:
            point = follower.solve_beside(share * 2.0 * margin * (margin + math.sqrt(margin**2 + square)), first)
            if point is not None:
                yield point

    def settle_k(self, point: SurrogatePoint) -> SurrogatePoint:
        """Return a point with the k that is worth its effort if that is smaller, or near enough for Newton steps to it."""
        slope = self.slope(point)
        is_too_large = slope > self.rate * (1.0 + CLOSE)
        if not is_too_large and not (self.is_cheap(point) and slope > NEARLY * self.rate):
            return point
        worth = self.weigh(point.control, point.contacts, point.k)
        return point if worth is None or not (is_too_large or point.k <= worth.k <= self.wanted) else worth

    def raise_k(self, stride: float) -> bool:
        """Raise k to the wanted one, or to the one that is worth its effort; tell whether no larger k could be reached.

        stride: the first one in k.
        """
        assert self.best is not None
        low, high = self.best, math.inf  # the k of a point that costs too much
        before = low
        stride = min(self.wanted - low.k, stride)
        shortest, tries, raises = min(NARROW, stride / 4.0) / 2.0, self.tries, self.raises
        self.is_complete = raises > 0 or not self.is_cheap(low)
        while self.is_cheap(low) and stride > shortest and tries > 0 and raises > 0:
            k = min(low.k + stride, self.wanted)
            point = self.solve(*extrapolate(before, low, k), k)
            if point is None:
                stride, tries = stride / 2, tries - 1
                continue
            if self.slope(point) <= self.rate:
                before, low = low, point
                self.best = low
                stride, raises = 2 * stride, raises - 1
            else:
                high = point.k
            is_near = low.k < self.wanted and self.slope(point) > NEARLY * self.rate
            worth = self.weigh(point.control, point.contacts, point.k) if is_near else None
            if worth is not None and low.k <= worth.k <= min(high, self.wanted):
                self.best = worth
                return False
            stride = min(stride, (high - low.k) / 2)
        return self.is_cheap(low) and stride <= shortest

    def slope(self, point: SurrogatePoint) -> float:
        """Return d ln J / dk at a point."""
        wish = self.problem.preference
        return wish.dt * point.rate / max(wish.fixed_cost + wish.dt * point.effort, 1e-300)

    def solve(self, near: Array, contacts: Contacts, k: float) -> SurrogatePoint | None:
        """Find the point at a k near another one."""
        self.deadline.check()
        return solve_surrogate_point(self.problem, near, contacts, k, self.angles)

    def solve_below(self, near: Array, contacts: Contacts, k: float) -> SurrogatePoint | None:
        """Find the point near another one at the first of `SHARES` of k that Newton steps lead to."""
        for share in SHARES if k > NARROW else (1.0,):
            point = self.solve(near, contacts, share * k)
            if point is not None:
                return point
        return None

    def weigh(self, near: Array, contacts: Contacts, k: float) -> SurrogatePoint | None:
        """Find the point whose k is worth its effort near another one; None without contacts, which leave nothing to weigh."""
        self.deadline.check()
        if math.isinf(self.rate) or not len(contacts.time):
            return None
        return solve_surrogate_point(self.problem, near, contacts, k, self.angles, self.preference)
