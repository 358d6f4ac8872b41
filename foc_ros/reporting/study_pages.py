# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pages about many recordings or trials: an evaluation, a fit, the closed-loop study."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation import report as evaluation
from foc_ros.analysis.evaluation.baselines import BOLTZMANN, PLAIN, PUBLISHED, REFITTED, UNIFORM
from foc_ros.analysis.evaluation.observations import GAP, GOAL, PATH_CLASS
from foc_ros.analysis.evaluation.scores import FEWEST, TENTHS, warn_of_few
from foc_ros.analysis.fitting import fit as fitting
from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay
from foc_ros.analysis.simulation import FOC, NONE, study
from foc_ros.analysis.simulation.operators import Task
from foc_ros.core.config import Config
from foc_ros.core.errors import FocError
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.outputs import EVALUATION_PAGE, FIT_PAGE, SIMULATION_PAGE

from .draw import compute_bounds, draw_scene, get_class_style
from .figures import make_moment_figure
from .page import Section, explain_tables, make_chart, make_picture, write_page
from .report import ReportCollector
from .views import choose_moment

NAT = 'the unit of a natural logarithm of a probability. 0.69 nat more means twice the probability for what really happened.'
EVALUATION_WORDS = {
    'nat': NAT,
    'above uniform': 'compared with a guess that finds all answers equally likely. 0 is no better than this; more is better.',
    'tenths': 'the first one is about the beginning of the movement, when little is known, the last one about its end.',
    'gain': 'the log-likelihood above uniform [nat], averaged over the whole movement.',
    'ECE': 'the expected calibration error: how far the stated probabilities are from the shares that come true. 0 is best.',
    'Brier': 'the mean squared error of the probabilities. 0 is best.',
    'correct': 'how often the likeliest answer is the true one.',
    'leads from': 'the part of the movement from which on the true answer stays the likeliest one. Less is better.',
    'leads for': 'the time before the end of the movement from which on the true answer stays the likeliest one. More is better.',
    'second half': 'predictions after the hand has covered half of its way.',
    'average': 'the distance of the predicted from the true position, over all times until then.',
    'final': 'this distance at that time alone.',
    'Negative log-density': 'how improbable the true position was. Less is better: both a wrong place and a wrong width count.',
    'inside': 'how often the true position is in the region that should hold this share of them. The share itself is best.',
    'held out': 'each recording is scored with the settings that fit the others best, so that none has been learnt by heart.',
    'bootstrap': 'recordings are drawn again and again, some twice and some not at all; 95 % of the results are in the interval.',
    'foc': 'this package with the given parameters; of all others but uniform, whatever can be set is held out.',
    PLAIN: 'the same with one exponent for all choices, near and far.',
    BOLTZMANN: 'each candidate has the probability exp(-b J), where J is its effort (maximum entropy).',
    'constant velocity': 'the hand goes on straight ahead, as fast as now.',
    'nearest gap': 'the gap straight ahead of the hand, or the nearest goal.',
    'shortest path': 'the shortest of all candidates.',
    'straight minimum jerk': 'a smooth straight movement to each goal, obstacles disregarded.',
    'Singer Kalman': 'a Kalman filter for a target that manoeuvres, which knows no scene.',
    'best setting': 'the one that fits all recordings best.',
}
FIT_WORDS = {
    'nat': NAT,
    'above uniform': 'compared with a guess that finds all answers equally likely. 0 is no better than this guess.',
    'log-likelihood': 'the logarithm of the probability of what the hand really did. More is better.',
    'log-density': 'how probable the true positions were. More is better; of a negative log-density less is better.',
    'region of 90 %': 'should hold 90 % of the true positions.',
    '90 % ellipse': 'should hold 90 % of the true positions, if the hand takes the most likely path.',
    'widening': 'process noise, scatter of the end point and spread of the duration, which widen the ellipses.',
    'held out': 'likelihood and widening fitted to the other recordings, all else to all: these two have learnt none by heart.',
    'as given': 'likelihood and widening at their given values, all else fitted.',
    '95 %': 'the interval within which the value would come out from other recordings of this kind; wide means: not well known.',
}
SIMULATION_WORDS = {
    'none': 'the operator moves alone, without guidance.',
    'foc': 'the operator moves with the guidance of this package.',
    'collisions': 'trials in which the hand entered an obstacle.',
    'arrivals': 'trials in which the hand came to rest at its goal.',
    'time': 'from the beginning of the movement to the arrival, over these trials.',
    'clearance': 'the least distance from an obstacle; negative within one.',
    'path [m]': 'the length of the path of the hand.',
    'effort': 'the integral of the square of the force of the operator.',
    'opposing impulse': 'force of the guidance against the direction in which the operator wants to go, added up over time.',
    'mean opposing force': 'the same on average, in parts of the greatest force of the guidance.',
    'wrong way': 'where the operator takes another path than predicted: how much more it costs than without guidance.',
    'bootstrap interval': 'the mean would be in it in 95 of 100 such studies. Two rules whose intervals overlap may be alike.',
}
"""What the words in headings, columns and rows of each page mean."""


