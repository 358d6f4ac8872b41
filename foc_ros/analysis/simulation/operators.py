"""The simulated operators: what they intend, what they see, and the arm with which they move."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from foc_ros.core.errors import FocError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array, Obstacles, Record, make_obstacles

from .intended_path import DT, IntendedPath, plan_path
from .names import ACCURATE, CHANGES_WAY, HUMAN_PATHS, LAGGY, NOISY, UNANNOUNCED_GOAL

OBSTACLES = 6
GAP_M = 0.03
"""Smallest gap between two obstacles, and between an obstacle and the start or a goal."""
SEEN_STDDEV_M = 0.005
"""Standard deviation of the place at which an operator sees an obstacle, along each axis."""
CHANGE_AT = (0.3, 0.5)
"""Part of the movement at which an operator changes the way."""
MOST_DRAWS = 200


@dataclass(frozen=True)
class Arm:
    """The arm of an operator, and how it is controlled.

    mass [kg] and viscosity [N s/m] of arm and device; stiffness [N/m] and damping [N s/m] of the correction by sight, which is
    late by delay_s [s]. noise: standard deviation of the force, as a share of it; noise_s: its correlation time [s].
    """

    delay_s: float = 0.2
    noise: float = 0.04
    mass: float = 1.0
    viscosity: float = 8.0
    stiffness: float = 30.0
    damping: float = 5.0
    noise_s: float = 0.05


ARMS = {
    ACCURATE: Arm(delay_s=0.15, noise=0.02),
    NOISY: Arm(noise=0.15),
    LAGGY: Arm(delay_s=0.25, noise=0.06),
    CHANGES_WAY: Arm(),
    UNANNOUNCED_GOAL: Arm(),
    HUMAN_PATHS: Arm(delay_s=0.15, noise=0.01),
}


@dataclass(frozen=True, eq=False)
class Task(Record):
    """One movement: the scene, what the assistance is told of it, and what the operator intends.

    obstacles: as they are; goals (g, 2): announced ones [m]; goal (2,): the one of the operator [m]; goal_row: its row, -1 if it
    is not announced. hand_radius: of the hand [m].
    """

    arm: Arm
    obstacles: Obstacles
    goals: Array
    goal: Array
    goal_row: int
    path: IntendedPath
    hand_radius: float = 0.0


def draw_task(operator: str, rng: np.random.Generator) -> Task:
    """Draw the scene and the intention of an operator other than `HUMAN_PATHS`."""
    for _ in range(MOST_DRAWS):
        goals = np.array([[0.30, -0.09], [0.33, 0.0], [0.30, 0.09]]) + rng.normal(0.0, 0.01, (3, 2))
        obstacles = _draw_obstacles(rng, goals)
        seen = replace(obstacles, centre=obstacles.centre + rng.normal(0.0, SEEN_STDDEV_M, obstacles.centre.shape))
        row = int(rng.integers(len(goals)))
        path = plan_path(rng, np.zeros(2), goals[row], seen)
        if path is not None and operator == CHANGES_WAY:
            row = int((row + rng.integers(1, len(goals))) % len(goals))
            path = _change_way(rng, path, goals[row], seen)
        if path is None:
            continue
        if operator == UNANNOUNCED_GOAL:
            return Task(ARMS[operator], obstacles, np.delete(goals, row, axis=0), goals[row], -1, path)
        return Task(ARMS[operator], obstacles, goals, goals[row], row, path)
    raise FocError(f'no scene in {MOST_DRAWS} draws has a path for the operator {operator}')


def _draw_obstacles(rng: np.random.Generator, goals: Array) -> Obstacles:
    """Return posts between the start and the goals, with gaps between them."""
    posts = make_obstacles()
    kept = np.concatenate([np.zeros((1, 2)), goals])
    while len(posts) < OBSTACLES:
        centre, radius = np.array([rng.uniform(0.07, 0.25), rng.uniform(-0.1, 0.1)]), rng.uniform(0.012, 0.025)
        distances = np.hypot(*(kept - centre).T)
        if len(posts):
            distances = np.append(distances, measure_offsets(centre, posts)[1][0] - posts.radius)
        if distances.min() >= radius + GAP_M:
            posts = make_obstacles([*posts.centre, centre], [*posts.radius, radius], 0.001)
    return posts


def _change_way(rng: np.random.Generator, path: IntendedPath, goal: Array, seen: Obstacles) -> IntendedPath | None:
    """Return a path that becomes one to another goal half-way."""
    step = round(rng.uniform(*CHANGE_AT) * len(path.position))
    moving = path.velocity[step], path.acceleration[step]
    rest = plan_path(rng, path.position[step], goal, seen, moving)
    return None if rest is None else path.join(step, rest)


class SimulatedArm:
    """Moves a hand along an intended path with delayed sight and noise.

        m a = u + n + f - b v,    u = m a_d + b v_d + K (x_d - x)(t - delay) + D (v_d - v)(t - delay),

    with the intended path x_d, the force f of the assistance and a noise n whose standard deviation grows with |u|
    (signal-dependent noise, Harris and Wolpert 1998, doi 10.1038/29528). Attributes: position [m], velocity [m/s] and force u [N]
    of the hand.
    """

    def __init__(self, arm: Arm, path: IntendedPath, noise: Array) -> None:
        self._arm, self._path, self._noise = arm, path, noise
        self.position, self.velocity, self.force = path.position[0].copy(), path.velocity[0].copy(), np.zeros(2)
        self._errors: list[tuple[Array, Array]] = []
        self._coloured = np.zeros(2)
        self._step = 0

    def move(self, assistance: Array) -> None:
        """Move for one time step with a force (2,) [N] of the assistance."""
        arm, path = self._arm, self._path
        row, last = self._step, len(path.position) - 1
        wanted = min(row, last)
        velocity, acceleration = (path.velocity[wanted], path.acceleration[wanted]) if row <= last else (np.zeros(2), np.zeros(2))
        self._errors.append((path.position[wanted] - self.position, velocity - self.velocity))
        late = row - round(arm.delay_s / DT)
        error, slip = self._errors[late] if late >= 0 else (np.zeros(2), np.zeros(2))
        self.force = arm.mass * acceleration + arm.viscosity * velocity + arm.stiffness * error + arm.damping * slip
        decay = np.exp(-DT / arm.noise_s)
        stddev = arm.noise * float(np.hypot(*self.force))
        self._coloured = decay * self._coloured + np.sqrt(1.0 - decay**2) * self._noise[row]
        total = self.force + stddev * self._coloured + assistance - arm.viscosity * self.velocity
        self.velocity = self.velocity + DT / arm.mass * total
        self.position = self.position + DT * self.velocity
        self._step += 1
