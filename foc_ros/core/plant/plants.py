# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Discrete linear plants of the hand, and their maps over a horizon.

State X, control U of two channels: X(t+1) = A X(t) + B (U(t) + noise). The first two states are the position, the next two the
velocity. The optimal control works for any such (A, B); `models` says what the predictor needs besides.

A unit control at step k of one channel changes a quantity at step s by h(s - k), with h(0) = 0 and no effect on earlier steps.
One response of N + 1 numbers therefore stands for a whole matrix. Responses (q, 2, N + 1) are those of q quantities to both
channels; a control is stacked, (2N,): the first channel at steps 0..N-1, then the second.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from foc_ros.core.errors import InputError
from foc_ros.core.types import Array, Record

from .response import Response

CACHED_HORIZONS = 16
"""Size of caches: one horizon per duration, for a prediction and a few before it, about 60 kB each at N = 50."""


@dataclass(frozen=True, eq=False)
class Plant(Record):
    """A discrete linear plant X(t+1) = A X(t) + B U(t).

    A (n, n), n >= 4; B (n, 2); dt [s]. States 0 and 1 are the position [m], 2 and 3 the velocity [m/s]. Raises InputError for
    other shapes, numbers that are not finite or dt <= 0.
    """

    A: Array
    B: Array
    dt: float

    def __post_init__(self) -> None:
        n = len(self.A)
        if self.A.shape != (n, n) or n < 4 or self.B.shape != (n, 2):
            raise InputError('plant', 'A (n, n) and B (n, 2) with n >= 4', f'A {self.A.shape}, B {self.B.shape}')
        if not (np.isfinite(self.A).all() and np.isfinite(self.B).all() and np.isfinite(self.dt) and self.dt > 0):
            raise InputError('plant', 'finite A and B and dt > 0', f'dt = {self.dt}')
        super().__post_init__()


def discretise_triple_integrator(dt: float) -> Plant:
    """Return the paper's hand: X = (x, y, vx, vy, ax, ay), U = jerk [m/s^3], piecewise constant over dt [s].

    Per axis A = [[1, dt, dt^2/2], [0, 1, dt], [0, 0, 1]], B = [dt^3/6, dt^2/2, dt] (paper, equation 1).
    """
    axis_a = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    axis_b = np.array([[dt**3 / 6], [dt**2 / 2], [dt]])
    return Plant(np.kron(axis_a, np.eye(2)), np.kron(axis_b, np.eye(2)), dt)


def discretise_damped_mass(dt: float, mass: float, damping: float) -> Plant:
    """Return the paper's second-order hand: X = (x, y, vx, vy), U = force [N], mass [kg] > 0, damping [N s/m] >= 0.

    m dv/dt = U - b v, discretised exactly for a force that is constant over dt [s] (paper, section V).
    """
    if not mass > 0 or not damping >= 0:
        raise InputError('plant', 'mass > 0 and damping >= 0', f'mass {mass}, damping {damping}')
    rate = damping / mass * dt
    decay = np.exp(-rate)
    # f1 = (1 - e^-r)/r and f2 = (1 - f1)/r, by their series where r is too small for the quotient
    f1 = -np.expm1(-rate) / rate if rate > 1e-5 else 1 - rate / 2
    f2 = (1 - f1) / rate if rate > 1e-5 else 0.5 - rate / 6
    axis_a = np.array([[1.0, dt * f1], [0.0, decay]])
    axis_b = np.array([[dt**2 / mass * f2], [dt / mass * f1]])
    return Plant(np.kron(axis_a, np.eye(2)), np.kron(axis_b, np.eye(2)), dt)