def write_evaluation(
    directory: Path,
    title: str,
    answer: Mapping[str, Any],
    recordings: Mapping[str, Recording] | None = None,
    config: Config | None = None,
) -> None:
    """Write the page; answer: as of `evaluate --json`, of recordings. Raises InputError where that cannot be done."""
    counts = f'with the numbers of predictions of {PUBLISHED}, and with intervals of 95 % by bootstrap over recordings where '
    counts += f'these are {FEWEST} or more'
    gain = 'mean log-likelihood of the true {} above uniform [nat], by tenths of the movement.'
    captions = {
        PATH_CLASS: f'Path past the obstacles still ahead: {gain.format("path")}',
        GOAL: f'Goal: {gain.format("goal")}',
        GAP: 'Gap in the next row: how often the likeliest gap is the true one, by tenths of the distance from row to row.',
    }
    pictures = []
    for name, caption in captions.items():
        if name in answer['questions']:
            reliability = f'{caption.partition(":")[0]}: how often the likeliest answer is true, over its probability, {counts}.'
            for draw, words in ((_draw_tenths, caption), (_draw_reliability, reliability)):
                pictures.append(make_chart((6.4, 4.6), words, draw, name, answer['questions'][name]))
    named = [[caption for _, caption in pictures], *map(list, answer['questions'].values())]
    all_predictors, *tables = explain_tables([('All predictors', (), named), *evaluation.make_tables(answer)], EVALUATION_WORDS)
    sections = [
        Section('In short', evaluation.make_summary(answer)),
        *draw_example(recordings, config),
        replace(all_predictors, pictures=pictures, rows=()),
        Section('Compared with simpler predictors', answer['verdict']),
        *tables,
    ]
    failed = [f'{name}: {reason}' for name, reason in answer['failed'].items()]
    warnings = [*answer['warnings'], *warn_of_few(answer['recordings'], 'recordings'), *failed]
    write_page(directory, EVALUATION_PAGE, f'Evaluation: {title}', sections, warnings, config)


def _find_look(predictor: str, all_predictors: Iterable[str]) -> dict[str, Any]:
    """Return the look of a predictor in all charts, in no colour of a path: black lines of this package, grey signs of others."""
    ours = {PUBLISHED: '-', REFITTED: '--', PLAIN: ':'}
    if predictor in ours:
        return {'color': 'black', 'linestyle': ours[predictor], 'linewidth': 2.0, 'marker': '.'}
    number = [each for each in all_predictors if each not in (*ours, UNIFORM)].index(predictor)
    signs = 'osD^vP*X<>'
    style = ('-', '--', ':')[number // len(signs) % 3]
    return {'color': '0.5', 'linestyle': style, 'linewidth': 1.0, 'marker': signs[number % len(signs)], 'markersize': 5.0}


def _draw_tenths(axes: Any, name: str, by_predictor: Mapping[str, Any]) -> None:
    score = 'right' if name == GAP else 'gain'
    for predictor, scores in by_predictor.items():
        if predictor != UNIFORM:
            heights = [each[score] if each[score] is not None else float('nan') for each in scores['by_tenth']]
            axes.plot(range(1, TENTHS + 1), heights, label=predictor, **_find_look(predictor, by_predictor))
    axes.set(xlabel=f'tenth of the {"distance" if name == GAP else "movement"}', xticks=range(1, TENTHS + 1))
    axes.set_ylabel('share of true answers' if name == GAP else 'log-likelihood above uniform [nat]')
    axes.axhline(0.0, color='0.4', linewidth=0.8)


def _draw_reliability(axes: Any, _: str, by_predictor: Mapping[str, Any]) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color='0.4', linewidth=0.8)
    for predictor in (PUBLISHED, REFITTED, BOLTZMANN):
        bins = [each for each in by_predictor[predictor]['reliability'] if each['count']]
        shares = np.array([each['right'] for each in bins])
        intervals = [each['interval'] if each['recordings'] >= FEWEST else (np.nan, np.nan) for each in bins]
        errors = np.abs(np.array(intervals).reshape(-1, 2).T - shares)
        look = {'capsize': 2, 'label': predictor, **_find_look(predictor, by_predictor)}
        (line, *_) = axes.errorbar([each['confidence'] for each in bins], shares, errors, **look)
        for each in bins if predictor == PUBLISHED else ():
            place = {'xy': (each['confidence'], each['right']), 'xytext': (5, -9), 'textcoords': 'offset points'}
            axes.annotate(str(each['count']), **place, fontsize=7, color=line.get_color())
    axes.set(xlabel='probability of the likeliest answer', ylabel='share of true answers', aspect='equal')


