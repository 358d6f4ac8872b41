# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""All predictors scored on all recordings: the result as plain values for JSON, sentences and tables; and labels checked."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.parallel import collect_all
from foc_ros.analysis.recordings import LABELS, TRIALS
from foc_ros.analysis.scenes import read_picked
from foc_ros.core.config import Config, flatten
from foc_ros.core.solution import LEFT
from foc_ros.core.types import Array
from foc_ros.io.csv_tables import read_rows
from foc_ros.io.terminal import show_progress

from .baselines import PLAIN, PUBLISHED, REFITTED, UNIFORM, Baseline, make_baselines
from .observations import GAP, GOAL, PATH_CLASS, Observation, ObservedRecording, Questions, ask_all
from .positions import compute_position_scores
from .scores import FEWEST, TENTHS, Scores, choose_held_out, compare_scores, compute_log_likelihoods, score_forecasts, summarise
from .truth import HORIZONS_S

FITTED_TO = {PATH_CLASS: PATH_CLASS, GAP: PATH_CLASS, GOAL: GOAL}
"""The question by whose answers the settings of a predictor are chosen, for each question that it is scored by."""
OURS = 'likelihood-weighted'
"""The predicted positions that are compared with those of the baselines."""
OWN_POSITIONS = OURS, 'most likely'
UNKNOWN = 'not distinguishable from'
ASKED = {PATH_CLASS: 'path past the obstacles', GOAL: 'goal', GAP: 'gap in the next row of obstacles'}
"""What each question is about, in words."""
COVERAGE_S, COVERAGE_LEVEL = '0.5', 0.9
"""Horizon and probability of the region that is judged."""
Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
GAP_TITLE = 'Gap in the next row: correct [%], by tenths of the distance from row to row'
TOTALS = {
    'gain': ('gain', 1.0, 3),
    'ECE': ('expected_calibration_error', 1.0, 3),
    'Brier': ('brier', 1.0, 3),
    'correct [%]': ('right', 100.0, 1),
    'leads from [%]': ('leads_for_good_from', 100.0, 1),
    'leads for [s]': ('leads_for_good_before_s', 1.0, 2),
}
"""Columns of the table of all predictions: the score, its factor and its digits."""
REGIONS = {
    'inside': 'ellipse of the most likely candidate',
    'inside_taken': 'ellipse of the candidate taken',
    'inside_all': 'smallest region of all candidates',
}


def evaluate(recordings: Sequence[ObservedRecording], config: Config, say: Callable[[str], str] = str) -> dict[str, Any]:
    """Score all predictors on recordings, at least one, that were replayed with a configuration; return plain values for JSON.

    say: returns the words of a progress for `compare` and `score`.
    """
    baselines = make_baselines(recordings, config.likelihood)
    items = [(recording.name, (recording, baselines)) for recording in recordings]
    # log-likelihood of each recording (r) under each setting (s), (r, s), by question and predictor
    tables = collect_all(_tabulate_log_likelihoods, items, say('compare'))
    table = {key: np.array([each[key] for each in tables]) for key in tables[0]}
    asked = {name: [ask_all(each, name) for each in recordings] for name in FITTED_TO}
    asked = {name: questions for name, questions in asked.items() if any(questions)}
    pairs = [(name, each) for name in asked for each in baselines]
    work: list[Callable[[], Any]] = [
        partial(_score_held_out, each, table[FITTED_TO[name], each.name], asked[name]) for name, each in pairs
    ]
    work.append(partial(compute_position_scores, recordings))
    *scored, positions = show_progress((each() for each in work), say('score'), len(work), is_stage=True)
    scores: dict[str, dict[str, Scores]] = {name: {} for name in asked}
    for (name, each), found in zip(pairs, scored, strict=True):
        scores[name][each.name] = found
    best = {key: int(each.sum(axis=0).argmax()) for key, each in table.items()}
    answer = {
        'recordings': len(recordings),
        'predictions': sum(len(recording.observations) for recording in recordings),
        'questions': {name: {other: summarise(each) for other, each in scores[name].items()} for name in asked},
        'comparisons': {
            name: {
                other: compare_scores(scores[name][PUBLISHED], each, is_share=name == GAP)
                for other, each in scores[name].items()
                if other not in (PUBLISHED, REFITTED, PLAIN)
            }
            for name in asked
        },
        'settings': {
            name: {each.name: _make_plain(each.settings[best[name, each.name]]) for each in baselines}
            for name in asked
            if name != GAP
        },
        'positions': positions,
        'parameters': flatten(config),
    }
    return answer | {'verdict': make_verdict(answer)}


