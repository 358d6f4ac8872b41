"""A state of health as a diagnostic_msgs/DiagnosticArray."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .types import MessageTypes, header

OK, WARN, ERROR, STALE = 0, 1, 2, 3
"""Levels of diagnostic_msgs/DiagnosticStatus."""


@dataclass(frozen=True)
class Health:
    """Level, the one thing to know in words, and every figure by name."""

    level: int
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


def diagnostic_array(health: Health, name: str, hardware_id: str, stamp_ns: int, types: MessageTypes) -> Any:
    """Return the array with one status. name: of the component, as in 'foc: prediction'."""
    values = [types.make('diagnostic_msgs/msg/KeyValue', key=key, value=value) for key, value in health.values.items()]
    status = types.make(
        'diagnostic_msgs/msg/DiagnosticStatus',
        level=health.level,
        name=name,
        message=health.message,
        hardware_id=hardware_id,
        values=values,
    )
    return types.make('diagnostic_msgs/msg/DiagnosticArray', header=header(types, stamp_ns, ''), status=[status])
