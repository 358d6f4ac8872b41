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
WAIT_S = (0.4, 0.9)
"""Limits of the random time for which the hand rests at the start before a goal is lit [s]."""
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


@dataclass(frozen=True)
class Score:
    """What a trial came to.

    time_s: from the light to the arrival, without the rest at the goal; touched: how often the hand entered an obstacle; path_m:
    length of its path; ahead_s: how long before the arrival the way taken had become the most likely one for good, nan if the
    trial was over before.
    """

    is_guided: bool
    time_s: float
    touched: int
    path_m: float
    ahead_s: float


def make_trials(settings: TasksMessage, scene: PlayScene) -> list[Trial]:
    """Return the random sequence of a seed, in which goals, and trials with and without guidance, occur about equally often."""
    random = np.random.default_rng(settings.seed)
    guided = {'mixed': (False, True), 'with': (True,), 'without': (False,)}[settings.assistance]
    kinds = [(goal, is_guided) for goal in range(len(scene.goals)) for is_guided in guided]
    trials: list[Trial] = []
    while len(trials) < settings.trials:
        for row in random.permutation(len(kinds)).tolist():
            shown_scene = make_random_scene(random, scene.goals) if settings.shuffled else scene
            trials.append(Trial(shown_scene, *kinds[row]))
    return trials[: settings.trials]


class Tasks:
    """A sequence of trials that follows the hand.

    Attributes: trials; number, of the present one; phase; scores, of the trials that are over.

    Parameters
    ----------
    settings, scene
        What the sequence is made of.
    """

    def __init__(self, settings: TasksMessage, scene: PlayScene) -> None:
        self.settings = settings
        self.trials = make_trials(settings, scene)
        self.number, self.phase = 0, Phase.RETURN
        self.scores: list[Score] = []
        self._waits = np.random.default_rng([settings.seed, 1]).uniform(*WAIT_S, len(self.trials))
        self._since_s = 0.0
        self._reach = _Reach(0.0, START)

    @property
    def trial(self) -> Trial:
        """The present trial, the last one when the tasks are over."""
        return self.trials[min(self.number, len(self.trials) - 1)]

    def follow(self, t: float, position: Point) -> Phase | None:
        """Take a position of the hand at a time [s]; return the phase that begins with it, if one does."""
        phase = self.phase
        if phase is Phase.OVER:
            return None
        if phase in (Phase.RETURN, Phase.WAIT):
            self._follow_to_start(t, math.dist(position, START) <= TARGET_RADIUS)
        else:
            self._follow_to_goal(t, position)
        if self.phase is Phase.REACH and phase is not Phase.REACH:
            self._reach = _Reach(t, position)
        return self.phase if self.phase is not phase else None

    def note_most_likely(self, t: float, way: int) -> None:
        """Take the number of the class that is the most likely one from a time [s] on."""
        if self.phase is Phase.REACH:
            self._reach.note_most_likely(t, way)

    @property
    def touched(self) -> int:
        """How often the hand has entered an obstacle in the present trial."""
        return self._reach.touched

    def _follow_to_start(self, t: float, is_at_start: bool) -> None:
        if not is_at_start:
            self.phase = Phase.RETURN
        elif self.phase is Phase.RETURN:
            self.phase, self._since_s = Phase.WAIT, t
        elif t - self._since_s >= self._waits[self.number]:
            self.phase = Phase.REACH

    def _follow_to_goal(self, t: float, position: Point) -> None:
        trial = self.trial
        self._reach.add(position, trial.scene)
        if self._reach.has_arrived(t, position, trial.scene.points[trial.goal]):
            self.scores.append(self._reach.score(trial.is_guided))
            self.number += 1
            self.phase = Phase.RETURN if self.number < len(self.trials) else Phase.OVER


class _Reach:
    """One movement from the light to the goal."""

    def __init__(self, t: float, position: Point) -> None:
        self.touched = 0
        self._begin_s, self._position, self._path_m = t, position, 0.0
        self._is_inside = False
        self._arrival_s: float | None = None
        self._way: int | None = None
        self._way_since_s = math.nan

    def add(self, position: Point, scene: PlayScene) -> None:
        is_inside = scene.measure_clearance(position) < 0.0
        self.touched += is_inside and not self._is_inside
        self._is_inside = is_inside
        self._path_m += math.dist(position, self._position)
        self._position = position

    def has_arrived(self, t: float, position: Point, goal: Point) -> bool:
        """Return whether the hand has rested at its goal for REST_S."""
        if math.dist(position, goal) > TARGET_RADIUS:
            self._arrival_s = None
        elif self._arrival_s is None:
            self._arrival_s = t
        return self._arrival_s is not None and t - self._arrival_s >= REST_S

    def note_most_likely(self, t: float, way: int) -> None:
        if self._arrival_s is None and way != self._way:
            self._way, self._way_since_s = way, t

    def score(self, is_guided: bool) -> Score:
        assert self._arrival_s is not None
        return Score(is_guided, self._arrival_s - self._begin_s, self.touched, self._path_m, self._arrival_s - self._way_since_s)


def tabulate_scores(scores: Sequence[Score]) -> list[tuple[str, ...]]:
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
