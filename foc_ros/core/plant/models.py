# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plant models: what the predictor has to know of the plant that the parameter `foc.plant` names.

The estimator follows position, velocity and acceleration of the hand, whatever the plant. A plant model takes the part of this
estimate that is its own state, and says how errors of the state evolve when the operator corrects them.

What else depends on the plant:

- The effort is the sum of squared controls: jerk [m^2/s^6] for the triple integrator, force [N^2] for the damped mass. The
  durations describe the hand and are the same for every plant.
- `foc.process_noise` is white noise of the control. For the triple integrator the covariance that it adds in a step is exact; for
  other plants the noise is held constant over a step.

**Errors under replanning.**
The operator sees the hand and plans anew from where it is: whatever the true state, the plan ends at the goal. The control
u = R_N^+ d moves the end by d with least effort, and moves the state at step t by K_t d, K_t = R_t R_N^+. An error e of the
initial state would move the end by A^N e. The operator corrects this, so that the error at step t is (A^t - K_t A^N) e, and zero
at step N. Without the correction, the uncertainty of the acceleration would grow with t^2 over the whole horizon, although the
hand of a seeing operator does not.

Unplanned control noise, white and of unit spectral density, adds a covariance G to the state in every step (for jerk: the
Gramian of the Kalman filter), and is corrected from then on like any other error:

    D(t) = sum_{k < t} E_{N-k-1}(t - k - 1) G E_{N-k-1}(t - k - 1)',

with E_m the map of an error m steps before the goal. For jerk, this is t^5 / 20 at first, as in the filter's model, and small at
the goal. Where the goal does not fix the velocity, errors of the velocity are not corrected: A^N and R_N have only the rows of
the other states.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from foc_ros.core.config import REFERENCE_STEP_S, FocConfig
from foc_ros.core.errors import InputError
from foc_ros.core.hand.kalman import compute_gramian
from foc_ros.core.registry import PLANTS
from foc_ros.core.solution import Solution
from foc_ros.core.types import Array

from .plants import (
    CACHED_HORIZONS,
    Horizon,
    Plant,
    build_triple_integrator_horizon,
    compute_state_scale,
    condense,
    discretise_damped_mass,
    discretise_triple_integrator,
    find_states_at_goal,
)

HAND_STATES = 6
"""x, y, vx, vy, ax, ay of the estimator."""


def compute_goal_map(horizon: Horizon, passing: bool = False) -> Array:
    """Return K_t at steps 0..N, (N + 1, n, n): how a displaced state at the goal displaces the plan of least effort to it.

    passing: the goal does not fix the velocity; the columns of states that the goal does not fix are zero.
    """
    fixed = find_states_at_goal(len(horizon.powers[-1]), passing)
    last = horizon.last[fixed]
    # the rows have different units (m, m/s, ...), so they are scaled to unit length first
    scale = 1.0 / np.sqrt((last**2).sum(axis=1))
    goal_map = np.zeros_like(horizon.powers)
    goal_map[1:, :, fixed] = horizon.response @ (np.linalg.pinv(scale[:, None] * last) * scale)
    return goal_map


def compute_error_map(horizon: Horizon, passing: bool = False) -> Array:
    """Return what remains of an initial error at steps 0..N, (N + 1, n, n); passing: the goal does not fix the velocity."""
    error_map: Array = horizon.powers - compute_goal_map(horizon, passing) @ horizon.powers[-1]
    return error_map


def compute_process_covariance(plant: Plant, steps: int, added: Array, passing: bool) -> Array:
    """Return D at steps 0..N, (N + 1, n, n), for a covariance `added` (n, n) that each step adds and the operator corrects."""
    covariance = np.zeros((steps + 1, *added.shape))
    for step in range(steps):
        left = steps - step - 1
        error_map = compute_error_map(condense(plant, left), passing) if left else np.eye(len(added))[None]
        covariance[step + 1 :] += error_map @ added @ error_map.swapaxes(1, 2)
    return covariance


