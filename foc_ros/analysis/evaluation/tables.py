"""An evaluation as tables for the terminal and the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .metrics import TENTHS
from .questions import GAP, GOAL, PATH_CLASS

Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""Title, columns, rows."""

GAIN_TITLES = {
    PATH_CLASS: 'Homotopy class: log-likelihood above uniform [nat]',
    GOAL: 'Goal: log-likelihood above uniform [nat]',
}
TOTALS = ('', 'gain', 'ECE', 'Brier', 'correct [%]', 'leads from [%]', 'leads for [s]')
GAP_TITLE = 'Gap in the next row: correct [%], by tenths of the distance from row to row'
REGIONS = {
    'inside': 'ellipse of the most likely candidate',
    'inside_taken': 'ellipse of the candidate taken',
    'inside_all': 'smallest region of all candidates',
}


def make_tables(answer: Mapping[str, Any]) -> Iterator[Table]:
    """Yield the tables of an answer of `evaluate --json`."""
    questions = answer['questions']
    tenths = ('', *(str(tenth + 1) for tenth in range(TENTHS)))
    for name, title in GAIN_TITLES.items():
        if name in questions:
            by_predictor = questions[name].items()
            lines = [_format_tenths(predictor, each, 'gain') for predictor, each in by_predictor]
            yield f'{title}, by tenths of the movement', tenths, lines
            yield f'{title}, of all', TOTALS, [_format_totals(predictor, each) for predictor, each in by_predictor]
    if GAP in questions:
        by_predictor = questions[GAP].items()
        yield GAP_TITLE, tenths, [_format_tenths(predictor, each, 'right') for predictor, each in by_predictor]
        halves: list[tuple[str, ...]] = [(predictor, _percent(each['right_from_half_way'])) for predictor, each in by_predictor]
        yield 'Gap in the next row', ('', 'correct in the second half [%]'), halves
    yield from _make_position_tables(answer['positions'])
    yield '', ('', ''), list(_list_facts(answer))


def _format_tenths(predictor: str, scores: Mapping[str, Any], score: str) -> tuple[str, ...]:
    shown = [_percent(each[score], 0) if score == 'right' else _number(each[score], 2) for each in scores['by_tenth']]
    return (predictor, *shown)


def _format_totals(predictor: str, scores: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = [_number(scores[name], 3) for name in ('gain', 'expected_calibration_error', 'brier')]
    leads = _percent(scores['leads_for_good_from']), _number(scores['leads_for_good_before_s'], 2)
    return (predictor, *numbers, _percent(scores['right']), *leads)


def _make_position_tables(positions: Mapping[str, Any]) -> Iterator[Table]:
    horizons = list(positions['inside']['0.5'])
    errors = [
        (name, *(_number(each if each is None else 1e3 * each, 1) for by in kinds.values() for each in by.values()))
        for name, kinds in positions['displacement_m'].items()
    ]
    columns = ('', *(f'{kind}\n{each} s' for kind in ('average', 'final') for each in horizons))
    yield 'Displacement error [mm]', columns, errors
    densities = [(name, *(_number(by[each], 2) for each in horizons)) for name, by in positions['nlpd'].items()]
    yield 'Negative log-density of the true position [nat, metres]', ('', *(f'{each} s' for each in horizons)), densities
    inside = [
        (f'{words}, {100 * float(level):g} %', *(_percent(by[each]) for each in horizons))
        for name, words in REGIONS.items()
        for level, by in positions[name].items()
    ]
    yield 'True positions inside [%]', ('', *(f'{each} s' for each in horizons)), inside


def _list_facts(answer: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield 'recordings', f'{answer["recordings"]}, {len(answer["failed"])} failed'
    yield 'predictions', str(answer['predictions'])
    for question, by_predictor in answer['settings'].items():
        for name, setting in by_predictor.items():
            if setting is not None:
                yield f'{question}, best setting\n{name}', _format_setting(setting)


def _format_setting(setting: Any) -> str:
    if isinstance(setting, Mapping):
        return ', '.join(f'{name} {_format_setting(value)}' for name, value in setting.items())
    if isinstance(setting, Sequence) and not isinstance(setting, str):
        return ', '.join(_format_setting(value) for value in setting)
    return f'{setting:.4g}' if isinstance(setting, float) else str(setting)


def _number(value: float | None, digits: int) -> str:
    return '-' if value is None else f'{value:.{digits}f}'


def _percent(value: float | None, digits: int = 1) -> str:
    return _number(None if value is None else 100 * value, digits)
