"""The assistance rules of the study behind one interface: what each is told, its force, and the way that it takes to be likely.

All rules have the same estimate of the hand and the same limits of force and slew.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from foc_ros.core.classes.sides import find_path_sides
from foc_ros.core.config import Config
from foc_ros.core.guidance.limits import find_largest_force, shorten
from foc_ros.core.guidance.step import GuidanceInput, GuidanceState, guide
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Prediction

from .intended_path import DT
from .names import FOC, NONE
from .operators import Task

POSE_STEPS = 2
"""Time steps between two measured poses: 100 Hz."""
SOURCE = 'simulation'


class Assistance(ABC):
    """A rule in one trial. Attributes: is_wrong, whether its likeliest way is not the intended one."""

    def __init__(self, task: Task, config: Config) -> None:
        self.task, self.config, self.is_wrong = task, config, False
        self.pipeline = Pipeline(config)
        self.pipeline.set_goals(task.goals, '')
        self.pipeline.set_obstacles(SOURCE, task.obstacles, None, '')
        self._force = np.zeros(2)

    def update(self, step: int, measured: Array) -> Array:
        """Return the force (2,) [N] at a time step from the measured position (2,) [m]."""
        if step % POSE_STEPS == 0:
            self.pipeline.add_hand_sample(HandSample(round((1.0 + step * DT) * NANOSECONDS), measured))
        assert self.pipeline.hand_state is not None
        mean = self.pipeline.hand_state.mean
        target = self.compute_force(step, *mean.reshape(3, 2))
        settings = self.config.guidance
        change = shorten(shorten(target, find_largest_force(settings)) - self._force, settings.slew * DT)
        self._force = self._force + change
        return self._force

    @abstractmethod
    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Return the wanted force (2,) [N] for the estimated position [m], velocity [m/s] and acceleration [m/s^2], (2,) each."""


class NoAssistance(Assistance):
    """The operator alone."""

    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:  # noqa: ARG002
        """Return no force."""
        return np.zeros(2)


class FocAssistance(Assistance):
    """The guidance of this package. A prediction is available one period after the pose that it was made from."""

    def __init__(self, task: Task, config: Config) -> None:
        super().__init__(task, config)
        self._state = GuidanceState()
        self._newest: Prediction | None = None
        self._next: Prediction | None = None
        self._is_next_wrong = False

    def compute_force(self, step: int, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Return the force of the guidance."""
        t = 1.0 + step * DT
        if self.pipeline.is_due:
            self._newest, self.is_wrong = self._next, self._is_next_wrong
            self._next = self.pipeline.predict()
            self._is_next_wrong = self._next is not None and is_wrong_way(self._next, self.task, step)
        age_s = 0.0 if self._newest is None else t - self._newest.t
        given = GuidanceInput(t, position, velocity, self._newest, 0.0, age_s, acceleration=acceleration)
        output, self._state = guide(self.config, self._state, given)
        return output.force


def is_wrong_way(prediction: Prediction, task: Task, step: int) -> bool:
    """Return whether the likeliest candidate leads to another goal, or passes an obstacle on another side, than intended."""
    likeliest = next((each for each in prediction.candidates_with_likelihood if each.label == prediction.most_likely), None)
    if likeliest is None:
        return False
    if likeliest.candidate.goal != task.goal_row:
        return True
    rest = task.path.position[min(step, len(task.path.position) - 2) :]
    intended = find_path_sides(np.ascontiguousarray(rest), task.obstacles)
    return any(intended.get(name, side) != side for name, side in likeliest.sides.items())


RULES: Mapping[str, type[Assistance]] = {NONE: NoAssistance, FOC: FocAssistance}
"""The rules of `simulate` by name. A study may have others: they need a task and a configuration, as `Assistance` has them."""
