"""One reaching problem: from a hand state to a goal among obstacles, stacked over its horizon."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.dynamics.condensed import (
    build_goal_rows,
    find_duplicates,
    find_inside_margin,
    mean_positions,
    position_variances,
    propagate_without_control,
    scene_extent,
    variance_weights,
)
from foc_ros.core.dynamics.noise import stack_noise
from foc_ros.core.dynamics.plants import Horizon, states_at_goal
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacles.chance_constraint import centre_trajectories, centres_by_obstacle, k_of_eta, size_moments
from foc_ros.core.types import Array, Obstacles, Record

from .contacts.hermite import compute_trajectory

BOTH = np.ones(2)
ALIKE = 1e-6
"""Difference between two circles, relative to the scene, at which they count as the same."""


class Chances(NamedTuple):
    """`Horizon.maps`, and of a `Problem` what has the same names; its `size` in two; its obstacles' covariances (m, 2, 2)."""

    maps: Array
    free_variance: Array
    error_course: Array
    initial_covariance: Array
    noise_variance: Array
    centres: Array
    size_mean: Array
    size_variance: Array
    centre_covariance: Array
    leaving: Array


@dataclass(frozen=True, eq=False)
class Problem(Record):
    """What the forward optimal control is asked.

    horizon: the plant over N steps; initial_mean (n,) and initial_covariance (n, n): the state now; error_map (N + 1, n, n): what
    an error of the initial state becomes at steps 0..N (`horizon.powers` where nobody corrects it); goal (n,), of which the
    states in at_goal (n,) bool are reached exactly by the mean; end_weights and way_weights (n,): w of the mean error and
    variance at the last step and at each step before it; noise (2,): c per step; obstacles: circles now; eta: wanted probability
    of avoidance per obstacle and step; recovery_s: time in which a hand that is inside a margin has to be out of it [s].
    """

    horizon: Horizon
    initial_mean: Array
    initial_covariance: Array
    error_map: Array
    goal: Array
    noise: Array
    obstacles: Obstacles
    eta: float
    at_goal: NDArray[np.bool_]
    end_weights: Array
    way_weights: Array
    recovery_s: float = 0.0

    @cached_property
    def extent(self) -> float:
        """Size of the scene that tolerances are relative to: the way to the goal, or the largest circle if that is more [m]."""
        way_x, way_y, *_ = (self.goal - self.initial_mean).tolist()
        return scene_extent(way_x, way_y, self.obstacles.radius)

    @cached_property
    def without_control(self) -> tuple[Array, Array, Array]:
        """The mean without control: states at steps 0..N (N + 1, n), positions at steps 1..N (N, 2) [m], and `free_course`."""
        return propagate_without_control(self.horizon.powers, self.initial_mean, self.horizon.dt)

    @property
    def free(self) -> Array:
        """Mean state at steps 0..N without control, (N + 1, n)."""
        return self.without_control[0]

    @property
    def free_position(self) -> Array:
        """Mean position at steps 1..N without control, (N, 2) [m]."""
        return self.without_control[1]

    @property
    def free_course(self) -> Array:
        """Mean position and velocity per step without control, x, y, vx, vy at steps 0..N, (4, N + 1) [m]."""
        return self.without_control[2]

    @cached_property
    def error_course(self) -> Array:
        """What an error of the initial state becomes in position and velocity per step, at steps 0..N, (4, N + 1, n).

        Without steps where there is no such error.
        """
        if not self.initial_covariance.any():
            return np.zeros((4, 0, len(self.initial_mean)))
        scale = np.array([1.0, 1.0, self.horizon.dt, self.horizon.dt])
        return np.ascontiguousarray(self.error_map[:, :4].swapaxes(0, 1) * scale[:, None, None])

    @cached_property
    def circles(self) -> tuple[Array, Array, Array, Array]:
        """What kernels ask about courses and circles: responses of the course, and it without control; centres and drifts."""
        return self.horizon.motion, self.free_course, self.obstacles.centre, self.drift

    @cached_property
    def costs(self) -> tuple[Array, Array, Array, Array, Array]:
        """What kernels ask about the cost: what weighs the squared control, and the goal's rows, targets and softness."""
        return self.weighted_variance, self.summed_variance, *self.goal_rows

    @cached_property
    def chances(self) -> Chances:
        """What kernels ask about the chance constraint."""
        course = self.horizon.maps, self.free_variance, self.error_course, self.initial_covariance, self.noise_variance
        return Chances(*course, self.centres, *self.size, self.obstacles.centre_covariance, self.leaving)

    @cached_property
    def drift(self) -> Array:
        """How far each centre moves in a step, (m, 2) [m]."""
        drift: Array = self.obstacles.velocity * self.horizon.dt
        return drift

    @cached_property
    def free_covariance(self) -> Array:
        """The part of the state covariance at steps 0..N that the control does not cause, (N + 1, n, n)."""
        if not self.initial_covariance.any():
            return np.zeros_like(self.error_map)
        carried: Array = self.error_map @ self.initial_covariance @ self.error_map.swapaxes(1, 2)
        return carried

    @cached_property
    def free_variance(self) -> Array:
        """Rows xx, yy, xy of the free position covariance at steps 1..N, (3, N) [m^2]."""
        covariance = self.free_covariance[1:]
        return np.stack((covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 0, 1]))

    @cached_property
    def centres(self) -> Array:
        """Mean centres of the obstacles at steps 1..N, (m, N, 2) [m]."""
        return centres_by_obstacle(self.obstacles.centre, self.drift, self.horizon.steps)

    @cached_property
    def courses(self) -> Array:
        """Mean centres of the obstacles at steps 0..N, step by step, (N + 1, m, 2) [m]."""
        return centre_trajectories(self.obstacles.centre, self.drift, self.horizon.steps)

    @cached_property
    def first_alike(self) -> NDArray[np.intp]:
        """For each obstacle the first one that is the same circle, (m,): a mean that touches both is held by one of them."""
        return find_duplicates(self.obstacles.centre, self.drift, np.sqrt(self.size[0]), ALIKE * self.extent)

    @cached_property
    def centres_from_free(self) -> Array:
        """`centres`, less the mean position without control, (m, N, 2) [m]."""
        return self.centres - self.free[1:, :2]

    @cached_property
    def distance_now(self) -> Array:
        """Distance of the hand from each centre now, (m,) [m]."""
        away = self.initial_mean[:2] - self.obstacles.centre
        return np.hypot(away[:, 0], away[:, 1])

    @cached_property
    def inside_margin(self) -> NDArray[np.bool_]:
        """Whether the hand is now inside the margin of each obstacle, (m,): never, without a recovery time."""
        if self.recovery_s <= 0 or not len(self.obstacles):
            return np.zeros(len(self.obstacles), dtype=np.bool_)
        circles = self.obstacles.centre, *self.size, self.obstacles.centre_covariance
        return find_inside_margin(self.initial_mean, self.initial_covariance, *circles, k_of_eta(self.eta))

    @cached_property
    def leaving(self) -> Array:
        """Steps from now in which each obstacle does not count, because the hand is still leaving its margin, (m,)."""
        leaving: Array = self.inside_margin.astype(np.float64) * (self.recovery_s / self.horizon.dt)
        return leaving

    @cached_property
    def size(self) -> tuple[Array, Array]:
        """E[R^2] and Var[R^2] of each obstacle, (m,) each [m^2, m^4]."""
        return size_moments(self.obstacles)

    @cached_property
    def noise_variance(self) -> Array:
        """c^2 for every entry of the stacked control, (2N,)."""
        return stack_noise(self.noise**2, self.horizon.steps)

    @cached_property
    def unweighted(self) -> Array:
        """Weights of the position's maps in obstacle rows, (2, 2N): one."""
        return np.ones((2, 2 * self.horizon.steps))

    @cached_property
    def summed_variance(self) -> Array:
        """(2N,): sum over steps of the variances of x and y is this times u^2, plus the free part."""
        summed: Array = variance_weights(self.horizon.states[:2], BOTH, BOTH) * self.noise_variance
        return summed

    @cached_property
    def weighted_variance(self) -> Array:
        """(2N,): the variance terms of J_X are this times u^2, plus the free part."""
        weighted: Array = variance_weights(self.horizon.states, self.end_weights, self.way_weights) * self.noise_variance
        return weighted

    @cached_property
    def goal_rows(self) -> tuple[Array, Array, Array]:
        """Rows (r, 2N), targets (r,) and softness (r,) that bring the mean to the goal.

        Softness 0 is an equality; 1 / (2 w) is a term w (X_i - goal_i)^2 of the cost.
        """
        rows, targets, softness = build_goal_rows(self.horizon.last, self.goal - self.free[-1], self.at_goal, self.end_weights)
        if not self.way_weights.any():
            return rows, targets, softness
        way, steps = np.flatnonzero(self.way_weights > 0), self.horizon.steps
        before, missing = self.horizon.response[:-1, way], (self.goal - self.free[1:-1])[:, way]
        return (
            np.concatenate((rows, before.reshape(-1, 2 * steps))),
            np.concatenate((targets, missing.ravel())),
            np.concatenate((softness, np.tile(0.5 / self.way_weights[way], steps - 1))),
        )

    def positions(self, control: Array) -> Array:
        """Mean positions at steps 1..N from the stacked control, (N, 2) [m]."""
        return mean_positions(self.horizon.maps[:2], np.ascontiguousarray(control, dtype=float), self.free_position)

    def course(self, control: Array) -> Array:
        """Mean position and velocity per step from the stacked control, x, y, vx, vy at steps 0..N, (4, N + 1) [m]."""
        return compute_trajectory(self.horizon.motion, self.free_course, np.ascontiguousarray(control, dtype=float))

    def position_variance(self, control: Array) -> Array:
        """Rows xx, yy, xy of the position covariance at steps 1..N, (3, N) [m^2]."""
        return position_variances(
            self.horizon.maps, self.noise_variance, np.ascontiguousarray(control, dtype=float), self.free_variance
        )


