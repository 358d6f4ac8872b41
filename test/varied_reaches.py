# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Random reaches of every kind that the chance constraint knows: noise, eta, moving and uncertain circles, an uncertain start."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from reach_helpers import bowed, random_scene, reach, solved

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.solution import Status

STEPS = 40
FASTEST = 0.05
"""Largest speed of a circle along each axis [m/s]."""
CENTRE_STDDEV = 0.003
"""Typical standard deviation of a centre [m]."""
START_STDDEV = np.repeat([0.002, 0.01, 0.05], 2)
"""Typical standard deviations of the state at the start [m, m/s, m/s^2]."""


@dataclass(frozen=True, eq=False)
class VariedReach:
    """A problem, a guess (N + 1, 2) to solve it from, and a pair (tau, lambda) for strategy `fixed`."""

    seed: int
    problem: Problem
    guess: np.ndarray
    tau: float
    lam: float


def varied_reach(seed: int) -> VariedReach:
    """Return the reach of a seed: noise 0.05 to 0.15 per axis, eta 0.6 to 0.95; each of the rest in about a third."""
    generator = np.random.default_rng(seed)
    obstacles, goal, amplitude = random_scene(generator)
    noise, eta = generator.uniform(0.05, 0.15, 2), generator.uniform(0.6, 0.95)
    start = _covariance(generator, START_STDDEV) if generator.random() < 1 / 3 else np.zeros((6, 6))
    problem = reach(_varied(obstacles, generator), goal=goal, steps=STEPS, noise=noise, eta=eta, initial_covariance=start)
    tau, lam = 10 ** generator.uniform(-4, -2.5), 10 ** generator.uniform(0, 6)
    return VariedReach(seed, problem, bowed((0, 0), goal, STEPS, amplitude), tau, lam)


def _varied(obstacles: Obstacles, generator: np.random.Generator) -> Obstacles:
    n, moving, uncertain = len(obstacles), generator.random() < 1 / 3, generator.random() < 1 / 3
    covariance = [_covariance(generator, np.full(2, CENTRE_STDDEV)) * uncertain for _ in range(n)]
    velocity = generator.uniform(-FASTEST, FASTEST, (n, 2)) * moving
    return replace(obstacles, velocity=velocity, centre_covariance=np.array(covariance))


def _covariance(generator: np.random.Generator, stddev: np.ndarray) -> np.ndarray:
    """Return a covariance with cross terms, about that of these standard deviations."""
    root = stddev[:, None] * generator.standard_normal((len(stddev), len(stddev))) / np.sqrt(len(stddev))
    return root @ root.T


@lru_cache(maxsize=1)
def feasible_reaches(count: int, tries: int = 300) -> tuple[VariedReach, ...]:
    found = []
    for seed in range(tries):
        made = varied_reach(seed)
        if solved(made.problem, made.guess, 'optimal').status is Status.SOLVED:
            found.append(made)
        if len(found) == count:
            return tuple(found)
    raise AssertionError(f'{len(found)} of {tries} random reaches are feasible: {count} are wanted')
