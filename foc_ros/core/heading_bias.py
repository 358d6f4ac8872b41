"""The heading bias of an operator: costs of classes where reaches begin beside the straight way to their goal.

The reaches of many people are slightly bent, and those of one person often to the same side. A hand that heads to the left of
its goal then seems to be on its way to another goal on the left. With a bias b [rad], positive to the left, a class is compared
by the cost that it would have if velocity and acceleration of the hand were turned back by

    b_i = b d_i / (d_i + d_0),

with the distances d_i from the goal of the class and d_0 from the onset of the movement: on an arc, the angle between the heading
and the straight way to the goal falls linearly with the rest of the way. The cost is then

    J_i(b) = max(J_i - J0_i(0), 0) + J0_i(b_i),

where J0_i(b_i) is the least effort, without obstacles, from the state that is turned by -b_i to the goal of the class in its
time. The cost of obstacles, the first term, stays as it is. J_i(0) is J_i, because no class needs less effort than without
obstacles, unless the goal is so uncertain (`foc.endpoint_stddev`) that a plan ends beside it.

Only likelihoods depend on the bias. Predicted paths begin with the velocity that the hand has.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .config import Config
from .dynamics.plant_models import make_plant_model
from .estimation.duration import is_passing
from .estimation.time_cost import compute_least_effort
from .types import Array, HandState, PredictedCandidate

SMALLEST_M = 1e-9
"""Smallest length of a way [m]."""


class Reaches(NamedTuple):
    """The reaches of k classes without obstacles, which take times_s (k,) [s].

    starts (k, 6) and goals (k, 2) [m]; remaining (k,): shares d_i / (d_i + d_0) of the way that remain; passing: whether the hand
    passes its goal at any velocity.
    """

    starts: Array
    goals: Array
    times_s: Array
    remaining: Array
    passing: bool

    def compute_unbiased_costs(self, costs: Array, bias: float) -> Array:
        """Return the costs J_i(b), (k,) [m^2/s^5], for a heading bias [rad], from those without one."""
        unbiased: Array = np.maximum(costs - self._compute_least_effort(0.0), 0.0) + self._compute_least_effort(bias)
        return unbiased

    def _compute_least_effort(self, bias: float) -> Array:
        """Return J0_i(b_i), (k,) [m^2/s^5], the sum over both axes."""
        cos, sin = np.cos(bias * self.remaining), np.sin(bias * self.remaining)
        (x, y), (vx, vy, ax, ay) = (self.goals - self.starts[:, :2]).T, self.starts[:, 2:].T
        along = compute_least_effort(x, cos * vx + sin * vy, cos * ax + sin * ay, self.times_s, self.passing)
        across = compute_least_effort(y, cos * vy - sin * vx, cos * ay - sin * ax, self.times_s, self.passing)
        return along + across


def make_reaches(candidates: Sequence[PredictedCandidate], goals: Array, hand: HandState, config: Config) -> Reaches | None:
    """Return the reaches of candidates to goals (g, 2) [m]; None for a plant that is not driven by jerk, which has no bias."""
    if not candidates or not make_plant_model(config.foc).is_jerk_driven:
        return None
    solutions, to = [each.solution for each in candidates], goals[[each.candidate.goal for each in candidates]]
    starts, times_s = np.array([each.mean[0] for each in solutions]), np.array([each.times[-1] for each in solutions])
    left_m, done_m = np.hypot(*(to - starts[:, :2]).T), 0.0
    if hand.onset_position is not None:
        done_m = math.hypot(*(hand.mean[:2] - hand.onset_position))
    remaining = left_m / np.maximum(left_m + done_m, SMALLEST_M)
    return Reaches(starts, to, times_s, remaining, is_passing(config.duration))
