# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public Python API for one reaching scene: `solve`, `solve_classes`, `monte_carlo`; `foc_ros` exports all of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core import solution as core_solution
from foc_ros.core.classes.guess import guess_path
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, SceneError
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.shapes import Shape, collect_obstacles
from foc_ros.core.ocp import monte_carlo as sampling
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.prediction import PredictedCandidate
from foc_ros.core.reach import build_scene_problems, solve_scene
from foc_ros.core.scene import ReachingScene
from foc_ros.core.solution import Candidate, Goal
from foc_ros.core.support import GoalTable, check_array, check_config, check_number, check_vector, collect_goals, find_shape
from foc_ros.core.types import HandState
from foc_ros.prediction import Prediction


@dataclass(frozen=True, eq=False, repr=False)
class Solution(core_solution.Solution):
    """The forward optimal control of one homotopy class, with the problem that it solves.

    Attributes
    ----------
    status, message : Status, str
        Result in words and numbers. `Status.SOLVED` meets the wanted eta, `Status.COMPROMISED` a smaller one.
    label : str
        Name of the homotopy class, such as ``goal0:+0-1``: + passes an obstacle on the left.
    times, path, mean, covariance : ndarray of shape (N + 1,), (N + 1, 2), (N + 1, n), (N + 1, n, n)
        Times [s], mean positions [m], and mean and covariance of the state: position, velocity and what else the plant has.
    control, effort : ndarray of shape (N, 2), float
        Jerk [m/s^3] for the triple integrator, force [N] for the damped mass; the sum of its squares.
    eta, problem : float, Problem
        Probability of avoidance that the solution achieves for each obstacle and step, and the problem that was solved.
    obstacles : Obstacles
        The obstacles as they were given; those of the problem are larger by `scene.hand_radius`.
    """

    label: str = ''
    problem: Problem | None = None
    obstacles: Obstacles = field(default_factory=make_obstacles)

    def plot(self, axes: Any = None) -> Any:
        """Draw the solution in its scene; see `Prediction.plot`."""
        from foc_ros.reporting.views import parse_sides

        sides = tuple(parse_sides(self.label, self.obstacles.ids).items())
        candidate = Candidate(self.label, 0, sides, self.path, 0.0)
        return plot_candidates([PredictedCandidate(candidate, self, {}, 0.0, 1.0)], axes)


def solve(
    start: ArrayLike,
    goal: ArrayLike | Goal,
    obstacles: Iterable[Shape] | Shape | Obstacles = (),
    eta: float | None = None,
    strategy: str | None = None,
    duration_s: float = 1.0,
    config: Config | None = None,
    guess: ArrayLike | None = None,
) -> Solution:
    """Solve one reaching scene and return its most likely homotopy class.

    Parameters
    ----------
    start : array_like of shape (2,) or (6,)
        Position of a hand at rest [m], or its state x, y, vx, vy, ax, ay [m, m/s, m/s^2].
    goal : array_like of shape (2,), or Goal
        Position at which the hand comes to rest [m]. An obstacle that holds it, now and when the hand is there, or that a `Goal`
        names as its object, does not block the path to it.
    obstacles : iterable of Circle, Box, Capsule and Hull, or one of them, or Obstacles
        The obstacles.
    eta : float, optional
        Wanted probability of avoiding each obstacle at each step; by default `foc.eta` of the config.
    strategy : str, optional
        Strategy of the solver; by default `foc.strategy` of the config.
    duration_s : float
        Duration of the movement [s].
    config : Config, optional
        All other parameters; the defaults if not given.
    guess : array_like of shape (m, 2), optional
        Via points of a path [m], or its positions at all N + 1 steps. Only its homotopy class is solved then.

    Returns
    -------
    Solution
        The solution of the most likely class. Its status says if the problem could not be solved.

    Raises
    ------
    InputError
        For input that cannot be used: `SceneError` for the scene, or if no path leads to the goal, `ParameterError` for eta,
        strategy and duration.

    Examples
    --------
    >>> import foc_ros
    >>> solution = foc_ros.solve((0, 0), (0.3, 0), [foc_ros.Circle((0.15, 0.01), radius=0.03)], eta=0.95)
    >>> solution.status, solution.label
    (<Status.SOLVED: 'solved'>, 'goal0:-0')
    >>> solution.path.shape
    (31, 2)
    """
    table, config = _collect_goals(goal), _fix_parameters(config, eta, strategy, duration_s)
    if len(table.positions) > 1:
        raise SceneError('goal', 'one goal; solve_classes takes several', repr(goal))
    target = table.positions[0]
    scene = _build_scene(start, table, obstacles, config)
    if guess is not None:
        points = check_array('guess', guess, (None, 2))
        scene = scene.with_guess(guess_path(scene.hand.mean[:2], target, config.foc.steps, via=points))
    candidates = _solve(scene)
    if not candidates:
        raise SceneError('scene', 'a path between the obstacles from the start to the goal', 'none')
    solution = candidates[0].solution
    assert isinstance(solution, Solution)
    return solution


