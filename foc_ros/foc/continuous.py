"""Strategies `lv` and `hc`: the smallest s on a curve of clearance and precision that meets the surrogate.

tau = delta s, lambda = lambda0 growth^s. The paper steps along this curve in whole s (algorithm 1); here s is continuous, so the
effort is a continuous function of eta, which cost ratios need. A small delta slows down (`lv`), a large one goes wide (`hc`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from .assess import Assessment, assess
from .chance import eta_of_k, k_of_eta
from .problem import Problem
from .records import Array, Status
from .sequential import Converged, converge
from .solver import WorkingSet

STRIDE = 4.0
"""First look along the curve, in s: lambda grows by 16 from one to the next."""
LARGEST_LAMBDA = 1e12
"""Where the walk ends: the variance weight is then all that counts, and k has stopped growing."""
CLOSE = 1e-7
"""Relative excess of k over the wanted one at which the root is found."""
MAX_TRIALS = 60


@dataclass(frozen=True)
class Curve:
    """tau = delta s [m^2], lambda = first_lambda growth^s."""

    delta: float
    growth: float
    first_lambda: float

    def at(self, s: float) -> tuple[float, float]:
        """Return (tau, lambda) at s >= 0."""
        return self.delta * s, self.first_lambda * self.growth**s

    @property
    def end(self) -> float:
        """The largest s worth trying."""
        return max(STRIDE, math.log(LARGEST_LAMBDA / max(self.first_lambda, 1.0)) / math.log(self.growth))


@dataclass(frozen=True, eq=False)
class Point:
    """One converged solution on the curve."""

    s: float
    converged: Converged
    assessment: Assessment

    @property
    def k(self) -> float:
        """The k that holds at every obstacle and step."""
        return self.assessment.smallest_k


@dataclass(frozen=True, eq=False)
class Walk:
    """How a walk ended: status, words, the point it ended at (None: no feasible point at all), QPs solved."""

    status: Status
    message: str
    point: Point | None
    qp_solves: int


class _Walker:
    """Evaluates points, each from a neighbour's solution, and counts."""

    def __init__(self, problem: Problem, curve: Curve) -> None:
        self.problem, self.curve, self.qp_solves = problem, curve, 0

    def point(self, s: float, guess: Array, working: WorkingSet) -> Point | None:
        converged = converge(self.problem, guess, working, *self.curve.at(s))
        if converged is None:
            return None
        self.qp_solves += converged.qp_solves
        return Point(s, converged, assess(self.problem, converged.control))

    def beside(self, s: float, neighbour: Point) -> Point | None:
        return self.point(s, neighbour.converged.positions, neighbour.converged.solution.active)


def walk(problem: Problem, guess: Array, curve: Curve) -> Walk:
    """Find the smallest s whose converged solution meets the surrogate. guess: positions at steps 1..N, (N, 2) [m]."""
    walker, wanted = _Walker(problem, curve), k_of_eta(problem.eta)
    first = walker.point(0.0, guess, WorkingSet())
    if first is None:
        return Walk(Status.INFEASIBLE, 'no control meets every linearised obstacle row', None, walker.qp_solves)
    low, high, best = first, None, first
    for point in _strides(walker, first) if first.k < wanted else [first]:
        best = max(best, point, key=lambda p: p.k)
        if point.k >= wanted:
            high = point
            break
        low = point
    if high is None:
        message = f'eta {problem.eta:g} is out of reach: the largest on the curve is {eta_of_k(best.k):.4g}, at s = {best.s:.3g}'
        return Walk(Status.ETA_UNREACHABLE, message, best, walker.qp_solves)
    point = high if high is first else _root(walker, low, high, wanted)
    if not point.converged.stays:
        return Walk(Status.ITERATION_LIMIT, 'the linearisation had not settled when its QPs ran out', point, walker.qp_solves)
    return Walk(Status.SOLVED, 'solved', point, walker.qp_solves)


def _strides(walker: _Walker, first: Point) -> Iterator[Point]:
    """Yield points further and further along the curve; towards an infeasible end in halved strides."""
    point, stride = first, STRIDE
    while stride > STRIDE / 16 and point.s < walker.curve.end:
        further = walker.beside(min(point.s + stride, walker.curve.end), point)
        if further is None:
            stride /= 2
        else:
            point = further
            yield point


def _root(walker: _Walker, low: Point, high: Point, wanted: float) -> Point:
    """Illinois iteration on k(s) = wanted between a point below and one at or above; returns one at or above."""
    below, above = low.k - wanted, high.k - wanted
    side = 0
    for _ in range(MAX_TRIALS):
        if high.k <= wanted * (1 + CLOSE) or high.s - low.s < 1e-10:
            break
        s = (low.s * above - high.s * below) / (above - below)
        nearest = low if s - low.s < high.s - s else high
        point = walker.beside(s, nearest)
        if point is None:
            break
        if point.k >= wanted:
            high, above = point, max(point.k - wanted, 1e-300)
            below = below / 2 if side > 0 else below
            side = 1
        else:
            low, below = point, point.k - wanted
            above = above / 2 if side < 0 else above
            side = -1
    return high
