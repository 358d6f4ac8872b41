"""Continuity of predictions: a class keeps its answer for a short time, its share changes gradually, and names do not matter.

A class that had no time, failed, or is not followed any more keeps its last answer for at most H = `likelihood.hold_s`. An answer
of age a is what remains of it: a movement of duration T over [a, T], resampled at N steps of (T - a) / N, with the cost of that
rest. Likelihoods p_i by cost are smoothed by a filter of the time constant S = `likelihood.smoothing_s` over the time h between
the stamps of two predictions, and the weight of a kept answer fades in the second half of its time:

    l_i = w(a_i) f_i / sum_j w(a_j) f_j,  w(a) = min(1, 2 (1 - a / H)),
    f_i = (1 - g) b_i + g p_i,            g = 1 - exp(-h / S),

where a = 0 for a fresh answer, and b_i is the l_i of the prediction before: 0 for a new class, which so fades in. Both p and b
sum to one, and so does f.

A class is the same one under another name if one of the names is the other with obstacles left out. Of several such classes, the
one with the largest p takes over its share, and the others fade in. The share of a class that has disappeared is divided among
all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.types import NANOSECONDS, Array, Candidate, PredictedCandidate, Prediction, Record, Solution, as_readonly

from .class_numbers import is_renamed

MOVED = 0.01
"""A goal that moves by more than this between two predictions is another goal [m]."""


@dataclass(frozen=True)
class Answer:
    """A published answer of a class, and the stamp at which it was solved."""

    predicted: PredictedCandidate
    stamp_ns: int


@dataclass(frozen=True, eq=False)
class Past(Record):
    """What continuity needs of the last prediction.

    stamp_ns: its stamp, None if there was none; goals (g, 2) [m]; durations_s: times to go by goal; candidates: the classes with
    a likelihood; likelihoods: of these, by label; answers: the last one of each class, by label.
    """

    stamp_ns: int | None = None
    goals: Array = field(default_factory=lambda: np.zeros((0, 2)))
    durations_s: Mapping[int, float] = field(default_factory=dict)
    candidates: Sequence[Candidate] = ()
    likelihoods: Mapping[str, float] = field(default_factory=dict)
    answers: Mapping[str, Answer] = field(default_factory=dict)

    def measure_time(self, stamp_ns: int) -> float:
        """Return the time since the last prediction [s], infinite if there was none or it is later."""
        if self.stamp_ns is None or stamp_ns < self.stamp_ns:
            return math.inf
        return (stamp_ns - self.stamp_ns) / NANOSECONDS

    def follow(self, prediction: Prediction, durations_s: Sequence[float], hold_s: float) -> Past:
        """Return what the next prediction needs of this one."""
        stamp_ns, taking_part = prediction.stamp_ns, prediction.candidates_with_likelihood
        answers = {name: each for name, each in self.answers.items() if 0 <= stamp_ns - each.stamp_ns < hold_s * NANOSECONDS}
        answers |= {each.label: Answer(each, stamp_ns) for each in taking_part if not each.age_s}
        likelihoods = {each.label: each.likelihood for each in taking_part}
        candidates = [each.candidate for each in taking_part]
        return Past(stamp_ns, prediction.goals, dict(enumerate(durations_s)), tuple(candidates), likelihoods, answers)

    def find_renamed(self, label: str | None, now: Mapping[Candidate, float]) -> str | None:
        """Return the present label of a class of the last prediction; now: the classes with their likelihoods."""
        before = next((each for each in self.candidates if each.label == label), None)
        return label if before is None else find_successor(before, now)

    def find_same(self, candidate: PredictedCandidate) -> Answer | None:
        """Return the last answer of the class of a candidate, also under another name, if its path passes all obstacles alike."""
        same = [
            each
            for each in self.answers.values()
            if is_renamed(each.predicted.candidate, candidate.candidate)
            and all(candidate.sides.get(name, side) == side for name, side in each.predicted.sides.items())
        ]
        return max(
            same,
            key=lambda each: (each.stamp_ns, each.predicted.label == candidate.label, each.predicted.likelihood),
            default=None,
        )

    def keep_goals(self, goals: Array) -> Past:
        """Return what belongs to those of the goals (g, 2) [m] that are where they were."""
        count = min(len(goals), len(self.goals))
        same = set(np.flatnonzero(np.hypot(*(goals[:count] - self.goals[:count]).T) <= MOVED).tolist())
        return replace(
            self,
            durations_s={goal: each for goal, each in self.durations_s.items() if goal in same},
            candidates=[each for each in self.candidates if each.goal in same],
            answers={label: each for label, each in self.answers.items() if each.predicted.candidate.goal in same},
        )


NO_PAST = Past()


def find_successor(before: Candidate, now: Mapping[Candidate, float]) -> str | None:
    """Return the label of what a class has become, of several the one with the largest p_i; None if it is not there any more."""
    if any(each.label == before.label for each in now):
        return before.label
    renamed = [(share, each.label) for each, share in now.items() if is_renamed(before, each)]
    return max(renamed)[1] if renamed else None


def keep_answers(
    candidates: Sequence[Candidate],
    solved: Sequence[PredictedCandidate],
    past: Past,
    stamp_ns: int,
    hold_s: float,
) -> list[PredictedCandidate]:
    """Return the solved candidates, with kept answers for those without a likelihood and for classes that are not followed.

    candidates: the classes followed; solved: those of them for which there was time. A class without an answer that is young
    enough stays as it is, or is left out if there was no time for it.
    """
    results = {each.label: each for each in solved}
    usable = [each for each in past.answers.values() if 0 < stamp_ns - each.stamp_ns < hold_s * NANOSECONDS]
    usable.sort(key=lambda each: (-each.predicted.likelihood, each.predicted.label))
    kept: list[PredictedCandidate] = []
    for candidate in candidates:
        result = results.get(candidate.label)
        if result is None or not result.has_likelihood:
            answer = past.answers.get(candidate.label)
            if answer not in usable:
                answer = next((each for each in usable if is_renamed(each.predicted.candidate, candidate)), None)
            reason = 'out of time' if result is None else result.solution.message
            held = None if answer is None else hold_answer(answer, candidate, stamp_ns, reason)
            result = held or result
        if result is not None:
            kept.append(result)
    for answer in usable:
        candidate = answer.predicted.candidate
        if not any(each.label == candidate.label or is_renamed(candidate, each) for each in candidates):
            held = hold_answer(answer, candidate, stamp_ns, 'the class is not followed any more')
            kept += [held] if held is not None else []
    return kept


def hold_answer(answer: Answer, candidate: Candidate, stamp_ns: int, reason: str) -> PredictedCandidate | None:
    """Return what remains of an answer, under the name of a candidate; None if nothing remains."""
    age_s, solution = (stamp_ns - answer.stamp_ns) / NANOSECONDS, answer.predicted.solution
    left_s = float(solution.times[-1]) - age_s
    if left_s <= solution.dt:
        return None
    rest = _shift(solution, age_s, left_s, f'{reason}; the answer is from {age_s:.3g} s ago')
    sides = answer.predicted.sides
    return PredictedCandidate(candidate, rest, sides, rest.expected_effort * rest.dt, answer.predicted.likelihood, age_s)


def interpolate_rest(states: Array, begin: float) -> Array:
    """Return states (N + 1, ...), such as means or covariances, from the step `begin` on, at N steps."""
    steps = len(states) - 1
    at = np.linspace(begin, steps, steps + 1)
    row = np.minimum(at.astype(np.intp), steps - 1)
    share = (at - row).reshape(-1, *(1,) * (states.ndim - 1))
    rest: Array = (1.0 - share) * states[row] + share * states[row + 1]
    return rest


def _shift(solution: Solution, age_s: float, left_s: float, message: str) -> Solution:
    """Return the rest of a solution from an age [s] on, at as many steps."""
    steps = len(solution.control)
    begin, motor = age_s / solution.dt, solution.motor_covariance
    mean, covariance = (as_readonly(interpolate_rest(each, begin)) for each in (solution.mean, solution.covariance))
    if motor is not None:
        motor = as_readonly(interpolate_rest(motor, begin))
    during = (begin + (steps - begin) * (np.arange(steps) + 0.5) / steps).astype(np.intp)
    control = as_readonly(solution.control[np.minimum(during, steps - 1)])
    rest = replace(solution, mean=mean, covariance=covariance, motor_covariance=motor, control=control, message=message)
    return replace(rest, effort=float((control**2).sum()), dt=left_s / steps)


def smooth_paths(
    candidates: Sequence[PredictedCandidate], past: Past, stamp_ns: int, smoothing_s: float
) -> list[PredictedCandidate]:
    """Return the candidates with mean paths that change gradually: those of fresh answers, by the filter of the likelihoods."""
    gain = -math.expm1(-past.measure_time(stamp_ns) / smoothing_s) if smoothing_s else 1.0
    smoothed = []
    for each in candidates:
        answer = past.find_same(each) if gain < 1.0 and each.has_likelihood and not each.age_s else None
        smoothed.append(each if answer is None else _smooth_path(each, answer, stamp_ns, gain))
    return smoothed


def _smooth_path(candidate: PredictedCandidate, answer: Answer, stamp_ns: int, gain: float) -> PredictedCandidate:
    """Return a candidate whose mean is led from that of an earlier answer towards its own, by a gain, from where the hand is now.

    x = x_new + (1 - gain) (x_old - x_new - e phi), where phi falls from one to zero as a minimum-jerk movement does, with its
    derivatives, and e is the difference of the positions now.
    """
    solution, age_s = candidate.solution, (stamp_ns - answer.stamp_ns) / NANOSECONDS
    left_s = float(answer.predicted.solution.times[-1]) - age_s
    if left_s <= solution.dt:
        return candidate
    earlier, total_s = answer.predicted.solution, float(solution.times[-1])
    before = interpolate_rest(earlier.mean, age_s / earlier.dt)
    difference = before - solution.mean
    now, fall = difference[0, :2].copy(), _fall_as_minimum_jerk(len(solution.control))
    for state in range(difference.shape[1] // 2):
        difference[:, 2 * state : 2 * state + 2] -= fall[state] * (now / total_s**state)
    return replace(candidate, solution=replace(solution, mean=as_readonly(solution.mean + (1.0 - gain) * difference)))


@cache
def _fall_as_minimum_jerk(steps: int) -> Array:
    """Return phi = 1 - s^3 (10 - 15 s + 6 s^2) and its first two derivatives at s = 0..1 in steps, (3, steps + 1, 1)."""
    s = np.linspace(0.0, 1.0, steps + 1)[:, None]
    slope, bend = -30.0 * s**2 * (1.0 - s) ** 2, -60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return np.stack((1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2), slope, bend))


def make_continuous(
    candidates: Sequence[PredictedCandidate], past: Past, stamp_ns: int, config: LikelihoodConfig
) -> list[PredictedCandidate]:
    """Return candidates with likelihoods l_i from those with p_i, ranked; those without likelihood come last, as they were."""
    taking_part = [each for each in candidates if each.has_likelihood]
    before = carry_over(past.candidates, past.likelihoods, {each.candidate: each.likelihood for each in taking_part})
    elapsed_s = past.measure_time(stamp_ns)
    gain = 1.0 if not before or not config.smoothing_s else -math.expm1(-elapsed_s / config.smoothing_s)
    filtered = [(1.0 - gain) * before.get(each.label, 0.0) + gain * each.likelihood for each in taking_part]
    weights = [
        share * min(1.0, 2.0 * (1.0 - each.age_s / config.hold_s)) if each.age_s else share
        for each, share in zip(taking_part, filtered, strict=True)
    ]
    total = sum(weights) or 1.0
    ranked = [replace(each, likelihood=weight / total) for each, weight in zip(taking_part, weights, strict=True)]
    ranked.sort(key=lambda each: (-each.likelihood, each.label))
    return ranked + [each for each in candidates if not each.has_likelihood]


def carry_over(before: Sequence[Candidate], shares: Mapping[str, float], now: Mapping[Candidate, float]) -> dict[str, float]:
    """Return by label what the classes of now had before, which sums to one; empty if no class of before is there any more.

    shares: of the classes of before, by label; now: the classes with their p_i.
    """
    carried: dict[str, float] = {}
    for each in before:
        label = find_successor(each, now)
        if label is not None:
            carried[label] = carried.get(label, 0.0) + shares[each.label]
    total = sum(carried.values())
    return {label: share / total for label, share in carried.items()} if total > 0.0 else {}