def write_fit(
    directory: Path,
    title: str,
    answer: Mapping[str, Any],
    recordings: Mapping[str, Recording] | None = None,
    config: Config | None = None,
) -> None:
    """Write the page; answer: as of `fit --json`, of recordings, with the fitted configuration.

    Raises InputError where that cannot be done.
    """
    count, failed = answer['recordings'], [f'{name}: {reason}' for name, reason in answer['failed'].items()]
    commands = [('parameter file', answer['output']), *zip(('without ROS', 'with ROS'), answer['node'], strict=True)]
    changed = sum(each['value'] != each['given'] for each in (*answer['parameters'].values(), *answer['chosen'].values()))
    kept = len(fitting.format_kept(answer))
    fitted = f'Fitted to {count} recording{"s" * (count != 1)}, {changed} parameter{"s" * (changed != 1)} changed, {kept} kept.'
    caption = 'Fitted values as multiples of the given ones, with 95 % intervals by bootstrap over recordings; '
    caption += 'the line is the given value.'
    drawn = {name: each for name, each in answer['parameters'].items() if each['given'] > 0.0 and each['value'] > 0.0}
    pictures = [make_chart((6.4, 0.9 + 0.34 * len(drawn)), caption, _draw_multiples, drawn)] if drawn else []
    sections = [
        Section('In short', [fitted, *fitting.make_verdict(answer)]),
        *draw_example(recordings, config),
        Section(pictures=pictures),
        *explain_tables(fitting.make_tables(answer), FIT_WORDS),
        Section('Run the node with these parameters', rows=commands),
    ]
    warnings = [*answer['warnings'], *failed]
    write_page(directory, FIT_PAGE, f'Fit: {title}', sections, warnings, config)


def _draw_multiples(axes: Any, drawn: Mapping[str, Any]) -> None:
    from matplotlib.ticker import LogLocator

    colour, _ = get_class_style(0)
    for row, each in enumerate(drawn.values()):
        ends = [end / each['given'] for end in each['interval'] if end > 0.0]
        axes.plot(ends, [row] * len(ends), color=colour, linewidth=3.0, alpha=0.5, solid_capstyle='butt')
        axes.plot(each['value'] / each['given'], row, marker='o', color=colour)
    axes.axvline(1.0, color='0.4', linewidth=1.0)
    axes.set_yticks(range(len(drawn)), list(drawn))
    axes.set(xscale='log', xlabel='fitted / given', ylim=(len(drawn) - 0.4, -0.6))
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.4), max(high, 2.5))  # so that there are three labels at least
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter('{x:g}')
    axes.xaxis.set_minor_formatter('')
    axes.tick_params(axis='x', labelsize=8, rotation=90)


