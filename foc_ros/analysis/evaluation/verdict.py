"""The verdict of an evaluation in plain words: where the predictions are better or worse than each baseline."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .baselines import PUBLISHED
from .bootstrap import compute_mean_interval
from .metrics import TENTHS, Scores, find_tenths
from .questions import GAP, GOAL, PATH_CLASS

SUBJECTS = {PATH_CLASS: 'Homotopy classes', GAP: 'Next gaps', GOAL: 'Goals'}
OURS = 'likelihood-weighted'
"""The predicted positions that are compared with those of the baselines."""
COVERAGE_S, COVERAGE_LEVEL, TOLERANCE = '0.5', 0.9, 0.05
"""Horizon and probability of the region that is judged, and the error of its share that counts as none."""
ALIKE = 0.02
"""Relative difference below which two errors of positions are alike."""


def compare_scores(ours: Scores, other: Scores, is_share: bool) -> dict[str, Any]:
    """Return the mean difference of two predictors in the same predictions, with its interval, and the tenths that are worse.

    is_share: compare the shares of correct answers instead of the log-likelihoods of the true ones.
    """
    difference = ours.correct - other.correct if is_share else ours.log_likelihood - other.log_likelihood
    tenths = find_tenths(ours.progress)
    by_tenth = [difference[tenths == each] for each in range(TENTHS)]
    return {
        'difference': float(difference.mean()),
        'interval': compute_mean_interval(difference, ours.recording),
        'worse_tenths': [number for number, each in enumerate(by_tenth, 1) if len(each) and each.mean() < 0.0],
    }


def make_verdict(answer: Mapping[str, Any]) -> list[str]:
    """Return the sentences about an answer of `evaluate --json`."""
    questions = [_judge_question(name, each) for name, each in answer['comparisons'].items()]
    positions = answer['positions']
    return [*questions, *_judge_positions(positions['displacement_m']), *_judge_region(positions['inside_all'])]


def _judge_question(name: str, comparisons: Mapping[str, Any]) -> str:
    unit, factor = ('points of 100', 100.0) if name == GAP else ('nat', 1.0)
    groups: dict[str, list[str]] = {'better than': [], 'not distinguishable from': [], 'worse than': []}
    for baseline, each in comparisons.items():
        low, high = each['interval']
        tenths = ', '.join(map(str, each['worse_tenths']))
        where = f', worse in tenths {tenths}' if 0 < len(each['worse_tenths']) < TENTHS else ''
        words = f'{baseline} ({factor * each["difference"]:+.2g} {unit}{where})'
        groups['better than' if low > 0.0 else 'worse than' if high < 0.0 else 'not distinguishable from'].append(words)
    judged = '; '.join(f'{verdict} {", ".join(each)}' for verdict, each in groups.items() if each)
    return f'{SUBJECTS[name]}: {PUBLISHED} is {judged}.'


def _judge_positions(errors: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each horizon with the final errors of the baselines beside ours."""
    sentences = []
    for horizon, ours in errors[OURS]['final'].items():
        others = {name: each['final'][horizon] for name, each in errors.items() if name not in (OURS, 'most likely')}
        if ours is not None:
            judged = ', '.join(f'{_judge_error(ours, each)} {name} ({1e3 * each:.0f} mm)' for name, each in others.items())
            sentences.append(f'Positions {horizon} s ahead: {1e3 * ours:.0f} mm away on average, {judged}.')
    return sentences


def _judge_error(ours: float, other: float) -> str:
    if abs(ours - other) <= ALIKE * other:
        return 'like'
    return 'better than' if ours < other else 'worse than'


def _judge_region(inside: Mapping[str, Any]) -> list[str]:
    share = inside[f'{COVERAGE_LEVEL:g}'][COVERAGE_S]
    if share is None:
        return []
    is_right = abs(share - COVERAGE_LEVEL) <= TOLERANCE
    judged = 'about right' if is_right else 'too narrow' if share < COVERAGE_LEVEL else 'too wide'
    return [
        f'Uncertainty: the region of {100 * COVERAGE_LEVEL:.0f} % holds {100 * share:.0f} % of the true positions {COVERAGE_S} s '
        f'ahead, so it is {judged}.'
    ]
