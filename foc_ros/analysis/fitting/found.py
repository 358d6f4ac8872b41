"""What a fit has found so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from foc_ros.core.config import Config

from .estimates import Estimate, applied


@dataclass
class Fit:
    """What was found.

    config; estimates by name; chosen: what is no number, by name; warnings in words; failed recordings with reasons; scores as
    plain values.
    """

    config: Config
    recordings: int = 0
    estimates: dict[str, Estimate] = field(default_factory=dict)
    chosen: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    scores: dict[str, Any] = field(default_factory=dict)

    def take(self, found: tuple[Mapping[str, Estimate], Sequence[str]]) -> None:
        """Take estimates into the configuration, and warnings."""
        self.estimates.update(found[0])
        self.warnings.extend(found[1])
        self.config = applied(self.config, found[0])
