"""The rows of the tables of a fit, for the terminal and the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Rows = list[tuple[str, ...]]


def format_parameters(answer: Mapping[str, Any]) -> Rows:
    """Return name, given value, fitted value, interval and data of each parameter in an answer of `fit --json`."""
    rows: Rows = []
    for name, each in answer['parameters'].items():
        low, high = ('-' if end is None else f'{end:.4g}' for end in each['interval'])
        rows.append((name, f'{each["given"]:.4g}', f'{each["value"]:.4g}', f'{low} to {high}', each['how']))
    chosen = answer.get('chosen', {}).items()
    return rows + [(name, each['given'], each['value'], '', 'predicted positions and classes') for name, each in chosen]


def format_scores(scores: Mapping[str, Mapping[str, float | None]], titles: Mapping[str, str]) -> Rows:
    """Return title, setting and value of each score."""
    return [
        (titles[score], setting, '-' if value is None else f'{value:.3f}')
        for score, values in scores.items()
        for setting, value in values.items()
    ]
