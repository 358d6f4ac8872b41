"""The memory of the predictor: followed candidates, their solutions to start from, and when they were last solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from .candidates import NOTHING, EarlierSolutions
from .types import NANOSECONDS, Candidate, PredictedCandidate, Prediction, Solution, Status

RETRY_AFTER = 10
"""Predictions after which a candidate that is unreachable, or left its class, is solved again from its own guess."""


@dataclass(frozen=True)
class Memory:
    """What one prediction passes to the next, by label.

    most_likely: label; candidates: the homotopy classes followed; earlier: their solutions and likelihoods; solved_ns: stamp at
    which each was last solved; followed: for how many predictions in a row each has been followed without being solved.
    """

    most_likely: str | None = None
    candidates: tuple[Candidate, ...] = ()
    earlier: EarlierSolutions = NOTHING
    solved_ns: Mapping[str, int] = field(default_factory=dict)
    followed: Mapping[str, int] = field(default_factory=dict)

    def find_earlier(self, candidates: Sequence[Candidate]) -> EarlierSolutions:
        """Return the earlier results of candidates under their present labels, also if their labels have changed.

        The labels of all candidates change at once when an obstacle is passed or comes into reach. A candidate without results
        takes over those of an earlier one that passes all obstacles of both labels on the same sides, of the most likely if
        there are several.
        """
        if all(candidate.label in self.earlier.solutions for candidate in candidates):
            return self.earlier
        solutions, likelihoods = dict(self.earlier.solutions), dict(self.earlier.likelihoods)
        before = [each for each in self.candidates if each.label in solutions]
        before.sort(key=lambda each: (-likelihoods.get(each.label, 0.0), each.label))
        for candidate in candidates:
            if candidate.label not in solutions:
                same = next((each for each in before if _is_renamed(each, candidate)), None)
                if same is not None:
                    solutions[candidate.label] = solutions[same.label]
                    likelihoods[candidate.label] = likelihoods.get(same.label, 0.0)
        return EarlierSolutions(solutions, likelihoods)

    def after(self, prediction: Prediction, candidates: tuple[Candidate, ...], solved: Sequence[PredictedCandidate]) -> Memory:
        """Return the memory after a prediction.

        A candidate that was not solved in time keeps its earlier solution, or the one at which it was stopped. One that is
        unreachable, or left its class, is only followed there, which is cheap, and solved from its own guess again after
        `RETRY_AFTER` predictions.
        """
        last = self.earlier.solutions
        solutions: dict[str, Solution] = {}
        followed: dict[str, int] = {}
        for each in solved:
            label, status = each.label, each.status
            if status is Status.DEADLINE and label in last:
                solutions[label] = last[label]
            elif status is Status.SOLVED or _was_stopped(each.solution):
                solutions[label] = each.solution
            elif status in (Status.ETA_UNREACHABLE, Status.LEFT_CLASS) and self.followed.get(label, 0) < RETRY_AFTER:
                solutions[label], followed[label] = each.solution, self.followed.get(label, 0) + 1
        likelihoods = {each.label: each.likelihood for each in prediction.candidates}
        solved_ns = {each.label: self.solved_ns[each.label] for each in candidates if each.label in self.solved_ns}
        solved_ns |= {each.label: prediction.stamp_ns for each in prediction.solved_candidates}
        return Memory(prediction.most_likely, candidates, EarlierSolutions(solutions, likelihoods), solved_ns, followed)

    def add_age(self, candidate: PredictedCandidate, stamp_ns: int) -> PredictedCandidate:
        """Add to the message of a candidate that was not solved in time when it was last solved."""
        if candidate.status is not Status.DEADLINE:
            return candidate
        solved_ns = self.solved_ns.get(candidate.label)
        age = 'never solved yet' if solved_ns is None else f'last solved {(stamp_ns - solved_ns) / NANOSECONDS:.3g} s ago'
        return replace(candidate, solution=replace(candidate.solution, message=f'{candidate.solution.message}; {age}'))


def _is_renamed(before: Candidate, now: Candidate) -> bool:
    """Return whether the label of one class to a goal is that of the other with obstacles left out."""
    one, other = set(before.sides), set(now.sides)
    return before.goal == now.goal and (one <= other or other <= one)


def _was_stopped(solution: Solution) -> bool:
    """Return whether the deadline stopped a solution on the penalty path, not before it."""
    return solution.status is Status.DEADLINE and solution.lam > 0.0
