"""One reaching problem: from a hand state to a goal among obstacles, stacked over its horizon."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .between import course_of
from .chance import centres, courses, k_at, k_of_eta, size_moments
from .compiled import Indices, Matrix, Tensor, Vector, compiled
from .driven import driven
from .dynamics import Horizon, states_at_goal
from .errors import SceneError
from .noise import stacked_noise
from .records import Array, Obstacles, Record

ALIKE = 1e-6
"""Difference between two circles, relative to the scene, at which they count as the same."""


@dataclass(frozen=True, eq=False)
class Problem(Record):
    """What the forward optimal control is asked.

    horizon: the plant over N steps; initial_mean (n,) and initial_covariance (n, n): the state now; error_map (N + 1, n, n): what
    an error of the initial state becomes at steps 0..N (`horizon.powers` where nobody corrects it); goal (n,), of which the
    states
    in at_goal (n,) bool are reached exactly by the mean; end_weights and way_weights (n,): w of the mean error and variance
    at the
    last step and at each step before it; noise (2,): c per step; obstacles: circles now; eta: wanted probability of avoidance per
    obstacle and step; recovery_s: time in which a hand that is inside a margin has to be out of it [s].
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
        way = self.goal[:2] - self.initial_mean[:2]
        return max(float(np.hypot(way[0], way[1])), float(self.obstacles.radius.max(initial=0.0)), 1e-6)

    @cached_property
    def free(self) -> Array:
        """Mean state at steps 0..N without control, (N + 1, n)."""
        return self.horizon.powers @ self.initial_mean

    @cached_property
    def free_position(self) -> Array:
        """Mean position at steps 1..N without control, (N, 2) [m]."""
        return self.free[1:, :2].copy()

    @cached_property
    def free_course(self) -> Array:
        """Mean position and velocity per step without control, x, y, vx, vy at steps 0..N, (4, N + 1) [m]."""
        scale = np.array([1.0, 1.0, self.horizon.dt, self.horizon.dt])
        return np.ascontiguousarray(self.free[:, :4].T * scale[:, None])

    @cached_property
    def error_course(self) -> Array:
        """What an error of the initial state becomes in position and velocity per step, at steps 0..N, (4, N + 1, n)."""
        scale = np.array([1.0, 1.0, self.horizon.dt, self.horizon.dt])
        return np.ascontiguousarray(self.error_map[:, :4].swapaxes(0, 1) * scale[:, None, None])

    @cached_property
    def circles(self) -> tuple[Array, Array, Array, Array]:
        """What kernels ask about courses and circles: the course's responses, and it without control; centres and their drifts."""
        return self.horizon.motion, self.free_course, self.obstacles.centre, self.drift

    @cached_property
    def costs(self) -> tuple[Array, Array, Array, Array, Array]:
        """What kernels ask about the cost: what weighs the squared control, and the goal's rows, targets and softness."""
        return self.weighted_variance, self.summed_variance, *self.goal_rows

    @cached_property
    def chances(self) -> tuple[Array, ...]:
        """What kernels ask about the chance constraint: `least_k`, from maps to leaving."""
        course = self.horizon.maps, self.free_variance, self.error_course, self.initial_covariance, self.noise_variance
        return *course, self.centres, *self.size, self.obstacles.centre_covariance, self.leaving

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
        return centres(self.obstacles.centre, self.drift, self.horizon.steps)

    @cached_property
    def courses(self) -> Array:
        """Mean centres of the obstacles at steps 0..N, step by step, (N + 1, m, 2) [m]."""
        return courses(self.obstacles.centre, self.drift, self.horizon.steps)

    @cached_property
    def first_alike(self) -> NDArray[np.intp]:
        """For each obstacle the first one that is the same circle, (m,): a mean that touches both is held by one of them."""
        return first_alike(self.obstacles.centre, self.drift, np.sqrt(self.size[0]), ALIKE * self.extent)

    @cached_property
    def centres_from_free(self) -> Array:
        """The same, less the mean position without control, (m, N, 2) [m]."""
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
        now = self.free_covariance[0]
        covariance = np.array([[now[0, 0]], [now[1, 1]], [now[0, 1]]])
        here, centre = self.initial_mean[None, :2], self.obstacles.centre[:, None]
        inside: NDArray[np.bool_] = k_at(here, covariance, centre, *self.size, self.obstacles.centre_covariance)[:, 0] < k_of_eta(
            self.eta
        )
        return inside

    @cached_property
    def leaving(self) -> Array:
        """Steps from now in which each obstacle does not count, because the hand is still leaving its margin, (m,)."""
        return np.where(self.inside_margin, self.recovery_s / self.horizon.dt, 0.0)

    @cached_property
    def size(self) -> tuple[Array, Array]:
        """E[R^2] and Var[R^2] of each obstacle, (m,) each [m^2, m^4]."""
        return size_moments(self.obstacles)

    @cached_property
    def noise_variance(self) -> Array:
        """c^2 for every entry of the stacked control, (2N,)."""
        return stacked_noise(self.noise, self.horizon.steps) ** 2

    @cached_property
    def unweighted(self) -> Array:
        """Weights of the position's maps in obstacle rows, (2, 2N): one."""
        return np.ones((2, 2 * self.horizon.steps))

    @cached_property
    def summed_variance(self) -> Array:
        """(2N,): sum over steps of the variances of x and y is this times u^2, plus the free part."""
        end, way = self.horizon.squared
        summed: Array = (end[:2] + way[:2]).sum(axis=0) * self.noise_variance
        return summed

    @cached_property
    def weighted_variance(self) -> Array:
        """(2N,): the variance terms of J_X are this times u^2, plus the free part."""
        end, way = self.horizon.squared
        weighted: Array = (self.end_weights @ end + self.way_weights @ way) * self.noise_variance
        return weighted

    @cached_property
    def goal_rows(self) -> tuple[Array, Array, Array]:
        """Rows (r, 2N), targets (r,) and softness (r,) that bring the mean to the goal.

        Softness 0 is an equality; 1 / (2 w) is a term w (X_i - goal_i)^2 of the cost.
        """
        hard = np.flatnonzero(self.at_goal)
        soft = np.flatnonzero(~self.at_goal & (self.end_weights > 0))
        way = np.flatnonzero(self.way_weights > 0)
        last, steps = self.horizon.last, self.horizon.steps
        before = self.horizon.response[:-1, way].reshape(-1, 2 * steps) if len(way) else last[way]
        missing = self.goal - self.free[1:]
        rows = np.concatenate((last[hard], last[soft], before))
        targets = np.concatenate((missing[-1, hard], missing[-1, soft], missing[:-1, way].ravel()))
        softness = np.concatenate(
            (
                np.zeros(len(hard)),
                0.5 / self.end_weights[soft],
                np.tile(0.5 / self.way_weights[way], steps - 1),
            )
        )
        return rows, targets, softness

    def positions(self, control: Array) -> Array:
        """Mean positions at steps 1..N from the stacked control, (N, 2) [m]."""
        return moved(self.horizon.maps[:2], np.ascontiguousarray(control, dtype=float), self.free_position)

    def course(self, control: Array) -> Array:
        """Mean position and velocity per step from the stacked control, x, y, vx, vy at steps 0..N, (4, N + 1) [m]."""
        return course_of(self.horizon.motion, self.free_course, np.ascontiguousarray(control, dtype=float))

    def position_variance(self, control: Array) -> Array:
        """Rows xx, yy, xy of the position covariance at steps 1..N, (3, N) [m^2]."""
        return spread(self.horizon.maps, self.noise_variance, np.ascontiguousarray(control, dtype=float), self.free_variance)


