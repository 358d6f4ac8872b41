# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Encoding of a prediction as a MarkerArray: paths, ellipses and labels of all candidates, and the uncertain obstacles.

Each labelled path has ellipses of one standard deviation of the motor noise; the most likely one also has outer ones of the total
uncertainty. Where the height is predicted, they are cylinders of one standard deviation of it up and down. Every array first
deletes the markers of the one before, and all markers expire after LIFETIME_S.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from foc_ros.core.obstacles.geometry import measure_offsets, trace_obstacle
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.types import Array

from .plane import lift
from .ranking import MOST_LETTERS, describe_candidate, find_drawn_curve, order_candidates
from .types import MessageTypes, make_header

CYLINDER, LINE_STRIP, TEXT, TRIANGLES = 3, 4, 9, 11
LIFETIME_S = 1.0
ELLIPSES = 6
MAX_DRAWN = 128
"""Number of obstacles drawn, the nearest to the hand: thousands of markers would take longer than the prediction."""
THICKNESS, TEXT_HEIGHT = 0.002, 0.01
TALL = 10 * THICKNESS
"""Height of round obstacles [m]; texts are above them."""
MOTOR, TOTAL = 'motor_noise', 'total_uncertainty'
ELLIPSE_STYLES = {MOTOR: (0.3, 2 * THICKNESS), TOTAL: (0.12, THICKNESS)}
"""Opacity as a share of that of the path, and thickness [m]: the inner ellipse stands out of the outer one."""
LEGEND = 'ellipses of one standard deviation\ninner: motor noise, which eta is about\nouter: total uncertainty'
LABELLED = 0.05
"""Least likelihood of a path with a label and ellipses: those of unlikely ones would cover those of the others."""
LINE_LETTERS = 28
"""Length of a line of a label."""

Colour = tuple[float, float, float, float]
GREY: Colour = (0.48, 0.48, 0.48, 0.5)
BLACK: Colour = (0.0, 0.0, 0.0, 1.0)
OBSTACLE: Colour = (0.45, 0.45, 0.5, 0.9)
DEVIATION: Colour = (0.85, 0.35, 0.2, 0.25)
UNLIKELY, LIKELY = np.array([0.25, 0.45, 0.85]), np.array([0.78, 0.32, 0.04])
"""Colours of paths. Foxglove and RViz, as config/ sets them up, write in each mixture of them, and in GREY, on white."""
ORIGIN = np.zeros(3)
PLANE_ROTATION = {
    'xy': (0.0, 0.0, 0.0, 1.0),
    'xz': (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)),
    'yz': (0.5, 0.5, 0.5, 0.5),
}
"""Quaternion (x, y, z, w) that rotates the x and y axes onto the axes of each plane."""


def encode_markers(prediction: Prediction, plane: str, types: MessageTypes) -> Any:
    """Encode the MarkerArray; unsolved candidates are grey and labelled with the reason."""
    encoder = _MarkerEncoder(prediction, plane, types)
    unsolved = [outcome for outcome in prediction.candidates if not outcome.has_likelihood]
    markers = [encoder.encode('', 0, 0, action=3)]  # DELETEALL
    for index, outcome in enumerate([*order_candidates(prediction), *unsolved]):
        markers.extend(encoder.encode_candidate(index, outcome))
    markers.extend(encoder.encode_names())
    markers.extend(encoder.encode_obstacles())
    return types.make('visualization_msgs/msg/MarkerArray', markers=markers)


def _is_labelled(outcome: PredictedCandidate) -> bool:
    return not outcome.has_likelihood or outcome.likelihood >= LABELLED


