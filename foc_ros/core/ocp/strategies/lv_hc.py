"""Strategies `lv` and `hc`: the smallest s on a curve of clearance and precision that meets the surrogate.

tau = delta s, lambda = lambda0 growth^s: a small delta slows down (`lv`), a large one goes wide (`hc`). The paper steps along it
in whole s (algorithm 1); here s is continuous, so that the effort follows eta as cost ratios need.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.homotopy import compute_swept_angles
from foc_ros.core.obstacles.chance_constraint import eta_of_k, k_of_eta
from foc_ros.core.ocp.contacts.checks import merge_contacts
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.warm_start import Start, correct_to_goal
from foc_ros.core.types import Status

from .penalty_path import STRIDE, PathFollower, PathPoint, PenaltyPath

WARM_STRIDE = 0.5
"""The longest first look around the s of a warm start."""
SHORTEST = 2.0**-10
"""The stride of a look around at which an end that is infeasible counts as reached."""
USUAL_SLOPE = 0.3
"""What k usually gains per unit of s: a first look goes as far as this says where an earlier solution does not know better."""
TINY = 1e-6
"""The shortest stride of a look around, which goes to where the slope of k leads."""
PATIENCE = 2
"""Strides in a row, no shorter than `WARM_STRIDE`, without a larger k after which a look around gives up: k may fall for a
while. A walk from the beginning of the curve goes to its end, over every dip."""
CLOSE = 1e-5
"""Relative excess of k over the wanted one at which the root is found."""
CELL = 1.0
"""Bracket in s down to which it is halved: k(s) may fall for a while where it is least at the goal, and cross a value twice."""
NARROW = 1e-4
"""Bracket in s at which the root is as good as found: k jumps there, because the mean slips into another minimum."""
MAX_TRIALS = 60


@dataclass(frozen=True, eq=False)
class PathResult:
    """How a walk ended: status, words, the point it ended at (None: no feasible point at all), QPs solved, dk/ds there or 0."""

    status: Status
    message: str
    point: PathPoint | None
    qp_solves: int
    slope: float = 0.0


def follow_path(problem: Problem, start: Start, curve: PenaltyPath, deadline: Deadline = NEVER) -> PathResult:
    """Find the smallest s whose converged solution meets the surrogate.

    A warm start follows what was found before: it looks around the s it had, and where there is nothing, from the beginning of
    the curve on. It goes by Newton steps alone, and ends where they do.
    """
    walker = PathFollower(problem, curve, deadline, follows=start.lam is not None)
    try:
        return _walk(walker, start)
    except OutOfTimeError:
        reached = 'nothing' if walker.best is None else f'eta {eta_of_k(walker.best.k):.4g}'
        return PathResult(Status.DEADLINE, f'out of time, with {reached} found', walker.best, walker.qp_solves)


def _walk(walker: PathFollower, start: Start) -> PathResult:
    problem, curve, wanted = walker.problem, walker.curve, k_of_eta(walker.problem.eta)
    stride, patience = STRIDE, math.inf
    if start.control is None or start.lam is None:
        first = walker.beginning(start.positions)
    else:
        way = compute_swept_angles(np.concatenate((problem.initial_mean[None, :2], start.positions)), problem.courses)
        control = correct_to_goal(problem, start.control, start.positions)
        first = walker.followed(curve.s_of(start.lam), control, merge_contacts(problem, start.contacts), way)
        if first is None:
            first = walker.beginning(start.positions, way)
        else:
            stride, patience = _ahead(first, wanted, start.slope or USUAL_SLOPE, WARM_STRIDE), PATIENCE
    if first is None:
        return PathResult(Status.INFEASIBLE, 'no way between the obstacles keeps clear of them', None, walker.qp_solves)
    low, high = _bracket(walker, first, wanted, stride, patience)
    if high is None:
        message = f'eta {problem.eta:g} is out of reach: the largest on the curve is {eta_of_k(low.k):.4g}, at s = {low.s:.3g}'
        return PathResult(Status.ETA_UNREACHABLE, message, low, walker.qp_solves)
    point, slope = (high, start.slope) if low is high else _root(walker, low, high, wanted, guided=start.lam is not None)
    if not walker.verified(point):
        return PathResult(Status.ITERATION_LIMIT, 'the QP linearised at the solution has another one', point, walker.qp_solves)
    return PathResult(Status.SOLVED, 'solved', point, walker.qp_solves, slope)


def _bracket(
    walker: PathFollower, first: PathPoint, wanted: float, stride: float, patience: float
) -> tuple[PathPoint, PathPoint | None]:
    """Return the last point below the wanted k and the first at or above it; or else any point, and one after it that is close.

    Both the same where the first is close enough, or the curve's beginning is enough; no upper one where the wanted k is out of
    reach: then the best point.
    """
    if _is_close(first, wanted):
        return first, first
    if first.k >= wanted:
        high = first
        for point in _strides(walker, first, wanted, -stride):
            if _is_close(point, wanted):
                return high, point
            if point.k < wanted:
                return point, high
            high = point
        return high, high
    low, best, since = first, first, 0
    for point in _strides(walker, first, wanted, stride):
        if point.k >= wanted:
            return low, point
        since = 0 if point.k > best.k else since + (point.s - low.s >= WARM_STRIDE)
        low = point
        best = max(best, point, key=lambda p: p.k)
        if since == patience:
            break
    return best, None


def _strides(walker: PathFollower, first: PathPoint, wanted: float, stride: float) -> Iterator[PathPoint]:
    """Yield points further and further along the curve, or back for a negative stride; towards an infeasible end in quarters.

    Warm ones go by the slope of k. Cold ones go the same way whatever k is wanted, so that more eta never comes out cheaper.
    """
    guided = abs(stride) < STRIDE
    point, end = first, walker.end if stride > 0 else 0.0
    shortest = (SHORTEST if guided else WARM_STRIDE) / 2
    while point.s != end:
        s = min(point.s + stride, end) if stride > 0 else max(point.s + stride, end)
        further = walker.beside(s, point)
        if further is None:
            stride /= 4
            end = point.s + 3 * stride
            if abs(stride) < shortest:
                return
            continue
        stride = _next_stride(point, further, wanted, stride) if guided else math.copysign(min(4 * abs(stride), STRIDE), stride)
        point = further
        yield point


def _next_stride(before: PathPoint, point: PathPoint, wanted: float, stride: float) -> float:
    """Go to where k would be the wanted one if it went on as it does, on the same way; at most four times the last stride."""
    largest = min(4 * abs(stride), STRIDE)
    slope = (point.k - before.k) / (point.s - before.s)
    return math.copysign(_ahead(point, wanted, slope, largest) if slope > 0 else largest, stride)


def _ahead(point: PathPoint, wanted: float, slope: float, most: float) -> float:
    """Return how far from a point k is the wanted one if it grows with a slope, in the middle of what counts as close."""
    return min(max(abs(_aim(wanted) - point.k) / slope, TINY), most)


def _aim(wanted: float) -> float:
    return wanted * (1 + CLOSE / 2)


def _is_close(point: PathPoint, wanted: float) -> bool:
    return wanted <= point.k <= wanted * (1 + CLOSE)


def _root(walker: PathFollower, low: PathPoint, high: PathPoint, wanted: float, *, guided: bool) -> tuple[PathPoint, float]:
    """Find k(s) = wanted between a point below and one at or above, by Illinois steps; returns one at or above, and dk/ds.

    Comes from below only: of several solutions at the same s, those that are met first as s grows. A wide bracket is halved
    first, at points that do not depend on the wanted k. A guided search spares both: it comes from the nearer end. Aims at the
    middle of what counts as close, and halves the bracket where three steps in a row came out on the same side: where k jumps,
    that is the way to the jump.
    """
    while high.s - low.s > CELL and not guided:
        middle = walker.beside((low.s + high.s) / 2, low)
        if middle is None:
            break
        low, high = (low, middle) if middle.k >= wanted else (middle, high)
    aim = _aim(wanted)
    below, above, side = low.k - aim, high.k - aim, 0
    for _ in range(MAX_TRIALS):
        if high.k <= wanted * (1 + CLOSE) or high.s - low.s < NARROW:
            break
        s = (low.s + high.s) / 2 if abs(side) > 2 else (low.s * above - high.s * below) / (above - below)
        point = walker.beside(s, high if guided and high.s - s < s - low.s else low)
        if point is None:
            break
        if point.k >= wanted:
            high, above, side = point, max(point.k - aim, 1e-300), side + 1 if side > 0 else 1
            below = below / 2 if side > 1 else below
        else:
            low, below, side = point, point.k - aim, side - 1 if side < 0 else -1
            above = above / 2 if side < -1 else above
    return high, max((high.k - low.k) / (high.s - low.s), 0.0)