@compiled
def first_alike(centre: Matrix, drift: Matrix, reach: Vector, tolerance: float) -> Indices:
    """Return for each circle the first that differs by less than a tolerance [m] in place, drift per step and reach, (m,)."""
    first = np.arange(len(reach))
    for i in range(len(reach)):
        for j in range(i):
            apart = abs(reach[i] - reach[j])
            for axis in range(2):
                apart = max(apart, abs(centre[i, axis] - centre[j, axis]), abs(drift[i, axis] - drift[j, axis]))
            if apart < tolerance:
                first[i] = j
                break
    return first


@compiled
def moved(position: Tensor, control: Vector, free: Matrix) -> Matrix:
    """Return free + S u, (N, 2), for the responses (2, 2, N + 1) of the position."""
    positions: Matrix = free + driven(position, control)[:, 1:].T
    return positions


@compiled
def spread(maps: Tensor, noise_variance: Vector, control: Vector, free: Matrix) -> Matrix:
    """Return the rows xx, yy, xy of free + V u^2, (3, N), for `Horizon.maps` (5, 2, N + 1) and c^2 (2N,)."""
    variance: Matrix = free + driven(maps[2:], noise_variance * control * control)[:, 1:]
    return variance


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
    for field, value in (('start', initial_mean), ('goal', goal_position), ('noise', noise)):
        if not np.isfinite(value).all():
            raise SceneError(field, 'finite numbers', np.asarray(value).tolist())
    return Problem(
        horizon=horizon,
        initial_mean=np.asarray(initial_mean, dtype=float),
        initial_covariance=np.zeros((n, n)) if initial_covariance is None else initial_covariance,
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
