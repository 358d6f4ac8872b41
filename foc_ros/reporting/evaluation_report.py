"""An evaluation as a page with plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.baselines import BOLTZMANN, PUBLISHED, REFITTED, UNIFORM
from foc_ros.analysis.evaluation.observations import GAP, GOAL, PATH_CLASS
from foc_ros.analysis.evaluation.report import GAP_TITLE, make_tables
from foc_ros.analysis.evaluation.scores import TENTHS
from foc_ros.io.outputs import EVALUATION_PAGE

from .draw import open_figure
from .page import render_figure, render_list, render_page, render_pictures, render_table, write_page

WIDTH_IN, HEIGHT_IN = 6.4, 4.2
COUNTS = f'with intervals of 95 % by bootstrap over recordings, and the numbers of predictions of {PUBLISHED}'
CAPTIONS = {
    PATH_CLASS: 'Homotopy class through the obstacles still ahead: mean log-likelihood of the true class above a uniform guess.',
    GOAL: 'Goal: mean log-likelihood of the true goal above a uniform guess.',
    GAP: 'Gap in the next row: how often the likeliest gap is the true one.',
}


def write_report(directory: Path, title: str, answer: Mapping[str, Any]) -> None:
    """Write the page; answer: as of `evaluate --json`. Raises InputError where that cannot be done."""
    tables = ''.join(render_table(columns, rows, heading) for heading, columns, rows in make_tables(answer))
    warnings = [f'{name}: {reason}' for name, reason in answer['failed'].items()]
    body = render_list(answer['verdict']) + render_pictures(_draw_questions(answer['questions'])) + tables
    page = render_page(f'Evaluation: {title}', body, warnings)
    write_page(directory, EVALUATION_PAGE, page)


def _draw_questions(questions: Mapping[str, Any]) -> Iterator[str]:
    """Yield two pictures for each question."""
    for name, caption in CAPTIONS.items():
        if name in questions:
            reliability = f'{name}: how often the likeliest answer is true, over its probability, {COUNTS}.'
            for draw, words in ((_draw_tenths, caption), (_draw_reliability, reliability)):
                with open_figure(WIDTH_IN, HEIGHT_IN) as figure:
                    draw(figure.subplots(), name, questions[name])
                yield render_figure(figure, words)


def _draw_tenths(axes: Any, name: str, by_predictor: Mapping[str, Any]) -> None:
    score = 'right' if name == GAP else 'gain'
    for predictor, scores in by_predictor.items():
        if predictor != UNIFORM:
            heights = [each[score] if each[score] is not None else float('nan') for each in scores['by_tenth']]
            is_ours = predictor in (PUBLISHED, REFITTED)
            look = {'linewidth': 2.5} if is_ours else {'linewidth': 1.0, 'linestyle': '--'}
            axes.plot(range(1, TENTHS + 1), heights, marker='.', label=predictor, **look)
    axes.set(xlabel='tenth of the distance', xticks=range(1, TENTHS + 1))
    axes.set_ylabel(GAP_TITLE.split(':')[0] if name == GAP else 'log-likelihood above uniform [nat]')
    axes.axhline(0.0, color='0.4', linewidth=0.8)
    axes.legend(fontsize='small')


def _draw_reliability(axes: Any, _: str, by_predictor: Mapping[str, Any]) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color='0.4', linewidth=0.8)
    for predictor in (PUBLISHED, REFITTED, BOLTZMANN):
        bins = [each for each in by_predictor[predictor]['reliability'] if each['count']]
        shares = np.array([each['right'] for each in bins])
        errors = np.abs(np.array([each['interval'] for each in bins]).reshape(-1, 2).T - shares)
        look = {'marker': 'o', 'markersize': 4, 'capsize': 2, 'label': predictor}
        (line, *_) = axes.errorbar([each['confidence'] for each in bins], shares, errors, **look)
        for each in bins if predictor == PUBLISHED else ():
            place = {'xy': (each['confidence'], each['right']), 'xytext': (5, -9), 'textcoords': 'offset points'}
            axes.annotate(str(each['count']), **place, fontsize=7, color=line.get_color())
    axes.set(xlabel='probability of the likeliest answer', ylabel='share of true answers', aspect='equal')
    axes.legend(fontsize='small')