@dataclass(frozen=True, eq=False)
class Horizon(Record):
    """The condensed dynamics of N steps: X(t) = A^t X(0) + the convolution of u with the impulse responses.

    u (2N,) is the stacked control: the first channel at steps 0..N-1, then the second. powers (N + 1, n, n): A^0..A^N; states
    (n, 2, N + 1): impulse responses of the states, as in `apply_impulse_response`. dt [s]. gain, unit: where responses of the
    position differ by a factor only from those of another horizon, this factor and that horizon.
    """

    powers: Array
    states: Array
    dt: float
    gain: float = 1.0
    unit: Horizon | None = None

    @property
    def steps(self) -> int:
        """N."""
        return int(self.states.shape[-1]) - 1

    @cached_property
    def products(self) -> Array:
        """Products of the impulse responses of each two states, (n^2, 2, N + 1): applied to c^2 u^2, they give the covariance."""
        products: Array = self.states[:, None] * self.states
        return products.reshape(-1, *self.states.shape[1:])

    @cached_property
    def motion(self) -> Array:
        """Impulse responses of position and velocity per step: x, y, vx, vy, (4, 2, N + 1)."""
        motion = self.states[:4].copy()
        motion[2:] *= self.dt
        return motion

    @cached_property
    def position_response(self) -> Response:
        """The response of the position at any time to a control in units of `gain`."""
        return Response(self.motion) if self.unit is None else self.unit.position_response

    @cached_property
    def last(self) -> Array:
        """Matrix (n, 2N) from u to the states at step N."""
        return np.ascontiguousarray(self.states[..., :0:-1].reshape(len(self.states), -1))

    @cached_property
    def response(self) -> Array:
        """Matrices (N, n, 2N) from u to the states at steps 1..N."""
        since = np.arange(1, self.steps + 1)[:, None] - np.arange(self.steps)
        response: Array = self.states[..., np.maximum(since, 0)].transpose(2, 0, 1, 3)  # later controls have no effect
        return response.reshape(self.steps, len(self.states), -1)

    @property
    def position(self) -> Array:
        """S: matrices (2, N, 2N) from u to the positions at steps 1..N."""
        return self.response[:, :2].swapaxes(0, 1)


def condense(plant: Plant, steps: int) -> Horizon:
    """Return the condensed horizon of a plant over `steps` >= 1 steps."""
    n = len(plant.A)
    powers = np.empty((steps + 1, n, n))
    powers[0] = np.eye(n)
    for t in range(steps):
        powers[t + 1] = plant.A @ powers[t]
    states = np.zeros((n, 2, steps + 1))
    states[..., 1:] = (powers[:-1] @ plant.B).transpose(1, 2, 0)
    return Horizon(powers, states, plant.dt)


def compute_state_scale(dt: float) -> Array:
    """Diagonal of D, (6,): the triple integrator's state at step dt [s] is D times its state at unit step."""
    scale: Array = dt ** -np.array([0.0, 0.0, 1.0, 1.0, 2.0, 2.0])
    return scale


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_horizon(steps: int) -> Horizon:
    return condense(discretise_triple_integrator(1.0), steps)


@lru_cache(maxsize=CACHED_HORIZONS)
def build_triple_integrator_horizon(dt: float, steps: int) -> Horizon:
    """Return the triple integrator's horizon for any dt [s], scaled from the one of unit step.

    With X = D X', D = diag(1, 1, 1/dt, 1/dt, 1/dt^2, 1/dt^2) and U = U'/dt^3 the dynamics of X' do not depend on dt.
    """
    unit = _unit_horizon(steps)
    scale = compute_state_scale(dt)
    return Horizon(unit.powers * (scale[:, None] / scale), unit.states * (dt**3 * scale)[:, None, None], dt, dt**3, unit)


def find_states_at_goal(n: int, passing: bool = False) -> NDArray[np.bool_]:
    """Return which of n states the goal fixes, (n,): all if the hand comes to rest, all but the velocity if it passes."""
    return np.array([not (passing and 2 <= state < 4) for state in range(n)])


def variance_weights(states: Array, terminal: Array, stage: Array) -> Array:
    """Return d (2N,), where d.u^2 is what a control's noise u adds to sum_i terminal_i X_i(N)^2 + stage_i sum_{t < N} X_i(t)^2.

    states (n, 2, N + 1): impulse responses of the states; terminal, stage (n,): weights.
    """
    is_weighed = (terminal > 0.0) | (stage > 0.0)
    squares, terminal, stage = states[is_weighed] ** 2, terminal[is_weighed], stage[is_weighed]
    since = np.tensordot(terminal, squares[..., 1:], 1) + np.tensordot(stage, squares[..., :-1].cumsum(axis=-1), 1)
    return since[:, ::-1].ravel()


def apply_impulse_response(responses: Array, control: Array) -> Array:
    """Return the q quantities at steps 0..N, (q, N + 1), from responses (q, 2, N + 1) and a stacked control (2N,)."""
    quantities, channels, times = responses.shape
    # the control at step s - m for each channel and each m, s = 0..N, (2 (N + 1), N + 1); zero before step 0
    padded = np.zeros((channels, 2 * times - 1))
    padded[:, times - 1 : -1] = control.reshape(channels, -1)
    row, item = padded.strides
    shifted = as_strided(padded[:, times - 1 :], (channels, times, times), (row, -item, item))
    moved: Array = responses.reshape(quantities, -1) @ shifted.reshape(channels * times, times)
    return moved