def solve_classes(
    start: ArrayLike,
    goal: ArrayLike | Goal | Iterable[Goal | ArrayLike],
    obstacles: Iterable[Shape] | Shape | Obstacles = (),
    eta: float | None = None,
    strategy: str | None = None,
    duration_s: float = 1.0,
    config: Config | None = None,
) -> tuple[PredictedCandidate, ...]:
    """Solve one reaching scene in every homotopy class that is found, at most `homotopy.max_candidates`.

    Parameters
    ----------
    start, obstacles, eta, strategy, duration_s, config
        As for `solve`, which also lists the errors.
    goal : array_like of shape (2,) or (g, 2), Goal, or iterable of Goal and positions
        One goal or several [m].

    Returns
    -------
    tuple of PredictedCandidate
        Solved ones first, the most likely first; then those that could not be solved. The solution of each is a `Solution`.
        Empty if no path leads to a goal.

    Examples
    --------
    >>> import foc_ros
    >>> for candidate in foc_ros.solve_classes((0, 0), (0.3, 0), [foc_ros.Circle((0.15, 0.01), radius=0.03)]):
    ...     print(candidate)
    <PredictedCandidate goal0: right of 0, solved, likelihood 0.66>
    <PredictedCandidate goal0: left of 0, solved, likelihood 0.34>
    """
    table = _collect_goals(goal)
    scene = _build_scene(start, table, obstacles, _fix_parameters(config, eta, strategy, duration_s))
    return _solve(scene)


def _collect_goals(goal: ArrayLike | Goal | Iterable[Goal | ArrayLike]) -> GoalTable:
    table = collect_goals('goal', goal)
    if table.heights is not None:
        raise SceneError('goal', 'two numbers [m] in the task plane: only a Predictor takes heights', repr(goal))
    return table


def _build_scene(
    start: ArrayLike, table: GoalTable, shapes: Iterable[Shape] | Shape | Obstacles, config: Config
) -> ReachingScene:
    expected = 'a position (2,) or a state (6,) x, y, vx, vy, ax, ay'
    size = find_shape(start)
    if size not in ((2,), (6,)):
        raise SceneError('start', expected, f'{start!r} of shape {size}')
    state, obstacles = np.zeros(6), collect_obstacles(shapes)
    state[: size[0]] = check_vector('start', start, size[0])
    hand = HandState(0, state, np.zeros((6, 6)))
    scene = ReachingScene(hand, table.positions, obstacles, None, None, config, table.names, table.objects)
    scene.check()
    return scene


def _fix_parameters(config: Config | None, eta: float | None, strategy: str | None, duration_s: float) -> Config:
    given = {'foc.eta': eta, 'foc.strategy': strategy, 'duration.fixed_s': duration_s, 'duration.model': 'fixed'}
    return check_config(config).with_values({name: value for name, value in given.items() if value is not None})


def _solve(scene: ReachingScene) -> tuple[PredictedCandidate, ...]:
    problems = build_scene_problems(scene)
    return tuple(
        replace(each, solution=Solution(**vars(each.solution), label=each.label, problem=problem, obstacles=scene.obstacles))
        for each in solve_scene(scene, problems)
        for problem in (problems[each.candidate.goal],)
    )


def monte_carlo(solution: Solution, samples: int = 10_000, seed: int = 0) -> sampling.MonteCarlo:
    """Estimate from noisy movements how often a solution avoids the obstacles.

    Parameters
    ----------
    solution : Solution
        Result of `solve`, or the solution of a candidate of `solve_classes`.
    samples : int
        Number of movements, up to 10,000,000.
    seed : int
        Seed of the random generator: equal seeds give equal results.

    Returns
    -------
    MonteCarlo
        Fractions of movements that avoid the obstacles, each with its 95 % interval: `step` for the worst obstacle and step, and
        `path` for all obstacles and steps together.

    Raises
    ------
    InputError
        For a solution without its problem, or a number of samples or a seed out of bounds.

    Examples
    --------
    >>> import foc_ros
    >>> solution = foc_ros.solve((0, 0), (0.3, 0), [foc_ros.Circle((0.15, 0.01), radius=0.03)])
    >>> fraction, low, high = foc_ros.monte_carlo(solution, samples=1000).step
    >>> fraction >= 0.9
    True
    """
    problem = getattr(solution, 'problem', None)
    if problem is None:
        raise InputError('solution', 'a result of foc_ros.solve or solve_classes', repr(solution))
    for name, value, low, high in (('samples', samples, 1, 10_000_000), ('seed', seed, 0, 2**32)):
        if not check_number(name, value, low, high).is_integer():
            raise InputError(name, 'a whole number', value)
    return sampling.monte_carlo(problem, solution.control.T.ravel(), int(samples), int(seed))


def plot_candidates(candidates: Sequence[PredictedCandidate], axes: Any = None) -> Any:
    """Draw the candidates of `solve_classes` in their scene, the thicker the more likely; those without a likelihood are grey.

    Parameters
    ----------
    candidates : sequence of PredictedCandidate
        Result of `solve_classes`, not empty.
    axes : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default. They are returned.
    """
    solutions = [each.solution for each in candidates if isinstance(each.solution, Solution)]
    problems = [each.problem for each in solutions if each.problem]
    if not problems:
        raise InputError('candidates', 'results of foc_ros.solve_classes', repr(candidates))
    by_number = {each.candidate.goal: problem.goal[:2] for each, problem in zip(candidates, problems, strict=True)}
    goals = np.array([by_number[number] for number in sorted(by_number)])
    shown = Prediction(0, '', 0.0, tuple(candidates), candidates[0].label, obstacles=solutions[0].obstacles, goal_positions=goals)
    return shown.plot(axes)
