"""
A custom obstacle source
========================

foc_ros needs circles with a centre, a radius and, if the obstacles move, a velocity. This example turns the boxes of an object
detector into circles. A small tracker estimates the velocity of each object from its last two detections. The prediction moves
each circle at this velocity.
"""

from dataclasses import dataclass, field

import matplotlib.pyplot as plt
import numpy as np

import foc_ros


@dataclass
class BoxTracker:
    """Turn detected boxes into circles that move.

    size_error: standard deviation of a detected size [m].
    """

    size_error: float = 0.004
    last: dict[str, tuple[float, np.ndarray]] = field(default_factory=dict)

    def track(self, t: float, boxes: dict[str, tuple[float, float, float, float]]) -> list[foc_ros.Circle]:
        """Return a circle around each box (x, y, width, height) [m] that was detected at time t [s]."""
        circles = []
        for name, (x, y, width, height) in boxes.items():
            centre = np.array([x, y])
            seen_at, was_at = self.last.get(name, (t, centre))
            velocity = (centre - was_at) / (t - seen_at) if t > seen_at else np.zeros(2)
            self.last[name] = t, centre
            radius = float(np.hypot(width, height)) / 2
            circles.append(foc_ros.Circle(centre, radius, self.size_error, velocity, name))
        return circles


def detect_boxes(t: float) -> dict[str, tuple[float, float, float, float]]:
    """Return what a detector would report: a box that stands still, and a cart that crosses the scene."""
    return {'box': (0.22, 0.05, 0.04, 0.03), 'cart': (0.13, -0.16 + 0.25 * t, 0.05, 0.04)}


# %%
# The hand rests during the first 0.3 s and then begins to move. The cart crosses its path in the meantime.

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
