"""What one row of the benchmark says."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Target:
    """What the ratio shall be: at least, or at most, a bound."""

    relation: str
    bound: float

    def met_by(self, ratio: float) -> bool:
        """Return whether a ratio is on the right side of the bound."""
        return ratio >= self.bound if self.relation == 'at least' else ratio <= self.bound

    def __str__(self) -> str:
        return f'{"≥" if self.relation == "at least" else "≤"} {self.bound:g}'


@dataclass(frozen=True)
class Result:
    """One row.

    ours, peer: what was timed; ours_ms, peer_ms: medians [ms]; ratio: as `ratio_of` says; agree: whether the answers differ by
    no more than the tolerance, both in words with numbers; target: None for a row that is for the record; details: further
    figures by name.
    """

    name: str
    ours: str
    peer: str
    ours_ms: float
    peer_ms: float
    ratio: float
    ratio_of: str
    agree: bool
    agreement: str
    repetitions: int
    target: Target | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def met(self) -> bool | None:
        """Whether the target is met by answers that agree; None without a target."""
        return None if self.target is None else self.agree and self.target.met_by(self.ratio)

    def record(self) -> dict[str, Any]:
        """Return the row for JSON."""
        return asdict(self) | {'target': None if self.target is None else str(self.target), 'met': self.met}


def at_least(bound: float) -> Target:
    """Return the target of a gain."""
    return Target('at least', bound)


def at_most(bound: float) -> Target:
    """Return the target of a burden."""
    return Target('at most', bound)
