# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings made by hand, and those of a simulated operator, for the tests of the evaluation and of `fit`."""

from pathlib import Path

import numpy as np
import pytest

from foc_ros.analysis.evaluation.observations import CandidateTable, Observation, ObservedRecording
from foc_ros.analysis.evaluation.truth import HORIZONS_S, TIMES_S, GroundTruth, RecordedHand, RecordedPath, find_open_gaps
from foc_ros.analysis.fitting import fit, race
from foc_ros.core.classes.rows import Decisions
from foc_ros.core.classes.sides import BranchTimes
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.solution import LEFT, RIGHT

H = len(TIMES_S)


def make_candidates(sides, goal=None, likelihood=None, cost_to_go=None) -> CandidateTable:
    """Return candidates that pass obstacles on sides (k, n); each in its own class, all branching now."""
    k, n = np.shape(sides)
    return CandidateTable(
        labels=tuple(f'class{i}' for i in range(k)),
        goal=np.zeros(k, dtype=int) if goal is None else np.array(goal),
        has_likelihood=np.ones(k, dtype=bool),
        safety_shortfall=np.zeros(k),
        cost_to_go=np.ones(k) if cost_to_go is None else np.array(cost_to_go, dtype=float),
        likelihood=np.full(k, 1.0 / k) if likelihood is None else np.array(likelihood, dtype=float),
        length=np.arange(1.0, k + 1.0),
        time_s=np.ones(k),
        named=frozenset(str(i) for i in range(n)),
        sides=np.array(sides, dtype=np.int8).reshape(k, n),
        mean=np.zeros((k, H, 2)),
        covariance=np.tile(np.eye(2), (k, len(HORIZONS_S), 1, 1)),
        plans=np.zeros((0, k, len(HORIZONS_S), 2, 2)),
        branch_times=BranchTimes(np.where(np.eye(k, dtype=bool), np.inf, 0.0), np.arange(k)),
        decisions=Decisions(np.arange(k), np.arange(k), np.zeros(k, dtype=np.intp)),
    )


def observation(
    candidates: CandidateTable, centre=((1.0, 0.0),), row=(0,), true_sides=(LEFT,), goals=((2.0, 0.0),), goal=0, **changes
) -> Observation:
    """Return an observation of a hand at the origin; changes: hand, and positions, progress and approach of the truth."""
    centre, row = np.array(centre, dtype=float).reshape(-1, 2), np.array(row, dtype=int)
    truth = GroundTruth(
        sides=np.array(true_sides, dtype=np.int8),
        is_ahead=np.ones(len(centre), dtype=bool),
        goal=goal,
        positions=np.array(changes.pop('positions', np.zeros((H, 2))), dtype=float),
        progress=changes.pop('progress', 0.0),
        approach=changes.pop('approach', 0.0),
        left_s=0.5,
    )
    return Observation(
        stamp_ns=0,
        hand=np.array(changes.pop('hand', (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)), dtype=float),
        movement_age_s=1.0,
        ids=tuple(str(i) for i in range(len(centre))),
        centre=centre,
        row=row,
        gaps=find_open_gaps(make_obstacles(centre, 0.01), row, np.array([1.0, 0.0]), 0.0),
        direction=np.array([1.0, 0.0]),
        goals=np.array(goals, dtype=float),
        candidates=candidates,
        most_likely=candidates.labels[0],
        truth=truth,
    )


def recorded(*each: Observation, name: str = 'one') -> ObservedRecording:
    stamps_ns = np.arange(0, 2_000_000_001, 50_000_000)
    return ObservedRecording(name, each, RecordedPath(stamps_ns, np.outer(stamps_ns / 1e9, [1.0, 0.0]), np.array([[2.0, 0.0]])))


TWO_CLASSES = make_candidates([[LEFT], [RIGHT]])

PARAMETERS = '/**: {ros__parameters: {rate_hz: 4.0, foc.steps: 15, foc.strategy: fixed, foc.tau: 1.0e-4, foc.lam: 0.0}}'


def reach(aside: float, end: tuple[float, float], seconds: float = 1.0, rest: float = 0.2, rate: float = 40.0):
    """Return times and positions of a minimum-jerk reach from the origin, bent aside half way, with rests before and after."""
    t = np.arange(0.0, seconds + 2.0 * rest, 1.0 / rate)
    s = np.clip((t - rest) / seconds, 0.0, 1.0)
    share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    x, y = share * end[0], share * end[1] + aside * np.sin(np.pi * share) ** 2
    return t, np.column_stack([x, y])


def write_tables(folder: Path, reaches, goals, obstacles=None) -> Path:
    """Write recordings (name: (times, positions)), goals and obstacles (x, y, radius) as CSV tables."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['recording,t_s,x_m,y_m']
    for name, (t, positions) in reaches.items():
        lines += [f'{name},{when:.4f},{x:.6f},{y:.6f}' for when, (x, y) in zip(t, positions, strict=True)]
    (folder / 'recordings.csv').write_text('\n'.join(lines) + '\n')
    (folder / 'goals.csv').write_text('x_m,y_m\n' + ''.join(f'{x},{y}\n' for x, y in goals))
    if obstacles is not None:
        (folder / 'obstacles.csv').write_text('x_m,y_m,radius_m\n' + ''.join(f'{x},{y},{r}\n' for x, y, r in obstacles))
    (folder / 'parameters.yaml').write_text(PARAMETERS)
    return folder


FIT_OBSTACLE = (0.15, 0.0, 0.03)
FIT_GOALS = np.array([[0.3, -0.1], [0.3, 0.0], [0.3, 0.1]])


def bowed_reach(goal: np.ndarray, bow: float, duration_s: float, hz: float, rng: np.random.Generator, noise: float) -> np.ndarray:
    """Return a minimum-jerk reach from the origin, bowed to the left, with rests of 0.1 s: rows of time and noisy position."""
    times, path = reach(bow, tuple(goal), duration_s, rest=0.1, rate=hz)
    return np.column_stack([times, path + rng.normal(0.0, noise, path.shape)])


def write_fit_tables(folder: Path, count: int = 6, obstacle: bool = True, hz: float = 30.0, noise: float = 5e-4) -> Path:
    """Write recordings past one obstacle, left and right in turn; or to three goals in turn, without any."""
    rng, reaches = np.random.default_rng(7), {}
    for number in range(count):
        goal = FIT_GOALS[1] if obstacle else FIT_GOALS[number % 3]
        bow = (0.06 if number % 2 else -0.06) if obstacle else 0.01 * rng.standard_normal()
        rows = bowed_reach(goal, bow, 1.2 + 0.1 * rng.standard_normal(), hz, rng, noise)
        reaches[f'r{number}'] = rows[:, 0], rows[:, 1:]
    used, obstacles = (FIT_GOALS[1:2], [FIT_OBSTACLE]) if obstacle else (FIT_GOALS, None)
    return write_tables(folder, reaches, used, obstacles)


def recorded_hand(name: str, times: np.ndarray, positions: np.ndarray, obstacles: Obstacles, goals: np.ndarray) -> RecordedHand:
    return RecordedHand(name, RecordedPath(np.round(times * 1e9).astype(np.int64), positions, goals), obstacles)


def use_few_predictions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a fit in this process predict seldom and try few settings."""
    monkeypatch.setattr(fit, 'PREDICTIONS', 2)
    for name, few in {'DURATIONS': (), 'NOISES': (0.5,), 'ETAS': (0.7,)}.items():
        monkeypatch.setattr(race, name, few)
