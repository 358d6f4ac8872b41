# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of a simulated operator, for the tests of `fit`."""

from pathlib import Path

import evaluation_samples
import numpy as np
import pytest

from foc_ros.analysis.evaluation.truth import RecordedHand, RecordedPath
from foc_ros.analysis.fitting import fit, race
from foc_ros.core.obstacle_table import Obstacles

OBSTACLE = (0.15, 0.0, 0.03)
GOALS = np.array([[0.3, -0.1], [0.3, 0.0], [0.3, 0.1]])


def reach(goal: np.ndarray, bow: float, duration_s: float, hz: float, rng: np.random.Generator, noise: float) -> np.ndarray:
    """Return a minimum-jerk reach from the origin, bowed to the left, with rests of 0.1 s: rows of time and noisy position."""
    times, path = evaluation_samples.reach(bow, tuple(goal), duration_s, rest=0.1, rate=hz)
    return np.column_stack([times, path + rng.normal(0.0, noise, path.shape)])


def write_tables(folder: Path, count: int = 6, obstacle: bool = True, hz: float = 50.0, noise: float = 5e-4) -> Path:
    """Write recordings past one obstacle, left and right in turn; or to three goals in turn, without any."""
    rng, reaches = np.random.default_rng(7), {}
    for number in range(count):
        goal = GOALS[1] if obstacle else GOALS[number % 3]
        bow = (0.06 if number % 2 else -0.06) if obstacle else 0.01 * rng.standard_normal()
        rows = reach(goal, bow, 1.2 + 0.1 * rng.standard_normal(), hz, rng, noise)
        reaches[f'r{number}'] = rows[:, 0], rows[:, 1:]
    used, obstacles = (GOALS[1:2], [OBSTACLE]) if obstacle else (GOALS, None)
    return evaluation_samples.write_tables(folder, reaches, used, obstacles)


def recorded_hand(name: str, times: np.ndarray, positions: np.ndarray, obstacles: Obstacles, goals: np.ndarray) -> RecordedHand:
    return RecordedHand(name, RecordedPath(np.round(times * 1e9).astype(np.int64), positions, goals), obstacles)


def use_few_predictions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a fit in this process predict seldom and try few settings."""
    monkeypatch.setattr(fit, 'PREDICTIONS', 3)
    for name, few in {'DURATIONS': (), 'NOISES': (0.5,), 'ETAS': (0.7,)}.items():
        monkeypatch.setattr(race, name, few)
