# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The study: assistance rules in closed loop with operators, in paired trials, and their means with bootstrap intervals.

Each rule is told the scene and the goals, and has the same estimate of the hand and the same limits of force and slew.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.scores import compute_mean_interval, find_mean
from foc_ros.analysis.simulation import FOC, HUMAN_PATHS, NONE, OPERATORS
from foc_ros.analysis.simulation.operators import DT, SimulatedArm, Task, draw_task
from foc_ros.core.classes.sides import find_path_sides
from foc_ros.core.config import Config
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceState, guide
from foc_ros.core.guidance.limits import find_largest_force, shorten
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Record

HARMS = {'wrong_way_s': 'duration_s', 'wrong_way_effort': 'effort'}
"""Measures of harm, and the measure that each compares: by how much more an operator needs than alone, in trials in which the
likeliest way was wrong; nan in the others. It is a lower bound where the trial ended before the hand arrived."""
COLUMNS = {
    'collision_rate': ('collisions [%]', 100.0, 1),
    'arrival_rate': ('arrivals [%]', 100.0, 1),
    'completion_s': ('time [s]', 1.0, 2),
    'min_clearance_m': ('clearance [mm]', 1e3, 1),
    'path_m': ('path [m]', 1.0, 3),
    'effort': ('effort [N² s]', 1.0, 2),
    'opposing_impulse': ('opposing impulse [N s]', 1.0, 3),
    'opposing_share': ('mean opposing force [% of f_max]', 100.0, 2),
    'wrong_way_s': ('extra time, wrong way [s]', 1.0, 2),
    'wrong_way_effort': ('extra effort, wrong way [N² s]', 1.0, 2),
}
"""The measures by name: heading, factor and digits."""
RULE_WORDS = {FOC: 'with guidance', NONE: 'without guidance'}


class Assistance:
    """A rule in one trial; this one gives no force. Attributes: is_wrong, whether its likeliest way is not the intended one."""

    def __init__(self, task: Task, config: Config) -> None:
        self.task, self.config, self.is_wrong = task, config, False
        self.pipeline = Pipeline(config)
        self.pipeline.set_goals(task.goals, '')
        self.pipeline.set_obstacles('simulation', task.obstacles, None, '')
        self._force = np.zeros(2)

    def update(self, step: int, measured: Array) -> Array:
        """Return the force (2,) [N] at a time step from the measured position (2,) [m]."""
        if step % 2 == 0:  # poses are measured at 100 Hz
            self.pipeline.add_hand_sample(HandSample(round((1.0 + step * DT) * NANOSECONDS), measured))
        assert self.pipeline.hand_state is not None
        target = self.compute_force(step, *self.pipeline.hand_state.mean.reshape(3, 2))
        settings = self.config.guidance
        self._force = self._force + shorten(shorten(target, find_largest_force(settings)) - self._force, settings.slew * DT)
        return self._force

    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:  # noqa: ARG002
        """Return the wanted force (2,) [N] for the estimated position [m], velocity [m/s] and acceleration [m/s^2], (2,) each."""
        return np.zeros(2)


