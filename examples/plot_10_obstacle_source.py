# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A custom obstacle source
========================

foc_ros takes obstacles from any source: circles, boxes, capsules and convex hulls, each with a velocity if it moves. This example
takes the boxes of an object detector. A small tracker estimates the velocity of each object from its last two detections. The
prediction moves each box at this velocity.
"""

from dataclasses import dataclass, field

import matplotlib.pyplot as plt
import numpy as np

import foc_ros


@dataclass
class BoxTracker:
    """Turn detected boxes into boxes that move.

    rounding: radius of their corners [m]; size_error: standard deviation of the place of a detected side [m].
    """

    rounding: float = 0.005
    size_error: float = 0.004
    last: dict[str, tuple[float, np.ndarray]] = field(default_factory=dict)

    def track(self, t: float, detected: dict[str, tuple[float, float, float, float, float]]) -> list[foc_ros.Box]:
        """Return a box for each detection (x, y, length, width [m], yaw [rad]) at time t [s]."""
        boxes = []
        for name, (x, y, length, width, yaw) in detected.items():
            centre = np.array([x, y])
            seen_at, was_at = self.last.get(name, (t, centre))
            velocity = (centre - was_at) / (t - seen_at) if t > seen_at else np.zeros(2)
            self.last[name] = t, centre
            size = length - 2 * self.rounding, width - 2 * self.rounding
            boxes.append(foc_ros.Box(centre, size, yaw, self.rounding, self.size_error, velocity, name))
        return boxes


def detect_boxes(t: float) -> dict[str, tuple[float, float, float, float, float]]:
    """Return what a detector would report: a box that stands still, and a cart that crosses the scene."""
    return {'box': (0.22, 0.05, 0.06, 0.03, 0.5), 'cart': (0.13, -0.16 + 0.25 * t, 0.05, 0.04, 0.0)}


# %%
# The hand rests during the first 0.3 s and then begins to move. The cart crosses its path in the meantime. Obstacles are drawn
# where they are at that time: a path may cross the place of the cart, which has moved on by then.

# without a time limit the answers do not depend on the machine
tracker, predictor = BoxTracker(), foc_ros.Predictor(foc_ros.Config(budget_s=0.0))
predictor.set_goals([(0.32, 0.0)])
figure, panels = plt.subplots(3, 1, figsize=(7, 14), layout='constrained')
shown = iter(panels)
for tick, t in enumerate(np.arange(0.0, 0.81, 0.02)):
    s = np.clip(t - 0.3, 0.0, 1.0)
    predictor.set_obstacles(tracker.track(t, detect_boxes(t)))
    prediction = predictor.update(t, (0.32 * (10 * s**3 - 15 * s**4 + 6 * s**5), 0.0))
    if tick in (10, 25, 40):
        axes = next(shown)
        prediction.plot(axes)
        axes.set_title(f't = {t:.2f} s: {prediction.most_likely}')
plt.show()