def _tabulate_log_likelihoods(item: tuple[ObservedRecording, Sequence[Baseline]]) -> dict[tuple[str, str], Array]:
    recording, baselines = item
    questions = {name: ask_all(recording, name) for name in (PATH_CLASS, GOAL)}
    return {(name, each.name): compute_log_likelihoods(questions[name], each) for name in questions for each in baselines}


def _score_held_out(baseline: Baseline, table: Array, questions: Sequence[Questions]) -> Scores:
    """Score a predictor, on the questions of each recording with the setting that is best for the others by a table (r, s)."""
    choices = choose_held_out(table)
    return score_forecasts(
        (number, observation, question, baseline.forecast(observation, question, baseline.settings[choice]))
        for number, (choice, asked) in enumerate(zip(choices, questions, strict=True))
        for observation, question in asked
    )


def _make_plain(setting: Any) -> Any:
    return asdict(setting) if is_dataclass(setting) and not isinstance(setting, type) else setting


def find_label_mismatches(data: Path, recordings: Sequence[ObservedRecording]) -> dict[str, str]:
    """Return both texts for each recording whose label is not the path class that was taken; none where there are no labels.

    The columns of labels.csv after the first are the gaps taken, row by row, counted from low x. The column `sides` of trials.csv
    has the side of each box by the end of its name. Raises RecordingError for a table that cannot be read.
    """
    trials, labels = data / TRIALS, data / LABELS
    compare: Callable[[Observation, Mapping[str, str]], str]
    if trials.exists() and not read_picked(trials):
        rows, compare = read_rows(trials, ('recording', 'sides')), _compare_sides
    elif labels.exists() and not trials.exists():
        rows, compare = read_rows(labels, ('recording',)), _compare_gaps
    else:
        return {}
    stated = {row.cells['recording']: row.cells for row in rows}
    found = ((each.name, each.observations[0], stated.get(each.name)) for each in recordings)
    differences = {name: compare(first, cells) if cells else 'no label' for name, first, cells in found}
    return {name: words for name, words in differences.items() if words}


def _compare_gaps(first: Observation, cells: Mapping[str, str]) -> str:
    labelled = [text for column, text in cells.items() if column != 'recording']
    taken = [str(gap) for gap in find_gaps(first)]
    return '' if labelled == taken else f'label {" ".join(labelled)}, path {" ".join(taken)}'


def _compare_sides(first: Observation, cells: Mapping[str, str]) -> str:
    differences = []
    for label in cells['sides'].split():
        name, _, side = label.rpartition('=')
        for identity, taken, is_ahead in zip(first.ids, first.truth.sides, first.truth.is_ahead, strict=True):
            words = 'left' if taken == LEFT else 'right'
            if is_ahead and identity.rpartition('/')[0].endswith(name) and words != side:
                differences.append(f'{name} label {side}, path {words}')
    return '; '.join(differences)


def find_gaps(observation: Observation) -> list[int]:
    """Return the gap that the hand really took in each row still ahead, counted from low x."""
    truth, row = observation.truth, observation.row
    is_higher = (truth.sides == LEFT) != (observation.left[0] < 0.0)
    return [int(is_higher[(row == each) & truth.is_ahead].sum()) for each in np.unique(row[truth.is_ahead])]


def make_verdict(answer: Mapping[str, Any]) -> list[str]:
    """Return the sentences about an answer of `evaluate --json`; two errors of positions are alike within 2 %."""
    sentences = [_judge_question(name, each, answer['recordings']) for name, each in answer['comparisons'].items()]
    errors = answer['positions']['displacement_m']
    for horizon, ours in errors[OURS]['final'].items():
        others = {name: each['final'][horizon] for name, each in errors.items() if name not in OWN_POSITIONS}
        judged = []
        for name, each in others.items() if ours is not None else ():
            word = 'like' if abs(ours - each) <= 0.02 * each else 'better than' if ours < each else 'worse than'
            judged.append(f'{word} {name} ({1e3 * each:.0f} mm)')
        if judged:
            sentences.append(f'Positions {horizon} s ahead: {1e3 * ours:.0f} mm away on average, {", ".join(judged)}.')
    share = answer['positions']['inside_all'][f'{COVERAGE_LEVEL:g}'][COVERAGE_S]
    if share is not None:
        words = judge_coverage(share, answer['recordings'])
        holds = f'holds {100 * share:.0f} % of the true positions {COVERAGE_S} s ahead, {words}.'
        sentences.append(f'Uncertainty: the region of {100 * COVERAGE_LEVEL:.0f} % {holds}')
    return sentences


