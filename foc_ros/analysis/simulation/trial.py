"""One trial: an operator with an assistance rule in a closed loop, and its measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import Config
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array, Record

from .assistance import Assistance
from .intended_path import DT
from .operators import SimulatedArm, Task

MEASURED_STDDEV_M = 0.0003
"""Standard deviation of a measured position, along each axis."""
ARRIVED_M, STOPPED = 0.01, 0.05
"""Distance from the goal [m] and speed [m/s] at which a movement is complete."""
EXTRA_S = 1.5
"""Time beyond that of the intended movement after which a trial ends."""


@dataclass(frozen=True, eq=False)
class Trial(Record):
    """What happened in a trial, at each of its n time steps.

    position (n, 2) [m]; assistance, effort (n, 2): forces of assistance and operator [N]; is_wrong (n,): whether the rule took
    another way than the intended one to be the likeliest.
    """

    position: Array
    assistance: Array
    effort: Array
    is_wrong: Array

    @property
    def duration_s(self) -> float:
        """Time until the goal was reached, or until the end of the trial [s]."""
        return DT * len(self.position)

    def measure_clearances(self, task: Task) -> Array:
        """Return the distance of the hand from the nearest obstacle, (n,) [m]; infinite without obstacles."""
        obstacles = task.obstacles.grow(task.hand_radius)
        if not len(obstacles):
            return np.full(len(self.position), np.inf)
        clearances: Array = (measure_offsets(self.position, obstacles)[1] - obstacles.radius).min(axis=1)
        return clearances

    def find_collisions(self, task: Task) -> NDArray[np.bool_]:
        """Return whether the hand is within an obstacle, (n,)."""
        return self.measure_clearances(task) < 0.0


def count_steps(task: Task) -> int:
    """Return the largest number of time steps of a trial."""
    return len(task.path.position) + round(EXTRA_S / DT)


def run_trial(task: Task, assistance: type[Assistance], config: Config, noise: Array) -> Trial:
    """Run a trial. noise (n, 2, 2): standard normal numbers for arm and measurement, the same ones for each rule of a pair."""
    arm, rule = SimulatedArm(task.arm, task.path, noise[:, 0]), assistance(task, config)
    rows = []
    for step in range(count_steps(task)):
        force = rule.update(step, arm.position + MEASURED_STDDEV_M * noise[step, 1])
        arm.move(force)
        rows.append((*arm.position, *force, *arm.force, float(rule.is_wrong)))
        if np.hypot(*(arm.position - task.goal)) < ARRIVED_M and np.hypot(*arm.velocity) < STOPPED:
            break
    table = np.array(rows)
    return Trial(table[:, :2], table[:, 2:4], table[:, 4:6], table[:, 6])


def measure_trial(trial: Trial, task: Task, f_max: float) -> dict[str, float]:
    """Return the measures of a trial by name.

    The opposing impulse is the integral of the force of the assistance against the direction in which the operator intends to
    move, and the opposing share its mean as a share of the largest force.
    """
    clearance = float(trial.measure_clearances(task).min())
    velocity = np.zeros_like(trial.position)
    steps = min(len(velocity), len(task.path.velocity))
    velocity[:steps] = task.path.velocity[:steps]
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    along = (trial.assistance * velocity).sum(axis=1) / np.where(speed > 0.0, speed, 1.0)
    opposing = DT * float(np.maximum(-along, 0.0).sum())
    return {
        'collision_rate': float(clearance < 0.0),
        'completion_s': trial.duration_s,
        'min_clearance_m': clearance,
        'path_m': float(np.hypot(*np.diff(trial.position, axis=0).T).sum()),
        'effort': DT * float((trial.effort**2).sum()),
        'opposing_impulse': opposing,
        'opposing_share': opposing / trial.duration_s / f_max,
        'wrong_s': DT * float(trial.is_wrong.sum()),
    }
