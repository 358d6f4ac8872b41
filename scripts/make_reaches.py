"""Write recordings of simulated hand reaches among several goals without obstacles, as tables for `evaluate` and `fit`.

make_reaches.py FOLDER [SEED]: 48 reaches from near the origin to 25 goals on a grid of 0.4 x 0.3 m, sampled at 120 Hz with 0.5 mm
of noise. Each waits 0.2 to 0.6 s, takes a duration that varies by 20 % about a law, bends, falls short and corrects, and ends
about 6 mm beside its goal; one in seven starts towards another goal first.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from foc_ros.foc.records import Array

COUNT, RATE_HZ, NOISE_M = 48, 120.0, 5e-4
SIDE = 5
STAY_S = 0.6


def reach(goals: Array, aim: int, draws: np.random.Generator) -> tuple[Array, Array]:
    """Return times (m,) [s] and positions (m, 2) [m] of one reach."""
    start, end = draws.normal(0.0, 0.005, 2), goals[aim] + draws.normal(0.0, 0.006, 2)
    distance = float(np.hypot(*(end - start)))
    lasts = (0.25 + 0.13 * np.log2(distance / 0.02 + 1.0)) * np.exp(draws.normal(0.0, 0.2))
    waits = draws.uniform(0.2, 0.6)
    t = np.arange(0.0, waits + lasts + STAY_S, 1.0 / RATE_HZ)
    primary, along = draws.uniform(0.85, 1.02), (end - start) / distance
    bow = draws.normal(0.0, 0.04) * distance
    first = _minimum_jerk(np.clip((t - waits) / lasts, 0.0, 1.0) ** draws.uniform(0.85, 1.05))
    second = _minimum_jerk((t - waits - 0.75 * lasts) / (0.5 * lasts))
    path = start + np.outer(first * primary + (1.0 - primary) * second, end - start)
    path += np.outer(bow * np.sin(np.pi * first), [-along[1], along[0]])
    if draws.random() < 0.15:
        other = goals[draws.integers(len(goals))] - start
        path += np.outer(0.06 * _minimum_jerk((t - waits + 0.15) / 0.25) * (1.0 - _minimum_jerk((t - waits - 0.05) / 0.4)), other)
    return t, path + draws.normal(0.0, NOISE_M, path.shape)


def _minimum_jerk(share: Array) -> Array:
    s = np.clip(share, 0.0, 1.0)
    done: Array = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return done


def main(folder: Path, seed: int) -> None:
    """Write the tables."""
    draws = np.random.default_rng(seed)
    goals = np.stack(np.meshgrid(np.linspace(-0.2, 0.2, SIDE), np.linspace(0.2, 0.5, SIDE)), -1).reshape(-1, 2)
    lines = ['recording,t_s,x_m,y_m']
    for number in range(COUNT):
        t, path = reach(goals, number % len(goals), draws)
        lines += [f'r{number:02d},{when:.4f},{x:.6f},{y:.6f}' for when, (x, y) in zip(t, path, strict=True)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'recordings.csv').write_text('\n'.join(lines) + '\n', encoding='utf-8')
    (folder / 'goals.csv').write_text('x_m,y_m\n' + ''.join(f'{x:.4f},{y:.4f}\n' for x, y in goals), encoding='utf-8')


if __name__ == '__main__':
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2)
