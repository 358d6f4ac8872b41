"""What one prediction hands to the next: the ways followed, their solutions to start from, and when they were solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from .candidates import NOTHING, EarlierSolutions
from .types import NANOSECONDS, Candidate, PredictedCandidate, Prediction, Solution, Status

RETRY_AFTER = 10
"""Predictions for which a way that is out of reach, or slid into another class, is only followed."""


@dataclass(frozen=True)
class Memory:
    """What is remembered, by label.

    most_likely: label; candidates: the ways followed; earlier: their solutions and likelihoods; solved_ns: when each was last
    solved; followed: for how many predictions in a row each has been followed without being solved.
    """

    most_likely: str | None = None
    candidates: tuple[Candidate, ...] = ()
    earlier: EarlierSolutions = NOTHING
    solved_ns: Mapping[str, int] = field(default_factory=dict)
    followed: Mapping[str, int] = field(default_factory=dict)

    def known(self, candidates: Sequence[Candidate]) -> EarlierSolutions:
        """Return what is known of ways by their labels, or by the names that they had before.

        A name changes, and those of all ways at once, where an obstacle is passed or comes into reach. A way that passes
        all obstacles that both names hold on the same sides starts from where the other was, the likeliest of several.
        """
        if all(candidate.label in self.earlier.solutions for candidate in candidates):
            return self.earlier
        solutions, likelihoods = dict(self.earlier.solutions), dict(self.earlier.likelihoods)
        before = [one for one in self.candidates if one.label in solutions]
        before.sort(key=lambda one: (-likelihoods.get(one.label, 0.0), one.label))
        for candidate in candidates:
            if candidate.label not in solutions:
                same = next((one for one in before if _renamed(one, candidate)), None)
                if same is not None:
                    solutions[candidate.label] = solutions[same.label]
                    likelihoods[candidate.label] = likelihoods.get(same.label, 0.0)
        return EarlierSolutions(solutions, likelihoods)

    def after(self, prediction: Prediction, candidates: tuple[Candidate, ...], tried: Sequence[PredictedCandidate]) -> Memory:
        """Keep what the next prediction can start from.

        A way that had no time keeps what it had, or begins where it was stopped. One that is out of reach, or slid into another
        class, is followed there, which costs little, and begun anew from its own guess after RETRY predictions.
        """
        last = self.earlier.solutions
        solutions: dict[str, Solution] = {}
        followed: dict[str, int] = {}
        for outcome in tried:
            label, status = outcome.candidate.label, outcome.solution.status
            if status is Status.DEADLINE and label in last:
                solutions[label] = last[label]
            elif status is Status.SOLVED or _stopped(outcome.solution):
                solutions[label] = outcome.solution
            elif status in (Status.ETA_UNREACHABLE, Status.LEFT_CLASS) and self.followed.get(label, 0) < RETRY_AFTER:
                solutions[label], followed[label] = outcome.solution, self.followed.get(label, 0) + 1
        likelihoods = {outcome.candidate.label: outcome.likelihood for outcome in prediction.candidates}
        solved = {one.label: self.solved_ns[one.label] for one in candidates if one.label in self.solved_ns}
        for outcome in prediction.solved_candidates:
            solved[outcome.candidate.label] = prediction.stamp_ns
        return Memory(prediction.most_likely, candidates, EarlierSolutions(solutions, likelihoods), solved, followed)

    def aged(self, outcome: PredictedCandidate, stamp_ns: int) -> PredictedCandidate:
        """Say of a way that had no time when it was last solved: how likely it is, nobody knows."""
        if outcome.solution.status is not Status.DEADLINE:
            return outcome
        solved_ns = self.solved_ns.get(outcome.candidate.label)
        age = 'never solved yet' if solved_ns is None else f'last solved {(stamp_ns - solved_ns) / NANOSECONDS:.3g} s ago'
        return replace(outcome, solution=replace(outcome.solution, message=f'{outcome.solution.message}; {age}'))


def _renamed(before: Candidate, now: Candidate) -> bool:
    """Tell whether the name of one way to a goal is the other's with obstacles left out."""
    one, other = set(before.sides), set(now.sides)
    return before.goal == now.goal and (one <= other or other <= one)


def _stopped(solution: Solution) -> bool:
    """Tell whether a solution ran out of time on its way, on the curve, and not before."""
    return solution.status is Status.DEADLINE and solution.lam > 0.0
