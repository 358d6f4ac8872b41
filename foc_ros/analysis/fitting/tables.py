"""The rows of the tables of a fit, for the terminal and the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from foc_ros.core.config import Config, flatten

from .comparison import SMALLER_IS_BETTER
from .covariance_fit import COVERAGE_LEVEL
from .estimates import Fit

PARAMETER_COLUMNS = ('parameter', 'given', 'fitted', '95 %', 'data')
SCORE_COLUMNS = ('score', 'setting', 'value')
CHANGES = ('better', 'worse')
COMPARISON_COLUMNS = ('with the same recordings', 'before', 'after', '')
COMPARISON_TITLES = {
    'class_gain': ('log-likelihood of the answer taken, above uniform [nat]', 1.0, 3),
    'gap_right': ('next gap correct [%]', 100.0, 1),
    'error_m 0.25': ('error of positions 0.25 s ahead [mm]', 1e3, 1),
    'error_m 0.5': ('error of positions 0.5 s ahead [mm]', 1e3, 1),
    'error_m 1': ('error of positions 1 s ahead [mm]', 1e3, 1),
    'nlpd': ('negative log-density of positions 0.5 s ahead [nat]', 1.0, 2),
    'inside_90': ('positions in the region of 90 %, 0.5 s ahead [%]', 100.0, 1),
}
"""Words, factor and digits of each measure."""
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
        low, high = ('-' if end is None else f'{end:.3g}' for end in each['interval'])
        rows.append((name, f'{each["given"]:.3g}', f'{each["value"]:.3g}', f'{low} to {high}', each['how']))
    chosen = answer.get('chosen', {}).items()
    return rows + [(name, each['given'], each['value'], '', 'predicted positions and classes') for name, each in chosen]


def format_comparison(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the measures before and after a fit in an answer of `fit --json`, with a word for each change."""
    rows: Rows = []
    for name, each in answer['comparison'].items():
        words, factor, digits = COMPARISON_TITLES[name]
        before, after = each['before'], each['after']
        if before is None or after is None:
            continue
        shown = [f'{factor * value:.{digits}f}' for value in (before, after)]
        rows.append((words, *shown, '' if shown[0] == shown[1] else 'better' if _is_better(name, before, after) else 'worse'))
    return rows


def _is_better(name: str, before: float, after: float) -> bool:
    if name == 'inside_90':
        return abs(after - COVERAGE_LEVEL) < abs(before - COVERAGE_LEVEL)
    return after < before if name.startswith(SMALLER_IS_BETTER) else after > before


def make_verdict(answer: Mapping[str, Any]) -> list[str]:
    """Return sentences that say what a fit makes better, and what worse."""
    rows = format_comparison(answer)
    found = {
        change: [f'{words} {before} to {after}' for words, before, after, each in rows if each == change] for change in CHANGES
    }
    judged = [f'{change.capitalize()} with the fitted parameters: {"; ".join(each)}.' for change, each in found.items() if each]
    return judged or ['The fitted parameters change no measure.']


def format_scores(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the scores in an answer of `fit --json`."""
    return [
        (SCORE_TITLES[score], setting, '-' if value is None else f'{value:.3f}')
        for score, values in answer['scores'].items()
        for setting, value in values.items()
    ]


def make_answer(fit: Fit, given: Config, output: Path) -> dict[str, Any]:
    """Return a fit as plain values; node: the commands that run the node with it, without and with a ROS installation."""
    before, options = flatten(given), f'--ros-args --params-file {output}'
    return {
        'recordings': fit.recordings,
        'failed': fit.failed,
        'parameters': {name: {**each.as_json(), 'given': before[name]} for name, each in fit.estimates.items()},
        'chosen': {name: {'value': value, 'given': before[name]} for name, value in fit.chosen.items()},
        'scores': fit.scores,
        'comparison': fit.comparison,
        'warnings': fit.warnings,
        'output': str(output),
        'node': [f'python -m foc_ros node {options}', f'ros2 run foc_ros foc_node {options}'],
    }


def make_tables(answer: Mapping[str, Any]) -> Iterator[tuple[None, tuple[str, ...], Rows]]:
    """Yield the tables of an answer of `fit --json`."""
    yield None, PARAMETER_COLUMNS, format_parameters(answer)
    yield None, SCORE_COLUMNS, format_scores(answer)
    yield None, COMPARISON_COLUMNS, format_comparison(answer)


def make_sentences(answer: Mapping[str, Any]) -> list[str]:
    """Return the notes of an answer of `fit --json`, and what became better and worse."""
    return [*(f'note: {warning}' for warning in answer['warnings']), *make_verdict(answer)]


def list_commands(answer: Mapping[str, Any]) -> str:
    """Return the lines that say how the node is run with the parameters."""
    words = f'{answer["recordings"]} recordings; parameters written to {answer["output"]}. Run the node with them:'
    return '\n  '.join((words, *answer['node']))
