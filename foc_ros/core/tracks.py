# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The homotopy classes that are followed: one track for each, and one matching of tracks and candidates per prediction.

A class goes on under another name if the name of one of the two is that of the other with obstacles left out: obstacles come into
reach and are passed. Of several tracks, a candidate continues the one with its own name, or else the one with which it shares
most sides, that was seen last, and is the most likely. No two candidates continue one track.

From its track a class has its number, the solution from which the next one starts, and its likelihood before. A class that could
not be solved, or that the search has missed, keeps the rest of its last solution for at most `HOLD_S`: of an age a, a movement of
duration T over [a, T], resampled at N steps of (T - a) / N, that begins where the hand is now and has the cost of that rest.

The rate at which a likelihood changes is bounded, and so is that of the shares that no candidate has. With p_i of this
prediction, l_i before (0 for a new class), and the time h between both,

    l_i <- ((1 - g) l_i + g p_i) / sum,   g = min(1, h / (`FULL_CHANGE_S` max_i |p_i - l_i|)).

Small changes are not delayed. With a new goal, and where no class goes on, all likelihoods are those of this prediction, because
what nothing was known of is not unlikely. The likelihood of a class that no candidate continues counts as unknown in l_i.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .interpolation import interpolate_linear
from .plant.response import fall_as_minimum_jerk
from .prediction import PredictedCandidate
from .solution import Candidate, Solution, agrees, label_class
from .types import NANOSECONDS, Array, Record, Unassigned, as_readonly

HOLD_S = 0.2
"""Longest time for which a class that is not solved keeps its last answer, and one that is not seen its number [s]: ten
predictions at 50 Hz, within which a solver or a search that missed a class finds it again."""
FULL_CHANGE_S = 0.15
"""Shortest time in which a likelihood changes by one [s]: less than people take to react to what they see."""
LEAD = 0.15
"""Lead in likelihood that another class needs to become the most likely one: equal ones do not swap by noise."""
MOVED_M = 0.01
"""A goal that moves by more than this between two predictions is another goal [m]."""


@dataclass(frozen=True, eq=False)
class Track(Record):
    """A homotopy class that is followed.

    number: stays for as long as the class is followed; candidate: as it was last, at the stamp seen_ns; likelihood: its last one;
    solution: the last one, found at solved_ns, None if there is none, and the sides on which it passes obstacles, by id;
    has_failed: whether the last prediction could not solve the class.
    """

    number: int
    candidate: Candidate
    seen_ns: int
    likelihood: float = 0.0
    solution: Solution | None = None
    solved_ns: int = 0
    sides: dict[str, int] = field(default_factory=dict)
    has_failed: bool = False

    def in_row(self, row: int) -> Track:
        """Return the track of the same class, whose goal has a row now."""
        if row == self.candidate.goal:
            return self
        label = label_class(row, self.candidate.sides)
        return replace(self, candidate=replace(self.candidate, goal=row, label=label))


