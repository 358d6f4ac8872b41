# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated operators: the path that they intend, what they see, and the arm with which they move.

The path is of minimum jerk through via points round the obstacles as the operator sees them, or that of a recording of people.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from foc_ros.analysis.evaluation.truth import read_hand
from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.simulation import ACCURATE, CHANGES_WAY, HUMAN_PATHS, LAGGY, NOISY, UNANNOUNCED_GOAL
from foc_ros.core.config import Config
from foc_ros.core.errors import FocError, InputError, RecordingError
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array, Record

DT = 0.005
"""Time step of the simulation [s]."""
CLEARANCE_M = (0.003, 0.01)
"""Range of the distance that an operator plans to keep from an obstacle."""
MOST_DRAWS = 200


def sample_path(spline: BSpline, times: Array) -> Array:
    """Return the path (n, 3, 2) of a spline of positions at times (n,) [s]: position, velocity and acceleration in SI units."""
    return np.stack([spline(times, order) for order in range(3)], axis=1)


def interpolate_minimum_jerk(points: Array, times: Array, moving: Array) -> Array:
    """Return the path (n, 3, 2) of least integrated squared jerk through points (k, 2) [m] at times (k,) [s], at rest at its end.

    With fixed times this is the quintic spline with knots at the via points (Flash and Hogan 1985, doi
    10.1523/JNEUROSCI.05-07-01688.1985). moving (2, 2): velocity [m/s] and acceleration [m/s^2] at the first point.
    """
    conditions = ([(1, moving[0]), (2, moving[1])], [(1, np.zeros(2)), (2, np.zeros(2))])
    spline = make_interp_spline(times, points, k=5, bc_type=conditions)
    return sample_path(spline, np.append(np.arange(0.0, times[-1], DT), times[-1]))


