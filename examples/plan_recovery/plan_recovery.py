# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tau and lambda of strategy `fixed` from demonstrated movements: those whose plans are nearest to what was measured.

With sensor noise of one deviation, the most likely (tau, lambda) are those of least squares,

    min sum_i sum_k |z_ik - p_i(t_k; tau, lambda)|^2,

over the logarithms of both. The plan of each movement begins at its first sample, which is as noisy as the others. The effect of
its error on the plan, a minimum-jerk way back, is removed from the residuals. Plans depend only on lambda times the square of the
noise, so the noise of the configuration is taken as true.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import foc_ros

Array = NDArray[np.float64]
AT_GOAL_M = 0.05
"""A movement that ends no farther from its goal than this has reached it [m]."""
GRID = np.log([(tau, lam) for tau in 10.0 ** np.arange(-5.0, -1.4, 0.5) for lam in 10.0 ** np.arange(2.0, 9.1, 1.0)])
"""Logarithms of tau and lambda; searches begin at the best of these."""
MARGIN = 3.0
"""How far beyond the grid a search may go, in the logarithms."""
UNPLANNED_M = 0.1
"""Residual of a movement for which there is no plan [m]."""
FEW = 6
"""Movements that decide where searches begin."""
SEARCHES = 2
"""Searches, because a path class that is left and a row that becomes active make local minima."""
MAX_STEPS = 30
OUTLIER_STDDEVS = 3.0
"""Larger residuals count less, because a plan near a change of path class follows its noisy start."""
MAD_STDDEVS = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
STEP = 1e-3
"""Relative step of the finite differences: 0.01 in the logarithms."""
NO_CHANGE = 1e-12
"""Sum of squares below which the plans do not change with a parameter [m^2]."""
FLAT = 1.0
"""Standard deviation of a logarithm above which the movements do not determine a parameter."""
EARLY, FEWEST = 0.3, 5
"""Share of the movement, and least number of samples, from which its start is estimated."""


@dataclass(frozen=True, eq=False)
class Movement:
    """A measured movement from rest to rest at a goal: times (m,) [s] from 0 on, positions (m, 2) [m], goal (2,) [m]."""

    times: Array
    positions: Array
    goal: Array
    obstacles: Sequence[foc_ros.Circle]

    def __post_init__(self) -> None:
        distance = float(np.hypot(*(self.positions[-1] - self.goal)))
        if distance > AT_GOAL_M:
            raise foc_ros.InputError('positions', f'an end within {AT_GOAL_M:g} m of the goal', f'{distance:.3g} m')

    def estimate_start(self) -> Array:
        """Return where the movement began, (2,) [m], by the cubic and quartic that its first samples follow."""
        early = max(int(np.searchsorted(self.times, EARLY * self.times[-1])), FEWEST)
        t = self.times[:early] / self.times[-1]
        powers = np.column_stack([np.ones(early), t**3, t**4])
        return np.asarray(np.linalg.lstsq(powers, self.positions[:early], rcond=None)[0][0])


@dataclass(frozen=True)
class Recovered:
    """The estimate of tau [m^2] and lam, standard deviations of their logarithms, and that of the residuals [m]."""

    tau: float
    lam: float
    log_stddev: tuple[float, float]
    stddev: float
    undetermined: tuple[str, ...]


def plan(movement: Movement, tau: float, lam: float, config: foc_ros.Config) -> foc_ros.Solution | None:
    """Return the plan of strategy `fixed` in the homotopy class of a movement; None where there is none."""
    chosen = config.with_values({'foc.strategy': 'fixed', 'foc.tau': tau, 'foc.lam': lam})
    duration_s = float(movement.times[-1])
    at = np.linspace(0.0, duration_s, chosen.foc.steps + 1)
    guess = np.column_stack([np.interp(at, movement.times, axis) for axis in movement.positions.T])
    given = movement.estimate_start(), movement.goal, movement.obstacles
    solution = foc_ros.solve(*given, duration_s=duration_s, config=chosen, guess=guess)
    return solution if solution.status is foc_ros.Status.SOLVED else None


def interpolate_plan(solution: foc_ros.Solution, times: Array) -> Array:
    """Return the mean positions (m, 2) [m] at times (m,) [s] from the start, exact between the steps; at rest beyond the end."""
    dt = float(solution.times[1])
    step = np.clip((times / dt).astype(np.intp), 0, len(solution.control) - 1)
    s = np.clip(times - step * dt, 0.0, dt)[:, None]
    state, jerk = solution.mean[step], solution.control[step]
    return np.asarray(state[:, :2] + s * state[:, 2:4] + s**2 / 2.0 * state[:, 4:6] + s**3 / 6.0 * jerk)


def recover(movements: Sequence[Movement], config: foc_ros.Config) -> Recovered:
    """Return the (tau, lambda) that explain movements best, with the noise and number of steps of the configuration."""

    def compute_residuals(logs: Array, some: Sequence[Movement] = movements) -> Array:
        return np.concatenate([_compute_residual(each, np.exp(logs), config) for each in some])

    few = movements[:: max(len(movements) // FEW, 1)][:FEW]
    scale = OUTLIER_STDDEVS * config.estimator.position_stddev
    tried = [compute_residuals(logs, few) for logs in GRID]
    rough = [float(np.log1p((each / scale) ** 2).sum()) for each in tried]
    scale = max(scale, OUTLIER_STDDEVS * MAD_STDDEVS * float(np.median(np.abs(tried[int(np.argmin(rough))]))))
    low, high = GRID.min(axis=0) - MARGIN, GRID.max(axis=0) + MARGIN
    options = {'bounds': (low, high), 'diff_step': STEP, 'loss': 'cauchy', 'f_scale': scale, 'max_nfev': MAX_STEPS}
    starts = np.argsort(rough, kind='stable')[:SEARCHES]
    found = min((least_squares(compute_residuals, GRID[row], **options) for row in starts), key=lambda each: float(each.cost))
    sizes = (found.jac**2).sum(axis=0)
    variance = max(float(found.fun @ found.fun) / max(len(found.fun) - 2, 1), NO_CHANGE)
    known = sizes > NO_CHANGE
    deviations = np.full(2, np.inf)
    deviations[known] = np.sqrt(np.diag(variance * np.linalg.pinv(found.jac[:, known].T @ found.jac[:, known])))
    at_bound = (found.x <= low + STEP) | (found.x >= high - STEP)
    unknown = tuple(name for name, is_lost in zip(('tau', 'lambda'), (deviations > FLAT) | at_bound, strict=True) if is_lost)
    tau, lam = np.exp(found.x).tolist()
    return Recovered(tau, lam, (float(deviations[0]), float(deviations[1])), float(np.sqrt(np.mean(found.fun**2))), unknown)


def _compute_residual(movement: Movement, parameters: Array, config: foc_ros.Config) -> Array:
    """Return the part of the positions that the plan with (tau, lambda) does not explain, (2m,) [m]."""
    solution = plan(movement, float(parameters[0]), float(parameters[1]), config)
    if solution is None:
        return np.full(2 * len(movement.times), UNPLANNED_M)
    offset = movement.positions - interpolate_plan(solution, movement.times)
    share = movement.times / movement.times[-1]
    way_back = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    residual: Array = offset - np.outer(way_back, way_back @ offset) / (way_back @ way_back)
    return residual.ravel()
