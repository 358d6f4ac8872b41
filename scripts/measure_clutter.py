#!/usr/bin/env python3
"""Measure the strategies in clutter: classes solved, clearance of `optimal` between the steps, and times of warm ticks.

    python scripts/measure_clutter.py [--scenes N] [--only solved|between|ticks] [--set NAME=VALUE ...]

Scenes are reaches of 0.36 m past random circles that do not touch each other, with default noise and eta.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence

import numpy as np
from accuracy.page import parse_setting, print_table
from accuracy.scenes import build_varied, solve

from foc_ros import solve_classes
from foc_ros.core.config import Config
from foc_ros.core.hand.kalman import FilterState, update
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import Array, HandSample, Obstacles, Solution, Status, make_obstacles

STRATEGIES = ('lv', 'hc', 'optimal')
GOAL = np.array([0.36, 0.0])
NUMBERS = (4, 8, 12, 16, 24)
CANDIDATES, DURATION_S = 16, 1.0
FRACTIONS = np.arange(1, 41) / 40.0
"""Times within a step at which the safety factor is looked at."""
TICKS = 15
DRIFT_M_S, TRACKER_STDDEV_M = np.array([0.01, 0.004]), 1e-4
"""Hands of warm ticks drift too slowly for a movement to begin, so that its duration stays the same."""


def draw_circles(number: int, seed: int, scale: float = 1.0) -> Obstacles:
    """Draw circles of 8 to 25 mm, times a scale, 2 mm or more apart, and 2 cm or more from start and goal."""
    draws = np.random.default_rng(seed)
    centres, radii = np.zeros((0, 2)), np.zeros(0)
    while len(radii) < number:
        centre, radius = draws.uniform((0.02, -0.15), (0.34, 0.15)), scale * draws.uniform(0.008, 0.025)
        gaps = np.hypot(*(centres - centre).T) - radii - radius
        ends = np.hypot(*(np.stack((np.zeros(2), GOAL)) - centre).T) - radius
        if gaps.min(initial=np.inf) > 0.002 and ends.min() > 0.02:
            centres, radii = np.vstack((centres, centre)), np.append(radii, radius)
    return make_obstacles(centres, radii, 0.001)


def measure_solved(scenes: int, config: Config) -> Iterator[list[str]]:
    """Yield rows of distinct classes found, and the shares of them that are solved and that take part, by strategy."""
    for number in NUMBERS:
        for strategy in STRATEGIES:
            values = {'foc.strategy': strategy, 'homotopy.max_candidates': CANDIDATES}
            began = time.process_time()
            found = [
                each
                for seed in range(scenes)
                for each in solve_classes((0.0, 0.0), GOAL, draw_circles(number, seed), config=config.with_values(values))
            ]
            seconds = time.process_time() - began
            shares = (sum(each.is_solved for each in found), sum(each.has_likelihood for each in found))
            percent = [f'{100 * share / len(found):.1f}' for share in shares]
            yield [str(number), f'`{strategy}`', str(len(found)), *percent, f'{1e3 * seconds / len(found):.1f}']


def find_least_share(problem: Problem, solution: Solution) -> float:
    """Return the smallest safety factor on the grid of FRACTIONS, as a share of the wanted one; a plant without damping."""
    wanted = np.sqrt(problem.eta / (1.0 - problem.eta))
    least = min(_find_least_factor(problem, solution, step, a) for step in range(len(solution.control)) for a in FRACTIONS)
    return float(least / wanted)


def _find_least_factor(problem: Problem, solution: Solution, step: int, share: float) -> float:
    """Return the smallest safety factor at a share of one step, from the state at its beginning and the control within it."""
    (size_mean, size_variance), dt, u = problem.size, share * solution.dt, solution.control[step]
    one, axes = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]]), np.eye(2)
    forward, push = np.kron(one, axes), np.kron(np.array([[dt**3 / 6], [dt**2 / 2], [dt]]), axes)
    position = (forward @ solution.mean[step] + push @ u)[:2]
    noise = push @ np.diag((problem.noise * u) ** 2) @ push.T
    covariance = (forward @ solution.covariance[step] @ forward.T + noise)[:2, :2] + problem.obstacles.centre_covariance
    offset = position - problem.obstacles.centre - (step + share) * problem.drift
    variance = size_variance + 4.0 * np.einsum('ni,nij,nj->n', offset, covariance, offset)
    factor = ((offset**2).sum(axis=1) - size_mean) / np.sqrt(variance)
    return float(factor.min(initial=np.inf))


def measure_between(scenes: int, strategies: Sequence[str] = STRATEGIES) -> Iterator[list[str]]:
    """Yield rows of the smallest safety factor between the steps, as shares of the wanted one, by strategy."""
    for strategy in strategies:
        solved = [(reach.problem, solve(reach.problem, reach.guess, strategy)) for reach in build_varied()[:scenes]]
        shares = [find_least_share(*each) for each in solved if each[1].status is Status.SOLVED]
        low, few, median = (f'{value:.4f}' for value in np.percentile(shares, (0, 5, 50)))
        yield [f'`{strategy}`', str(len(shares)), low, few, median, str(sum(share < 0.999 for share in shares))]


def drift_hand(config: Config, ticks: int = TICKS) -> list[FilterState]:
    """Return the estimated states of a hand at 100 Hz that drifts from the start."""
    draws = np.random.default_rng(3)
    states: list[FilterState] = []
    for tick in range(2 * ticks):
        position = DRIFT_M_S * tick / 100.0 + draws.normal(0.0, TRACKER_STDDEV_M, 2)
        sample = HandSample(1_000_000_000 + 10_000_000 * tick, position)
        states.append(update(states[-1] if states else None, sample, config.estimator).state)
    return states[ticks:]


def time_ticks(obstacles: Obstacles, config: Config, goals: Array = GOAL[None]) -> tuple[Array, int, int]:
    """Return the CPU times [s] of warm ticks, and how many candidates the last one has and how many of them take part."""
    config = config.with_values({'duration.model': 'fixed', 'duration.fixed_s': DURATION_S})
    memory, seconds = NO_TRACKS, []
    for hand in drift_hand(config):
        began = time.process_time()
        prediction, memory = predict(config, hand, obstacles, goals, memory)
        seconds.append(time.process_time() - began)
    return np.array(seconds[3:]), len(prediction.candidates), len(prediction.candidates_with_likelihood)


def measure_ticks(config: Config) -> Iterator[list[str]]:
    """Yield rows of the CPU times of warm ticks with many classes and with many obstacles, by strategy."""
    scenes = {
        '32 classes, 12 circles': (draw_circles(12, 1), 32),
        '64 circles, 4 classes': (draw_circles(64, 1, 0.5), 4),
        '64 circles, 16 classes': (draw_circles(64, 1, 0.5), 16),
    }
    for name, (obstacles, candidates) in scenes.items():
        for strategy in STRATEGIES:
            values = {'foc.strategy': strategy, 'homotopy.max_candidates': candidates}
            seconds, found, takes_part = time_ticks(obstacles, config.with_values(values))
            median, largest = (f'{1e3 * value:.1f}' for value in np.percentile(seconds, (50, 100)))
            yield [name, f'`{strategy}`', str(found), str(takes_part), median, largest]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure what the command line names, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--scenes', type=int, default=20, metavar='N', help='scenes of each number of circles; times ten between')
    parser.add_argument('--only', nargs='+', choices=('solved', 'between', 'ticks'), default=('solved', 'between', 'ticks'))
    parser.add_argument('--set', action='append', default=[], type=parse_setting, metavar='NAME=VALUE', help='a parameter')
    chosen = parser.parse_args(arguments)
    config = Config().with_values(dict(chosen.set))
    print(config)
    if 'solved' in chosen.only:
        head = ('circles', 'strategy', 'distinct classes', 'solved [%]', 'take part [%]', 'CPU for each [ms]')
        print_table(head, measure_solved(chosen.scenes, config))
    if 'between' in chosen.only:
        head = ('strategy', 'solved', 'least k / wanted k', '5 %', 'median', 'below 0.999')
        print_table(head, measure_between(10 * chosen.scenes))
    if 'ticks' in chosen.only:
        head = ('warm tick', 'strategy', 'candidates', 'take part', 'median CPU [ms]', 'largest')
        print_table(head, measure_ticks(config))


if __name__ == '__main__':
    main()
