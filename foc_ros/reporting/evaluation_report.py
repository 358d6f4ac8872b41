# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An evaluation as a page with plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.baselines import BOLTZMANN, PUBLISHED, REFITTED, UNIFORM
from foc_ros.analysis.evaluation.questions import GAP, GOAL, PATH_CLASS
from foc_ros.analysis.evaluation.report import GAP_TITLE, make_tables
from foc_ros.analysis.evaluation.scores import TENTHS
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config
from foc_ros.io.outputs import EVALUATION_PAGE

from .example import draw_example, warn_of_few
from .page import Picture, Section, explain_tables, make_chart, write_page

SIZE_IN = 6.4, 4.6
WEIGHTED, AHEAD_S, LEVEL = 'likelihood-weighted', '0.5', '0.9'
"""The predicted position, the time ahead [s] and the probability of a region that the summary is about."""
COUNTS = f'with intervals of 95 % by bootstrap over recordings, and the numbers of predictions of {PUBLISHED}'
CAPTIONS = {
    PATH_CLASS: 'Homotopy class through the obstacles still ahead: mean log-likelihood of the true class above a uniform guess.',
    GOAL: 'Goal: mean log-likelihood of the true goal above a uniform guess.',
    GAP: 'Gap in the next row: how often the likeliest gap is the true one.',
}
ASKED = {PATH_CLASS: 'path past the obstacles', GOAL: 'goal', GAP: 'gap in the next row of obstacles'}
EXPLANATIONS = {
    'nat': 'the unit of a natural logarithm of a probability. 0.69 nat more mean twice the probability for what really happened.',
    'above uniform': 'compared with a guess that finds all answers equally likely. 0 is no better than this; more is better.',
    'tenths': 'the first column is about the beginning of the movement, when little is known, the last one about its end.',
    'gain': 'the log-likelihood above uniform [nat], averaged over the whole movement.',
    'ECE': 'the expected calibration error: how far the stated probabilities are from the shares that come true. 0 is best.',
    'Brier': 'the mean squared error of the probabilities. 0 is best.',
    'correct': 'how often the likeliest answer is the true one.',
    'leads from': 'the part of the movement from which on the true answer stays the likeliest one. Less is better.',
    'average': 'the distance of the predicted from the true position, over all times until then.',
    'final': 'this distance at that time alone.',
    'Negative log-density': 'how improbable the true position was. Less is better: both a wrong place and a wrong width count.',
    'inside': 'how often the true position is in the region that should hold this share of them. The share itself is best.',
    'held out': 'each recording is scored with the settings that fit the others best, so that none has been learnt by heart.',
    'best setting': 'the one that fits all recordings best.',
}
"""What the words in headings and columns mean."""


def write_report(
    directory: Path,
    title: str,
    answer: Mapping[str, Any],
    recordings: Mapping[str, Recording] | None = None,
    config: Config | None = None,
) -> None:
    """Write the page; answer: as of `evaluate --json`, of recordings. Raises InputError where that cannot be done."""
    sections = [
        Section('In short', summarise(answer)),
        *draw_example(recordings, config),
        Section(pictures=list(_draw_questions(answer['questions']))),
        Section('Compared with simpler predictors', answer['verdict']),
        *explain_tables(make_tables(answer), EXPLANATIONS),
    ]
    failed = [f'{name}: {reason}' for name, reason in answer['failed'].items()]
    warnings = [*warn_of_few(answer['recordings'], 'recordings'), *failed]
    write_page(directory, EVALUATION_PAGE, f'Evaluation: {title}', sections, warnings, config)


def summarise(answer: Mapping[str, Any]) -> list[str]:
    """Return the main results of `evaluate --json` in plain words."""
    sentences = [f'{answer["recordings"]} recordings were predicted, at {answer["predictions"]} moments on the way.']
    for name, asked in ASKED.items():
        if name in answer['questions']:
            ours, guess = (answer['questions'][name][each] for each in (PUBLISHED, UNIFORM))
            chances = [100.0 * np.exp(each['log_likelihood']) for each in (ours, guess)]
            sentences.append(
                f'The likeliest {asked} was the one that the hand took in {100.0 * ours["right"]:.0f} % of them. The true '
                f'one had a probability of {chances[0]:.0f} % (geometric mean); a guess among equals gives it {chances[1]:.0f} %.'
            )
    positions = answer['positions']
    error_m, share = positions['displacement_m'][WEIGHTED]['final'][AHEAD_S], positions['inside_all'][LEVEL][AHEAD_S]
    if error_m is not None:
        sentences.append(f'{AHEAD_S} s ahead, the predicted position was {1e3 * error_m:.0f} mm from the true one on average.')
    if share is not None:
        level = 100.0 * float(LEVEL)
        sentences.append(f'The region that should hold {level:.0f} % of the true positions then held {100.0 * share:.0f} %.')
    return sentences


def _draw_questions(questions: Mapping[str, Any]) -> Iterator[Picture]:
    """Yield two pictures for each question."""
    for name, caption in CAPTIONS.items():
        if name in questions:
            reliability = f'{name}: how often the likeliest answer is true, over its probability, {COUNTS}.'
            for draw, words in ((_draw_tenths, caption), (_draw_reliability, reliability)):
                yield make_chart(SIZE_IN, words, draw, name, questions[name])


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
