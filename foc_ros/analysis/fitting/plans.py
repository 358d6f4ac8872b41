"""What strategy `fixed` plans for a recorded movement, at given tau and lambda."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from foc_ros.core.config import REFERENCE_STEP_S, Config
from foc_ros.core.dynamics.noise import scale_noise
from foc_ros.core.dynamics.plants import triple_integrator_horizon
from foc_ros.core.errors import RecordingError
from foc_ros.core.estimation.duration import is_passing
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.warm_start import Start, cold_start
from foc_ros.core.types import Array, Record, Solution, Status

from .demonstrations import FEWEST, Demonstration

AT_GOAL_M = 0.05
"""A recording that ends no farther from a goal than this reached it [m]."""

EARLY = 0.3
"""Share of the movement from which its start is judged."""


@dataclass(frozen=True, eq=False)
class Reach(Record):
    """A recorded movement from rest to a goal and the problem that its operator solved.

    times (m,) [s] and positions (m, 2) [m]: as recorded; start: where the search for a plan begins, on the path recorded.
    """

    name: str
    times: Array
    positions: Array
    problem: Problem
    start: Start


def reach(demonstration: Demonstration, config: Config) -> Reach:
    """Take a recording for one movement: from its first sample, at rest, to the goal that it ends at, in all of its time.

    Raises RecordingError where it ends at no goal.
    """
    goal = demonstration.goals[np.hypot(*(demonstration.goals - demonstration.positions[-1]).T).argmin()]
    missed = float(np.hypot(*(goal - demonstration.positions[-1])))
    if missed > AT_GOAL_M:
        raise RecordingError(f'{demonstration.name}: ends {missed:.3g} m from the nearest goal, not within {AT_GOAL_M:g} m')
    times, steps = demonstration.times, config.foc.steps
    dt = float(times[-1]) / steps
    problem = rest_to_goal(
        triple_integrator_horizon(dt, steps),
        np.concatenate([_start(times, demonstration.positions), np.zeros(4)]),
        goal,
        demonstration.obstacles,
        scale_noise(np.array([config.foc.noise_x, config.foc.noise_y]), REFERENCE_STEP_S, dt),
        config.foc.eta,
        passing=is_passing(config.duration),
    )
    guess = np.column_stack([np.interp(dt * np.arange(steps + 1), times, axis) for axis in demonstration.positions.T])
    return Reach(demonstration.name, times, demonstration.positions, problem, cold_start(guess))


def _start(times: Array, positions: Array) -> Array:
    """Return where a movement from rest began, (2,) [m], by the cubic and quartic that its first samples follow."""
    early = max(int(np.searchsorted(times, EARLY * times[-1])), FEWEST // 2)
    t = times[:early] / times[-1]
    start: Array = np.linalg.lstsq(np.column_stack([np.ones(early), t**3, t**4]), positions[:early], rcond=None)[0][0]
    return start


def planned(reach: Reach, tau: float, lam: float, config: Config) -> Solution | None:
    """Return the plan of strategy `fixed` on the side on which the recorded path runs; None where there is none."""
    solution = solve_problem(reach.problem, reach.start, replace(config.foc, strategy='fixed', tau=tau, lam=lam))
    return solution if solution.status is Status.SOLVED else None


def positions_at(solution: Solution, times: Array) -> Array:
    """Return the mean positions (m, 2) [m] at times (m,) [s] from the start, exact between the steps; at rest beyond the end."""
    step = np.clip((times / solution.dt).astype(np.intp), 0, len(solution.control) - 1)
    s = np.clip(times - step * solution.dt, 0.0, solution.dt)[:, None]
    state, jerk = solution.mean[step], solution.control[step]
    positions: Array = state[:, :2] + s * state[:, 2:4] + s**2 / 2.0 * state[:, 4:6] + s**3 / 6.0 * jerk
    return positions
