"""The public Python API as far as it is more than a re-export; `foc_ros` exports all of it. No other module imports this one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core import types
from foc_ros.core.checks import check_array, check_number, check_vector
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.config import Config
from foc_ros.core.deadline import Deadline
from foc_ros.core.errors import InputError, SceneError
from foc_ros.core.estimation.kalman_filter import FilterState, describe_jump, update
from foc_ros.core.guidance.step import GuidanceInput, GuidanceOutput, GuidanceState, guide
from foc_ros.core.learning.experience import make_library
from foc_ros.core.memory.memory import Memory
from foc_ros.core.obstacles.scene import ObstacleSource
from foc_ros.core.obstacles.shapes import Shape, collect_obstacles
from foc_ros.core.ocp import monte_carlo as sampling
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import find_least_safety_factor
from foc_ros.core.predictor import predict, warm_up
from foc_ros.core.reaching_scene import ReachingScene, check_outside
from foc_ros.core.registry import LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES, Registry
from foc_ros.core.scene_solver import build_scene_problems, solve_scene
from foc_ros.core.types import (
    NANOSECONDS,
    Candidate,
    HandSample,
    HandState,
    Obstacles,
    PredictedCandidate,
    SampleStatus,
    make_obstacles,
)

LATEST_S = 9e9
"""Bound on a time [s]: stamps are 64-bit numbers of nanoseconds."""
MOST_SAMPLES = 10_000_000
PLANE, SPACE = 2, 3
"""Number of coordinates of a position in the task plane, and of one with its height over the plane."""


class Prediction(types.Prediction):
    """The prediction for one hand sample.

    Attributes
    ----------
    t, solve_s : float
        Time of the hand sample, and wall time of the prediction [s].
    candidates : tuple of PredictedCandidate
        Solved ones first, the most likely first; then those that could not be solved, with their status. The `height` of a
        candidate has `mean` and `covariance` of the height over the plane and its derivatives, None where it is not predicted.
    most_likely : str or None
        Label of the most likely class, which changes only when another one leads by `likelihood.margin`; None if none was solved.
    obstacles, goals : Obstacles, ndarray of shape (g, 2)
        The scene at time `t`.
    cleared : tuple of bool
        For each obstacle, whether the hand is predicted to pass above or below it, so that it does not block.
    notes : dict
        Counts of events such as merged classes and culled obstacles.
    """

    def plot(self, axes: Any = None) -> Any:
        """Draw the candidates in their scene, the thicker the more likely; those without a likelihood are grey.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Axes to draw on; new ones by default.

        Returns
        -------
        matplotlib.axes.Axes
            The axes that hold the drawing.
        """
        from foc_ros.reporting.draw import plot_prediction

        return plot_prediction(self, axes)


class Guidance:
    """Turn predictions into a guiding force: bounded, passive, and zero without a fresh prediction.

    Call `update` at `guidance.rate_hz`, several times for each prediction. `guidance.enabled` has no effect here.

    Parameters
    ----------
    config : Config, optional
        Parameters, of which `guidance` and `scene.hand_radius` are used; the defaults if not given.

    Examples
    --------
    >>> import foc_ros
    >>> config = foc_ros.Config(budget_s=0.0)
    >>> predictor, guidance = foc_ros.Predictor(config), foc_ros.Guidance(config)
    >>> predictor.set_goals([(0.3, 0.0)])
    >>> prediction = predictor.update(t=0.0, position=(0.0, 0.0))
    >>> for tick in range(20):
    ...     output = guidance.update(t=0.005 * tick, position=(0.0, 0.0), velocity=(0.2, 0.1), prediction=prediction)
    >>> output.status.value, output.agreement
    ('guiding', 1.0)
    """

    def __init__(self, config: Config | None = None) -> None:
        self.config = _check_config(config)
        self._state = GuidanceState()

    def __repr__(self) -> str:
        """Say mode and force."""
        return f'<Guidance of mode {self.config.guidance.mode}, force {np.hypot(*self._state.force):.3g} N>'

    def update(
        self,
        t: float,
        position: ArrayLike,
        velocity: ArrayLike,
        prediction: types.Prediction | None,
        acceleration: ArrayLike = (0.0, 0.0),
    ) -> GuidanceOutput:
        """Return the guidance for a hand.

        Parameters
        ----------
        t : float
            Time, by the clock of the predictions [s].
        position : array_like of shape (2,)
            Position of the hand [m].
        velocity : array_like of shape (2,)
            Velocity of the hand [m/s].
        prediction : Prediction or None
            The newest prediction; None to release the hand.
        acceleration : array_like of shape (2,), optional
            Acceleration of the hand [m/s^2]; zero if not given, and then the force does not yield to it.

        Returns
        -------
        GuidanceOutput
            The force, and what it was computed from.

        Raises
        ------
        InputError
            For a time that is not after the last one, a number that is not finite or a wrong shape. Nothing is changed then.
        """
        time = check_number('t', t, -LATEST_S, LATEST_S)
        if self._state.energy is not None and time <= self._state.t:
            raise InputError('t', f'a time after the last one, {self._state.t:.9g} s', t)
        if prediction is not None and not isinstance(prediction, types.Prediction):
            raise InputError('prediction', 'a Prediction or None', repr(prediction))
        age_s = 0.0 if prediction is None else time - prediction.t
        place, motion, change = (
            check_vector(name, value, 2)
            for name, value in (('position', position), ('velocity', velocity), ('acceleration', acceleration))
        )
        given = GuidanceInput(time, place, motion, prediction, 0.0, age_s, acceleration=change)
        output, self._state = guide(self.config, self._state, given)
        return output

    def reset(self) -> None:
        """Forget everything: the force begins at zero, the tank is full. The next update may have any time."""
        self._state = GuidanceState()


class Predictor:
    """Predict where a moving hand is going.

    A predictor follows one hand: it filters its positions, detects where movements begin, and starts every prediction from the
    previous one.

    Parameters
    ----------
    config : Config, optional
        Parameters; the defaults if not given. `rate_hz` and the timeouts have no effect here: every update predicts. `budget_s`
        holds by the clock as in the node; with 0 the answers do not depend on the machine.
    library : path or sequence of demonstrations, optional
        Demonstrated paths that `foc_ros replay --learn` wrote; by default the file that `homotopy.library` names.

    Examples
    --------
    >>> import foc_ros
    >>> predictor = foc_ros.Predictor(foc_ros.Config(budget_s=0.0))
    >>> predictor.set_goals([(0.3, 0.0)])
    >>> predictor.set_obstacles([foc_ros.Circle((0.15, 0.01), radius=0.03, name='cup')])
    >>> prediction = predictor.update(t=0.0, position=(0.0, 0.0))
    >>> prediction
    <Prediction t=0 s, 2 candidates, most likely goal0:-cup (0.65)>
    >>> [candidate.label for candidate in prediction.candidates]
    ['goal0:-cup', 'goal0:+cup']
    """

    def __init__(self, config: Config | None = None, library: str | Path | Sequence[Demonstration] | None = None) -> None:
        self.config = _check_config(config)
        source = self.config.homotopy.library if library is None else library
        if isinstance(source, (str, Path)):
            from foc_ros.io.class_library import load_library

            source = load_library(str(source))
        self._library = make_library(tuple(source))
        if self.config.budget_s:
            warm_up(self.config)  # imports are no part of the time of the first update
        self._goals: types.Array | None = None
        self._goal_heights: types.Array | None = None
        self._obstacles = ObstacleSource(make_obstacles(), None, '')
        self._hand: FilterState | None = None
        self._memory = Memory()

    def __repr__(self) -> str:
        """Count goals and obstacles."""
        goals = 0 if self._goals is None else len(self._goals)
        return f'<Predictor with {goals} goals, {len(self._obstacles.obstacles)} obstacles>'

    def set_goals(self, goals: ArrayLike) -> None:
        """Replace the goals.

        Parameters
        ----------
        goals : array_like of shape (g, 2) or (g, 3)
            Positions [m], at least one, in the plane or also with the height over it. Labels number them in this order. If they
            have heights, the height of the hand is predicted. `SceneError` is raised for anything else.
        """
        has_heights = _find_shape(goals)[1:] == (SPACE,)
        points = check_array('goals', goals, (None, SPACE if has_heights else PLANE))
        if not len(points):
            raise SceneError('goals', 'at least one position', 'none')
        self._goals, self._goal_heights = points[:, :PLANE], points[:, PLANE] if has_heights else None

    def set_obstacles(self, obstacles: Iterable[Shape] | Obstacles) -> None:
        """Replace the obstacles. Their positions hold at the next update; from then on each moves on at its velocity.

        Parameters
        ----------
        obstacles : iterable of Circle, Box, Capsule and Hull, or Obstacles
            The obstacles, none for a free scene. `SceneError` is raised if a name occurs twice.
        """
        self._obstacles = ObstacleSource(collect_obstacles(obstacles), None, '')

    def update(self, t: float, position: ArrayLike) -> Prediction:
        """Take the next hand position and predict from it.

        A gap of more than `estimator.gap_s` since the last update restarts the movement: the hand is then taken to be at rest.

        Parameters
        ----------
        t : float
            Time of the measurement [s].
        position : array_like of shape (2,) or (3,)
            Position of the hand [m], in the plane, and with the height over it if the goals have heights.

        Returns
        -------
        Prediction
            The prediction for this time.

        Raises
        ------
        SceneError
            If no goals were set.
        InputError
            For a time that is not after the last one, a number that is not finite or a wrong shape. Nothing is changed then.
            Also for a position that jumps: the next one decides whether it was an outlier, or the movement restarts there.
        """
        stamp_ns = round(check_number('t', t, -LATEST_S, LATEST_S) * NANOSECONDS)
        point = check_vector('position', position, PLANE if self._goal_heights is None else SPACE)
        height = 0.0 if self._goal_heights is None else float(point[PLANE])
        sample = HandSample(stamp_ns, point[:PLANE], height, self.config.frame_id)
        if self._goals is None:
            raise SceneError('goals', 'at least one, by set_goals', 'none')
        updated = update(self._hand, sample, self.config.estimator)
        if updated.status is SampleStatus.JUMPED:
            assert self._hand is not None
            error, self._hand = describe_jump('position', self._hand, sample, self.config.estimator), updated.state
            raise error
        if updated.status is SampleStatus.RESTARTED_BACKWARD or not updated.status.is_taken:
            last = '' if self._hand is None else f', {self._hand.stamp_ns / NANOSECONDS:.9g} s'
            raise InputError('t', f'a time after the last one{last}', t)
        if updated.status.is_restart:
            self._memory = self._memory.forget()
        self._hand = updated.state
        if self._obstacles.stamp_ns is None:
            self._obstacles = replace(self._obstacles, stamp_ns=stamp_ns)
        obstacles = self._obstacles.at(stamp_ns)
        deadline = Deadline(self.config.budget_s or None)
        known = self._memory, self._library, deadline, self._goal_heights
        prediction, self._memory = predict(self.config, self._hand, obstacles, self._goals, *known)
        return Prediction(**vars(prediction))

    def reset(self) -> None:
        """Forget the movement; keep goals and obstacles. The next update may have any time."""
        self._hand, self._memory = None, self._memory.forget()


@dataclass(frozen=True, eq=False, repr=False)
class Solution(types.Solution):
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
        from foc_ros.reporting.views import parse_label

        _, sides = parse_label(self.label, self.obstacles.ids)
        candidate = Candidate(self.label, 0, tuple(sides.items()), self.path, 0.0)
        return plot_candidates([PredictedCandidate(candidate, self, {}, 0.0, 1.0)], axes)


def solve(
    start: ArrayLike,
    goal: ArrayLike,
    obstacles: Iterable[Shape] | Obstacles = (),
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
    goal : array_like of shape (2,)
        Position at which the hand comes to rest [m].
    obstacles : iterable of Circle, Box, Capsule and Hull, or Obstacles
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
    (51, 2)
    """
    target, config = check_vector('goal', goal, 2), _fix_parameters(config, eta, strategy, duration_s)
    scene = _build_scene(start, target[None], obstacles, config)
    if guess is not None:
        from foc_ros.io.scene_file import guess_path

        points = check_array('guess', guess, (None, 2))
        scene = replace(scene, guess=guess_path(scene.hand.mean[:2], target, config.foc.steps, via=points))
    candidates = _solve(scene)
    if not candidates:
        raise SceneError('scene', 'a path between the obstacles from the start to the goal', 'none')
    solution = candidates[0].solution
    assert isinstance(solution, Solution)
    return solution


