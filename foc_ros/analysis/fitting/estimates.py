"""What a fit found of one parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from foc_ros.core.config import Config, parameters, updated

BOUNDS = {parameter.name: parameter.bound for parameter in parameters()}


@dataclass(frozen=True)
class Estimate:
    """A fitted value by dotted name, with its interval of 95 % by bootstrap over recordings (nan: none), and how it was found."""

    name: str
    value: float
    low: float
    high: float
    how: str


def bounded(name: str, value: float, least: float = 0.0) -> float:
    """Return a value within the bounds of a parameter, and not below `least`; rounded, so that a file reads well."""
    bound = BOUNDS[name]
    assert bound.low is not None and bound.high is not None
    return float(f'{min(max(value, bound.low, least), bound.high):.6g}')


def applied(config: Config, estimates: Mapping[str, Estimate]) -> Config:
    """Return the configuration with the estimates in place."""
    return updated(config, {name: estimate.value for name, estimate in estimates.items()})


def as_json(estimate: Estimate) -> dict[str, Any]:
    """Return plain values; an end of the interval that is not known is null."""
    ends = [None if math.isnan(end) else end for end in (estimate.low, estimate.high)]
    return {'value': estimate.value, 'interval': ends, 'how': estimate.how}
