"""Measures the time of the search for homotopy classes among circles, at rest and moving: `python scripts/measure_classes.py`.

The hand moves, and the search for four classes knows the candidates of before. Times are CPU times of one process.
"""

from __future__ import annotations

import time

import numpy as np

from foc_ros.core.classes import search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.types import Array, Candidate, make_obstacles

TICKS = 200
STEPS = 50
GOALS = np.array([[0.4, 0.0]])
NUMBERS = 1, 8, 16, 32, 64


def place_circles(count: int) -> tuple[Array, Array]:
    """Return centres (n, 2) and radii (n,) [m] of circles between hand and goal that hold neither of them."""
    rng, circles = np.random.default_rng(0), list[tuple[float, float, float]]()
    while len(circles) < count:
        x, y, radius = (
            rng.uniform(0.04, 0.36),
            rng.uniform(-0.2, 0.2),
            rng.uniform(*((0.006, 0.012) if count > 16 else (0.01, 0.025))),
        )
        if min(np.hypot(x, y), np.hypot(x - 0.4, y)) > 0.03 + radius:
            circles.append((x, y, radius))
    table = np.array(circles)
    return table[:, :2], table[:, 2]


def measure(count: int, speed: float) -> Array:
    """Return the times (TICKS,) [ms] of searches among circles that move by a speed [m/tick]."""
    centre, radius = place_circles(count)
    config, previous, times = HomotopyConfig(max_candidates=4), tuple[Candidate, ...](), []
    for tick in range(TICKS):
        obstacles = make_obstacles(centre + np.array([0.0, speed * tick]), radius)
        hand = np.array([1e-4 * tick, 3e-5 * tick, 0.1, 0.0, 0.0, 0.0])
        began = time.process_time()
        previous = search(hand, GOALS, obstacles, config, [1.0], STEPS, previous).candidates
        times.append(1e3 * (time.process_time() - began))
    return np.array(times)


def main() -> None:
    """Print a table."""
    print('| obstacles | at rest: median, 90 %, first [ms] | moving: median, 90 % [ms] |\n|---|---|---|')
    for count in NUMBERS:
        rest, moving = measure(count, 0.0), measure(count, 5e-5)
        figures = [np.median(rest), np.quantile(rest, 0.9), rest[0], np.median(moving), np.quantile(moving, 0.9)]
        print('| {} | {:.2f}, {:.2f}, {:.2f} | {:.2f}, {:.2f} |'.format(count, *figures))


if __name__ == '__main__':
    main()
