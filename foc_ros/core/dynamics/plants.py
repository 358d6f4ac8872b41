"""Linear plants of the hand and their maps over a horizon.

State X, control U of two channels: X(t+1) = A X(t) + B (U(t) + noise). The first two states are the position, the next two the
velocity. Everything downstream works for any such (A, B).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import InputError
from foc_ros.core.types import Array, Record

CACHED_HORIZONS = 16
"""Horizons kept: those of one tick (one per duration) and a few ticks before it, about 30 kB each at N = 50."""
FREEDOM = 1e-2
"""Weight w of the control that leads back to a path, relative to what it moves: less would turn sharply to be back at once."""


@dataclass(frozen=True, eq=False)
class Plant(Record):
    """A discrete linear plant: A (n, n), B (n, 2), dt [s]; states 0 and 1 are the position [m], 2 and 3 the velocity [m/s]."""

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


def triple_integrator(dt: float) -> Plant:
    """Return the paper's hand: X = (x, y, vx, vy, ax, ay), U = jerk [m/s^3], piecewise constant over dt [s].

    Per axis A = [[1, dt, dt^2/2], [0, 1, dt], [0, 0, 1]], B = [dt^3/6, dt^2/2, dt] (paper, equation 1).
    """
    axis_a = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    axis_b = np.array([[dt**3 / 6], [dt**2 / 2], [dt]])
    return Plant(np.kron(axis_a, np.eye(2)), np.kron(axis_b, np.eye(2)), dt)


def damped_mass(dt: float, mass: float, damping: float) -> Plant:
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
    """What N steps of a plant do: X(t) = A^t X(0) + what the control drives it to, `driven(states, u)`.

    u (2N,) is the control stacked axis after axis: first channel at steps 0..N-1, then the second. powers (N + 1, n, n):
    A^0..A^N; states (n, 2, N + 1): the responses of the states, as in `driven`. dt [s].
    """

    powers: Array
    states: Array
    dt: float

    @property
    def steps(self) -> int:
        """N."""
        return int(self.states.shape[-1]) - 1

    @cached_property
    def maps(self) -> Array:
        """Responses of the position: x, y and their products xx, yy, xy, (5, 2, N + 1).

        The first two, driven by u, move it; the last three, driven by c^2 u^2, spread it.
        """
        x, y = self.states[:2]
        return np.stack((x, y, x * x, y * y, x * y))

    @cached_property
    def motion(self) -> Array:
        """Responses of position and velocity per step: x, y, vx, vy, (4, 2, N + 1)."""
        motion = self.states[:4].copy()
        motion[2:] *= self.dt
        return motion

    @cached_property
    def last(self) -> Array:
        """What the states at step N owe to u, (n, 2N)."""
        return np.ascontiguousarray(self.states[..., :0:-1].reshape(len(self.states), -1))

    @cached_property
    def response(self) -> Array:
        """What the states at steps 1..N owe to u, written out in full, (N, n, 2N)."""
        since = np.arange(1, self.steps + 1)[:, None] - np.arange(self.steps)
        response: Array = self.states[..., np.maximum(since, 0)].transpose(2, 0, 1, 3)  # nothing is owed to what comes later
        return response.reshape(self.steps, len(self.states), -1)

    @property
    def position(self) -> Array:
        """S: positions at steps 1..N from u, written out in full, (2, N, 2N)."""
        return self.response[:, :2].swapaxes(0, 1)

    def returning(self, path: Array, state: Array, fixed: NDArray[np.bool_]) -> Array:
        """Return the control (2N,) that makes up for what a path, and the fixed states (n,) at its end, are missing.

        path (N, 2): of the positions at steps 1..N; state (n,): of the states at step N. It is the u of least
        |S u - path|^2 + w |u|^2 with E u = state, where S and E are the responses of the positions and of the fixed states.
        """
        back, to_goal = _returning(self, fixed.tobytes())
        control: Array = back @ path.T.ravel() + to_goal @ state
        return control


@lru_cache(maxsize=CACHED_HORIZONS)
def _returning(stacked: Horizon, fixed: bytes) -> tuple[Array, Array]:
    is_fixed = np.frombuffer(fixed, dtype=np.bool_)
    S, E = np.concatenate(stacked.position), stacked.last[is_fixed]
    unit = 1.0 / np.sqrt((E**2).sum(axis=1))[:, None]  # of rows that mix metres, metres per second and their like
    square = S.T @ S
    weight = square + FREEDOM * np.trace(square) / len(square) * np.eye(len(square))
    back, turned = np.linalg.solve(weight, S.T), np.linalg.solve(weight, (unit * E).T)
    to_goal = turned @ np.linalg.pinv(unit * E @ turned) * unit.T
    of_each_state = np.zeros((len(to_goal), len(is_fixed)))
    of_each_state[:, is_fixed] = to_goal
    return back - to_goal @ (E @ back), of_each_state


def condense(plant: Plant, steps: int) -> Horizon:
    """Stack a plant over `steps` >= 1 steps."""
    n = len(plant.A)
    powers = np.empty((steps + 1, n, n))
    powers[0] = np.eye(n)
    for t in range(steps):
        powers[t + 1] = plant.A @ powers[t]
    states = np.zeros((n, 2, steps + 1))
    states[..., 1:] = (powers[:-1] @ plant.B).transpose(1, 2, 0)
    return Horizon(powers, states, plant.dt)


STATE_ORDER = np.array([0.0, 0.0, 1.0, 1.0, 2.0, 2.0])
"""Of the triple integrator's states as derivatives of the position."""


def state_scale(dt: float) -> Array:
    """Diagonal of D, (6,): the triple integrator's state at step dt [s] is D times its state at unit step."""
    scale: Array = dt**-STATE_ORDER
    return scale


@dataclass(frozen=True, eq=False)
class _Scaled(Horizon):
    """The triple integrator's horizon at a step dt [s]; unit: the one of unit step, which knows the way back to a path."""

    unit: Horizon

    def returning(self, path: Array, state: Array, fixed: NDArray[np.bool_]) -> Array:
        return self.unit.returning(path, state * self.dt**STATE_ORDER, fixed) / self.dt**3


@lru_cache(maxsize=CACHED_HORIZONS)
def _unit_horizon(steps: int) -> Horizon:
    return condense(triple_integrator(1.0), steps)


@lru_cache(maxsize=CACHED_HORIZONS)
def triple_integrator_horizon(dt: float, steps: int) -> Horizon:
    """Return the triple integrator's horizon for any dt [s] by scaling the one of unit step.

    With X = D X', D = diag(1, 1, 1/dt, 1/dt, 1/dt^2, 1/dt^2) and U = U'/dt^3 the dynamics have no unit of time left.
    """
    unit = _unit_horizon(steps)
    scale = state_scale(dt)
    return _Scaled(unit.powers * (scale[:, None] / scale), unit.states * (dt**3 * scale)[:, None, None], dt, unit)


def states_at_goal(n: int, passing: bool = False) -> NDArray[np.bool_]:
    """Tell which of n states the goal fixes, (n,): all, as at rest; or, where the hand only passes it, all but the velocity."""
    return np.array([not (passing and 2 <= state < 4) for state in range(n)])