class _MarkerEncoder:
    """Encodes markers in the plane of one prediction; the fields that all of them share are made once."""

    def __init__(self, prediction: Prediction, plane: str, types: MessageTypes) -> None:
        self._prediction, self._plane, self._types = prediction, plane, types
        lifetime = types.make('builtin_interfaces/msg/Duration', sec=int(LIFETIME_S))
        self._shared = {'header': make_header(types, prediction.stamp_ns, prediction.frame_id), 'lifetime': lifetime}
        # down in the plane, and towards a viewer who sees its first axis to the right
        self._down = lift([0.0, -1.0], 0.0, plane)
        self._towards = lift([0.0, 0.0], -1.0 if plane == 'xz' else 1.0, plane)

    def encode_candidate(self, index: int, outcome: PredictedCandidate) -> Iterator[Any]:
        likelihood = outcome.likelihood
        if outcome.has_likelihood:
            red, green, blue = UNLIKELY + likelihood * (LIKELY - UNLIKELY)
            colour, share = (red, green, blue, 0.4 + 0.6 * likelihood), f'{100 * likelihood:.0f} %'
            found = 'estimated' if outcome.is_estimated else 'compromised'
            notes = '' if outcome.is_solved else f', {found}: eta {outcome.eta:.3f}'
            names = (MOTOR, TOTAL) if index == 0 else (MOTOR,)
            for name in names if _is_labelled(outcome) else ():
                yield from self._encode_ellipses(name, index, outcome, colour)
        else:
            colour, share, notes = GREY, '- %', f', {outcome.reason}'
        points = self._lift_curve(find_drawn_curve(outcome), outcome)
        width = 0.002 + 0.004 * likelihood
        yield self.encode('path', index, LINE_STRIP, colour, (width, 0, 0), points=points)
        if _is_labelled(outcome):
            words = describe_candidate(outcome, len(self._prediction.goal_positions), MOST_LETTERS)
            text = f'{share}, {words}{notes}'.replace(' of ', '\0of\0')  # no line parts a side from its obstacle
            lines = textwrap.wrap(text, LINE_LETTERS, break_long_words=False, break_on_hyphens=False)
            place = points[round((0.45 + 0.12 * (index % 3)) * (len(points) - 1))]  # labels of neighbours stand apart
            yield self._encode_text('label', index, '\n'.join(lines).replace('\0', ' '), place, colour, 1.0)

    def _encode_ellipses(self, name: str, index: int, outcome: PredictedCandidate, colour: Colour) -> Iterator[Any]:
        path, height, is_motor = outcome.solution.path, outcome.height, name == MOTOR
        steps = np.unique(np.linspace(0, len(path) - 1, ELLIPSES + 1).round().astype(np.intp)[1:])
        covariance = outcome.motor_covariance if is_motor else outcome.covariance
        variances, axes = np.linalg.eigh(covariance[steps, :2, :2])
        diameters = (2.0 * np.sqrt(np.maximum(variances, 0.0))).tolist()
        angles = np.arctan2(axes[:, 1, 0], axes[:, 0, 0]).tolist()
        opacity, thickness = ELLIPSE_STYLES[name]
        thick = np.full(len(steps), thickness)
        if height is not None:
            variance = (height.motor_covariance if is_motor else height.covariance)[steps, 0, 0]
            thick = np.maximum(thick, 2.0 * np.sqrt(np.maximum(variance, 0.0)))
        faint = (*colour[:3], opacity * colour[3])
        for i, centre in enumerate(self._lift_curve(path, outcome)[steps]):
            yield self.encode(name, 1000 * index + i, CYLINDER, faint, (*diameters[i], float(thick[i])), centre, angles[i])

    def encode_names(self) -> Iterator[Any]:
        """Yield the names of several goals and of the obstacles in the labels of paths, and the legend."""
        given, near = self._prediction, self._prediction.obstacles
        if len(given.goals) > 1:
            for row, place in enumerate(self._lift(given.goal_positions)):
                yield self._encode_text('goal', row, given.goals[row].name, place, GREY, 2.0)
        named = {name for each in given.candidates if _is_labelled(each) for name, _ in each.candidate.sides}
        for row, place in enumerate(self._lift(near.centre)):
            if near.ids[row] in named:
                yield self._encode_text('obstacle_name', row, near.ids[row], place, BLACK)
        for outcome in given.candidates_with_likelihood[:1]:
            shares = (given.unknown, 'unknown'), (given.other, 'another goal')
            text = '\n'.join([LEGEND, *(f'{100 * share:.0f} % {name}' for share, name in shares if share > 0.0)])
            yield self._encode_text('legend', 0, text, self._lift(outcome.solution.path[0]), GREY, 3.0)

    def encode_obstacles(self) -> Iterator[Any]:
        """Yield the obstacles with their mean sizes and larger by a standard deviation: cylinders, or triangles of an outline."""
        near = self._prediction.obstacles
        if len(near) > MAX_DRAWN and self._prediction.candidates:
            distances = measure_offsets(self._prediction.candidates[0].candidate.guess[0], near)[1][0] - near.radius
            near = near.take(np.argsort(distances, kind='stable'))
        near = near.take(list(range(min(len(near), MAX_DRAWN))))
        centres = self._lift(near.centre)
        for name, growths, colour, above in (
            ('obstacle', np.zeros(len(near)), OBSTACLE, 0.0),
            ('obstacle_deviation', near.radius_stddev, DEVIATION, -THICKNESS),  # at equal heights, viewers draw either above
        ):
            shift = above * self._towards
            for row, growth in enumerate(growths.tolist()):
                if near.corners[row] == 1:
                    diameter = 2 * (float(near.radius[row]) + growth)
                    yield self.encode(name, row, CYLINDER, colour, (diameter, diameter, TALL), centres[row] + shift)
                    continue
                outline = self._lift(trace_obstacle(near, row, growth, 32))
                middle, *edge = self._types.fill_each('geometry_msgs/msg/Point', np.vstack([centres[row], outline]))
                corners = [corner for before, after in pairwise(edge) for corner in (middle, before, after)]
                yield self.encode(name, row, TRIANGLES, colour, centre=shift, points=corners)

    def _encode_text(self, name: str, identity: int, text: str, place: Array, colour: Colour, below: float = 0.0) -> Any:
        """Return a text at a place, in front of the obstacles; below: by how many lines its first one is below the place."""
        down = TEXT_HEIGHT * (below + text.count('\n') / 2) if below else 0.0  # viewers centre a text at its place
        centre = place + TALL * self._towards + down * self._down
        return self.encode(name, identity, TEXT, (*colour[:3], 1.0), (0, 0, TEXT_HEIGHT), centre, text=text)

    def encode(
        self,
        name: str,
        identity: int,
        kind: int,
        colour: Colour = GREY,
        scale: tuple[float, float, float] = (1, 1, 1),
        centre: Array = ORIGIN,
        angle: float = 0.0,
        **rest: Any,
    ) -> Any:
        x, y, z, w = PLANE_ROTATION[self._plane if kind == CYLINDER else 'xy']  # a cylinder stands on the plane
        sine, cosine = math.sin(angle / 2), math.cos(angle / 2)
        turn = x * cosine + y * sine, y * cosine - x * sine, z * cosine + w * sine, w * cosine - z * sine
        own = {'ns': name, 'id': identity, 'type': kind, 'color': colour, 'scale': scale, 'pose': (centre.tolist(), turn)}
        return self._types.make('visualization_msgs/msg/Marker', **own, **self._shared, **rest)

    def _lift(self, positions: Array) -> Array:
        return lift(positions, self._prediction.height, self._plane)

    def _lift_curve(self, curve: Array, outcome: PredictedCandidate) -> Array:
        if outcome.height is None:
            return self._lift(curve)
        heights = outcome.height.mean[:, 0]
        between = np.interp(np.linspace(0.0, 1.0, len(curve)), np.linspace(0.0, 1.0, len(heights)), heights)
        return lift(curve, between, self._plane)