def judge_coverage(share: float, recordings: int) -> str:
    """Return in words whether the region that should hold `COVERAGE_LEVEL` of the true positions holds a share of them by chance.

    The positions of one recording are alike, so each recording counts as one position. A difference is chance up to 1.96
    standard deviations of a binomial share: then the 95 % interval of Wilson (1927, doi:10.2307/2276774) holds the level.
    """
    difference = share - COVERAGE_LEVEL
    if abs(difference) <= 0.05:
        return 'so it is about right'
    if abs(difference) <= 1.96 * np.sqrt(COVERAGE_LEVEL * (1.0 - COVERAGE_LEVEL) / recordings):
        return f'which may be chance with {recordings} recording{"s" * (recordings > 1)}'
    return f'so it is too {"narrow" if difference < 0.0 else "wide"}'


def _judge(comparison: Mapping[str, Any], recordings: int) -> str:
    """Return in words how a predictor compares with another one; few recordings are no evidence."""
    if comparison['interval'] is None or recordings < FEWEST:
        count = 1 if comparison['interval'] is None else recordings
        return f'by {"one recording" if count == 1 else f"{count} recordings"} {UNKNOWN}'
    low, high = comparison['interval']
    return 'better than' if low > 0.0 else 'worse than' if high < 0.0 else UNKNOWN


def _judge_question(name: str, comparisons: Mapping[str, Any], recordings: int) -> str:
    unit, factor = ('points of 100', 100.0) if name == GAP else ('nat', 1.0)
    groups: dict[str, list[str]] = {'better than': [], UNKNOWN: []}
    for baseline, each in comparisons.items():
        verdict = _judge(each, recordings)
        worse = [] if verdict.startswith('by ') else each['worse_tenths']
        runs = np.split(worse, np.flatnonzero(np.diff(worse) > 1) + 1)
        tenths = ', '.join(' to '.join(str(end) for end in dict.fromkeys((run[0], run[-1]))) for run in runs if len(run))
        where = f', worse in tenths {tenths}' if 0 < len(worse) < TENTHS else ''
        words = f'{baseline} ({factor * each["difference"]:+.2g} {unit}{where})'
        groups.setdefault(verdict, []).append(words)
    judged = '; '.join(f'{verdict} {", ".join(each)}' for verdict, each in groups.items() if each)
    subject = {PATH_CLASS: 'Paths', GAP: 'Next gaps', GOAL: 'Goals'}[name]
    return f'{subject}: {PUBLISHED} is {judged}.'


def make_summary(answer: Mapping[str, Any]) -> list[str]:
    """Return the main results of `evaluate --json` in plain words, beside those of the simple predictors."""
    count = answer['recordings']
    words = f'{PUBLISHED} predicted {count} recording{"s" * (count > 1)}'
    sentences = [f'{words}, at {answer["predictions"]} moments on the way.']
    for name, asked in ASKED.items():
        if name in answer['questions']:
            sentences += _summarise_question(name, asked, answer, count)
    if 0 < count < FEWEST:
        sentences.append(f'{FEWEST} recordings are needed to tell differences between predictors from chance.')
    errors, share = answer['positions']['displacement_m'], answer['positions']['inside_all'][f'{COVERAGE_LEVEL:g}'][COVERAGE_S]
    if (error_m := errors[OURS]['final'][COVERAGE_S]) is not None:
        others = [f'{name} {1e3 * errors[name]["final"][COVERAGE_S]:.0f} mm' for name in errors if name not in OWN_POSITIONS]
        ours = f'{COVERAGE_S} s ahead, the predicted position was {1e3 * error_m:.0f} mm from the true one on average'
        sentences.append(f'{ours}; that of {", of ".join(others)}.')
    if share is not None:
        level = 100.0 * COVERAGE_LEVEL
        sentences.append(f'The region that should hold {level:.0f} % of the true positions then held {100.0 * share:.0f} %.')
    return sentences