def rest_to_goal(
    horizon: Horizon,
    initial_mean: Array,
    goal_position: Array,
    obstacles: Obstacles,
    noise: Array,
    eta: float,
    initial_covariance: Array | None = None,
    error_map: Array | None = None,
    goal_weight: float = 0.0,
    recovery_s: float = 0.0,
    passing: bool = False,
) -> Problem:
    """Build the default problem: the mean reaches the goal position (2,) [m] exactly, at rest.

    goal_weight: w of the position variance at the end; passing: at any velocity instead, which no longer changes. Raises
    SceneError for anything not finite.
    """
    n = len(initial_mean)
    goal = np.zeros(n)
    goal[:2] = goal_position
    covariance = np.zeros((n, n)) if initial_covariance is None else np.asarray(initial_covariance, dtype=float)
    for field, value in (('start', initial_mean), ('goal', goal_position), ('noise', noise), ('start covariance', covariance)):
        if not np.isfinite(value).all():
            raise SceneError(field, 'finite numbers', np.asarray(value).tolist())
    return Problem(
        horizon=horizon,
        initial_mean=np.asarray(initial_mean, dtype=float),
        initial_covariance=covariance,
        error_map=horizon.powers if error_map is None else error_map,
        goal=goal,
        noise=np.asarray(noise, dtype=float),
        obstacles=obstacles,
        eta=eta,
        at_goal=states_at_goal(n, passing),
        end_weights=np.where(np.arange(n) < 2, goal_weight, 0.0),
        way_weights=np.zeros(n),
        recovery_s=recovery_s,
    )