def write_simulation(
    directory: Path, cells: Sequence[Mapping[str, Any]], results: Sequence[study.PairResult], config: Config | None = None
) -> None:
    """Write the page; cells: of `simulate --json`. Raises InputError where that cannot be done."""
    words = f'mean over the paired trials, of {FEWEST} or more with its bootstrap interval of 95 %.'
    measures = [
        make_chart((6.4, 4.2), f'{study.COLUMNS[name][0]}: {words}', _draw_measure, cells, name)
        for name in ('collision_rate', 'completion_s', 'opposing_impulse')
    ]
    words = 'Intended path dashed; arrows: force of guidance; crosses: within an obstacle.'
    trials = [
        make_chart((6.4, 4.2), f'Operator {each.operator}. {words}', _draw_trial, each.task, each.trials)
        for each in results
        if each.task
    ]
    sections = [
        Section('In short', study.make_summary(cells), pictures=measures),
        *explain_tables(study.make_tables(cells), SIMULATION_WORDS),
        Section('Single trials', pictures=trials),
    ]
    warnings = warn_of_few(min(cell['trials'] for cell in cells), 'trials of each operator') if cells else []
    write_page(directory, SIMULATION_PAGE, 'Closed-loop study of guidance', sections, warnings, config)


def _draw_measure(axes: Any, cells: Sequence[Mapping[str, Any]], name: str) -> None:
    """Draw the mean of a measure with its interval for every operator and rule."""
    operators, rules = (list(dict.fromkeys(cell[key] for cell in cells)) for key in ('operator', 'assistance'))
    heading, factor, _ = study.COLUMNS[name]
    for number, rule in enumerate(rules):
        drawn = [cell for cell in cells if cell['assistance'] == rule and cell[name] is not None]
        at = [operators.index(cell['operator']) + 0.14 * (number - (len(rules) - 1) / 2) for cell in drawn]
        means = factor * np.array([cell[name] for cell in drawn])
        intervals = [cell[f'{name}_interval'] if cell['trials'] >= FEWEST else (np.nan, np.nan) for cell in drawn]
        bounds = factor * np.array(intervals, dtype=float).reshape(-1, 2)
        errors = np.maximum(np.abs(bounds.T - means), 0.0)
        axes.errorbar(
            at,
            means,
            errors,
            fmt='o',
            label=study.RULE_WORDS.get(rule, rule),
            markersize=4,
            capsize=2,
            color=get_class_style(number)[0],
        )
    axes.set_xticks(range(len(operators)), [name.replace('_', '\n') for name in operators])
    axes.set(ylabel=heading, xlim=(-0.5, len(operators) - 0.5))
    axes.set_ylim(bottom=0.0)


def _draw_trial(axes: Any, task: Task, trials: Mapping[str, study.Trial]) -> None:
    paths = [task.path[:, 0], *(each.position for each in trials.values())]
    draw_scene(axes, task.obstacles, task.goals, compute_bounds(task.obstacles, task.goals, (), *paths))
    axes.plot(*task.path[:, 0].T, color='black', linestyle='--', linewidth=1.0, label='intended')
    for number, (rule, trial) in enumerate(trials.items()):
        look = {'color': get_class_style(number)[0], 'linewidth': 2.0 if rule in (FOC, NONE) else 1.0}
        axes.plot(*trial.position.T, label=study.RULE_WORDS.get(rule, rule), **look)
        touching = trial.position[trial.measure_clearances(task) < 0.0]
        axes.plot(*touching.T, linestyle='', marker='x', markersize=4, color=look['color'])
        if rule == FOC:
            rows = np.linspace(0, len(trial.position) - 1, 24).astype(int)
            options = {'angles': 'xy', 'scale_units': 'xy', 'scale': 60.0, 'width': 0.004, 'color': look['color']}  # [N/m]
            axes.quiver(*trial.position[rows].T, *trial.assistance[rows].T, zorder=6, **options)


def draw_example(recordings: Mapping[str, Recording] | None, config: Config | None) -> list[Section]:
    """Return a section with a moment of the first recording that can be replayed, nothing if there is none."""
    for name, recording in (recordings or {}).items():
        collected = ReportCollector()
        try:
            for step in Replay(config or Config()).steps(islice(recording.items(), 3_000)):
                collected.add(step)
        except FocError:
            continue  # the page lists what cannot be read
        hand = collected.hand
        for span in hand.find_movements():
            row = choose_moment(collected.snapshots, *span)
            if row is not None:
                snapshot = collected.snapshots[row]
                words = f'{name}, {(snapshot.stamp_ns - span[0]) / NANOSECONDS:.2f} s after the hand began to move.'
                picture = make_picture(make_moment_figure(hand, snapshot, span), words)
                return [Section('One recording with its prediction', pictures=[picture])]
    return []
