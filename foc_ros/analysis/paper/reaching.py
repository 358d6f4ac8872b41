"""One homotopy class of one scene, solved and measured: the unit that every study consists of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from foc_ros.core.classes import find_path_sides
from foc_ros.core.config import FocConfig
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.plants import build_triple_integrator_horizon
from foc_ros.core.types import Array, Obstacles, Solution, Status, make_obstacles
from foc_ros.io.scene_file import guess_path

STEPS, DURATION_S = 50, 1.0
EQUAL_M = 1e-6
"""Distances that differ by less than this are equal [m]."""
HORIZON = build_triple_integrator_horizon(DURATION_S / STEPS, STEPS)


@dataclass(frozen=True)
class PathClass:
    """A homotopy class: the amplitude of its guess to the left [m], and the side on which it passes obstacles, by id."""

    name: str
    amplitude: float
    sides: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class PaperScene:
    """A reach from rest at the origin to rest at a goal on the x axis, in DURATION_S.

    goal_x [m]; circles: x, y, mean and standard deviation of the radius [m] of each obstacle; ways: the classes that are studied.
    """

    goal_x: float
    circles: tuple[tuple[float, float, float, float], ...]
    path_classes: tuple[PathClass, ...]

    @cached_property
    def obstacles(self) -> Obstacles:
        """The circles as obstacles, with ids counted from 0."""
        table = np.array(self.circles)
        return make_obstacles(table[:, :2], table[:, 2], table[:, 3])

    @cached_property
    def goal(self) -> Array:
        """The goal, (2,) [m]."""
        return np.array([self.goal_x, 0.0])

    def make_problem(self, noise: float, eta: float) -> Problem:
        """Return the problem with noise c on both axes, per step, and a wanted eta."""
        return rest_to_goal(HORIZON, np.zeros(6), self.goal, self.obstacles, np.full(2, noise), eta)


@dataclass(frozen=True)
class Method:
    """How a problem is solved: noise c per step, and a strategy with its settings where they are not the defaults."""

    noise: float
    strategy: str
    settings: tuple[tuple[str, float], ...] = ()

    @property
    def config(self) -> FocConfig:
        """The settings as the configuration of the forward optimal control."""
        return replace(FocConfig(strategy=self.strategy), **dict(self.settings))  # type: ignore[arg-type]


def solve_class(scene: PaperScene, path_class: PathClass, method: Method, eta: float) -> Solution:
    """Solve one class from its guess, so that no study depends on the order of its solutions.

    A solution that slid into another class has the status LEFT_CLASS.
    """
    guess = guess_path(np.zeros(2), scene.goal, STEPS, path_class.amplitude)
    solution = solve_problem(scene.make_problem(method.noise, eta), cold_start(guess), method.config)
    sides = find_path_sides(solution.path, scene.obstacles)
    if solution.status is Status.SOLVED and any(sides.get(identity) != side for identity, side in path_class.sides):
        return replace(solution, status=Status.LEFT_CLASS, message='the solution slid into another class')
    return solution


def measure_solution(scene: PaperScene, solution: Solution) -> dict[str, float]:
    """Return the numbers by which solutions are compared, by name.

    clearance: least distance of the mean path from the mean edge of an obstacle [m]; path_length: of the mean path [m];
    largest_stddev: root of the largest sum over the axes of the position's variance [m]; speed_to_obstacles: mean speed up to
    where the mean is nearest to the edge of an obstacle [m/s].
    """
    speed, obstacles = compute_speed(solution), scene.obstacles
    distance = (np.linalg.norm(solution.path[:, None] - obstacles.centre, axis=-1) - obstacles.radius).min(axis=1)
    nearest = np.flatnonzero(distance < distance.min() + EQUAL_M)[-1]  # the mean often touches a circle at two steps
    return {
        'effort': solution.effort,
        'eta': solution.eta,
        'tau': solution.tau,
        'lambda': solution.lam,
        'clearance': float(distance.min()),
        'path_length': float(np.linalg.norm(np.diff(solution.path, axis=0), axis=1).sum()),
        'largest_stddev': float(np.sqrt(solution.covariance[:, 0, 0] + solution.covariance[:, 1, 1]).max()),
        'peak_speed': float(speed.max()),
        'speed_to_obstacles': float(speed[: nearest + 1].mean()),
    }


def compute_speed(solution: Solution) -> Array:
    """Return the speed of the mean, (N + 1,) [m/s]."""
    return np.asarray(np.linalg.norm(solution.mean[:, 2:4], axis=1))
