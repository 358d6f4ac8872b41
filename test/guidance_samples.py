# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Random predictions and hostile hands for the tests of guidance: no solver, so that thousands of them are cheap."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from prediction_samples import outcome, prediction

from foc_ros.core.config import Config, GuidanceConfig
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, guide
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import Status
from foc_ros.core.types import Array

SAMPLES, PERIOD = 12, 0.005
HANDS = ('still', 'walks', 'flees', 'shakes', 'attacks', 'circles')


def random_scene(rng: np.random.Generator) -> Obstacles:
    """Return up to four posts and boxes round the origin."""
    n = int(rng.integers(0, 5))
    box = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    polygons = [rng.uniform(0.004, 0.03, 2) * box if rng.random() < 0.4 else np.zeros((1, 2)) for _ in range(n)]
    return make_obstacles(rng.uniform(-0.12, 0.12, (n, 2)), rng.uniform(0.003, 0.03, n), 0.0, polygons=polygons or None)


def random_candidate(rng: np.random.Generator, start: Array, label: str) -> PredictedCandidate:
    """Return a candidate along a smooth random path; every sixth one could not be solved."""
    base = outcome(label, float(rng.uniform(0.01, 1.0)))
    u = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    mean, covariance = np.zeros((SAMPLES, 6)), np.zeros((SAMPLES, 6, 6))
    mean[:, :2] = start + u * rng.normal(0.0, 0.2, 2) + u * (1 - u) * rng.normal(0.0, 0.3, 2)
    if rng.random() < 0.05:
        mean[:, :2] = start  # a path without any length
    factor = rng.normal(0.0, 10.0 ** rng.uniform(-6, 0), (SAMPLES, 2, 2))
    covariance[:, :2, :2] = factor @ factor.transpose(0, 2, 1)
    status = Status.INFEASIBLE if rng.random() < 1 / 6 else Status.SOLVED
    solution = replace(base.solution, mean=mean, covariance=covariance, status=status)
    return replace(base, solution=solution, likelihood=base.likelihood if status is Status.SOLVED else 0.0)


def random_prediction(rng: np.random.Generator, t: float, start: Array, obstacles: Obstacles) -> Prediction:
    """Return a prediction of up to four candidates, of which none needs to agree with another one, or with the hand."""
    names = rng.permutation(['goal0:', 'goal0:+0', 'goal0:-0', 'goal1:'])[: rng.integers(0, 5)]
    candidates = [random_candidate(rng, start + rng.normal(0.0, 0.02, 2), str(name)) for name in names]
    total = sum(each.likelihood for each in candidates) or 1.0
    candidates = [replace(each, likelihood=each.likelihood / total) for each in candidates]
    return prediction(*candidates, stamp_ns=round(t * 1e9), obstacles=obstacles)


@dataclass
class Run:
    """What happened: outputs, positions (n, 2) and times (n,) of all updates."""

    config: GuidanceConfig
    obstacles: Obstacles
    outputs: list[GuidanceOutput] = field(default_factory=list)
    positions: list[Array] = field(default_factory=list)

    @property
    def forces(self) -> Array:
        return np.array([each.force for each in self.outputs])

    @property
    def times(self) -> Array:
        return np.array([each.t for each in self.outputs])

    def measure_extracted_energy(self) -> Array:
        """Return the energy [J] that the hand has extracted until each update, of forces that are held in between."""
        return np.concatenate([[0.0], np.cumsum((self.forces[:-1] * np.diff(self.positions, axis=0)).sum(axis=1))])

    def measure_force_into_margins(self) -> Array:
        """Return the largest force (n,) [N] into a margin within 1 mm of it at each update."""
        if not len(self.obstacles):
            return np.zeros(len(self.outputs))
        offsets, distances = measure_offsets(np.array(self.positions), self.obstacles)
        normals = offsets / np.where(distances == 0.0, 1.0, distances)[..., None]
        heights = distances - self.obstacles.radius - self.config.margin
        inward = -(normals * self.forces[:, None]).sum(axis=2)
        return np.where(np.abs(heights) <= 0.001, inward, 0.0).max(axis=1)


def move(rng: np.random.Generator, kind: str, state: GuidanceState, obstacles: Obstacles, speed: float) -> Array:
    """Return where a hand goes within a period, at most at a speed."""
    step = speed * PERIOD
    if kind == 'still':
        return state.position
    if kind == 'flees':  # with the force, to extract what there is
        norm = float(np.hypot(*state.force))
        direction = state.force / norm if norm > 0.0 else rng.normal(0.0, 0.1, 2)
    elif kind == 'attacks' and len(obstacles):
        direction = obstacles.centre[0] - state.position
    elif kind == 'circles' and len(obstacles):
        x, y = state.position - obstacles.centre[0]
        direction = np.array([-y, x]) - 0.3 * np.array([x, y])
    elif kind == 'shakes':
        direction = np.array([1.0, 0.4]) * (1 if rng.random() < 0.5 else -1)
    else:
        direction = rng.normal(0.0, 1.0, 2)
    norm = float(np.hypot(*direction))
    return state.position + step * direction / max(norm, 1.0 if kind == 'flees' else norm, 1e-9)


def run_hostile(rng: np.random.Generator, ticks: int = 24, *, has_jumps: bool = False) -> Run:
    """Run guidance on a hostile hand, with predictions that jump, vanish, arrive late and contradict each other.

    has_jumps: the hand jumps, and obstacles change, faster than any hand moves. Velocities are wrong in one run of three.
    """
    mode = 'path' if rng.random() < 0.5 else 'trajectory'
    settings = GuidanceConfig(
        mode=mode,
        tank=float(10.0 ** rng.uniform(-3, 0)),
        k_max=float(rng.uniform(50, 3000)),
        lookahead_s=float(rng.choice([0, 0.2])),
    )
    config, obstacles = Config(guidance=settings), random_scene(rng)
    run, state, newest = Run(settings, obstacles), GuidanceState(), None
    kind, is_wrong = str(rng.choice(HANDS)), rng.random() < 1 / 3
    position, t = rng.normal(0.0, 0.06, 2), 0.0
    for _ in range(ticks):
        if rng.random() < 0.3:
            late = rng.choice([0.0, 0.02, 1.0], p=[0.5, 0.4, 0.1])
            scene = random_scene(rng) if has_jumps and rng.random() < 0.3 else obstacles
            newest = None if rng.random() < 0.1 else random_prediction(rng, t - late, position, scene)
        velocity = rng.normal(0.0, 10.0 ** rng.uniform(-2, 4), 2) if is_wrong else (position - state.position) / PERIOD
        age = 0.0 if newest is None else t - newest.t
        acceleration = rng.normal(0.0, 2.0, 2)
        given = GuidanceInput(t, position, velocity, newest, 0.0, age, bool(rng.random() < 0.02), acceleration)
        output, state = guide(config, state, given)
        run.outputs.append(output)
        run.positions.append(position)
        position = move(rng, kind, state, obstacles, settings.max_speed)
        if has_jumps and rng.random() < 0.1:
            position = rng.normal(0.0, 10.0 ** rng.uniform(-2, 3), 2)
        t += PERIOD
    return run