def plan_path(rng: np.random.Generator, start: Array, goal: Array, seen: Obstacles, moving: Array | None = None) -> Array | None:
    """Return an intended path (n, 3, 2) to a goal among obstacles as the operator sees them; None if few via points do not do.

    Via points, at most four, are set beside the obstacle that the path comes nearest to, until the path is free by 1 mm. moving
    (2, 2): velocity [m/s] and acceleration [m/s^2] at the start; at rest if not given.
    """
    points, s = [start, goal], np.linspace(0.0, 1.0, 201)
    for _ in range(5):
        # the times are those of a straight minimum-jerk movement of the same length at 0.25 m/s
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        shares = lengths / lengths[-1]
        if moving is None:  # else it has begun: the first half of the profile is past
            shares = np.interp(shares, 10 * s**3 - 15 * s**4 + 6 * s**5, s)
        times = shares * max(lengths[-1] / 0.25, 0.4)
        path = interpolate_minimum_jerk(np.array(points), times, np.zeros((2, 2)) if moving is None else moving)
        offsets, distances = measure_offsets(path[:, 0], seen)
        heights = distances - seen.radius
        if not len(seen) or heights.min() >= 0.001:
            return path
        step, row = np.unravel_index(heights.argmin(), heights.shape)
        # one more point beside the obstacle, on the shorter side with a probability of 3/4
        along, extent = goal - start, float(seen.extent[row])
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        side = (1.0 if offsets[step, row] @ left > 0.0 else -1.0) * (-1.0 if rng.random() > 0.75 else 1.0)
        via = seen.centre[row] + side * (extent + rng.uniform(*CLEARANCE_M)) * left
        others = [each for each in points[1:-1] if np.hypot(*(each - path[step, 0])) > extent + CLEARANCE_M[1]]
        points = [start, *sorted([*others, via], key=lambda each: float(each @ along)), goal]
    return None


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

    goals (g, 2): announced ones [m]; goal (2,): the one of the operator [m]; goal_row: its row, -1 if it is not announced; path
    (n, 3, 2): intended positions, velocities and accelerations at steps of `DT`, in SI units; hand_radius [m].
    """

    arm: Arm
    obstacles: Obstacles
    goals: Array
    goal: Array
    goal_row: int
    path: Array
    hand_radius: float = 0.0


def draw_task(operator: str, rng: np.random.Generator, hand_radius: float = 0.0) -> Task:
    """Draw the scene and the intention of an operator other than `HUMAN_PATHS`, who has a hand of a radius [m]."""
    for _ in range(MOST_DRAWS):
        goals = np.array([[0.30, -0.09], [0.33, 0.0], [0.30, 0.09]]) + rng.normal(0.0, 0.01, (3, 2))
        obstacles, kept = make_obstacles(), np.concatenate([np.zeros((1, 2)), goals])
        while len(obstacles) < 6:  # posts between the start and the goals, with gaps of at least 3 cm between all of them
            centre, radius = np.array([rng.uniform(0.07, 0.25), rng.uniform(-0.1, 0.1)]), rng.uniform(0.012, 0.025)
            distances = np.hypot(*(kept - centre).T)
            if len(obstacles):
                distances = np.append(distances, measure_offsets(centre, obstacles)[1][0] - obstacles.radius)
            if distances.min() >= radius + 0.03:
                obstacles = make_obstacles([*obstacles.centre, centre], [*obstacles.radius, radius], 0.001)
        # the operator sees each obstacle at a place with a standard deviation of 5 mm
        seen = replace(obstacles, centre=obstacles.centre + rng.normal(0.0, 0.005, obstacles.centre.shape)).grow(hand_radius)
        row = int(rng.integers(len(goals)))
        path = plan_path(rng, np.zeros(2), goals[row], seen)
        if path is not None and operator == CHANGES_WAY:
            row = int((row + rng.integers(1, len(goals))) % len(goals))
            step = round(rng.uniform(0.3, 0.5) * len(path))
            rest = plan_path(rng, path[step, 0], goals[row], seen, path[step, 1:])
            path = None if rest is None else np.concatenate([path[:step], rest])
        if path is None:
            continue
        if operator == UNANNOUNCED_GOAL:
            return Task(ARMS[operator], obstacles, np.delete(goals, row, axis=0), goals[row], -1, path, hand_radius)
        return Task(ARMS[operator], obstacles, goals, goals[row], row, path, hand_radius)
    words = f'no scene in {MOST_DRAWS} draws has a path for the operator {operator}, with scene.hand_radius {hand_radius:g} m'
    raise FocError(words)


class SimulatedArm:
    """Moves a hand along an intended path with delayed sight and noise.

        m a = u + n + f - b v,    u = m a_d + b v_d + K (x_d - x)(t - delay) + D (v_d - v)(t - delay),

    with the intended path x_d, the force f of the assistance and a noise n whose standard deviation grows with |u| (Harris and
    Wolpert 1998, doi 10.1038/29528). Attributes: position [m], velocity [m/s] and force u [N] of the hand.
    """

    def __init__(self, arm: Arm, path: Array) -> None:
        self._arm, self._path = arm, path
        (self.position, self.velocity), self.force = path[0, :2], np.zeros(2)
        self._errors: list[Array] = []
        self._coloured = np.zeros(2)

    def move(self, assistance: Array, noise: Array) -> None:
        """Move for one time step with a force (2,) [N] of the assistance; noise (2,): standard normal numbers."""
        arm, path, step = self._arm, self._path, len(self._errors)
        wanted = path[step] if step < len(path) else np.array([path[-1, 0], np.zeros(2), np.zeros(2)])
        self._errors.append(wanted[:2] - [self.position, self.velocity])
        late = step - round(arm.delay_s / DT)
        error, slip = self._errors[late] if late >= 0 else np.zeros((2, 2))
        self.force = arm.mass * wanted[2] + arm.viscosity * wanted[1] + arm.stiffness * error + arm.damping * slip
        decay = np.exp(-DT / arm.noise_s)
        self._coloured = decay * self._coloured + np.sqrt(1.0 - decay**2) * noise
        stddev = arm.noise * float(np.hypot(*self.force))
        total = self.force + stddev * self._coloured + assistance - arm.viscosity * self.velocity
        self.velocity = self.velocity + DT / arm.mass * total
        self.position = self.position + DT * self.velocity


def read_tasks(recordings: Iterable[Recording], config: Config) -> list[Task]:
    """Return a task for each recording that can be used, in their order; raise InputError if there is none."""
    tasks = [task for recording in recordings if (task := read_task(recording, config)) is not None]
    if not tasks:
        raise InputError('--recordings', 'recordings with goals', 'none')
    return tasks


def read_task(recording: Recording, config: Config) -> Task | None:
    """Return the task of a recording: its path, its scene and, as the goal of the hand, the end of the path.

    None for a recording that cannot be read, that has few samples or no goals, or whose hand touches an obstacle by itself.
    """
    try:
        hand = read_hand(recording, config)
    except RecordingError:
        return None
    spline = make_interp_spline(hand.times, hand.path.positions, k=5)
    path, radius = sample_path(spline, np.arange(0.0, hand.times[-1], DT)), config.scene.hand_radius
    if (measure_offsets(path[:, 0], hand.obstacles)[1] - hand.obstacles.radius).min(initial=np.inf) <= radius:
        return None
    goal, goals = path[-1, 0], hand.path.goals
    return Task(ARMS[HUMAN_PATHS], hand.obstacles, goals, goal, int(np.hypot(*(goals - goal).T).argmin()), path, radius)
