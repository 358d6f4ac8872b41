"""What a fit finds: estimates of parameters with intervals, and the configuration that they lead to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.bootstrap import CENTRAL
from foc_ros.core.config import Config, list_parameters, replace_values
from foc_ros.core.types import Array

BOUNDS = {parameter.name: parameter.bound for parameter in list_parameters()}


@dataclass(frozen=True)
class Estimate:
    """A fitted value by dotted name, its 95 % interval by bootstrap over recordings (nan: none), and its data."""

    name: str
    value: float
    low: float
    high: float
    how: str

    @classmethod
    def from_resamples(cls, name: str, value: float, resampled: Array | Sequence[float], how: str) -> Estimate:
        """Return the estimate whose interval holds the central values of a bootstrap, (b,)."""
        low, high = np.percentile(resampled, CENTRAL).tolist()
        return cls(name, value, low, high, how)

    def as_json(self) -> dict[str, Any]:
        """Return plain values; an unknown end of the interval is null."""
        ends = [None if math.isnan(end) else end for end in (self.low, self.high)]
        return {'value': self.value, 'interval': ends, 'how': self.how}


Estimates = dict[str, Estimate]
"""Estimates by dotted name."""


def clip_to_bounds(name: str, value: float, least: float = 0.0) -> float:
    """Return a value within the bounds of a parameter, and not below `least`; rounded, so that a file reads well."""
    bound = BOUNDS[name]
    assert bound.low is not None and bound.high is not None
    return float(f'{min(max(value, bound.low, least), bound.high):.6g}')


def apply_estimates(config: Config, estimates: Mapping[str, Estimate]) -> Config:
    """Return the configuration with the estimates in place."""
    return replace_values(config, {name: estimate.value for name, estimate in estimates.items()})


@dataclass
class Fit:
    """The state of a fit.

    config; recordings: how many are used; estimates by name; chosen: values that are no numbers, by name; warnings in words;
    failed recordings with reasons; scores as plain values; comparison: of the given parameters with the fitted ones.
    """

    config: Config
    recordings: int = 0
    estimates: Estimates = field(default_factory=dict)
    chosen: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    scores: dict[str, Any] = field(default_factory=dict)
    comparison: dict[str, dict[str, float | None]] = field(default_factory=dict)

    def take(self, estimates: Estimates, warnings: Sequence[str] = ()) -> None:
        """Take estimates into the configuration, and warnings."""
        self.estimates.update(estimates)
        self.warnings.extend(warnings)
        self.config = apply_estimates(self.config, estimates)
