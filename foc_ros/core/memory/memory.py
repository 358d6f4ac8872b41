"""The memory of the predictor: followed candidates, their solutions to start from, and whose turn it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from foc_ros.core.candidates import NO_TURN, NOTHING, EarlierSolutions
from foc_ros.core.learning.choices import Choice
from foc_ros.core.types import Candidate, PredictedCandidate, Solution, Status

from .class_numbers import NO_NUMBERS, ClassNumbers, is_renamed
from .continuity import NO_PAST, Past

RETRY_AFTER = 10
"""Predictions after which a candidate that is unreachable, or left its class, is solved again from its own guess."""


LATE_AFTER = 2
"""Turns for which the time was too short, after which a candidate is solved from its own guess: its solution leads nowhere."""


@dataclass(frozen=True)
class Memory:
    """What one prediction passes to the next, by label.

    most_likely: label; candidates: the homotopy classes followed; earlier: their solutions, likelihoods and turns; followed: for
    how many predictions in a row each has been followed without being solved; past: what continuity needs; next_goal: row of the
    goal at which the search begins; numbers: of the classes; choice: the last one, from which preferences are learnt.
    """

    most_likely: str | None = None
    candidates: tuple[Candidate, ...] = ()
    earlier: EarlierSolutions = NOTHING
    followed: Mapping[str, int] = field(default_factory=dict)
    past: Past = NO_PAST
    next_goal: int = 0
    numbers: ClassNumbers = NO_NUMBERS
    choice: Choice | None = None

    def forget(self) -> Memory:
        """Return the memory with which a new movement begins: empty, but no number of a class is given again."""
        return Memory(numbers=self.numbers.forget())

    def find_earlier(self, candidates: Sequence[Candidate]) -> EarlierSolutions:
        """Return the earlier results of candidates under their present labels, also if their labels have changed.

        The labels of all candidates change at once when an obstacle is passed or comes into reach. A candidate without results
        takes over those of an earlier one that passes all obstacles of both labels on the same sides, of the most likely if
        there are several.
        """
        if all(candidate.label in self.earlier.solutions for candidate in candidates):
            return self.earlier
        solutions, likelihoods, turns = (dict(each) for each in vars(self.earlier).values())
        before = [each for each in self.candidates if each.label in solutions]
        before.sort(key=lambda each: (-likelihoods.get(each.label, 0.0), each.label))
        for candidate in candidates:
            if candidate.label not in solutions:
                same = next((each for each in before if is_renamed(each, candidate)), None)
                if same is not None:
                    solutions[candidate.label] = solutions[same.label]
                    likelihoods[candidate.label] = likelihoods.get(same.label, 0.0)
                    turns[candidate.label] = turns.get(same.label, NO_TURN)
        return EarlierSolutions(solutions, likelihoods, turns)

    def remember(
        self,
        candidates: Sequence[Candidate],
        solved: Sequence[PredictedCandidate],
        earlier: EarlierSolutions,
        likelihoods: Mapping[str, float],
        stamp_ns: int,
    ) -> tuple[EarlierSolutions, dict[str, int]]:
        """Return what is earlier to the next prediction, and for how long candidates have been followed without being solved.

        solved: the candidates for which there was time; earlier: what `find_earlier` returned. A candidate that was not solved in
        time keeps its earlier solution, or the one at which it was stopped. One that is unreachable, or left its class, is only
        followed there, which is cheap, and solved from its own guess again after `RETRY_AFTER` predictions.
        """
        results = {each.label: each for each in solved}
        solutions: dict[str, Solution] = {}
        followed: dict[str, int] = {}
        for label in [each.label for each in candidates]:
            result, last = results.get(label), earlier.solutions.get(label)
            is_stopped = result is not None and _was_stopped(result.solution)
            if result is None or (result.status is Status.DEADLINE and not (is_stopped and _is_unfinished(last))):
                turns_late = self.followed.get(label, 0) + (result is not None)
                if last is not None and (result is None or turns_late < LATE_AFTER):
                    solutions[label], followed[label] = last, turns_late
            elif result.has_likelihood or is_stopped:
                solutions[label] = result.solution
            elif result.status in (Status.ETA_UNREACHABLE, Status.LEFT_CLASS) and self.followed.get(label, 0) < RETRY_AFTER:
                solutions[label], followed[label] = result.solution, self.followed.get(label, 0) + 1
        turns = {each.label: earlier.turns.get(each.label, NO_TURN) for each in candidates}
        for label, result in results.items():
            turns[label] = stamp_ns, stamp_ns if result.solution.is_complete else turns[label][1]
        return EarlierSolutions(solutions, likelihoods, turns), followed


def _was_stopped(solution: Solution) -> bool:
    """Return whether the deadline stopped a solution that the next prediction can continue from."""
    return solution.status is Status.DEADLINE and (solution.lam > 0.0 or bool(solution.multipliers))


def _is_unfinished(solution: Solution | None) -> bool:
    """Return whether there is no earlier solution, or one that the deadline stopped as well."""
    return solution is None or solution.status is Status.DEADLINE
