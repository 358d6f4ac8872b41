"""An evaluation as a page with plots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from foc_ros.analysis.evaluation.families import PUBLISHED, REFITTED, UNIFORM
from foc_ros.analysis.evaluation.questions import GAP, GOAL, WAY
from foc_ros.analysis.evaluation.scores import TENTHS
from foc_ros.analysis.evaluation.tables import RIGHT, tables
from foc_ros.core.errors import InputError

from .drawing import new_figure
from .page import page_of, picture, pictures, table
from .plots import save

PAGE = 'evaluation.html'
WIDTH_IN, HEIGHT_IN = 6.4, 4.2
ABOUT = {
    WAY: 'The way through the obstacles still ahead: mean log-likelihood of what came true, above that of an even guess.',
    GOAL: 'The goal: mean log-likelihood of what came true, above that of an even guess.',
    GAP: 'The gap taken in the next row: how often the likeliest was the true one.',
}


def write_report(directory: Path, title: str, answer: Mapping[str, Any]) -> None:
    """Write the page; raises InputError where that cannot be done."""
    with TemporaryDirectory() as scratch:
        shown = [_picture(Path(scratch), name, draw, words, answer) for name, draw, words in _wanted(answer)]
    tabular = ''.join(f'<h2>{title}</h2>{table(columns, rows)}' for title, columns, rows in tables(answer))
    warnings = [f'{name}: {reason}' for name, reason in answer['failed'].items()]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        (directory / PAGE).write_text(page_of(f'Evaluation: {title}', pictures(shown) + tabular, warnings), encoding='utf-8')
    except OSError as error:
        raise InputError('--report', 'a folder that can be written', f'{directory}: {error.strerror}') from error


Draw = Callable[[Any, Mapping[str, Any]], None]


def _wanted(answer: Mapping[str, Any]) -> list[tuple[str, Draw, str]]:
    wanted: list[tuple[str, Draw, str]] = []
    for name, about in ABOUT.items():
        if name in answer['questions']:
            wanted.append((f'{name}_tenths', _by_tenth(name), about))
            wanted.append((f'{name}_reliability', _reliability(name), f'{name}: of the times it says p, how often is it right?'))
    return wanted


def _picture(directory: Path, name: str, draw: Draw, words: str, answer: Mapping[str, Any]) -> str:
    with new_figure(WIDTH_IN, HEIGHT_IN) as figure:
        draw(figure.subplots(), answer)
    file = directory / f'{name}.png'
    save(figure, file)
    return picture(file, words)


def _by_tenth(name: str) -> Draw:
    value = 'right' if name == GAP else 'gain'

    def draw(axes: Any, answer: Mapping[str, Any]) -> None:
        for predictor, scores in answer['questions'][name].items():
            if predictor != UNIFORM:
                heights = [each[value] if each[value] is not None else float('nan') for each in scores['by_tenth']]
                ours = predictor in (PUBLISHED, REFITTED)
                look = {'linewidth': 2.5} if ours else {'linewidth': 1.0, 'linestyle': '--'}
                axes.plot(range(1, TENTHS + 1), heights, marker='.', label=predictor, **look)
        axes.set_xlabel('tenth of the way')
        axes.set_xticks(range(1, TENTHS + 1))
        axes.set_ylabel(RIGHT.split(':')[0] if name == GAP else 'log-likelihood above uniform [nat]')
        axes.axhline(0.0, color='0.4', linewidth=0.8)
        axes.legend(fontsize='small')

    return draw


def _reliability(name: str) -> Draw:
    def draw(axes: Any, answer: Mapping[str, Any]) -> None:
        axes.plot([0.0, 1.0], [0.0, 1.0], color='0.4', linewidth=0.8)
        for predictor in (PUBLISHED, REFITTED, 'Boltzmann'):
            bins = [each for each in answer['questions'][name][predictor]['reliability'] if each['count']]
            places, right = [each['confidence'] for each in bins], [each['right'] for each in bins]
            axes.plot(places, right, marker='o', markersize=4, label=predictor)
        axes.set_xlabel('what it said of the likeliest answer')
        axes.set_ylabel('share that came true')
        axes.set_aspect('equal')
        axes.legend(fontsize='small')

    return draw
