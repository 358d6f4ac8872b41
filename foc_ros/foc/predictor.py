"""One hand state and one scene in, one prediction out; what is remembered goes in and comes out."""

from __future__ import annotations

from dataclasses import dataclass, field

from .config import Config
from .records import Array, HandState, Obstacles, Prediction


@dataclass(frozen=True)
class Memory:
    """What one prediction hands to the next: the most likely label, and a warm start by label."""

    most_likely: str | None = None
    warm: dict[str, Array] = field(default_factory=dict)


def predict(config: Config, hand: HandState, obstacles: Obstacles, goals: Array, memory: Memory) -> tuple[Prediction, Memory]:
    """Predict. obstacles: already moved to the hand's stamp; goals (g, 2) [m], at least one."""
    raise NotImplementedError
