# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tasks: reach the lit goal from the start, without touching an obstacle, in a random sequence; and their scores."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from .messages import TasksMessage
from .scene import START, TARGET_RADIUS, PlayScene, Point, make_random_scene

REST_S = 0.3
"""Time for which the hand has to stay at a goal to reach it [s]."""
SCORE_COLUMNS = ('', 'trials', 'time [s]', 'touched', 'path [cm]', 'predicted ahead [s]')


class Phase(Enum):
    """What the hand has to do: go to the start, rest there, reach the lit goal; or the tasks are over."""

    RETURN = 'return'
    WAIT = 'wait'
    REACH = 'reach'
    OVER = 'over'


@dataclass(frozen=True)
class Trial:
    """One trial: its scene, the row of the goal that is lit, and whether the hand is guided."""

    scene: PlayScene
    goal: int
    is_guided: bool


class TrialMovement:
    """One movement from the light to the goal, and what it came to.

    Attributes: is_guided; touched: how often the hand entered an obstacle; path_m: length of its path; time_s: from the light to
    the arrival, without the rest at the goal; ahead_s: how long before the arrival the class taken had become the most likely one
    for good, nan if the trial was over before. The times are nan before the arrival.
    """

    def __init__(self, trial: Trial, t: float, position: Point) -> None:
        self.is_guided, self._scene, self._goal = trial.is_guided, trial.scene, trial.scene.points[trial.goal]
        self.touched, self.path_m = 0, 0.0
        self._begin_s, self._arrival_s, self._position = t, math.nan, position
        self._is_inside, self._most_likely = False, (math.nan, -1)

    @property
    def time_s(self) -> float:
        """From the light to the arrival [s]."""
        return self._arrival_s - self._begin_s

    @property
    def ahead_s(self) -> float:
        """From the right prediction to the arrival [s]."""
        return self._arrival_s - self._most_likely[0]

    def add(self, t: float, position: Point) -> bool:
        """Take a position at a time [s]; return whether the hand has rested at its goal for REST_S."""
        is_inside = self._scene.measure_clearance(position) < 0.0
        self.touched += is_inside and not self._is_inside
        self.path_m += math.dist(position, self._position)
        self._is_inside, self._position = is_inside, position
        if math.dist(position, self._goal) > TARGET_RADIUS:
            self._arrival_s = math.nan
        elif math.isnan(self._arrival_s):
            self._arrival_s = t
        return t - self._arrival_s >= REST_S

    def note_most_likely(self, t: float, way: int) -> None:
        """Take the number of the class that is the most likely one from a time [s] on."""
        if math.isnan(self._arrival_s) and way != self._most_likely[1]:
            self._most_likely = (max(t, self._begin_s), way)  # a prediction may be of the hand before the light


class Tasks:
    """A sequence of trials, made of settings and a scene, that follows the hand.

    Attributes: settings; trials; number, of the present one; phase; scores, of the trials that are over; touched, how often the
    hand has entered an obstacle in the present trial.
    """

    def __init__(self, settings: TasksMessage, scene: PlayScene) -> None:
        self.settings, random = settings, np.random.default_rng(settings.seed)
        guided = {'mixed': (False, True), 'with': (True,), 'without': (False,)}[settings.assistance]
        self.trials: list[Trial] = []  # in which goals, and trials with and without guidance, occur about equally often
        while len(self.trials) < settings.trials:
            orders = [random.permutation(len(scene.goals)).tolist() for _ in guided]
            for goals in zip(*orders, strict=True):
                for kind in random.permutation(len(guided)).tolist():
                    shown_scene = make_random_scene(random, scene.goals) if settings.shuffled else scene
                    self.trials.append(Trial(shown_scene, goals[kind], guided[kind]))
        del self.trials[settings.trials :]
        self.number, self.phase = 0, Phase.RETURN
        self.scores: list[TrialMovement] = []
        # times for which the hand rests at the start before a goal is lit [s]
        self._waits = np.random.default_rng([settings.seed, 1]).uniform(0.4, 0.9, len(self.trials))
        self._since_s = 0.0
        self._reach: TrialMovement | None = None

    @property
    def trial(self) -> Trial:
        """The present trial, the last one when the tasks are over."""
        return self.trials[min(self.number, len(self.trials) - 1)]

    @property
    def touched(self) -> int:
        """How often the hand has entered an obstacle in the present trial."""
        return 0 if self._reach is None else self._reach.touched

    def follow(self, t: float, position: Point) -> Phase | None:
        """Take a position of the hand at a time [s]; return the phase that begins with it, if one does."""
        before, is_at_start = self.phase, math.dist(position, START) <= TARGET_RADIUS
        if before is Phase.REACH and self._reach is not None:
            if self._reach.add(t, position):
                self.scores.append(self._reach)
                self.number += 1
                self.phase = Phase.RETURN if self.number < len(self.trials) else Phase.OVER
        elif before is not Phase.OVER and not is_at_start:
            self.phase = Phase.RETURN
        elif before is Phase.RETURN:
            self.phase, self._since_s = Phase.WAIT, t
        elif before is Phase.WAIT and t - self._since_s >= self._waits[self.number]:
            self.phase, self._reach = Phase.REACH, TrialMovement(self.trial, t, position)
        return self.phase if self.phase is not before else None

    def note_most_likely(self, t: float, way: int) -> None:
        """Take the number of the class that is the most likely one from a time [s] on."""
        if self.phase is Phase.REACH and self._reach is not None:
            self._reach.note_most_likely(t, way)


def tabulate_scores(scores: Sequence[TrialMovement]) -> list[tuple[str, ...]]:
    """Return a row of SCORE_COLUMNS for the trials without and with guidance: medians, and the number of touches in all."""
    rows: list[tuple[str, ...]] = []
    for name, is_guided in (('without guidance', False), ('with guidance', True)):
        chosen = [each for each in scores if each.is_guided is is_guided]
        if chosen:
            time_s, path_m = (float(np.median([getattr(each, name) for each in chosen])) for name in ('time_s', 'path_m'))
            ahead_s = [each.ahead_s for each in chosen if math.isfinite(each.ahead_s)]
            ahead = f'{np.median(ahead_s):.2f}' if ahead_s else '-'
            touched = str(sum(each.touched for each in chosen))
            rows.append((name, str(len(chosen)), f'{time_s:.2f}', touched, f'{100.0 * path_m:.1f}', ahead))
    return rows
