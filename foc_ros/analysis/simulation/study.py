"""The study: paired trials of operators and assistance rules, and their means with bootstrap intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from foc_ros.analysis.parallel import collect_all
from foc_ros.core.config import Config
from foc_ros.core.types import Array

from .assistance import RULES, Assistance
from .names import HUMAN_PATHS, NONE, OPERATORS
from .operators import Task, draw_task
from .trial import Trial, count_steps, measure_trial, run_trial

MEASURES = (
    'collision_rate',
    'completion_s',
    'min_clearance_m',
    'path_m',
    'effort',
    'opposing_impulse',
    'opposing_share',
    'wrong_way_s',
    'wrong_way_effort',
)
WRONG_S = 0.1
"""Time for which the likeliest way has to be a wrong one for a trial to count in the harm of wrong ways [s]."""
RESAMPLES = 2000
LEVEL = 0.95
SHOWN_TRIALS = 3
"""Number of trials of each operator that are kept with their paths."""
Row = dict[str, float | None]
Rules = Mapping[str, type[Assistance]]
"""Assistance rules by name."""


@dataclass(frozen=True)
class Pair:
    """One seed of one operator: all rules meet the same scene, intention and noise. tasks: for `human_paths`."""

    operator: str
    seed: int
    number: int
    assistance: tuple[str, ...]
    tasks: Sequence[Task] = ()

    def draw(self) -> tuple[Task, Array]:
        """Return the task, and the standard normal numbers of arm and measurement."""
        rng = np.random.default_rng([self.seed, OPERATORS.index(self.operator), self.number])
        task = self.tasks[0] if self.operator == HUMAN_PATHS else draw_task(self.operator, rng)
        return task, rng.normal(size=(count_steps(task), 2, 2))


@dataclass(frozen=True)
class PairResult:
    """The measures of one pair by rule; task and trials: of the first pairs only, for pictures."""

    operator: str
    measures: Mapping[str, Row]
    task: Task | None
    trials: Mapping[str, Trial]


def simulate(pairs: Sequence[Pair], config: Config, executor: Executor, rules: Rules = RULES) -> list[PairResult]:
    """Run all pairs with a progress bar; raise RecordingError where one fails. The results do not depend on the executor."""
    items = [(f'{pair.operator} {pair.number}', pair) for pair in pairs]
    return collect_all(partial(run_pair, config=config, rules=rules), items, executor, 'simulate')


def make_pairs(
    operators: Sequence[str], assistance: Sequence[str], trials: int, seed: int, tasks: Sequence[Task] = ()
) -> list[Pair]:
    """Return the pairs of a study, all with the rule `none`; tasks: of `human_paths`, used one after the other."""
    rules = tuple(dict.fromkeys([NONE, *assistance]))
    return [
        Pair(name, seed, number, rules, [tasks[number % len(tasks)]] if name == HUMAN_PATHS else ())
        for name in operators
        for number in range(trials)
    ]


def run_pair(pair: Pair, config: Config, rules: Rules = RULES) -> PairResult:
    """Run all rules of a pair."""
    task, noise = pair.draw()
    trials = {rule: run_trial(task, rules[rule], config, noise) for rule in pair.assistance}
    raw = {rule: measure_trial(trial, task, config.guidance.f_max) for rule, trial in trials.items()}
    measures = {rule: _add_harm(values, raw[NONE]) for rule, values in raw.items()}
    is_shown = pair.number < SHOWN_TRIALS
    return PairResult(pair.operator, measures, task if is_shown else None, trials if is_shown else {})


def _add_harm(values: Mapping[str, float], alone: Mapping[str, float]) -> Row:
    """Return measures with the time [s] and effort that the operator needs more than alone; None where no way was wrong."""
    row: Row = {name: values[name] for name in values if name != 'wrong_s'}
    is_wrong = values['wrong_s'] >= WRONG_S
    row['wrong_way_s'] = values['completion_s'] - alone['completion_s'] if is_wrong else None
    row['wrong_way_effort'] = values['effort'] - alone['effort'] if is_wrong else None
    return row


def summarise(results: Sequence[PairResult], seed: int) -> list[dict[str, Any]]:
    """Return a cell for each operator and rule: number of trials, and every measure with its interval.

    `<name>_interval` is a bootstrap interval of 95 % of the mean; `<name>_difference` and `<name>_difference_interval` are those
    of the paired difference to `none`. None where there is nothing to average, or the value is not finite.
    """
    cells = []
    for operator in dict.fromkeys(each.operator for each in results):
        rows = [each.measures for each in results if each.operator == operator]
        for rule in rows[0]:
            cell: dict[str, Any] = {'operator': operator, 'assistance': rule, 'trials': len(rows)}
            for name in MEASURES:
                values, alone = (np.array([row[key][name] for row in rows], dtype=float) for key in (rule, NONE))
                cell[name], cell[f'{name}_interval'] = estimate_mean(values, seed)
                if not name.startswith('wrong_way'):
                    cell[f'{name}_difference'], cell[f'{name}_difference_interval'] = estimate_mean(values - alone, seed)
            cells.append(cell)
    return cells


def estimate_mean(values: Array, seed: int) -> tuple[float | None, list[float] | None]:
    """Return the mean of the finite values, and its bootstrap interval of 95 %; None where there is none."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None, None
    rows = np.random.default_rng(seed).integers(len(finite), size=(RESAMPLES, len(finite)))
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(finite[rows].mean(axis=1), [tail, 100.0 - tail])
    return float(finite.mean()), [float(low), float(high)]
