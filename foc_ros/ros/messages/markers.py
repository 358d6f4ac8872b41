"""A prediction drawn: paths, standard-deviation ellipses and labels of all candidates, obstacles with their uncertainty.

Every array begins by deleting what the last one drew, and all markers live for LIFETIME_S: a prediction that is not renewed
disappears.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array, Obstacles, PredictedCandidate, Prediction

from .plane import lift
from .ranking import ranked
from .types import MessageTypes, header

CYLINDER, LINE_STRIP, TEXT = 3, 4, 9
DELETE_ALL = 3
LIFETIME_S = 1.0
ELLIPSES = 6
"""Drawn along each path."""
MAX_DRAWN = 128
"""Obstacles drawn, the nearest to the hand: markers of thousands would take longer to make than the prediction."""
THICKNESS = 0.002
TEXT_HEIGHT = 0.012

Colour = tuple[float, float, float, float]
GREY: Colour = (0.55, 0.55, 0.55, 0.5)
OBSTACLE: Colour = (0.45, 0.45, 0.5, 0.9)
SHELL: Colour = (0.85, 0.35, 0.2, 0.25)
UNLIKELY, LIKELY = np.array([0.25, 0.45, 0.85]), np.array([0.95, 0.6, 0.05])


def marker_array(prediction: Prediction, obstacles: Obstacles, plane: str, types: MessageTypes) -> Any:
    """Return the MarkerArray. Unsolved candidates are grey and carry their status; obstacles are those at the stamp."""
    pen = _Pen(prediction, plane, types)
    solved = ranked(prediction)
    unsolved = [outcome for outcome in prediction.candidates if not outcome.is_solved]
    drawn = [pen.clear()]
    for index, outcome in enumerate([*solved, *unsolved]):
        drawn.extend(pen.candidate(index, outcome))
    drawn.extend(pen.obstacles(obstacles))
    return types.make('visualization_msgs/msg/MarkerArray', markers=drawn)


@dataclass(frozen=True)
class _Pen:
    """Draws in the plane of one prediction. What all markers have in common is made once."""

    prediction: Prediction
    plane: str
    types: MessageTypes

    @cached_property
    def _common(self) -> dict[str, Any]:
        return {
            'header': header(self.types, self.prediction.stamp_ns, self.prediction.frame_id),
            'lifetime': self.types.make('builtin_interfaces/msg/Duration', sec=int(LIFETIME_S)),
        }

    def clear(self) -> Any:
        return self._marker('', 0, 0, action=DELETE_ALL)

    def candidate(self, index: int, outcome: PredictedCandidate) -> Iterator[Any]:
        solution, likelihood = outcome.solution, outcome.likelihood
        line = solution.path if np.isfinite(solution.path).all() and len(solution.path) else outcome.candidate.guess
        if outcome.is_solved:
            red, green, blue = UNLIKELY + likelihood * (LIKELY - UNLIKELY)
            colour, words = (red, green, blue, 0.4 + 0.6 * likelihood), f'{100 * likelihood:.0f} %'
            yield from self._ellipses(index, outcome, colour)
        else:
            colour, words = GREY, solution.status.value
        points = self._lifted(line)
        drawn = [self._point(*point) for point in points]
        yield self._marker('path', index, LINE_STRIP, colour, (0.002 + 0.004 * likelihood, 0, 0), points=drawn)
        text = f'{outcome.candidate.label} {words}'
        yield self._marker('label', index, TEXT, colour, (0, 0, TEXT_HEIGHT), points[len(points) // 2], text=text)

    def _ellipses(self, index: int, outcome: PredictedCandidate, colour: Colour) -> Iterator[Any]:
        """Draw one standard deviation about the mean at steps spread over the path."""
        steps = _spread(len(outcome.solution.mean))
        variances, axes = np.linalg.eigh(outcome.solution.covariance[steps, :2, :2])
        diameters = (2.0 * np.sqrt(np.maximum(variances, 0.0))).tolist()
        angles = np.arctan2(axes[:, 1, 0], axes[:, 0, 0]).tolist()
        faint = (*colour[:3], 0.3 * colour[3])
        for i, centre in enumerate(self._lifted(outcome.solution.path[steps])):
            scale = (diameters[i][0], diameters[i][1], THICKNESS)
            yield self._marker('deviation', 1000 * index + i, CYLINDER, faint, scale, centre, angles[i])

    def obstacles(self, obstacles: Obstacles) -> Iterator[Any]:
        near = self._nearest(obstacles)
        centres = self._lifted(near.centre)
        for name, radii, colour in (
            ('obstacle', near.radius, OBSTACLE),
            ('obstacle_deviation', near.radius + near.radius_stddev, SHELL),
        ):
            for i, (centre, diameter) in enumerate(zip(centres, (2 * radii).tolist(), strict=True)):
                yield self._marker(name, i, CYLINDER, colour, (diameter, diameter, 10 * THICKNESS), centre)

    def _nearest(self, obstacles: Obstacles) -> Obstacles:
        if len(obstacles) <= MAX_DRAWN or not self.prediction.candidates:
            return obstacles.take(list(range(min(len(obstacles), MAX_DRAWN))))
        hand = self.prediction.candidates[0].candidate.guess[0]
        gaps = np.linalg.norm(obstacles.centre - hand, axis=1) - obstacles.radius
        return obstacles.take(np.argsort(gaps, kind='stable')[:MAX_DRAWN])

    def _marker(
        self,
        name: str,
        identity: int,
        kind: int,
        colour: Colour = GREY,
        scale: tuple[float, float, float] = (1, 1, 1),
        centre: Sequence[float] = (0.0, 0.0, 0.0),
        angle: float = 0.0,
        **rest: Any,
    ) -> Any:
        make = self.types.make
        qx, qy, qz, qw = _turned(angle, self.plane) if kind == CYLINDER else (0.0, 0.0, 0.0, 1.0)
        return make(
            'visualization_msgs/msg/Marker',
            ns=name,
            id=identity,
            type=kind,
            pose=make(
                'geometry_msgs/msg/Pose',
                position=self._point(*centre),
                orientation=make('geometry_msgs/msg/Quaternion', x=qx, y=qy, z=qz, w=qw),
            ),
            scale=make('geometry_msgs/msg/Vector3', **dict(zip('xyz', scale, strict=True))),
            color=make('std_msgs/msg/ColorRGBA', **dict(zip('rgba', colour, strict=True))),
            **self._common,
            **rest,
        )

    def _lifted(self, positions: Array) -> list[list[float]]:
        """Return positions in the plane (m, 2) as points in space."""
        points: list[list[float]] = lift(positions, self.prediction.height, self.plane).tolist()
        return points

    def _point(self, x: float, y: float, z: float) -> Any:
        return self.types.make('geometry_msgs/msg/Point', x=x, y=y, z=z)


@lru_cache(maxsize=4)
def _spread(samples: int) -> NDArray[np.intp]:
    """Return the numbers of up to ELLIPSES of the samples, spread evenly, the last among them and the first not."""
    return np.unique(np.linspace(0, samples - 1, ELLIPSES + 1).round().astype(np.intp)[1:])


_STANDING = {
    'xy': (0.0, 0.0, 0.0, 1.0),
    'xz': (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)),
    'yz': (0.5, 0.5, 0.5, 0.5),
}
"""Rotation (x, y, z, w) that takes x and y to the plane's first and second axis."""


def _turned(angle: float, plane: str) -> tuple[float, float, float, float]:
    """Return the rotation that stands a cylinder on the plane, its x axis at an angle [rad] to the plane's first axis."""
    x, y, z, w = _STANDING[plane]
    sine, cosine = math.sin(angle / 2), math.cos(angle / 2)
    return x * cosine + y * sine, y * cosine - x * sine, z * cosine + w * sine, w * cosine - z * sine
