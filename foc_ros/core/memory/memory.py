"""The memory of the predictor: followed candidates, and their solutions to start from."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from foc_ros.core.types import Candidate, Solution

from .class_numbers import NO_NUMBERS, ClassNumbers, is_renamed
from .continuity import NO_PAST, Past


@dataclass(frozen=True)
class Memory:
    """What one prediction passes to the next, by label.

    most_likely: label; candidates: the homotopy classes followed; solutions: of those with a likelihood; past: what continuity
    needs; next_goal: row of the goal at which the search begins; numbers: of the classes.
    """

    most_likely: str | None = None
    candidates: tuple[Candidate, ...] = ()
    solutions: Mapping[str, Solution] = field(default_factory=dict)
    past: Past = NO_PAST
    next_goal: int = 0
    numbers: ClassNumbers = NO_NUMBERS

    def forget(self) -> Memory:
        """Return the memory with which a new movement begins: empty, but no number of a class is given again."""
        return Memory(numbers=self.numbers.forget())

    def find_earlier(self, candidates: Sequence[Candidate], goals: Collection[int]) -> Mapping[str, Solution]:
        """Return the earlier solutions of candidates under their present labels, also if their labels have changed.

        Only those to some of the goals, by row: the goals that are where they were.

        The labels of all candidates change at once when an obstacle is passed or comes into reach. A candidate without a solution
        takes over that of an earlier one that passes all obstacles of both labels on the same sides, of the most likely if there
        are several.
        """
        before = [each for each in self.candidates if each.label in self.solutions and each.goal in goals]
        solutions = {each.label: self.solutions[each.label] for each in before}
        before.sort(key=lambda each: (-self.past.likelihoods.get(each.label, 0.0), each.label))
        for candidate in candidates:
            if candidate.label not in solutions:
                same = next((each for each in before if is_renamed(each, candidate)), None)
                if same is not None:
                    solutions[candidate.label] = solutions[same.label]
        return solutions