def solve_classes(
    start: ArrayLike,
    goal: ArrayLike,
    obstacles: Iterable[Shape] | Obstacles = (),
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
    goal : array_like of shape (2,) or (g, 2)
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
    <PredictedCandidate goal0:-0, solved, likelihood 0.66>
    <PredictedCandidate goal0:+0, solved, likelihood 0.34>
    """
    goals = check_array('goal', np.atleast_2d(np.asarray(goal, dtype=object)).tolist(), (None, 2))
    return _solve(_build_scene(start, goals, obstacles, _fix_parameters(config, eta, strategy, duration_s)))


def _build_scene(start: ArrayLike, goals: types.Array, obstacles: Iterable[Shape] | Obstacles, config: Config) -> ReachingScene:
    expected = 'a position (2,) or a state (6,) x, y, vx, vy, ax, ay'
    size = _find_shape(start)
    if size not in ((2,), (6,)):
        raise SceneError('start', expected, f'{start!r} of shape {size}')
    state, table = np.zeros(6), collect_obstacles(obstacles)
    state[: size[0]] = check_vector('start', start, size[0])
    for name, point in (('start', state[:2]), *(('goal', goal) for goal in goals)):
        check_outside(name, point, table.grow(config.scene.hand_radius))
    return ReachingScene(HandState(0, state, np.zeros((6, 6))), goals, table, None, None, config)


def _fix_parameters(config: Config | None, eta: float | None, strategy: str | None, duration_s: float) -> Config:
    given = {'foc.eta': eta, 'foc.strategy': strategy, 'duration.fixed_s': duration_s, 'duration.model': 'fixed'}
    return _check_config(config).with_values({name: value for name, value in given.items() if value is not None})


def _find_shape(given: object) -> tuple[int, ...]:
    """Return the shape of anything that may be an array, without a check of its numbers."""
    return np.shape(np.asarray(given, dtype=object))


def _check_config(config: Config | None) -> Config:
    if not isinstance(config, (Config, type(None))):
        raise InputError('config', 'a Config', repr(config))
    return Config() if config is None else config


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
        For a solution without its problem, or a number of samples out of bounds.

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
    if not check_number('samples', samples, 1, MOST_SAMPLES).is_integer():
        raise InputError('samples', 'a whole number', samples)
    return sampling.monte_carlo(problem, solution.control.T.ravel(), int(samples), seed)


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
    shown = Prediction(0, '', 0.0, tuple(candidates), candidates[0].label, obstacles=solutions[0].obstacles, goals=goals)
    return shown.plot(axes)


def replay(recording: str | Path, config: Config | None = None, topics: Mapping[str, str] | None = None) -> Iterator[Prediction]:
    """Predict through a recording, in its own time.

    Parameters
    ----------
    recording : path
        A bag: MCAP or SQLite file, or its folder. `RecordingError` is raised if it cannot be read, and `FocWarning` issued if a
        part of it is missing.
    config : Config, optional
        Parameters; the defaults if not given.
    topics : mapping, optional
        Topic of each input by its name, where the recording uses others than the usual ones.

    Yields
    ------
    Prediction
        One for every hand pose that is due, in their order.
    """
    from foc_ros.analysis.replay import replay as replay_bag

    for prediction in replay_bag(recording, _check_config(config), topics):
        yield Prediction(**vars(prediction))


def load_config(file: str | Path) -> Config:
    """Return the configuration of a ROS 2 parameter file such as `foc.yaml`; parameters that it does not set keep their defaults.

    Raises
    ------
    ParameterError
        For an unknown parameter or a value out of bounds; it names the parameter, the value and the bound.
    RecordingError
        If the file cannot be read.
    """
    from foc_ros.ros.parameters import load_parameter_file

    return load_parameter_file(file)


def register_strategy(name: str, function: Callable[..., Any]) -> None:
    """Add a strategy, a new value of `foc.strategy`.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    function : callable
        ``function(problems, starts, settings, deadline)``, which returns a list of `StrategyResult`: see
        `foc_ros.core.ocp.strategies`.
    """
    _register(STRATEGIES, name, function)


def get_strategy(name: str) -> Callable[..., Any]:
    """Return a strategy by its name, for a strategy that builds on another one; `InputError` is raised for an unknown name."""
    strategy: Callable[..., Any] = STRATEGIES.get(name)
    return strategy


def compute_eta(problem: Problem, control: types.Array) -> float:
    """Return the eta that a stacked control (2N,) achieves: the smallest over all obstacles and times."""
    return problem.risk.find_probability(find_least_safety_factor(problem, control)[0])


def register_plant(name: str, factory: Callable[..., Any]) -> None:
    """Add a plant, a new value of `foc.plant`.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    factory : callable
        ``factory(settings)``, which returns a `PlantModel`; `settings` are the parameters of the group `foc`.

    Examples
    --------
    A hand whose control is its acceleration [m/s^2]:

    >>> import numpy as np
    >>> import foc_ros
    >>> def discretise(dt):
    ...     position, velocity = np.eye(2) * dt**2 / 2, np.eye(2) * dt
    ...     A = np.block([[np.eye(2), np.eye(2) * dt], [np.zeros((2, 2)), np.eye(2)]])
    ...     return foc_ros.Plant(A, np.vstack([position, velocity]), dt)
    >>> foc_ros.register_plant('double_integrator', lambda settings: foc_ros.PlantModel(discretise))
    >>> config = foc_ros.Config().with_values({'foc.plant': 'double_integrator'})
    >>> foc_ros.solve((0, 0), (0.3, 0), config=config).mean.shape
    (51, 4)
    """
    _register(PLANTS, name, factory)


def register_qp_backend(name: str, solver: Callable[..., Any]) -> None:
    """Add a QP solver, a new value of `foc.qp_backend`; the solvers of qpsolvers need no registration.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    solver : callable
        ``solver(qp)``, from a `foc_ros.core.ocp.backend.DenseQP` to an `Answer`.
    """
    _register(QP_BACKENDS, name, solver)


def register_likelihood_rule(name: str, function: Callable[..., Any]) -> None:
    """Add a likelihood rule, a new value of `likelihood.rule`.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    function : callable
        ``function(costs, config)``: from the costs (k,) of k classes and the parameters of the group `likelihood` to the
        logarithms (k,) of their weights, which need no normalisation.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.register_likelihood_rule('exponential', lambda costs, config: -config.beta * costs)
    """
    _register(LIKELIHOOD_RULES, name, function)


def _register(registry: Registry, name: str, part: Callable[..., Any]) -> None:
    if not callable(part):
        raise InputError(f'{registry.kind} {name}', 'a function', repr(part))
    registry.register(name, part)
