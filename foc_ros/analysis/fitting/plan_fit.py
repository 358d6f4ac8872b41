"""Tau and lambda of strategy `fixed` from recorded movements: those whose plans are nearest to what was recorded.

With sensor noise of one deviation, the most likely (tau, lambda) are those of least squares,

    min sum_i sum_k |z_ik - p_i(t_k; tau, lambda)|^2,

over the logarithms of both. The plan of each recording begins at its first sample, which is as noisy as the others. The effect of
its error on the plan, a minimum-jerk way back, is removed from the residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from foc_ros.core.config import REFERENCE_STEP_S, Config
from foc_ros.core.errors import RecordingError
from foc_ros.core.hand.duration import is_passing
from foc_ros.core.learning.movements import AT_GOAL_M, find_goal_at_end
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import Start, cold_start
from foc_ros.core.plant.covariance import scale_noise
from foc_ros.core.plant.plants import build_triple_integrator_horizon
from foc_ros.core.types import Array, Record, Solution, Status

from .estimates import Estimate, Estimates, clip_to_bounds
from .recorded_hand import MIN_SAMPLES, RecordedHand
from .resampling import Quadratic

NAMES = ('foc.tau', 'foc.lam')
REASONS = (
    'no movement comes so near to an obstacle that its clearance would show',
    'so small a weight of the variance, or so large a one, leaves the plans as they are',
)
GRID = np.log([(tau, lam) for tau in 10.0 ** np.arange(-5.0, -1.4, 0.5) for lam in 10.0 ** np.arange(2.0, 9.1, 1.0)])
"""Logarithms of tau and lambda; searches begin at the best of these."""
MARGIN = 3.0
"""How far beyond the grid a search may go, in the logarithms."""
UNPLANNED_M = 0.1
"""Residual of a recording for which there is no plan [m]."""
FEW = 6
"""Recordings that decide where searches begin."""
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
EARLY = 0.3
"""Share of the movement from which its start is estimated."""


@dataclass(frozen=True, eq=False)
class Reach(Record):
    """A recorded movement from rest to a goal and the problem that its operator solved.

    times (m,) [s] and positions (m, 2) [m]: as recorded; start: where the search for a plan begins, on the recorded path.
    """

    name: str
    times: Array
    positions: Array
    problem: Problem
    start: Start


@dataclass(frozen=True, eq=False)
class Recovered:
    """The estimate of tau [m^2] and lam.

    local: log-likelihoods about their logarithms; stddev: of the residuals [m]; unplanned: movements without such a plan.
    """

    tau: float
    lam: float
    local: Quadratic
    stddev: float
    unplanned: tuple[str, ...]


def make_reach(hand: RecordedHand, config: Config) -> Reach:
    """Take a recording for one movement: from its first sample, at rest, to the goal where it ends, in all of its time.

    Raises RecordingError where it ends at no goal.
    """
    goal, distance_m = find_goal_at_end(hand.positions, hand.goals)
    if distance_m > AT_GOAL_M:
        raise RecordingError(f'{hand.name}: ends {distance_m:.3g} m from the nearest goal, not within {AT_GOAL_M:g} m')
    times, steps = hand.times, config.foc.steps
    dt = float(times[-1]) / steps
    problem = rest_to_goal(
        build_triple_integrator_horizon(dt, steps),
        np.concatenate([_estimate_start(times, hand.positions), np.zeros(4)]),
        hand.goals[goal],
        hand.obstacles.grow(config.scene.hand_radius),
        scale_noise(np.array([config.foc.noise_x, config.foc.noise_y]), REFERENCE_STEP_S, dt),
        config.foc.eta,
        passing=is_passing(config.duration),
    )
    guess = np.column_stack([np.interp(dt * np.arange(steps + 1), times, axis) for axis in hand.positions.T])
    return Reach(hand.name, times, hand.positions, problem, cold_start(guess))


def plan(reach: Reach, tau: float, lam: float, config: Config) -> Solution | None:
    """Return the plan of strategy `fixed` in the path class of the recorded path; None where there is none."""
    solution = solve_problem(reach.problem, reach.start, replace(config.foc, strategy='fixed', tau=tau, lam=lam))
    return solution if solution.status is Status.SOLVED else None


def interpolate_plan(solution: Solution, times: Array) -> Array:
    """Return the mean positions (m, 2) [m] at times (m,) [s] from the start, exact between the steps; at rest beyond the end."""
    step = np.clip((times / solution.dt).astype(np.intp), 0, len(solution.control) - 1)
    s = np.clip(times - step * solution.dt, 0.0, solution.dt)[:, None]
    state, jerk = solution.mean[step], solution.control[step]
    return np.asarray(state[:, :2] + s * state[:, 2:4] + s**2 / 2.0 * state[:, 4:6] + s**3 / 6.0 * jerk)


def recover_tau_and_lambda(reaches: Sequence[Reach], config: Config) -> Recovered:
    """Return the (tau, lambda) that explain the movements best, with the noise and number of steps of the configuration."""

    def compute_residuals(logs: Array) -> Array:
        return np.concatenate([_compute_residual(each, logs, config) for each in reaches])

    few = reaches[:: max(len(reaches) // FEW, 1)][:FEW]
    scale = OUTLIER_STDDEVS * config.estimator.position_stddev
    residuals = [np.concatenate([_compute_residual(each, logs, config) for each in few]) for logs in GRID]
    rough = [float(np.log1p((each / scale) ** 2).sum()) for each in residuals]
    scale = max(scale, OUTLIER_STDDEVS * MAD_STDDEVS * float(np.median(np.abs(residuals[int(np.argmin(rough))]))))
    low, high = GRID.min(axis=0) - MARGIN, GRID.max(axis=0) + MARGIN
    options = {'bounds': (low, high), 'diff_step': STEP, 'loss': 'cauchy', 'f_scale': scale, 'max_nfev': MAX_STEPS}
    starts = np.argsort(rough, kind='stable')[:SEARCHES]
    found = min((least_squares(compute_residuals, GRID[k], **options) for k in starts), key=lambda each: float(each.cost))
    gradient, curvature = _expand_log_likelihood(reaches, found.fun, found.jac)
    tau, lam = np.exp(found.x).tolist()
    unplanned = tuple(each.name for each in reaches if plan(each, tau, lam, config) is None)
    stddev = float(np.sqrt(np.mean(found.fun**2)))
    return Recovered(tau, lam, Quadratic(found.x, gradient, curvature, low, high), stddev, unplanned)


def fit_plans(reaches: Sequence[Reach], config: Config) -> tuple[Estimates, list[str]]:
    """Return the estimates of tau and lambda, and warnings in words."""
    found = recover_tau_and_lambda(reaches, config)
    low, high = np.exp(found.local.compute_interval())
    how = f'plans nearest to the movements, {1e3 * found.stddev:.2g} mm away'
    estimates = {
        name: Estimate(name, clip_to_bounds(name, value), float(a), float(b), how)
        for name, value, a, b in zip(NAMES, (found.tau, found.lam), low, high, strict=True)
    }
    warnings = [
        f'{NAMES[row]}: the movements do not determine it (standard deviation of its logarithm '
        f'{found.local.deviation[row]:.2g}): {REASONS[row]}'
        for row in found.local.undetermined
    ]
    warnings.append('foc.lam: plans depend only on lambda times the square of the noise; the given noise is taken as true')
    if found.unplanned:
        warnings.append(f'foc.tau, foc.lam: no such plan for {", ".join(found.unplanned)}')
    return estimates, warnings


def _estimate_start(times: Array, positions: Array) -> Array:
    """Return where a movement from rest began, (2,) [m], by the cubic and quartic that its first samples follow."""
    early = max(int(np.searchsorted(times, EARLY * times[-1])), MIN_SAMPLES // 2)
    t = times[:early] / times[-1]
    return np.asarray(np.linalg.lstsq(np.column_stack([np.ones(early), t**3, t**4]), positions[:early], rcond=None)[0][0])


def _expand_log_likelihood(reaches: Sequence[Reach], residual: Array, jacobian: Array) -> tuple[Array, Array]:
    """Return gradient (n, 2) and curvature (n, 2, 2) of each log-likelihood, by the Jacobian of the residuals."""
    variance = max(float(residual @ residual) / max(len(residual) - 2, 1), NO_CHANGE)
    jacobian = np.where((jacobian**2).sum(axis=0) > NO_CHANGE, jacobian, 0.0)
    ends = np.cumsum([2 * len(each.times) for each in reaches])[:-1]
    pairs = list(zip(np.split(residual, ends), np.split(jacobian, ends), strict=True))
    gradient = np.array([-part.T @ left / variance for left, part in pairs])
    return gradient, np.array([-part.T @ part / variance for _, part in pairs])


def _compute_residual(reach: Reach, logs: Array, config: Config) -> Array:
    """Return the part of the positions that the plan does not explain, (2m,) [m]."""
    tau, lam = np.exp(logs).tolist()
    solution = plan(reach, tau, lam, config)
    if solution is None:
        return np.full(2 * len(reach.times), UNPLANNED_M)
    offset = reach.positions - interpolate_plan(solution, reach.times)
    share = reach.times / reach.times[-1]
    way_back = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    residual: Array = offset - np.outer(way_back, way_back @ offset) / (way_back @ way_back)
    return residual.ravel()
