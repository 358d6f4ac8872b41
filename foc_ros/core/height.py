# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The third axis: the height over the task plane, predicted by the stochastic control of the plane without obstacles.

The height moves to that of the goal in the time of the candidate, with the plant of the plane's first axis, least effort, and the
same condition at the goal. With the state z of this axis (height, velocity, acceleration), its control u (N,), the noise c, the
response R of the states that the goal fixes at step N, whose first row S is that of the height, and the weight w of
`foc.goal_weight`, the problem

    minimise sum_k (1 + w c^2 S_k^2) u_k^2  subject to  A^N z(0) + R u = z_goal

is linear-quadratic, and its answer is closed: with W = diag(1 + w c^2 S^2),

    u = W^-1 R' (R W^-1 R')^-1 (z_goal - A^N z(0)).

The covariance has the parts that it has in the plane (`plant.covariance`). c is the root mean square of
`foc.noise_x` and `foc.noise_y`. Time to go, onset and likelihoods are those of the plane.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .config import REFERENCE_STEP_S, Config
from .hand.duration import is_passing
from .obstacle_table import Obstacles
from .obstacles.clearance import find_cleared
from .plant.covariance import SharedCovariances, propagate_covariance, scale_noise, stack_noise, widen_covariance
from .plant.models import HAND_STATES, make_plant_model
from .plant.plants import apply_impulse_response, find_states_at_goal
from .prediction import HeightTrajectory, PredictedCandidate
from .solution import Solution, Status
from .types import Array, HandState


class HeightPredictor:
    """Predicts the height of a hand on its way to any of its goals.

    Parameters
    ----------
    config
        All parameters.
    hand
        The state from which the predictions start.
    goal_heights
        Height of each goal, (g,) [m]. Nothing is predicted if they are not known, or with `predict_height` false.
    shared
        What all plans from this state share of their covariance.
    """

    def __init__(self, config: Config, hand: HandState, goal_heights: Array | None, shared: SharedCovariances) -> None:
        self._config, self._hand, self._shared = config, hand, shared
        self._goal_heights = goal_heights if config.predict_height else None
        self._known: dict[tuple[int, float], HeightTrajectory] = {}

    def add_to(self, candidates: Sequence[PredictedCandidate]) -> tuple[PredictedCandidate, ...]:
        """Return the candidates, those with a likelihood with the height on their way."""
        return tuple(
            replace(each, height=self._predict(each.candidate.goal, each.solution.dt) if each.has_likelihood else None)
            for each in candidates
        )

    def find_cleared(self, obstacles: Obstacles, goals: Array, durations_s: Sequence[float]) -> NDArray[np.bool_]:
        """Return which obstacles are passed above or below on the way to every goal, (n,).

        obstacles: grown by the radius of the hand; goals (g, 2) [m], with the times to go [s].
        """
        if self._goal_heights is None:
            return np.zeros(len(obstacles), dtype=bool)
        ends, (bottom, top) = np.append(self._goal_heights, self._hand.height_mean[0]), obstacles.heights.T
        is_cleared: NDArray[np.bool_] = (top < ends.max()) | (bottom > ends.min())  # the others reach over all heights of the way
        if not is_cleared.any():
            return is_cleared
        scene, place = self._config.scene, self._hand.mean[:2]
        for row, (goal, duration_s) in enumerate(zip(goals, durations_s, strict=True)):
            dt = duration_s / self._config.foc.steps
            height = self._predict(row, dt)
            assert height is not None
            margin = scene.hand_radius + 2.0 * height.stddev
            band = height.mean[:, 0] + np.stack((-margin, margin))
            is_cleared &= find_cleared(obstacles, place, goal, self.compute_progress(goal, dt), band, dt)
        return is_cleared

    def _predict(self, goal: int, dt: float) -> HeightTrajectory | None:
        """Return the height on the way to the goal of a row, at steps 0..N of dt [s]; equal ones are computed once."""
        if self._goal_heights is None:
            return None
        if (goal, dt) not in self._known:
            goal_height = float(self._goal_heights[goal])
            self._known[goal, dt] = predict_height(self._config, self._hand, goal_height, dt, self._shared[dt])
        return self._known[goal, dt]

    def compute_progress(self, goal: Array, dt: float) -> Array:
        """Return how far the free movement in the plane has come on the line to a goal (2,) at steps 0..N, (N + 1,) [m]."""
        axes = self._hand.mean.reshape(3, 2)
        offset = goal - axes[0]
        distance = math.hypot(*offset)
        start = axes @ (offset / distance) if distance else np.zeros(3)
        start[0] = 0.0
        progress: Array = reach_along_axis(self._config, start, distance, dt).mean[:, 0]
        return progress


def predict_height(config: Config, hand: HandState, goal_height: float, dt: float, shared: Array) -> HeightTrajectory:
    """Return the height of a hand on its way to a goal at a height [m], at steps 0..N of dt [s].

    shared (N + 1, n, n): of `SharedCovariances`.
    """
    solution = reach_along_axis(config, hand.height_mean, goal_height, dt)
    covariance = widen_covariance(solution, shared, hand.onset_ns is None, config)
    return HeightTrajectory(solution.mean[:, ::2], covariance[:, ::2, ::2], solution.covariance[:, ::2, ::2])


def reach_along_axis(config: Config, start: Array, target: float, dt: float) -> Solution:
    """Return the movement of least effort of one axis, without obstacles, in N steps of dt [s].

    start (3,): position, velocity and acceleration; target: position at the end [m]. The axis is the first one of the solution,
    whose second one rests at zero. The covariance is that of motor noise.
    """
    foc, plant = config.foc, make_plant_model(config.foc)
    horizon = plant.build_horizon(dt, foc.steps)
    is_fixed = find_states_at_goal(plant.states, is_passing(config.duration))[::2]
    now, goal = np.zeros(HAND_STATES), np.zeros(plant.states)
    now[::2], goal[0] = start, target
    free = horizon.powers @ plant.project_mean(now)
    rows, missing = horizon.last[::2, : foc.steps][is_fixed], (goal - free[-1])[::2][is_fixed]
    noise = scale_noise(np.array([math.hypot(foc.noise_x, foc.noise_y) / math.sqrt(2.0), 0.0]), REFERENCE_STEP_S, dt)
    hessian = 1.0 + foc.goal_weight * (noise[0] * rows[0]) ** 2
    control = np.zeros((2, foc.steps))
    scaled = rows / hessian
    length = np.sqrt((rows * scaled).sum(axis=1))
    square = (scaled @ rows.T) / np.outer(length, length)
    control[0] = np.linalg.solve(square, missing / length) @ (scaled / length[:, None])
    stacked = control.ravel()
    mean = free + apply_impulse_response(horizon.states, stacked).T
    covariance = propagate_covariance(horizon, np.zeros_like(horizon.powers), stack_noise(noise**2, foc.steps), stacked)
    return Solution(Status.SOLVED, '', dt, mean, covariance, control.T, float(stacked @ stacked), {}, 0.0, 0.0, 1.0)
