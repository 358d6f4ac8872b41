"""One reaching scene as the paper poses it: a known start, goals and a duration, without a movement before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .config import Config
from .errors import SceneError
from .obstacles.geometry import measure_offsets
from .types import Array, HandState, Obstacles, Record


@dataclass(frozen=True, eq=False)
class ReachingScene(Record):
    """One reaching problem.

    hand: where it starts; goals (g, 2) [m]; obstacles; noise (2,): c per step, None for the parameters' noise scaled to the step;
    guess (N + 1, 2) [m]: path in the only class to be solved, None to search the classes; config: parameters, of which
    `duration.fixed_s` is the duration.
    """

    hand: HandState
    goals: Array
    obstacles: Obstacles
    noise: Array | None
    guess: Array | None
    config: Config

    @property
    def avoided(self) -> Obstacles:
        """The obstacles that the centre of the hand has to avoid: those of the scene, larger by the radius of the hand."""
        return self.obstacles.grow(self.config.scene.hand_radius)

    @property
    def duration_s(self) -> float:
        """Duration of the movement [s]."""
        return self.config.duration.fixed_s


def check_outside(field: str, point: Array, obstacles: Obstacles) -> None:
    """Raise SceneError, which names the field, if a point (2,) [m] lies inside the mean boundary of an obstacle."""
    distances = measure_offsets(point, obstacles)[1][0]
    for row in np.flatnonzero(distances < obstacles.radius)[:1]:
        found = f'{point.tolist()}, {max(round(distances[row], 9), 0.0):.4g} m from its polygon'
        raise SceneError(field, f'a point outside obstacle {obstacles.ids[row]}, of radius {obstacles.radius[row]:g} m', found)
