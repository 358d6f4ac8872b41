"""Numbers of homotopy classes that stay the same for as long as a class is followed, whatever its label and its rank are."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from foc_ros.core.types import NANOSECONDS, Candidate, PredictedCandidate


@dataclass(frozen=True)
class FollowedClass:
    """A class that is followed: its number, the candidate that it was last, and the stamp of that [ns]."""

    number: int
    candidate: Candidate
    stamp_ns: int


@dataclass(frozen=True)
class ClassNumbers:
    """The classes that are followed, and the next number; no number is given twice."""

    followed: tuple[FollowedClass, ...] = ()
    next_number: int = 0

    def number(
        self, candidates: Sequence[PredictedCandidate], stamp_ns: int, hold_s: float
    ) -> tuple[tuple[PredictedCandidate, ...], ClassNumbers]:
        """Return the candidates with their numbers, and those for the next prediction.

        A candidate continues the class of its label, or else one under another name (`is_renamed`): the one with which it shares
        most sides, and of several that has been seen last. Two candidates do not continue the same class. A class that is not
        among the candidates is remembered for `hold_s` [s].
        """
        free = [known for known in self.followed if 0 <= stamp_ns - known.stamp_ns <= hold_s * NANOSECONDS]
        pairs = [
            (known.candidate.label == each.label, _count_shared(known.candidate, each.candidate), known.stamp_ns, -place, known)
            for place, each in enumerate(candidates)
            for known in free
            if is_renamed(known.candidate, each.candidate)
        ]
        found: dict[int, FollowedClass] = {}
        for *_, place, known in sorted(pairs, key=lambda pair: pair[:4], reverse=True):
            if -place not in found and known not in found.values():
                found[-place] = known
        count, numbered = self.next_number, []
        for place, each in enumerate(candidates):
            if place in found:
                numbered.append(replace(each, way=found[place].number))
            else:
                numbered.append(replace(each, way=count))
                count += 1
        present = tuple(FollowedClass(each.way, each.candidate, stamp_ns) for each in numbered)
        absent = tuple(known for known in free if known not in found.values())
        return tuple(numbered), ClassNumbers(present + absent, count)

    def keep_goals(self, goals: Collection[int]) -> ClassNumbers:
        """Return those of classes to some of the goals, by row."""
        return replace(self, followed=tuple(known for known in self.followed if known.candidate.goal in goals))

    def forget(self) -> ClassNumbers:
        """Return no classes, and the next number, so that none is given again."""
        return ClassNumbers((), self.next_number)


NO_NUMBERS = ClassNumbers()


def _count_shared(one: Candidate, other: Candidate) -> int:
    return len({*one.sides} & {*other.sides})


def is_renamed(before: Candidate, now: Candidate) -> bool:
    """Return whether the label of one class to a goal is that of the other with obstacles left out."""
    if before.goal != now.goal:
        return False
    fewer, more = sorted((before.sides, now.sides), key=len)
    return set(fewer) <= set(more)
