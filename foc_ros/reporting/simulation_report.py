# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The closed-loop study as a page: a figure of the main measures, the table of each operator, and single trials."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.simulation import FOC, NONE
from foc_ros.analysis.simulation.operators import Task
from foc_ros.analysis.simulation.study import COLUMNS, PairResult, Trial, make_tables
from foc_ros.core.config import Config
from foc_ros.io.outputs import SIMULATION_PAGE

from .draw import draw_scene, get_class_style
from .example import warn_of_few
from .page import Picture, Section, explain_tables, make_chart, write_page

DRAWN = ('collision_rate', 'completion_s', 'opposing_impulse')
"""Measures with a figure."""
SIZE_IN = 6.4, 4.2
ARROWS = 24
"""Number of arrows along a path."""
NEWTONS_PER_M = 60.0
"""Force that is drawn with the length of one metre [N/m]."""
BORDER_M = 0.04
EXPLANATIONS = {
    'collisions': 'trials in which the hand entered an obstacle.',
    'time': 'from the beginning of the movement to the arrival.',
    'clearance': 'the least distance from an obstacle; negative within one.',
    'effort': 'the integral of the square of the force of the operator.',
    'opposing impulse': 'force of the guidance against the direction in which the operator wants to go, added up over time.',
    'mean opposing force': 'the same on average, in parts of the greatest force of the guidance.',
    'wrong way': 'where the operator takes another path than predicted: how much more it costs than without guidance.',
    'bootstrap interval': 'the mean would be in it in 95 of 100 such studies. Two rules whose intervals overlap may be alike.',
}
"""What the words in headings and columns mean."""
SUMMARISED = {'collision_rate': 'collisions in {:.0f} % of the trials', 'completion_s': '{:.2f} s for a movement'}


def write_report(
    directory: Path, cells: Sequence[Mapping[str, Any]], results: Sequence[PairResult], config: Config | None = None
) -> None:
    """Write the page; cells: of `simulate --json`. Raises InputError where that cannot be done."""
    sections = [
        Section('In short', summarise(cells), list(_draw_measures(cells))),
        *explain_tables(make_tables(cells), EXPLANATIONS),
        Section('Single trials', pictures=list(_draw_trials(results))),
    ]
    warnings = warn_of_few(min(cell['trials'] for cell in cells), 'trials of each operator') if cells else []
    write_page(directory, SIMULATION_PAGE, 'Closed-loop study of guidance', sections, warnings, config)


def summarise(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return for each operator what guidance changes, in plain words."""
    sentences = ['Simulated operators reached goals among obstacles, each trial with and without guidance (foc and none).']
    for operator in dict.fromkeys(cell['operator'] for cell in cells):
        by_rule = {cell['assistance']: cell for cell in cells if cell['operator'] == operator}
        told = [
            ' and '.join(
                words.format(COLUMNS[name][1] * by_rule[rule][name])
                for name, words in SUMMARISED.items()
                if by_rule[rule][name] is not None
            )
            + f' {"with" if rule == FOC else "without"} guidance'
            for rule in (FOC, NONE)
            if rule in by_rule
        ]
        sentences.append(f'{operator.replace("_", " ").capitalize()}: {"; ".join(told)}.')
    return sentences


def _draw_measures(cells: Sequence[Mapping[str, Any]]) -> Iterator[Picture]:
    for name in DRAWN:
        words = f'{COLUMNS[name][0]}: mean over the paired trials, with its bootstrap interval of 95 %.'
        yield make_chart(SIZE_IN, words, _draw_measure, cells, name)


def _draw_measure(axes: Any, cells: Sequence[Mapping[str, Any]], name: str) -> None:
    """Draw the mean of a measure with its interval for every operator and rule."""
    operators, rules = (list(dict.fromkeys(cell[key] for cell in cells)) for key in ('operator', 'assistance'))
    heading, factor, _ = COLUMNS[name]
    for number, rule in enumerate(rules):
        drawn = [cell for cell in cells if cell['assistance'] == rule and cell[name] is not None]
        at = [operators.index(cell['operator']) + 0.14 * (number - (len(rules) - 1) / 2) for cell in drawn]
        means = factor * np.array([cell[name] for cell in drawn])
        bounds = factor * np.array([cell[f'{name}_interval'] for cell in drawn]).reshape(-1, 2)
        errors = np.maximum(np.abs(bounds.T - means), 0.0)
        axes.errorbar(at, means, errors, fmt='o', markersize=4, capsize=2, color=get_class_style(number)[0], label=rule)
    axes.set_xticks(range(len(operators)), [name.replace('_', '\n') for name in operators])
    axes.set(ylabel=heading, xlim=(-0.5, len(operators) - 0.5))
    axes.set_ylim(bottom=0.0)


def _draw_trials(results: Sequence[PairResult]) -> Iterator[Picture]:
    """Yield a picture of every trial that was kept."""
    for result in results:
        if result.task is not None:
            words = f'Operator {result.operator}. Intended path dashed; arrows: force of foc; crosses: within an obstacle.'
            yield make_chart(SIZE_IN, words, _draw_trial, result.task, result.trials)


def _draw_trial(axes: Any, task: Task, trials: Mapping[str, Trial]) -> None:
    everything = np.concatenate([task.path.position, task.goals, *(each.position for each in trials.values())])
    (left, low), (right, high) = everything.min(axis=0) - BORDER_M, everything.max(axis=0) + BORDER_M
    draw_scene(axes, task.obstacles, task.goals, (float(left), float(right), float(low), float(high)))
    axes.plot(*task.path.position.T, color='black', linestyle='--', linewidth=1.0, label='intended')
    for number, (rule, trial) in enumerate(trials.items()):
        look = {'color': get_class_style(number)[0], 'linewidth': 2.0 if rule in (FOC, NONE) else 1.0}
        axes.plot(*trial.position.T, label=rule, **look)
        touching = trial.position[trial.find_collisions(task)]
        axes.plot(*touching.T, linestyle='', marker='x', markersize=4, color=look['color'])
        if rule == FOC:
            rows = np.linspace(0, len(trial.position) - 1, ARROWS).astype(int)
            options = {'angles': 'xy', 'scale_units': 'xy', 'scale': NEWTONS_PER_M, 'width': 0.004, 'color': look['color']}
            axes.quiver(*trial.position[rows].T, *trial.assistance[rows].T, zorder=6, **options)
