"""An evaluation as tables for the terminal and the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .questions import GAP, GOAL, WAY
from .scores import TENTHS

Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""Title, columns, rows."""

GAINS = {
    WAY: 'Way through the rows ahead: log-likelihood above uniform [nat], by tenths of the movement',
    GOAL: 'Goal: log-likelihood above uniform [nat], by tenths of the movement',
}
RIGHT = 'Gap in the next row: right [%], by tenths of the way from row to row'
INSIDE = {
    'inside': 'ellipse of the most likely way',
    'inside_taken': 'ellipse of the way taken',
    'inside_all': 'smallest region of all ways together',
}


def tables(answer: Mapping[str, Any]) -> Iterator[Table]:
    """Yield the tables of an answer as of `answer.answer_of`."""
    questions = answer['questions']
    for name, title in GAINS.items():
        if name in questions:
            yield (
                title,
                _columns('all', 'ECE', 'Brier', 'right', 'leads from'),
                [_gains(predictor, scores) for predictor, scores in questions[name].items()],
            )
    if GAP in questions:
        yield RIGHT, _columns('from half way'), [_right(predictor, scores) for predictor, scores in questions[GAP].items()]
    yield from _positions(answer['positions'])
    yield _facts(answer)


def _columns(*more: str) -> tuple[str, ...]:
    return ('', *(str(tenth + 1) for tenth in range(TENTHS)), *more)


def _gains(predictor: str, scores: Mapping[str, Any]) -> tuple[str, ...]:
    tenths = [number(each['gain'], 2) for each in scores['by_tenth']]
    rest = number(scores['gain'], 3), number(scores['expected_calibration_error'], 3), number(scores['brier'], 3)
    return (predictor, *tenths, *rest, percent(scores['right']), percent(scores['leads_for_good_from']))


def _right(predictor: str, scores: Mapping[str, Any]) -> tuple[str, ...]:
    return (predictor, *(percent(each['right']) for each in scores['by_tenth']), percent(scores['right_from_half_way']))


def _positions(positions: Mapping[str, Any]) -> Iterator[Table]:
    horizons = list(positions['inside']['0.5'])
    errors = [
        (name, *(number(1e3 * by[kind][each], 1) if by[kind][each] is not None else '-' for kind in by for each in horizons))
        for name, by in positions['displacement_m'].items()
    ]
    columns = ('', *(f'{kind} {each} s' for kind in ('average', 'final') for each in horizons))
    yield 'Displacement error [mm]', columns, errors
    inside = [
        (f'{words}, {100 * float(level):g} %', *(percent(by[each]) for each in horizons))
        for name, words in INSIDE.items()
        for level, by in positions[name].items()
    ]
    yield 'True positions inside [%]', ('', *(f'{each} s' for each in horizons)), inside


def _facts(answer: Mapping[str, Any]) -> Table:
    rows: list[tuple[str, ...]] = [
        ('recordings', f'{answer["recordings"]}, {len(answer["failed"])} failed'),
        ('predictions', str(answer['predictions'])),
        *(
            (f'best for {question}: {name}', _setting(setting))
            for question, by_predictor in answer['settings'].items()
            for name, setting in by_predictor.items()
            if setting is not None
        ),
    ]
    return '', ('', ''), rows


def _setting(setting: Any) -> str:
    if isinstance(setting, Mapping):
        return ', '.join(f'{name} {value:g}' for name, value in setting.items())
    return ', '.join(f'{value:.4g}' for value in setting) if isinstance(setting, Sequence) else f'{setting:.4g}'


def number(value: float | None, digits: int) -> str:
    """Return a number with so many digits; a dash for none."""
    return '-' if value is None else f'{value:.{digits}f}'


def percent(value: float | None) -> str:
    """Return a share in per cent; a dash for none."""
    return '-' if value is None else f'{100 * value:.1f}'
