# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Monte Carlo check of a solution: noisy roll-outs against the true obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.obstacle_table import Edges
from foc_ros.core.obstacles.geometry import find_offset
from foc_ros.core.plant.covariance import stack_noise
from foc_ros.core.types import Array

from .problem import Problem

BATCH = 2000
"""Roll-outs held at once, to bound the memory."""


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Fractions of roll-outs that stay clear, each with its 95 % interval (Wilson).

    step: the worst obstacle and step, (estimate, low, high), at `place` = (obstacle row, step 1..N); path: of every obstacle
    at every step together.
    """

    samples: int
    step: tuple[float, float, float]
    place: tuple[int, int] | None
    path: tuple[float, float, float]


def monte_carlo(problem: Problem, control: Array, samples: int, seed: int = 0) -> MonteCarlo:
    """Roll out `samples` noisy movements under a stacked control (2N,), with sampled radii and centres.

    The noise of each step is normal with standard deviation c |U|; the error of the initial state is drawn once per roll-out.
    """
    generator = np.random.default_rng(seed)
    m, steps = len(problem.obstacles), problem.horizon.steps
    clear_steps, clear_paths = np.zeros((m, steps)), 0
    for begin in range(0, samples, BATCH):
        clear = _clear(problem, control, min(BATCH, samples - begin), generator)
        clear_steps += clear.sum(axis=0)
        clear_paths += int(clear.all(axis=(1, 2)).sum())
    if m == 0:
        return MonteCarlo(samples, (1.0, *wilson(samples, samples)), None, (1.0, *wilson(samples, samples)))
    row, column = np.unravel_index(int(clear_steps.argmin()), clear_steps.shape)
    worst = int(clear_steps[row, column])
    return MonteCarlo(
        samples,
        (worst / samples, *wilson(worst, samples)),
        (int(row), int(column) + 1),
        (clear_paths / samples, *wilson(clear_paths, samples)),
    )


def _clear(problem: Problem, control: Array, samples: int, generator: np.random.Generator) -> Array:
    """Whether each roll-out is outside each obstacle at each step, (samples, m, N) bool."""
    steps, obstacles = problem.horizon.steps, problem.obstacles
    noise = stack_noise(problem.noise, steps) * np.abs(control) * generator.standard_normal((samples, 2 * steps))
    positions = problem.positions(control) + np.einsum('atu,su->sta', problem.horizon.position, noise)
    errors = _gaussian(problem.initial_covariance[None], samples, generator)[:, 0]
    positions += np.einsum('tij,sj->sti', problem.error_map[1:, :2], errors)
    radius = obstacles.radius + obstacles.radius_stddev * generator.standard_normal((samples, len(obstacles)))
    drift = _gaussian(obstacles.centre_covariance, samples, generator)
    clear: Array = np.empty((samples, len(obstacles), steps), dtype=np.bool_)
    for row in range(len(obstacles)):
        relative = positions - problem.centres[row] - drift[:, row, None]
        edges = Edges(*(each[row] for each in problem.obstacles.edges))
        distance = find_offset(relative[..., 0], relative[..., 1], edges).distance
        clear[:, row] = distance >= np.abs(radius[:, row, None])
    return clear


def _gaussian(covariance: Array, samples: int, generator: np.random.Generator) -> Array:
    """Zero-mean samples (samples, k, n) of covariances (k, n, n) that may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    drawn: Array = np.einsum('kij,skj->ski', root, generator.standard_normal((samples, *covariance.shape[:2])))
    return drawn


def wilson(successes: int, samples: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson score interval of a fraction, (low, high)."""
    p, n = successes / samples, samples
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * float(np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)))
    return max(0.0, middle - half), min(1.0, middle + half)
