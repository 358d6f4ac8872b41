"""Recovery of (tau, lambda) from recorded movements: the plan of strategy `fixed` that is nearest to what was recorded.

With sensor noise of one deviation, the most likely (tau, lambda) are those of least squares,

    min sum_i sum_k |z_ik - p_i(t_k; tau, lambda)|^2,

over the logarithms of both. The plan of each recording begins at its first sample, which is as noisy as the others: what an
error of it does to the plan, a minimum-jerk way back, is taken out of the residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from foc_ros.core.config import Config
from foc_ros.core.types import Array

from .estimates import Estimate, bounded
from .plans import Reach, planned, positions_at
from .resampling import Quadratic

TAUS = tuple(10.0 ** np.arange(-5.0, -1.4, 0.5))
LAMBDAS = tuple(10.0 ** np.arange(2.0, 9.1, 1.0))
"""Where the search begins: at the best of these."""
UNPLANNED_M = 0.1
"""Residual of a recording for which there is no plan [m]."""
FEW = 6
"""Recordings by which the search finds where to begin."""
STARTS = 2
"""Searches, from the best places: a class that is left and a row that becomes active make valleys of their own."""
MOST_STEPS = 30
OUTLIER_STDDEVS = 3.0
"""Residuals beyond this many standard deviations count less: a plan near a change of class follows its noisy start."""
MAD_STDDEVS = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
BEYOND = 3.0
"""How far beyond these the search may go, in the logarithms."""
STEP = 1e-3
"""Relative step of the finite differences: 0.01 in the logarithms."""


NAMES = ('foc.tau', 'foc.lam')
NO_STEP = 1e-12
"""Sum of squares below which the plans do not change with a parameter [m^2]."""


@dataclass(frozen=True, eq=False)
class Recovered:
    """What was found of tau [m^2] and lam.

    local: log-likelihoods about their logarithms; stddev: of the residuals [m]; unplanned: movements without such a plan.
    """

    tau: float
    lam: float
    local: Quadratic
    stddev: float
    unplanned: tuple[str, ...]


def recover(reaches: Sequence[Reach], config: Config) -> Recovered:
    """Return the (tau, lambda) that explain the movements best, in the noise and number of steps of the configuration."""

    def residuals(logs: Array) -> Array:
        return np.concatenate([_residual(each, logs, config) for each in reaches])

    few = reaches[:: max(len(reaches) // FEW, 1)][:FEW]
    scale = OUTLIER_STDDEVS * config.estimator.position_stddev
    grid = np.log([(tau, lam) for tau in TAUS for lam in LAMBDAS])
    left = [np.concatenate([_residual(each, logs, config) for each in few]) for logs in grid]
    rough = [_loss(each / scale) for each in left]
    scale = max(scale, OUTLIER_STDDEVS * MAD_STDDEVS * float(np.median(np.abs(left[int(np.argmin(rough))]))))
    low, high = grid.min(axis=0) - BEYOND, grid.max(axis=0) + BEYOND
    searches = [
        least_squares(residuals, grid[k], bounds=(low, high), diff_step=STEP, loss='cauchy', f_scale=scale, max_nfev=MOST_STEPS)
        for k in np.argsort(rough, kind='stable')[:STARTS]
    ]
    found = min(searches, key=lambda each: float(each.cost))
    local = _local(reaches, found.x, found.fun, found.jac, low, high)
    tau, lam = np.exp(found.x).tolist()
    unplanned = tuple(each.name for each in reaches if planned(each, tau, lam, config) is None)
    return Recovered(tau, lam, local, float(np.sqrt(np.mean(found.fun**2))), unplanned)


def fit_plans(reaches: Sequence[Reach], config: Config) -> tuple[dict[str, Estimate], list[str]]:
    """Return tau and lambda as estimates, and warnings in words."""
    found = recover(reaches, config)
    low, high = np.exp(found.local.interval())
    how = f'plans nearest to the movements, {1e3 * found.stddev:.2g} mm away'
    estimates = {
        name: Estimate(name, bounded(name, value), float(a), float(b), how)
        for name, value, a, b in zip(NAMES, (found.tau, found.lam), low, high, strict=True)
    }
    warnings = [
        f'{NAMES[place]}: the movements do not tell it (standard deviation of its logarithm {found.local.deviation[place]:.2g}): '
        f'{_UNTOLD[place]}'
        for place in found.local.undetermined
    ]
    warnings.append('foc.lam: the plans depend on lambda times the square of the noise alone; the noise given is taken as true')
    if found.unplanned:
        warnings.append(f'foc.tau, foc.lam: no such plan for {", ".join(found.unplanned)}')
    return estimates, warnings


_UNTOLD = (
    'no movement comes so near to an obstacle that its clearance would show',
    'so small a weight of the variance, or so large a one, leaves the plans as they are',
)


def _local(reaches: Sequence[Reach], logs: Array, residual: Array, jacobian: Array, low: Array, high: Array) -> Quadratic:
    """Return the log-likelihoods about the least squares, by the Jacobian of the residuals of each movement."""
    variance = max(float(residual @ residual) / max(len(residual) - 2, 1), NO_STEP)
    jacobian = np.where((jacobian**2).sum(axis=0) > NO_STEP, jacobian, 0.0)
    ends = np.cumsum([2 * len(each.times) for each in reaches])[:-1]
    pairs = list(zip(np.split(residual, ends), np.split(jacobian, ends), strict=True))
    gradient = np.array([-part.T @ left / variance for left, part in pairs])
    curvature = np.array([-part.T @ part / variance for _, part in pairs])
    return Quadratic(logs, gradient, curvature, low, high)


def _loss(scaled: Array) -> float:
    return float(np.log1p(scaled**2).sum())


def _residual(reach: Reach, logs: Array, config: Config) -> Array:
    """Return what the plan leaves unexplained, (2m,) [m]."""
    tau, lam = np.exp(logs).tolist()
    solution = planned(reach, tau, lam, config)
    if solution is None:
        return np.full(2 * len(reach.times), UNPLANNED_M)
    away = reach.positions - positions_at(solution, reach.times)
    share = reach.times / reach.times[-1]
    back = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    rest: Array = away - np.outer(back, back @ away) / (back @ back)
    return rest.ravel()
