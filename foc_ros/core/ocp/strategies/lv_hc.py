"""Strategies `lv` and `hc`: the smallest s on a penalty path that meets the surrogate, or one before it where that is too dear.

tau = delta s, lambda = lambda0 growth^s: a small delta slows the hand down (low velocity, `lv`), a large one leads it past at a
distance (high clearance, `hc`). The paper steps along the path in whole s (algorithm 1); here s is continuous, so that the effort
is a continuous function of eta, as ratios of costs need.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from foc_ros.core.classes import compute_swept_angles
from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.ocp.minimum_safety_factor import find_minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.warm_start import Start, correct_to_goal
from foc_ros.core.types import Status

from . import StrategyResult, find_best_effort, give_up_out_of_time
from .least_loss import compute_loss, find_least_loss
from .penalty_path import STRIDE, PathFollower, PathPoint, PenaltyPath

WARM_STRIDE = 0.5
"""The longest first stride from the s of a warm start."""
SHORTEST_STRIDE = 2.0**-10
"""The stride from a warm start at which an end that is infeasible counts as reached."""
USUAL_SLOPE = 0.3
"""Usual gain of k per unit of s: the first stride from a warm start without a slope of its own assumes it."""
SMALLEST_STRIDE = 1e-6
"""The shortest stride that the slope of k may ask for."""
PATIENCE = 2
"""Consecutive strides from a warm start, no shorter than `WARM_STRIDE`, without a larger k, after which the search is given up: k
may fall for a while. A search from the beginning of the path goes to its end, past every dip."""
CLOSE = 1e-5
"""Relative excess of k over the wanted one at which the root is found."""
CELL = 1.0
"""Bracket in s down to which it is bisected: k(s) may fall for a while where its minimum is at the goal, and cross k twice."""
NARROW = 1e-4
"""Bracket in s at which the search for the root ends: k jumps there, because the mean passes into another minimum."""
MAX_TRIALS = 60


def solve_lv(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> StrategyResult:
    """Solve a problem by slowing down."""
    return follow_path(problem, start, PenaltyPath(settings.lv_delta, settings.growth, settings.lam), deadline)


def solve_hc(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> StrategyResult:
    """Solve a problem by keeping a distance."""
    return follow_path(problem, start, PenaltyPath(settings.hc_delta, settings.growth, settings.lam), deadline)


def follow_path(problem: Problem, start: Start, path: PenaltyPath, deadline: Deadline = NEVER) -> StrategyResult:
    """Find the smallest s whose solution meets the surrogate, or the s with the least loss where that is smaller.

    A warm start follows the earlier solution: it searches around the s of that, and from the beginning of the path where there is
    nothing. It uses Newton steps alone, and ends where they fail.
    """
    follower = PathFollower(problem, path, deadline, newton_only=start.lam is not None and problem.preference.is_hard)
    try:
        result = _search(follower, start)
    except OutOfTimeError as error:
        best = follower.best
        result = give_up_out_of_time(problem, error)
        if best is not None:
            result = _result(
                follower, Status.DEADLINE, f'out of time, with eta {problem.risk.find_probability(best.k):.4g} found', best
            )
    if result.minimum is None:
        result = replace(result, minimum=find_minimum_safety_factor(problem, result.control, between_steps=True))
    return result


def _result(follower: PathFollower, status: Status, message: str, point: PathPoint, slope: float = 0.0) -> StrategyResult:
    """Return the result that ends at a point."""
    control, contacts, minimum = point.solution
    weights = follower.weights_at(point.s)
    return StrategyResult(
        status, message, control, contacts, *weights, follower.qp_solves, safety_factor_slope=slope, minimum=minimum
    )


def _search(follower: PathFollower, start: Start) -> StrategyResult:
    problem, wanted = follower.problem, follower.problem.wanted_k
    stride, patience = STRIDE, math.inf
    if start.control is None or start.lam is None:
        first = follower.solve_first(start.positions)
    else:
        positions = np.concatenate((problem.initial_mean[None, :2], start.positions))
        angles = compute_swept_angles(positions, problem.centre_trajectories)
        contacts = start.contacts.merge(problem.first_alike)
        control = correct_to_goal(problem, start.control, start.positions, contacts.time)
        first = follower.solve_by_newton(follower.path.s_of(start.lam), control, contacts, angles)
        if first is None:
            first = follower.solve_first(start.positions, angles)
        else:
            stride, patience = _stride_to(first, wanted, start.safety_factor_slope or USUAL_SLOPE, WARM_STRIDE), PATIENCE
    if first is None:
        return find_best_effort(problem, start, *follower.weights_at(0.0), follower.qp_solves, follower.deadline)
    low, high = _bracket(follower, first, wanted, stride, patience)
    point, slope = high, start.safety_factor_slope
    if high is not None and low is not high:
        point, slope = _find_root(follower, low, high, wanted, is_warm=start.lam is not None)
    if not problem.preference.is_hard:
        least = find_least_loss(follower, point)
        if least.k < wanted:
            kept = problem.risk.find_probability(least.k)
            message = f'eta {problem.eta:g} is out of reach or not worth its effort: {kept:.4g} is kept, at s = {least.s:.3g}'
            return _result(follower, Status.ETA_UNREACHABLE, message, least)
        point = least
    if point is None:
        largest = problem.risk.find_probability(low.k)
        message = f'eta {problem.eta:g} is out of reach: the largest on the path is {largest:.4g}, at s = {low.s:.3g}'
        return _result(follower, Status.ETA_UNREACHABLE, message, low)
    if not follower.is_verified(point):
        return _result(follower, Status.ITERATION_LIMIT, 'the QP linearised at the solution has another one', point)
    return _result(follower, Status.SOLVED, 'solved', point, slope)


def _bracket(
    follower: PathFollower, first: PathPoint, wanted: float, stride: float, patience: float
) -> tuple[PathPoint, PathPoint | None]:
    """Return the last point below the wanted k and the first at or above it, or any point and one after it that is close enough.

    Both are the same where the first is close enough, or where the beginning of the path meets the wanted k. Where that is out of
    reach, the best point is returned, and None; also as soon as the effort, which does not fall along the path, alone is a larger
    loss than that of a point before.
    """
    if _is_close(first, wanted):
        return first, first
    if first.k >= wanted:
        high = first
        for point in _follow(follower, first, wanted, -stride):
            if _is_close(point, wanted):
                return high, point
            if point.k < wanted:
                return point, high
            high = point
        return high, high
    low, best, since, least = first, first, 0, compute_loss(follower, first)
    for point in _follow(follower, first, wanted, stride):
        if point.k >= wanted:
            return low, point
        since = 0 if point.k > best.k else since + (point.s - low.s >= WARM_STRIDE)
        low = point
        best = max(best, point, key=lambda p: p.k)
        least = min(least, compute_loss(follower, point))
        if since == patience or follower.problem.preference.compute_effort_loss(point.effort) >= least:
            break
    return best, None


def _follow(follower: PathFollower, first: PathPoint, wanted: float, stride: float) -> Iterator[PathPoint]:
    """Yield points further and further along the path, or back for a negative stride; near an infeasible end by quarter strides.

    From a warm start the strides follow the slope of k. From a cold one they do not depend on the wanted k, so that more eta is
    never cheaper.
    """
    is_warm = abs(stride) < STRIDE
    point, end = first, follower.end if stride > 0 else 0.0
    shortest = (SHORTEST_STRIDE if is_warm else WARM_STRIDE) / 2
    while point.s != end:
        s = min(point.s + stride, end) if stride > 0 else max(point.s + stride, end)
        further = follower.solve_beside(s, point)
        if further is None:
            stride /= 4
            end = point.s + 3 * stride
            if abs(stride) < shortest:
                return
            continue
        stride = _next_stride(point, further, wanted, stride) if is_warm else math.copysign(min(4 * abs(stride), STRIDE), stride)
        point = further
        yield point


def _next_stride(before: PathPoint, point: PathPoint, wanted: float, stride: float) -> float:
    """Return the stride to where k, extrapolated, is the wanted one; the same direction, at most four times the last stride."""
    largest = min(4 * abs(stride), STRIDE)
    slope = (point.k - before.k) / (point.s - before.s)
    return math.copysign(_stride_to(point, wanted, slope, largest) if slope > 0 else largest, stride)


def _stride_to(point: PathPoint, wanted: float, slope: float, most: float) -> float:
    """Return the stride from a point to the middle of what counts as close, if k grows with a slope; at most so much."""
    return min(max(abs(_aim(wanted) - point.k) / slope, SMALLEST_STRIDE), most)


def _aim(wanted: float) -> float:
    return wanted * (1 + CLOSE / 2)


def _is_close(point: PathPoint, wanted: float) -> bool:
    return wanted <= point.k <= wanted * (1 + CLOSE)


def _find_root(
    follower: PathFollower, low: PathPoint, high: PathPoint, wanted: float, *, is_warm: bool
) -> tuple[PathPoint, float]:
    """Find k(s) = wanted between a point below and one at or above by the Illinois method; return one at or above, and dk/ds.

    Points are solved from the one below, to find those of several solutions at the same s that come first as s grows, and a wide
    bracket is bisected first, at points that do not depend on the wanted k. A search from a warm start does neither: it solves
    from the nearer end. The aim is the middle of what counts as close. After three steps on the same side the bracket is
    bisected, which leads to the jump where k jumps.
    """
    while high.s - low.s > CELL and not is_warm:
        middle = follower.solve_beside((low.s + high.s) / 2, low)
        if middle is None:
            break
        low, high = (low, middle) if middle.k >= wanted else (middle, high)
    aim = _aim(wanted)
    below, above, side = low.k - aim, high.k - aim, 0
    for _ in range(MAX_TRIALS):
        if high.k <= wanted * (1 + CLOSE) or high.s - low.s < NARROW:
            break
        s = (low.s + high.s) / 2 if abs(side) > 2 else (low.s * above - high.s * below) / (above - below)
        point = follower.solve_beside(s, high if is_warm and high.s - s < s - low.s else low)
        if point is None:
            break
        if point.k >= wanted:
            high, above, side = point, max(point.k - aim, 1e-300), side + 1 if side > 0 else 1
            below = below / 2 if side > 1 else below
        else:
            low, below, side = point, point.k - aim, side - 1 if side < 0 else -1
            above = above / 2 if side < -1 else above
    return high, max((high.k - low.k) / (high.s - low.s), 0.0)