class FocAssistance(Assistance):
    """The guidance of this package. A prediction is available one period after the pose that it was made from."""

    def __init__(self, task: Task, config: Config) -> None:
        super().__init__(task, config)
        self._state = GuidanceState()
        self._newest: Prediction | None = None
        self._next: Prediction | None = None
        self._is_next_wrong = False

    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Return the force of the guidance."""
        t = 1.0 + step * DT
        if self.pipeline.is_due:
            self._newest, self.is_wrong = self._next, self._is_next_wrong
            self._next = self.pipeline.predict()
            self._is_next_wrong = self._next is not None and self._is_wrong_way(self._next, step)
        age_s = 0.0 if self._newest is None else t - self._newest.t
        given = GuidanceInput(t, position, velocity, self._newest, 0.0, age_s, acceleration=acceleration)
        output, self._state = guide(self.config, self._state, given)
        return output.force

    def _is_wrong_way(self, prediction: Prediction, step: int) -> bool:
        """Return whether the likeliest candidate leads to another goal, or passes an obstacle on another side, than intended."""
        path, goal = self.task.path, self.task.goal_row
        rest = np.ascontiguousarray(path[min(step, len(path) - 2) :, 0])
        for each in prediction.candidates_with_likelihood:
            if each.label == prediction.most_likely:
                intended = find_path_sides(rest, self.task.obstacles)
                return each.candidate.goal != goal or any(intended.get(name, side) != side for name, side in each.sides.items())
        return False


RULES: dict[str, type[Assistance]] = {NONE: Assistance, FOC: FocAssistance}
"""The rules of `simulate` by name. A study may add others, which are made from a task and a configuration."""


@dataclass(frozen=True, eq=False)
class Trial(Record):
    """What happened in a trial, at each of its n time steps.

    position (n, 2) [m]; assistance, effort (n, 2): forces of assistance and operator [N]; is_wrong (n,): whether the rule took
    another way than the intended one to be the likeliest; has_arrived: whether the hand came to rest at its goal in time.
    """

    position: Array
    assistance: Array
    effort: Array
    is_wrong: Array
    has_arrived: bool

    def measure_clearances(self, task: Task) -> Array:
        """Return the distance of the hand from the nearest obstacle, (n,) [m]; infinite without obstacles."""
        offsets = measure_offsets(self.position, task.obstacles)[1] - task.obstacles.radius - task.hand_radius
        return np.asarray(offsets.min(axis=1, initial=np.inf))


def run_trial(task: Task, assistance: type[Assistance], config: Config, noise: Array) -> Trial:
    """Run a trial. noise (n, 2, 2): standard normal numbers for arm and measurement, the same ones for each rule of a pair."""
    arm, rule, rows = SimulatedArm(task.arm, task.path), assistance(task, config), []
    was_away = has_arrived = False  # a movement that comes back to where it begins has not arrived there at its start
    for step, (shaken, measured) in enumerate(noise):
        force = rule.update(step, arm.position + 3e-4 * measured)  # the standard deviation of a tracker [m]
        arm.move(force, shaken)
        rows.append((*arm.position, *force, *arm.force, float(rule.is_wrong)))
        is_away = np.hypot(*(arm.position - task.goal)) >= 0.01  # [m]
        was_away = was_away or is_away
        has_arrived = was_away and not is_away and np.hypot(*arm.velocity) < 0.05  # [m/s]
        if has_arrived:
            break
    table = np.array(rows)
    return Trial(table[:, :2], table[:, 2:4], table[:, 4:6], table[:, 6], has_arrived)


def measure_trial(trial: Trial, task: Task, f_max: float) -> dict[str, float]:
    """Return the measures of a trial by name; the opposing impulse integrates the force against the intended movement."""
    clearance, duration_s = float(trial.measure_clearances(task).min()), DT * len(trial.position)
    velocity = task.path[: len(trial.position), 1]
    speed = np.hypot(*velocity.T)
    along = (trial.assistance[: len(velocity)] * velocity).sum(axis=1) / np.where(speed > 0.0, speed, 1.0)
    opposing = DT * float(np.maximum(-along, 0.0).sum())
    return {
        'collision_rate': float(clearance < 0.0),
        'arrival_rate': float(trial.has_arrived),
        'duration_s': duration_s,
        'completion_s': duration_s if trial.has_arrived else np.nan,
        'min_clearance_m': clearance if len(task.obstacles) else np.nan,
        'path_m': float(np.hypot(*np.diff(trial.position, axis=0).T).sum()),
        'effort': DT * float((trial.effort**2).sum()),
        'opposing_impulse': opposing,
        'opposing_share': opposing / duration_s / f_max if f_max else 0.0,
    }


@dataclass(frozen=True)
class Pair:
    """One seed of one operator: all rules meet the same scene, intention and noise. task: for `human_paths`."""

    operator: str
    seed: int
    number: int
    assistance: tuple[str, ...]
    task: Task | None = None


@dataclass(frozen=True)
class PairResult:
    """The measures of one pair by rule; task and trials: of the first pairs only, for pictures."""

    operator: str
    measures: Mapping[str, Mapping[str, float]]
    task: Task | None
    trials: Mapping[str, Trial]


def make_pairs(
    operators: Sequence[str], assistance: Sequence[str], trials: int, seed: int, tasks: Sequence[Task] = ()
) -> list[tuple[str, Pair]]:
    """Return the pairs of a study with their names, all with the rule `none`; tasks: of `human_paths`, one after the other."""
    rules = tuple(dict.fromkeys([NONE, *assistance]))
    return [
        (f'{name} {number}', Pair(name, seed, number, rules, tasks[number % len(tasks)] if name == HUMAN_PATHS else None))
        for name in operators
        for number in range(trials)
    ]


def run_pair(pair: Pair, config: Config, rules: Mapping[str, type[Assistance]] = RULES) -> PairResult:
    """Run all rules of a pair."""
    rng = np.random.default_rng([pair.seed, OPERATORS.index(pair.operator), pair.number])
    task = pair.task or draw_task(pair.operator, rng, config.scene.hand_radius)
    noise = rng.normal(size=(len(task.path) + round(1.5 / DT), 2, 2))  # a trial ends 1.5 s after the intended movement
    trials = {rule: run_trial(task, rules[rule], config, noise) for rule in pair.assistance}
    measures = {rule: measure_trial(trial, task, config.guidance.f_max) for rule, trial in trials.items()}
    for rule, row in measures.items():
        is_wrong = DT * trials[rule].is_wrong.sum() >= 0.1
        for harm, name in HARMS.items():
            row[harm] = row[name] - measures[NONE][name] if is_wrong else np.nan
    is_shown = pair.number < 3
    return PairResult(pair.operator, measures, task if is_shown else None, trials if is_shown else {})


def summarise(results: Sequence[PairResult], seed: int) -> list[dict[str, Any]]:
    """Return a cell for each operator and rule: number of trials, and every measure with its interval.

    `<name>_difference` is the paired difference to `none`. None where there is nothing to average, or the value is not finite.
    """
    cells = []
    for operator in dict.fromkeys(each.operator for each in results):
        rows = [each.measures for each in results if each.operator == operator]
        for rule in rows[0]:
            cell: dict[str, Any] = {'operator': operator, 'assistance': rule, 'trials': len(rows)}
            for name in COLUMNS:
                values, alone = (np.array([row[key][name] for row in rows]) for key in (rule, NONE))
                measures = {name: values} if name in HARMS else {name: values, f'{name}_difference': values - alone}
                for measure, each in measures.items():
                    finite = each[np.isfinite(each)]
                    interval = compute_mean_interval(finite, np.arange(len(finite)), seed, 2000) if len(finite) else None
                    cell |= {measure: find_mean(finite), f'{measure}_interval': interval}
            cells.append(cell)
    return cells


def make_summary(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return for each operator what guidance changes, in plain words."""
    measures = {'collision_rate': 'collisions in {:.0f} % of the trials', 'completion_s': '{:.2f} s for a movement'}
    sentences = ['Simulated operators reached goals among obstacles, each trial with and without guidance (foc and none).']
    for operator in dict.fromkeys(cell['operator'] for cell in cells):
        by_rule, told = {cell['assistance']: cell for cell in cells if cell['operator'] == operator}, []
        for rule, words in RULE_WORDS.items():
            values = {name: by_rule[rule][name] for name in measures} if rule in by_rule else {}
            known = [measures[name].format(COLUMNS[name][1] * each) for name, each in values.items() if each is not None]
            if values:
                told.append(f'{" and ".join(known)} {words}')
        sentences.append(f'{operator.replace("_", " ").capitalize()}: {"; ".join(told)}.')
    return sentences


def make_tables(cells: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Yield title, columns and rows for each operator, from the cells of `simulate --json`."""

    def show(cell: Mapping[str, Any], name: str, factor: float, digits: int) -> str:
        if cell[name] is None:
            return '-'
        # z: 0 has no sign
        value, low, high = (f'{factor * each:z.{digits}f}' for each in (cell[name], *cell[f'{name}_interval']))
        return f'{value} ({low} to {high})'

    for operator in dict.fromkeys(cell['operator'] for cell in cells):
        rows = [cell for cell in cells if cell['operator'] == operator]
        title = f'{operator}: mean of {rows[0]["trials"]} paired trials, and bootstrap interval of 95 %'
        styles = COLUMNS.items()
        lines = [
            (cell['assistance'], *(show(cell, name, factor, digits) for name, (_, factor, digits) in styles)) for cell in rows
        ]
        yield title, ('', *(heading for heading, _, _ in COLUMNS.values())), lines
