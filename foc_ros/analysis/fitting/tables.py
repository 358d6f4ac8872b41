"""The rows of the tables of a fit, for the terminal and the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

PARAMETER_COLUMNS = ('parameter', 'given', 'fitted', '95 %', 'data')
SCORE_COLUMNS = ('score', 'setting', 'value')
SCORE_TITLES = {
    'ways': 'log-likelihood of the class taken [nat]',
    'positions': 'log-density of true positions [nat]',
    'inside_90': 'true positions in the 90 % ellipse of the likeliest candidate at 0.5 s',
    'inside_all_90': 'true positions in the 90 % region of all candidates at 0.5 s',
}
Rows = list[tuple[str, ...]]


def format_parameters(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the parameters in an answer of `fit --json`."""
    rows: Rows = []
    for name, each in answer['parameters'].items():
        low, high = ('-' if end is None else f'{end:.4g}' for end in each['interval'])
        rows.append((name, f'{each["given"]:.4g}', f'{each["value"]:.4g}', f'{low} to {high}', each['how']))
    chosen = answer.get('chosen', {}).items()
    return rows + [(name, each['given'], each['value'], '', 'predicted positions and classes') for name, each in chosen]


def format_scores(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the scores in an answer of `fit --json`."""
    return [
        (SCORE_TITLES[score], setting, '-' if value is None else f'{value:.3f}')
        for score, values in answer['scores'].items()
        for setting, value in values.items()
    ]
