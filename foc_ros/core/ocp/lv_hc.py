# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Strategies `lv` and `hc`: the best point of a curve of tau and lambda.

    tau = delta s,  lambda = lambda0 growth^s

A small delta slows the hand down (low velocity, `lv`), a large one leads it past at a distance (high clearance, `hc`). The paper
steps along the curve in whole s (algorithm 1); here s is continuous, so that the effort is a continuous function of eta, as
ratios of costs need. The smallest s at which the wanted safety factor holds is chosen, or one with a smaller loss before it.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.solution import Status
from foc_ros.core.types import Array

from .margin import Margins
from .minima import find_least_factors
from .point import Point, solve_at
from .problem import Problem
from .start import Start
from .strategies import INFEASIBLE, StrategyResult, collect

STRIDE, LONGEST = 4.0, 60.0
"""First stride along the curve of `lv` and `hc`, and its end: with a growth of 2, lambda has grown by 1e18 there."""
LARGEST_SHARE = 1e6
"""Weight of the variances relative to the effort at which the curve ends: k has stopped growing."""
NARROW = 1e-5
"""Interval in s at which the search ends, and relative difference of k from the wanted one."""
FLAT = 2e-3
"""Interval in s at which the search for the least loss ends: the loss differs by its square."""
PROBE = 1e-2
"""Distance in s from the root at which the loss tells whether it is less before it."""
GOLDEN = 0.381966
FURTHER_LOSS = 1e-3
"""How much a loss may rise before the curve is not followed any further."""
MOST_TRIALS = 60


