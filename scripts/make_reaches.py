"""Write recordings of simulated hand reaches among several goals without obstacles, as tables for `evaluate` and `fit`.

There are 48 reaches of one of three kinds:

- grid: from near the origin to 25 goals on a grid of 0.4 x 0.3 m, sampled at 120 Hz with 0.5 mm of noise. Each waits 0.2 to
  0.6 s, takes a duration that varies by 20 % about a law, bends, falls short and corrects, and ends about 6 mm beside its goal;
  one in seven starts towards another goal first.
- star: from near the origin to 8 goals all round, 0.1 to 0.3 m away, sampled at 100 Hz with 0.3 mm of noise. Each waits 0.1 to
  0.4 s, takes 0.4 to 1 s however far it goes, bends a little, and ends about 3 mm beside its goal.
- bent: likewise, but to 6 goals in an arc ahead, 0.25 m away and 24 degrees apart, in 0.6 to 1.2 s; all bend to the left, by 0.12
  of their length, so that they begin 21 degrees beside the straight way. The goals come in random order.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from foc_ros.core.types import Array

COUNT = 48
SIDE = 5
STAR_M = np.array([0.1, 0.2, 0.3, 0.15, 0.25, 0.1, 0.2, 0.3])


def grid_goals() -> Array:
    """Return the goals (25, 2) [m]."""
    return np.stack(np.meshgrid(np.linspace(-0.2, 0.2, SIDE), np.linspace(0.2, 0.5, SIDE)), -1).reshape(-1, 2)


def grid_reach(goals: Array, aim: int, draws: np.random.Generator) -> tuple[Array, Array]:
    """Return times (m,) [s] and positions (m, 2) [m] of one reach."""
    start, end = draws.normal(0.0, 0.005, 2), goals[aim] + draws.normal(0.0, 0.006, 2)
    distance = float(np.hypot(*(end - start)))
    lasts = (0.25 + 0.13 * np.log2(distance / 0.02 + 1.0)) * np.exp(draws.normal(0.0, 0.2))
    waits = draws.uniform(0.2, 0.6)
    t = np.arange(0.0, waits + lasts + 0.6, 1.0 / 120.0)
    primary, along = draws.uniform(0.85, 1.02), (end - start) / distance
    bow = draws.normal(0.0, 0.04) * distance
    first = _minimum_jerk(np.clip((t - waits) / lasts, 0.0, 1.0) ** draws.uniform(0.85, 1.05))
    second = _minimum_jerk((t - waits - 0.75 * lasts) / (0.5 * lasts))
    path = start + np.outer(first * primary + (1.0 - primary) * second, end - start)
    path += np.outer(bow * np.sin(np.pi * first), [-along[1], along[0]])
    if draws.random() < 0.15:
        other = goals[draws.integers(len(goals))] - start
        path += np.outer(0.06 * _minimum_jerk((t - waits + 0.15) / 0.25) * (1.0 - _minimum_jerk((t - waits - 0.05) / 0.4)), other)
    return t, path + draws.normal(0.0, 5e-4, path.shape)


def star_goals() -> Array:
    """Return the goals (8, 2) [m]."""
    angles = np.arange(len(STAR_M)) * 2.0 * np.pi / len(STAR_M)
    return np.column_stack([STAR_M * np.cos(angles), STAR_M * np.sin(angles)])


def star_reach(goals: Array, aim: int, draws: np.random.Generator) -> tuple[Array, Array]:
    """Return times (m,) [s] and positions (m, 2) [m] of one reach."""
    return _bow_reach(goals[aim], (0.4, 1.0), (0.0, 0.02), draws)


def _bow_reach(
    goal: Array, lasts_s: tuple[float, float], bow: tuple[float, float], draws: np.random.Generator
) -> tuple[Array, Array]:
    """Return a reach to a goal (2,) that takes a time between two [s], and bends by a share of its length (mean, deviation)."""
    end, start = goal + draws.normal(0.0, 0.003, 2), draws.normal(0.0, 0.002, 2)
    lasts, waits = draws.uniform(*lasts_s), draws.uniform(0.1, 0.4)
    t = np.arange(0.0, waits + lasts + 0.4, 0.01)
    done = _minimum_jerk(np.clip((t - waits) / lasts, 0.0, 1.0) ** draws.uniform(0.9, 1.0))
    across = np.array([start[1] - end[1], end[0] - start[0]])
    path = start + np.outer(done, end - start) + np.outer(draws.normal(*bow) * np.sin(np.pi * done), across)
    return t, path + draws.normal(0.0, 3e-4, path.shape)


def bent_goals() -> Array:
    """Return the goals (6, 2) [m]."""
    angles = np.radians(np.linspace(30.0, 150.0, 6))
    return 0.25 * np.column_stack([np.cos(angles), np.sin(angles)])


def bent_reach(goals: Array, aim: int, draws: np.random.Generator) -> tuple[Array, Array]:
    """Return times (m,) [s] and positions (m, 2) [m] of one reach."""
    return _bow_reach(goals[draws.permutation(len(goals))[aim]], (0.6, 1.2), (0.12, 0.03), draws)


KINDS = {'grid': (grid_goals, grid_reach), 'star': (star_goals, star_reach), 'bent': (bent_goals, bent_reach)}


def _minimum_jerk(share: Array) -> Array:
    s = np.clip(share, 0.0, 1.0)
    done: Array = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return done


def main(folder: Path, seed: int, kind: str) -> None:
    """Write the tables."""
    draws, (made, reach) = np.random.default_rng(seed), KINDS[kind]
    goals = made()
    lines = ['recording,t_s,x_m,y_m']
    for number in range(COUNT):
        t, path = reach(goals, number % len(goals), draws)
        lines += [f'r{number:02d},{when:.4f},{x:.6f},{y:.6f}' for when, (x, y) in zip(t, path, strict=True)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'recordings.csv').write_text('\n'.join(lines) + '\n', encoding='utf-8')
    (folder / 'goals.csv').write_text('x_m,y_m\n' + ''.join(f'{x:.4f},{y:.4f}\n' for x, y in goals), encoding='utf-8')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=Path)
    parser.add_argument('seed', type=int, nargs='?', default=2)
    parser.add_argument('kind', choices=KINDS, nargs='?', default='grid')
    arguments = parser.parse_args()
    main(arguments.folder, arguments.seed, arguments.kind)