@dataclass(frozen=True, eq=False)
class Tracks(Record):
    """What one prediction passes to the next.

    followed: the tracks of its candidates; absent: those that the search no longer finds, for `HOLD_S`; stamp_ns: of the
    prediction, None if there was none; goals (g, 2) [m]; durations_s: time to go to each goal [s];
    unassigned: what no candidate had; most_likely: number of the most likely class; next_number: of the next new class;
    next_goal: row of the goal at which the search begins.
    """

    followed: tuple[Track, ...] = ()
    absent: tuple[Track, ...] = ()
    stamp_ns: int | None = None
    goals: Array = field(default_factory=lambda: np.zeros((0, 2)))
    durations_s: dict[int, float] = field(default_factory=dict)
    unassigned: Unassigned = field(default_factory=Unassigned)
    most_likely: int | None = None
    next_number: int = 0
    next_goal: int = 0

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The candidates of the last prediction."""
        return tuple(each.candidate for each in self.followed)

    def forget(self) -> Tracks:
        """Return what a new movement begins with: nothing, but no number is given twice."""
        return Tracks(next_number=self.next_number)

    def keep_goals(self, goals: Array) -> Tracks:
        """Return what belongs to those of the goals (g, 2) [m] that are where they were, in their rows now."""
        distances = np.hypot(*(goals[:, None] - self.goals).transpose(2, 0, 1))
        near = np.argwhere(distances <= MOVED_M).tolist()
        pairs = [(now != before, distances[now, before], before, now) for now, before in near]
        rows: dict[int, int] = {}
        for *_, before, now in sorted(pairs):  # one that is in its row stays there; of others the nearest
            if before not in rows and now not in rows.values():
                rows[before] = now
        durations_s = {rows[goal]: each for goal, each in self.durations_s.items() if goal in rows}
        followed, absent = (
            tuple(each.in_row(rows[each.candidate.goal]) for each in part if each.candidate.goal in rows)
            for part in (self.followed, self.absent)
        )
        next_goal = rows.get(self.next_goal, 0)
        return replace(self, followed=followed, absent=absent, durations_s=durations_s, next_goal=next_goal)

    def without_solutions(self) -> Tracks:
        """Return the same classes without their solutions, which other parameters would not give."""
        followed, absent = (tuple(replace(each, solution=None) for each in part) for part in (self.followed, self.absent))
        return replace(self, followed=followed, absent=absent)

    def measure_time(self, stamp_ns: int) -> float:
        """Return the time since the last prediction [s], infinite if there was none or it is later."""
        if self.stamp_ns is None or stamp_ns < self.stamp_ns:
            return math.inf
        return (stamp_ns - self.stamp_ns) / NANOSECONDS

    def match(self, candidates: Sequence[Candidate], stamp_ns: int) -> list[Track]:
        """Return the track of each candidate, a new one where it continues none; those not seen for `HOLD_S` are forgotten."""
        alive = self._find_recent(stamp_ns)
        pairs = [
            (each.candidate.label != candidate.label, -shared, -each.seen_ns, -each.likelihood, row, each)
            for row, candidate in enumerate(candidates)
            for each in alive
            if (shared := count_shared(each.candidate, candidate)) is not None
        ]
        found, taken = dict[int, Track](), set[int]()
        for *_, row, each in sorted(pairs, key=lambda pair: pair[:5]):
            if row not in found and each.number not in taken:
                found[row] = each
                taken.add(each.number)
        numbers = iter(range(self.next_number, self.next_number + len(candidates)))
        return [found.get(row) or Track(next(numbers), each, stamp_ns) for row, each in enumerate(candidates)]

    def find_absent(self, candidates: Sequence[Candidate], matched: Sequence[Track], stamp_ns: int) -> tuple[Track, ...]:
        """Return the tracks that were seen in the last `HOLD_S` and are no candidates now, under any name."""
        numbers = {each.number for each in matched}
        return tuple(
            each
            for each in self._find_recent(stamp_ns)
            if each.number not in numbers and all(count_shared(each.candidate, other) is None for other in candidates)
        )

    def limit_changes(
        self, predicted: Sequence[PredictedCandidate], unassigned: Unassigned, stamp_ns: int, absent: Sequence[Track] = ()
    ) -> tuple[list[PredictedCandidate], Unassigned]:
        """Return candidates with likelihoods p_i with the likelihoods l_i, ranked, and what no candidate has likewise.

        absent: the tracks that are no candidates any more. Their likelihoods do not rise, because their paths do not follow the
        hand.
        """
        taking_part = [each for each in predicted if each.has_likelihood]
        before, lost = self._hand_down(taking_part)
        goals = {each.candidate.goal for each in (*self.followed, *self.absent)}
        unknown, other = self.unassigned
        old = np.array([*(before.get(each.way, 0.0) for each in taking_part), unknown + lost, other])
        found, numbers = np.array([*(each.likelihood for each in taking_part), *unassigned]), {each.number for each in absent}
        is_absent = np.array([*(each.way in numbers for each in taking_part), False, False])
        change = _limit_gains(found, old, is_absent) - old
        largest, allowed = float(abs(change).max()), self.measure_time(stamp_ns) / FULL_CHANGE_S
        is_new = all(each.way not in before for each in taking_part) or any(
            each.candidate.goal not in goals for each in taking_part
        )
        gain = 1.0 if is_new or largest <= allowed else allowed / largest
        *weights, unknown, other = (old + gain * change).tolist()
        factor = 1.0 / (sum(weights) + unknown + other)
        ranked = [replace(each, likelihood=factor * weight) for each, weight in zip(taking_part, weights, strict=True)]
        ranked.sort(key=lambda each: (-each.likelihood, each.label))
        return ranked + [each for each in predicted if not each.has_likelihood], Unassigned(factor * unknown, factor * other)

    def _hand_down(self, taking_part: Sequence[PredictedCandidate]) -> tuple[dict[int, float], float]:
        """Return the last likelihood of each track, by its number, and the sum of those that no candidate continues.

        Two classes become one when the obstacle that told them apart is no longer between their paths. Their likelihoods are
        then added.
        """
        known, lost = (*self.followed, *self.absent), 0.0
        before, present = {each.number: each.likelihood for each in known}, {each.way for each in taking_part}
        for track in known:
            if track.number in present:
                continue
            heirs = [each for each in taking_part if _inherits(each, track.candidate)]
            if heirs:
                heir = max(heirs, key=lambda each: each.likelihood).way
                before[heir] = before.get(heir, 0.0) + track.likelihood
            else:
                lost += track.likelihood
        return before, lost

    def choose_most_likely(self, predicted: Sequence[PredictedCandidate]) -> PredictedCandidate | None:
        """Return the most likely of ranked candidates; the one of before stays until another leads by more than `LEAD`."""
        taking_part = [each for each in predicted if each.has_likelihood]
        if not taking_part:
            return None
        best = taking_part[0]
        kept = next((each for each in taking_part if each.way == self.most_likely), best)
        return kept if best.likelihood - kept.likelihood <= LEAD else best

    def follow(
        self,
        predicted: Sequence[PredictedCandidate],
        matched: Sequence[Track],
        solved: Sequence[PredictedCandidate],
        absent: Sequence[Track],
        stamp_ns: int,
    ) -> tuple[tuple[Track, ...], tuple[Track, ...]]:
        """Return the tracks of the candidates after a prediction, with new solutions where there are, and the absent ones.

        predicted: as published; matched: the track of each candidate; solved: all candidates with what the solver has found;
        absent: the tracks that are no candidates.
        """
        likelihoods = {each.way: each.likelihood for each in predicted}
        present = []
        for track, found in zip(matched, solved, strict=True):
            is_new = found.has_likelihood
            newest = (found.solution, stamp_ns, found.sides) if is_new else (track.solution, track.solved_ns, track.sides)
            share = likelihoods.get(track.number, 0.0)
            present.append(Track(track.number, found.candidate, stamp_ns, share, *newest, not is_new))
        return tuple(present), tuple(replace(each, likelihood=likelihoods.get(each.number, 0.0)) for each in absent)

    def _find_recent(self, stamp_ns: int) -> list[Track]:
        """Return the tracks that were seen in the last `HOLD_S` before a stamp [ns]."""
        return [each for each in (*self.followed, *self.absent) if 0 <= stamp_ns - each.seen_ns <= HOLD_S * NANOSECONDS]


NO_TRACKS = Tracks()


def count_shared(before: Candidate, now: Candidate) -> int | None:
    """Return how many sides two candidates share, None if they are different classes: neither name contains the other."""
    if before.goal != now.goal or not agrees(frozenset(before.sides), frozenset(now.sides)):
        return None
    return min(len(before.sides), len(now.sides))


def _limit_gains(shares: Array, old: Array, limited: NDArray[np.bool_]) -> Array:
    """Return shares (s,) that sum to one. The limited ones are not larger than the old ones, unless there are no others."""
    others = float(shares[~limited].sum())
    if not others:
        return shares
    kept = np.minimum(shares, old)
    return np.where(limited, kept, shares * (1.0 - float(kept[limited].sum())) / others)


def _inherits(candidate: PredictedCandidate, before: Candidate) -> bool:
    """Tell whether a candidate is a class that was followed before, under any name, or its path is in that class.

    A path that passes none of the obstacles in the name of a class says nothing of it.
    """
    if count_shared(before, candidate.candidate) is not None:
        return True
    is_to_goal, is_known = candidate.candidate.goal == before.goal, any(name in candidate.sides for name, _ in before.sides)
    return is_to_goal and is_known and before.contains(candidate.sides)


def take_remainder(solution: Solution, age_s: float, position: Array, reason: str) -> Solution | None:
    """Return the rest of a solution from an age [s] on, at as many steps, that begins at a position (2,) [m].

    None if no more than a step remains. reason: why it is used, in words. The distance of the hand from the solution now falls to
    zero at its end as a minimum-jerk movement does, with its derivatives.
    """
    steps, left_s = len(solution.control), float(solution.times[-1]) - age_s
    if left_s <= solution.dt:
        return None
    begin = age_s / solution.dt
    at = np.linspace(begin, steps, steps + 1)
    mean, covariance = interpolate_linear(solution.mean, at), _interpolate_matrices(solution.covariance, at)
    aside, fall = position - mean[0, :2], fall_as_minimum_jerk(np.linspace(0.0, 1.0, steps + 1)[:, None])
    for order in range(mean.shape[1] // 2):
        mean[:, 2 * order : 2 * order + 2] += fall[order] * (aside / left_s**order)
    during = (begin + (steps - begin) * (np.arange(steps) + 0.5) / steps).astype(np.intp)
    control = as_readonly(solution.control[np.minimum(during, steps - 1)])
    motor = None if solution.motor_covariance is None else _interpolate_matrices(solution.motor_covariance, at)
    message, effort = f'{reason}; the answer is from {age_s:.3g} s ago', float((control**2).sum())
    return replace(
        solution,
        mean=as_readonly(mean),
        covariance=covariance,
        motor_covariance=motor,
        control=control,
        effort=effort,
        dt=left_s / steps,
        message=message,
    )


def _interpolate_matrices(covariance: Array, at: Array) -> Array:
    """Return covariances (m, n, n) at times (m,) [steps], from those at steps 0..N, (N + 1, n, n)."""
    found = interpolate_linear(covariance.reshape(len(covariance), -1), at)
    return as_readonly(found.reshape(-1, *covariance.shape[1:]))