def _summarise_question(name: str, asked: str, answer: Mapping[str, Any], recordings: int) -> list[str]:
    scores, comparisons = answer['questions'][name], answer['comparisons'][name]
    simple = [name for name in comparisons if name != UNIFORM]
    found = {}
    for score in ('right', 'log_likelihood'):
        best = max(simple, key=lambda name: scores[name][score])
        found[score] = [scores[PUBLISHED][score], scores[best][score], best]
    chances = [100.0 * np.exp(each) for each in (*found['log_likelihood'][:2], scores[UNIFORM]['log_likelihood'])]
    ours, other, best = found['right']
    sentences = [
        f'The likeliest {asked} was the one that the hand took in {100.0 * ours:.0f} % of them; with the best simple predictor, '
        f'{best}, in {100.0 * other:.0f} %. The true one had a probability of {chances[0]:.0f} % (geometric mean); '
        f'the best simple predictor, {found["log_likelihood"][2]}, gives it {chances[1]:.0f} %, a guess among equals '
        f'{chances[2]:.0f} %.'
    ]
    verdicts, told = {each: _judge(comparisons[each], recordings) for each in simple}, []
    for verdict in ('better than', 'worse than', UNKNOWN):
        names = [each for each in simple if verdicts[each] == verdict]
        told += (
            [f'{verdict} {f"all {len(simple)} simple ones" if len(names) == len(simple) else ", ".join(names)}'] if names else []
        )
    subject = 'By how often it was right' if name == GAP else 'By this probability'
    return sentences + ([f'{subject}, {PUBLISHED} is {"; ".join(told)}.'] if told else [])


def make_tables(answer: Mapping[str, Any]) -> Iterator[Table]:
    """Yield the tables of an answer of `evaluate --json`."""
    questions, tenths = answer['questions'], ('', *(str(tenth + 1) for tenth in range(TENTHS)))
    for name, subject in ((PATH_CLASS, 'Path'), (GOAL, 'Goal')):
        if name in questions:
            title, scores = f'{subject}: log-likelihood above uniform [nat]', questions[name].items()
            gains = [_show_row(predictor, (tenth['gain'] for tenth in each['by_tenth'])) for predictor, each in scores]
            yield f'{title}, by tenths of the movement', tenths, gains
            totals = [
                (predictor, *(_show(each[score], factor, digits) for score, factor, digits in TOTALS.values()))
                for predictor, each in scores
            ]
            yield f'{title}, of all', ('', *TOTALS), totals
    if GAP in questions:
        scores = questions[GAP].items()
        shares = [_show_row(predictor, (tenth['right'] for tenth in each['by_tenth']), 100.0, 0) for predictor, each in scores]
        yield GAP_TITLE, tenths, shares
        halves = [_show_row(predictor, [each['right_from_half_way']], 100.0, 1) for predictor, each in scores]
        yield 'Gap in the next row', ('', 'correct in the second half [%]'), halves
    positions, horizons = answer['positions'], [f'{each:g} s' for each in HORIZONS_S]
    columns = ('', *(f'{kind}\n{each}' for kind in ('average', 'final') for each in horizons))
    errors = positions['displacement_m'].items()
    rows = [_show_row(name, (error for by in kinds.values() for error in by.values()), 1e3, 1) for name, kinds in errors]
    yield 'Displacement error [mm]', columns, rows
    rows = [_show_row(name, by.values()) for name, by in positions['nlpd'].items()]
    yield 'Negative log-density of the true position [nat, metres]', ('', *horizons), rows
    rows = [
        _show_row(f'{words}, {100 * float(level):g} %', by.values(), 100.0, 1)
        for name, words in REGIONS.items()
        for level, by in positions[name].items()
    ]
    yield 'True positions inside [%]', ('', *horizons), rows
    facts: list[tuple[str, ...]] = [
        ('recordings', f'{answer["recordings"]}, {len(answer["failed"])} failed'),
        ('predictions', str(answer['predictions'])),
    ]
    for question, settings in answer['settings'].items():
        known = {name: setting for name, setting in settings.items() if setting is not None}
        facts += [(f'{question}, best setting\n{name}', _format_setting(setting)) for name, setting in known.items()]
    yield '', ('', ''), facts


def _format_setting(setting: Any) -> str:
    if isinstance(setting, Mapping):
        return ', '.join(f'{name} {_format_setting(value)}' for name, value in setting.items())
    if isinstance(setting, Sequence) and not isinstance(setting, str):
        return ', '.join(_format_setting(value) for value in setting)
    return f'{setting:.4g}' if isinstance(setting, float) else str(setting)


def _show_row(name: str, values: Iterable[float | None], factor: float = 1.0, digits: int = 2) -> tuple[str, ...]:
    return name, *(_show(each, factor, digits) for each in values)


def _show(value: float | None, factor: float, digits: int) -> str:
    return '-' if value is None else f'{factor * value:.{digits}f}'