@dataclass(frozen=True)
class Curve:
    """tau = delta s [m^2], lambda = first_lambda growth^s [1/s^6]."""

    delta: float
    growth: float
    first_lambda: float

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return tau and lambda (b,) at s >= 0 (b,)."""
        return self.delta * s, self.first_lambda * self.growth**s

    def find_s(self, lam: float) -> float:
        """Return the s of a lambda on the curve."""
        if not lam > self.first_lambda > 0.0:
            return 0.0
        return math.log(lam / self.first_lambda) / math.log(self.growth)

    def find_end(self, problem: Problem) -> float:
        """Return the s at which nothing but the variances counts, or `LONGEST`."""
        weight = self.first_lambda * float(problem.summed_variance.max())
        return min(LONGEST, max(0.0, math.log(LARGEST_SHARE / weight) / math.log(self.growth))) if weight > 0.0 else LONGEST


@dataclass(frozen=True, eq=False)
class Sample:
    """One point of a curve: s, the safety factor k, the loss, and the result; is_path: whether the mean keeps its clearance."""

    s: float
    k: float
    loss: float
    result: StrategyResult
    is_path: bool


Choice: TypeAlias = Generator[float, Sample, Sample | None]


def choose_sample(wanted_k: float, is_hard: bool, first_s: float, end: float) -> Choice:
    """Look for the point of a curve with the least loss: yield an s, receive its sample, and return the best one.

    k grows along the curve, but for dips, and so does the effort. The loss therefore falls as long as k is cheap, and rises after
    the s at which the wanted k holds. Where it holds nowhere and is a condition, the sample with the largest k is returned, and
    None where there is no path at all.
    """
    before = yield first_s
    if not before.is_path and first_s > 0.0:
        before = yield 0.0
    if not before.is_path:
        return None
    samples, stride = [before], STRIDE if first_s == 0.0 else STRIDE / 8
    while before.k >= wanted_k and before.s > 0.0:
        before = yield max(before.s - stride, 0.0)
        samples, stride = [before, *samples], 2.0 * stride
    after = samples[-1]
    while after.k < wanted_k and after.s < end and (is_hard or _may_improve(after, samples)):
        after = yield min(after.s + stride, end)
        if not after.is_path:
            after, stride = samples[-1], stride / 4.0
            if stride < NARROW:
                break
            continue
        samples, stride = [*samples, after], 2.0 * stride
    low = max((each for each in samples if each.k < wanted_k), key=lambda each: each.s, default=None)
    high = min((each for each in samples if each.k >= wanted_k), key=lambda each: each.s, default=None)
    if low is not None and high is not None:
        high = yield from _find_root(wanted_k, low, high)
    samples = [each for each in samples if high is None or each.s < high.s] + ([high] if high is not None else [])
    if is_hard:
        return high or max(samples, key=lambda each: each.k)
    if high is not None and high.s > PROBE:
        beside = yield high.s - PROBE
        if min(each.loss for each in [*samples, beside]) >= high.loss:
            return high
        samples = [*(each for each in samples[:-1] if each.s < beside.s), beside, high]
    return (yield from _find_least(samples))


def _may_improve(after: Sample, samples: list[Sample]) -> bool:
    """Return whether the effort alone is not yet a larger loss than the least so far; samples: in the order of s."""
    return after.loss <= min(each.loss for each in samples) + FURTHER_LOSS


def _find_root(wanted_k: float, low: Sample, high: Sample) -> Generator[float, Sample, Sample]:
    """Return the sample with the smallest s, between two, at which the wanted k holds: regula falsi and bisections in turn."""
    for trial in range(MOST_TRIALS):
        if high.s - low.s < NARROW or high.k < wanted_k * (1.0 + NARROW):
            break
        share = (wanted_k * (1.0 + 0.5 * NARROW) - low.k) / (high.k - low.k)
        if trial % 3 == 2:
            share = 0.5
        new = yield low.s + min(max(share, 1e-3), 1.0 - 1e-3) * (high.s - low.s)
        low, high = (low, new) if new.k >= wanted_k else (new, high)
    return high


def _find_least(samples: list[Sample]) -> Generator[float, Sample, Sample]:
    """Return the sample with the least loss, sought by golden sections beside the lowest of some samples in the order of s."""
    middle = min(range(len(samples)), key=lambda i: samples[i].loss)
    best, low, high = samples[middle], samples[max(middle - 1, 0)].s, samples[min(middle + 1, len(samples) - 1)].s
    while high - low > FLAT:
        left = best.s - low > high - best.s
        new = yield best.s + GOLDEN * ((low if left else high) - best.s)
        if new.loss < best.loss and new.is_path:
            low, high, best = (low, best.s, new) if left else (best.s, high, new)
        else:
            low, high = (new.s, high) if left else (low, new.s)
    return best


def follow_curve(
    problems: Sequence[Problem], starts: Sequence[Start], curve: Curve, deadline: Deadline = NEVER
) -> list[StrategyResult]:
    """Find the best point of a curve for each problem; all problems are solved together, each at the s that it asks for.

    A warm start begins at the s of the earlier solution.
    """
    s = np.array([0.0 if each.lam is None else curve.find_s(each.lam) for each in starts])
    ends = [curve.find_end(each) for each in problems]
    s = np.minimum(s, ends)
    choices = [
        choose_sample(problem.wanted_k, problem.preference.is_hard, first, end)
        for problem, first, end in zip(problems, s.tolist(), ends, strict=True)
    ]
    for choice in choices:
        next(choice)
    chance = Margins(problems, np.zeros(len(problems)), is_chance=True)
    results: dict[int, StrategyResult] = {}
    best: dict[int, Sample] = {}
    point: Point | None = None
    solves = np.zeros(len(problems), dtype=np.intp)
    while len(results) < len(problems):
        point = solve_at(problems, starts, curve.at(s), is_chance=False, deadline=deadline, before=point)
        solves += point.now.iterations
        k, *_ = find_least_factors(chance, point.now.control)
        touching = point.is_touching()
        is_late = not deadline.allows()
        for row, problem in enumerate(problems):
            if row in results:
                continue
            sample = _sample(point, row, float(s[row]), float(k[row]), bool(touching[row]), curve)
            if is_late and not point.now.is_done[row]:
                results[row] = _stop(problem, best.get(row, sample), int(solves[row]))
                continue
            if sample.is_path and (row not in best or sample.loss < best[row].loss):
                best[row] = sample
            try:
                s[row] = choices[row].send(sample)
            except StopIteration as end:
                results[row] = _finish_choice(problem, end.value, sample, int(solves[row]))
                continue
            if is_late:
                results[row] = _stop(problem, best.get(row, sample), int(solves[row]))
    return [results[row] for row in range(len(problems))]


def _stop(problem: Problem, sample: Sample, solves: int) -> StrategyResult:
    """Return the result of a search that the deadline has stopped."""
    reached = problem.risk.find_probability(sample.k)
    message = f'out of time: eta {reached:.4g} so far, and the likelihood is estimated'
    return replace(sample.result, status=Status.DEADLINE, message=message, qp_solves=solves, aims_at_eta=False)


def _sample(point: Point, row: int, s: float, k: float, is_touching: bool, curve: Curve) -> Sample:
    """Return the sample of a problem at a point of the curve."""
    tau, lam = curve.at(np.array(s))
    result = collect(point, row, Status.SOLVED, 'solved', tau=float(tau), lam=float(lam))
    problem = point.solver.margins.problems[row]
    loss = problem.preference.compute_loss(float(result.control @ result.control), min(k, problem.wanted_k), problem.wanted_k)
    return Sample(s, k, loss, result, not is_touching)


def _finish_choice(problem: Problem, chosen: Sample | None, last: Sample, solves: int) -> StrategyResult:
    """Return the result of a search that has ended."""
    if chosen is None:
        return replace(last.result, status=Status.INFEASIBLE, message=INFEASIBLE, qp_solves=solves)
    if problem.is_reached(chosen.k):
        return replace(chosen.result, qp_solves=solves)
    reached = problem.risk.find_probability(chosen.k)
    cause = 'out of reach' if problem.preference.is_hard else 'out of reach or not worth its effort'
    message = f'eta {problem.eta:g} is {cause}: {reached:.4g} is kept, at s = {chosen.s:.3g}'
    return replace(chosen.result, status=Status.ETA_UNREACHABLE, message=message, qp_solves=solves)


def solve_lv(
    problems: Sequence[Problem], starts: Sequence[Start], settings: FocConfig, deadline: Deadline = NEVER
) -> list[StrategyResult]:
    """Solve by slowing down."""
    return follow_curve(problems, starts, Curve(settings.lv_delta, settings.growth, settings.lam), deadline)


def solve_hc(
    problems: Sequence[Problem], starts: Sequence[Start], settings: FocConfig, deadline: Deadline = NEVER
) -> list[StrategyResult]:
    """Solve by keeping a distance."""
    return follow_curve(problems, starts, Curve(settings.hc_delta, settings.growth, settings.lam), deadline)
