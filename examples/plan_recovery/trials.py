# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Trials of the recovery of tau and lambda, as a table: known values, planned movements, a noisy sensor, and what is recovered.

python examples/plan_recovery/trials.py [--trials N]
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from plan_recovery import Array, Movement, Recovered, interpolate_plan, plan, recover

import foc_ros

SENSOR_STDDEV_M, TIMES_S = 1e-3, np.linspace(0.0, 1.0, 101)
GOALS, BOWS_M = ((0.3, -0.05), (0.3, 0.0), (0.3, 0.05)), (0.06, -0.06)
CONFIG = foc_ros.Config().with_values({'foc.noise_x': 0.1, 'foc.noise_y': 0.1})
TAU_RANGE_M2, LAMBDA_RANGE = (5e-4, 3e-3), (2e5, 1e7)
HEADINGS = ('tau [m²]', 'lambda', 'movements', 'tau found / true', 'lambda found / true', 'recovered')


def simulate(tau: float, lam: float, draws: np.random.Generator, repeats: int = 2) -> list[Movement]:
    """Return reaches of 0.3 m in 1 s to three goals, left and right of two obstacles of 2 to 3 cm, each made `repeats` times.

    Homotopy classes without a plan with (tau, lambda) are left out.
    """
    places = (0.12, draws.uniform(-0.01, 0.01)), (0.2, draws.uniform(-0.05, 0.05))
    obstacles = [foc_ros.Circle(place, radius=draws.uniform(0.02, 0.03), radius_stddev=0.003) for place in places]
    movements = []
    for goal in np.array(GOALS):
        for bow in BOWS_M:
            solution = plan(Movement(TIMES_S, make_arc(goal, bow), goal, obstacles), tau, lam, CONFIG)
            if solution is None:
                continue
            for _ in range(repeats):
                noise = draws.normal(0.0, SENSOR_STDDEV_M, (len(TIMES_S), 2))
                movements.append(Movement(TIMES_S, interpolate_plan(solution, TIMES_S) + noise, goal, obstacles))
    return movements


def make_arc(goal: Array, bow_m: float) -> Array:
    """Return a minimum-jerk path from the origin to a goal, (101, 2) [m], that bows to the left."""
    progress = TIMES_S**3 * (10.0 - 15.0 * TIMES_S + 6.0 * TIMES_S**2)
    left = np.array([-goal[1], goal[0]]) / np.hypot(*goal)
    return np.asarray(np.outer(progress, goal) + np.outer(bow_m * np.sin(np.pi * TIMES_S), left))


def run_trial(seed: int, repeats: int = 2) -> tuple[float, float, int, Recovered]:
    """Draw tau, lambda and a scene; return them, the number of movements, and what was recovered."""
    draws = np.random.default_rng(seed)
    tau, lam = (float(np.exp(draws.uniform(*np.log(bounds)))) for bounds in (TAU_RANGE_M2, LAMBDA_RANGE))
    movements = simulate(tau, lam, draws, repeats)
    return tau, lam, len(movements), recover(movements, CONFIG)


def is_recovered(tau: float, lam: float, found: Recovered) -> bool:
    """Tell whether tau was found within 5 % and lambda within a factor of 1.2."""
    factor = found.lam / lam
    return abs(found.tau / tau - 1.0) <= 0.05 and max(factor, 1.0 / factor) <= 1.2


def main() -> int:
    """Run the trials and print them."""
    parser = argparse.ArgumentParser(description='Recover tau and lambda from planned movements.')
    parser.add_argument('--trials', type=int, default=20, metavar='N', help='default: %(default)s')
    trials = [run_trial(seed) for seed in range(parser.parse_args().trials)]
    print(f'| {" | ".join(HEADINGS)} |\n{"|---" * len(HEADINGS)}|')
    for tau, lam, count, found in trials:
        words = 'yes' if is_recovered(tau, lam, found) else 'no'
        print(f'| {tau:.2e} | {lam:.2e} | {count} | {found.tau / tau:.3f} | {found.lam / lam:.3f} | {words} |')
    print(f'\n{sum(is_recovered(tau, lam, found) for tau, lam, _, found in trials)} of {len(trials)} recovered')
    return 0


if __name__ == '__main__':
    sys.exit(main())