class PlantModel:
    """A linear plant of the hand at every step length.

    Parameters
    ----------
    discretise
        Function that returns the discrete `Plant` for a step dt [s]. Its states are x, y [m], vx, vy [m/s] and, where the plant
        has them, ax, ay [m/s^2], so that n is 4 to 6; its control has one channel for each axis.

    Attributes
    ----------
    states
        Number n of the states.

    Raises
    ------
    InputError
        For a plant with other states.
    """

    def __init__(self, discretise: Callable[[float], Plant]) -> None:
        self.discretise = discretise
        self.states = len(discretise(REFERENCE_STEP_S).A)
        if self.states > HAND_STATES:
            raise InputError('plant', f'4 to {HAND_STATES} states x, y, vx, vy, ax, ay', self.states)

    def build_horizon(self, dt: float, steps: int) -> Horizon:
        """Return the condensed horizon of `steps` steps of dt [s]."""
        return _condense(self, dt, steps)

    def project_mean(self, hand_mean: Array) -> Array:
        """Return the state (n,) of the plant for the estimated state (6,) of a hand."""
        return hand_mean[: self.states]

    def project_covariance(self, hand_covariance: Array) -> Array:
        """Return the covariance (n, n) of the state for that (6, 6) of the estimate."""
        return hand_covariance[: self.states, : self.states]

    def find_unit(self, dt: float) -> tuple[float, Array]:
        """Return the step [s] for which maps are computed, and the factors (n,) from the states there to those at a step dt [s].

        They are dt and ones, but for a plant whose maps at one step are those at any other, scaled: its maps are computed once.
        """
        return dt, np.ones(self.states)

    def compute_process_noise(self, dt: float) -> Array:
        """Return the covariance (n, n) that white control noise of unit spectral density adds in a step of dt [s]."""
        control = self.discretise(dt).B
        noise: Array = control @ control.T / dt
        return noise

    def compute_goal_map(self, dt: float, steps: int, passing: bool) -> Array:
        """Return K_t, (N + 1, n, n): how a displaced state at the goal displaces the states before it."""
        unit, scale = self.find_unit(dt)
        goal_map: Array = _find_goal_map(self, unit, steps, passing) * (scale[:, None] / scale)
        return goal_map

    def compute_error_map(self, dt: float, steps: int, passing: bool) -> Array:
        """Return E_t, (N + 1, n, n): what remains at steps 0..N of an error of the initial state that the operator corrects."""
        unit, scale = self.find_unit(dt)
        error_map: Array = _find_error_map(self, unit, steps, passing) * (scale[:, None] / scale)
        return error_map

    def propagate_error(self, covariance: Array, dt: float, steps: int, passing: bool) -> Array:
        """Return the covariance (N + 1, n, n) at steps 0..N that an estimate of covariance (6, 6) leads to."""
        unit, scale = self.find_unit(dt)
        error_map, units = _find_error_map(self, unit, steps, passing), np.outer(scale, scale)
        propagated: Array = error_map @ (self.project_covariance(covariance) / units) @ error_map.swapaxes(1, 2) * units
        return propagated

    def compute_process_covariance(self, dt: float, steps: int, passing: bool) -> Array:
        """Return the covariance (N + 1, n, n) that white control noise of unit spectral density causes at steps 0..N."""
        unit, scale = self.find_unit(dt)
        scale = (dt / unit) ** 2.5 * scale
        covariance: Array = _find_process_covariance(self, unit, steps, passing) * (scale[:, None] * scale)
        return covariance

    def compute_end_rate(self, solution: Solution) -> Array:
        """Return the time derivative (n,) of the mean state at the end of a solution, by a backward difference."""
        states = solution.mean
        rate: Array = (1.5 * states[-1] - 2.0 * states[-2] + 0.5 * states[-3]) / solution.dt
        return rate


@lru_cache(maxsize=CACHED_HORIZONS)
def _condense(model: PlantModel, dt: float, steps: int) -> Horizon:
    return condense(model.discretise(dt), steps)


@lru_cache(maxsize=CACHED_HORIZONS)
def _find_goal_map(model: PlantModel, dt: float, steps: int, passing: bool) -> Array:
    return compute_goal_map(model.build_horizon(dt, steps), passing)


@lru_cache(maxsize=CACHED_HORIZONS)
def _find_error_map(model: PlantModel, dt: float, steps: int, passing: bool) -> Array:
    return compute_error_map(model.build_horizon(dt, steps), passing)


@lru_cache(maxsize=CACHED_HORIZONS)
def _find_process_covariance(model: PlantModel, dt: float, steps: int, passing: bool) -> Array:
    return compute_process_covariance(model.discretise(dt), steps, model.compute_process_noise(dt), passing)


class TripleIntegratorModel(PlantModel):
    """The paper's hand, driven by jerk: everything is scaled from the horizon of unit step, which is computed once."""

    def __init__(self, _: FocConfig | None = None) -> None:
        super().__init__(discretise_triple_integrator)

    build_horizon = staticmethod(build_triple_integrator_horizon)

    def find_unit(self, dt: float) -> tuple[float, Array]:  # noqa: D102
        return 1.0, compute_state_scale(dt)

    def compute_process_noise(self, dt: float) -> Array:  # noqa: D102
        return np.kron(compute_gramian(dt), np.eye(2)).astype(np.float64)

    def compute_end_rate(self, solution: Solution) -> Array:  # noqa: D102
        # the control belongs to the middle of its step: in 50 steps of a reach from rest, the last one is 7 % below the jerk at
        # the end, so it is extrapolated by half a step
        jerk = 1.5 * solution.control[-1] - 0.5 * solution.control[-2]
        return np.concatenate([solution.mean[-1, 2:6], jerk])


def make_damped_mass(settings: FocConfig) -> PlantModel:
    """Return the paper's second-order hand: a mass with viscous damping, driven by force."""
    return PlantModel(lambda dt: discretise_damped_mass(dt, settings.plant_mass, settings.plant_damping))


@lru_cache(maxsize=CACHED_HORIZONS)
def make_plant_model(settings: FocConfig) -> PlantModel:
    """Return the model of the plant that `foc.plant` names; raise InputError if its factory makes something else."""
    model = PLANTS.get(settings.plant)(settings)
    if not isinstance(model, PlantModel):
        raise InputError(f'plant {settings.plant}', 'a factory that returns a PlantModel', repr(model))
    return model
