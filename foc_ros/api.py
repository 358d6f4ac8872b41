# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public Python API for a moving hand: `Predictor`, `Guidance`, `replay`; `foc_ros` exports all of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core import prediction as core_prediction
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.config import Config
from foc_ros.core.deadline import Deadline
from foc_ros.core.errors import FocError, InputError, SceneError, warn
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, guide
from foc_ros.core.hand.kalman import describe_jump
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.shapes import Shape, collect_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.scene import list_missing_objects
from foc_ros.core.solution import Goal
from foc_ros.core.support import check_config, check_number, check_vector, collect_goals, find_shape
from foc_ros.core.types import NANOSECONDS, HandSample, SampleStatus
from foc_ros.prediction import Prediction

LATEST_S = 9e9
"""Bound on a time [s]: stamps are 64-bit numbers of nanoseconds."""
PLANE, SPACE = 2, 3
"""Number of coordinates of a position in the task plane, and of one with its height over the plane."""


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
        self.config = check_config(config)
        self._state = GuidanceState()

    def __repr__(self) -> str:
        """Say mode and force."""
        return f'<Guidance of mode {self.config.guidance.mode}, force {np.hypot(*self._state.force):.3g} N>'

    def update(
        self,
        t: float,
        position: ArrayLike,
        velocity: ArrayLike,
        prediction: core_prediction.Prediction | None,
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
        if prediction is not None and not isinstance(prediction, core_prediction.Prediction):
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

    A predictor follows one hand: it filters its positions, detects where movements begin, starts every prediction from the
    previous one, and learns from the operator's movements, as the node and replays do.

    Parameters
    ----------
    config : Config, optional
        Parameters; the defaults if not given. `rate_hz` and the timeouts have no effect here: every update predicts. `budget_s`
        holds by the clock as in the node; with 0 the answers do not depend on the machine.
    library : path or sequence of demonstrations, optional
        Demonstrated paths that `foc_ros learn` or `foc_ros replay --learn` wrote; by default the file that `homotopy.library`
        names. They count in their frame, or in any if the config names no `frame_id`. `FocWarning` is issued if none can.

    Examples
    --------
    >>> import foc_ros
    >>> predictor = foc_ros.Predictor(foc_ros.Config(budget_s=0.0))
    >>> predictor.set_goals([(0.3, 0.0)])
    >>> predictor.set_obstacles([foc_ros.Circle((0.15, 0.01), radius=0.03, name='cup')])
    >>> prediction = predictor.update(t=0.0, position=(0.0, 0.0))
    >>> prediction
    <Prediction t=0 s, 2 candidates, most likely goal0: right of cup (0.64)>
    >>> [candidate.label for candidate in prediction.candidates]
    ['goal0:-cup', 'goal0:+cup']
    """

    def __init__(self, config: Config | None = None, library: str | Path | Sequence[Demonstration] | None = None) -> None:
        self.config = check_config(config)
        source: object = self.config.homotopy.library if library is None else library
        self._library = str(source) if isinstance(source, (str, Path)) else 'library'
        if isinstance(source, (str, Path)):
            from foc_ros.io.class_library import load_library

            source = load_library(str(source))
        if not isinstance(source, Sequence) or not all(isinstance(each, Demonstration) for each in source):
            raise InputError('library', 'a file, or demonstrations', repr(library))
        self._pipeline = Pipeline(self.config, tuple(source), is_timed=False)
        self._obstacles: Obstacles | None = make_obstacles()
        self._goal_names: tuple[str, ...] = ()
        self._missing: set[object] = set()

    def __repr__(self) -> str:
        """Count goals and obstacles."""
        scene = self._pipeline.scene
        goals = 0 if scene.goals is None else len(scene.goals)
        waiting = self._obstacles
        obstacles = sum(len(each.obstacles) for each in scene.sources.values()) if waiting is None else len(waiting)
        return f'<Predictor with {goals} goals, {obstacles} obstacles>'

    @property
    def adapted_config(self) -> Config:
        """The parameters with which the next prediction is made: those given, adapted to the operator."""
        return self._pipeline.adapted_config

    def set_goals(self, goals: ArrayLike | Goal | Iterable[Goal | ArrayLike]) -> None:
        """Replace the goals.

        Parameters
        ----------
        goals : array_like of shape (g, 2) or (g, 3), or iterable of Goal and positions
            Positions [m], at least one, in the plane or also with the height over it. Labels number them in this order. If they
            have heights, the height of the hand is predicted. One goal needs no list: three numbers are a position with a height.
            An update issues `FocWarning` if the object of a `Goal` is no obstacle.
            `SceneError` is raised for anything else, for heights of some goals only, and for a name that occurs twice.
        """
        table = collect_goals('goals', goals)
        self._goal_names = table.names
        self._pipeline.set_goals(table.positions, self._pipeline.frame_id or '', table.heights, table.objects)

    def set_obstacles(self, obstacles: Iterable[Shape] | Shape | Obstacles) -> None:
        """Replace the obstacles. Their positions hold at the next update; from then on each moves on at its velocity.

        Parameters
        ----------
        obstacles : iterable of Circle, Box, Capsule and Hull, or one of them, or Obstacles
            The obstacles, none for a free scene. `SceneError` is raised if a name occurs twice.
        """
        self._obstacles = collect_obstacles(obstacles)

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
        pipeline, before = self._pipeline, self._pipeline.hand_state
        goals, heights = pipeline.scene.goals, pipeline.scene.goal_heights
        if heights is not None and find_shape(position) != (SPACE,):
            raise SceneError('position', 'x, y and the height, because the goals have heights', repr(position))
        point = check_vector('position', position, PLANE if heights is None else SPACE)
        if goals is None:
            raise SceneError('goals', 'at least one, by set_goals', 'none')
        if before is not None and stamp_ns <= before.stamp_ns:
            raise InputError('t', f'a time after the last one, {before.stamp_ns / NANOSECONDS:.9g} s', t)
        frame_id = pipeline.frame_id or ''
        sample = HandSample(stamp_ns, point[:PLANE], 0.0 if heights is None else float(point[PLANE]), frame_id)
        if self._obstacles is not None:
            pipeline.set_obstacles('shapes', self._obstacles, stamp_ns, frame_id)
        if pipeline.add_hand_sample(sample) is SampleStatus.JUMPED:
            assert before is not None
            raise describe_jump('position', before, sample, self.config.estimator)
        self._obstacles = None
        doubt, prediction = pipeline.library_doubt, pipeline.predict(Deadline(self.config.budget_s or None))
        if prediction is None:
            raise FocError(str(pipeline.last_refusal))
        if pipeline.library_doubt and pipeline.library_doubt != doubt:
            warn(f'{self._library}: {pipeline.library_doubt}')
        self._warn_of_missing_objects(prediction.obstacles)
        named = prediction.with_goal_names(self._goal_names) if self._goal_names else prediction
        return Prediction(**vars(named))

    def _warn_of_missing_objects(self, obstacles: Obstacles) -> None:
        """Warn of the object of a goal that is no obstacle, unless it was none at the last update, too."""
        missing = list_missing_objects(self._pipeline.scene.goal_objects, obstacles)
        before, self._missing = self._missing, {each.got for each in missing}
        for each in missing:
            if each.got not in before:
                warn(str(each))

    def reset(self) -> None:
        """Forget the movement and the operator; keep goals and obstacles, where they are. The next update may have any time."""
        hand = self._pipeline.hand_state
        if self._obstacles is None and hand is not None:
            self._obstacles = self._pipeline.scene.obstacles(hand.stamp_ns)
        self._pipeline.remove_source('shapes')
        self._pipeline.reset()


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
    from foc_ros.analysis.replay import Replay
    from foc_ros.io.bags import BagReader

    with BagReader(recording, topics) as reader:
        for step in Replay(check_config(config)).steps(reader):
            if step.prediction is not None:
                yield Prediction(**vars(step.prediction))


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
