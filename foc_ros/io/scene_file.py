# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A scene file (YAML or JSON) as one reaching problem: the fields that are declared here, and those that are parameters.

A missing field has the default of its parameter.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag, ValidationError

from foc_ros.core.classes.guess import guess_path
from foc_ros.core.config import Config, replace_values
from foc_ros.core.errors import FocError, ParameterError, SceneError, collect, collect_all, join_errors, warn
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import TURN
from foc_ros.core.obstacles.shapes import Box, Circle, Hull, Shape, collect_obstacles
from foc_ros.core.scene import ReachingScene
from foc_ros.core.solution import Goal
from foc_ros.core.support import FARTHEST, GoalTable, collect_goals
from foc_ros.core.types import HandState

from .documents import read_document
from .fields import Fields, describe_errors

MOST_OBSTACLES, MOST_GOALS = 20_000, 256
"""Bounds on the rows of a scene, those of the node's messages."""
FASTEST = 10.0
"""Mean speed [m/s] beyond which a scene is probably not in metres and seconds."""

PARAMETERS = {
    'duration_s': 'duration.fixed_s',
    'steps': 'foc.steps',
    'eta': 'foc.eta',
    'bound': 'foc.bound',
    'risk': 'foc.risk',
    'shortfall': 'likelihood.shortfall',
    'strategy': 'foc.strategy',
    'tau': 'foc.tau',
    'lambda': 'foc.lam',
    'plant': 'foc.plant',
    'plant_mass': 'foc.plant_mass',
    'plant_damping': 'foc.plant_damping',
    'max_candidates': 'homotopy.max_candidates',
    'hand_radius': 'scene.hand_radius',
}
"""Fields that are parameters, with their bounds."""

Number = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
Length = Annotated[float, Field(ge=0.0, le=FARTHEST)]
Point = Annotated[tuple[Number, Number], Strict(False)]
Points = Annotated[list[Point], Field(max_length=10_000)]
Identity = Annotated[
    str,
    BeforeValidator(lambda given: str(given) if type(given) is int and abs(given) < 10**40 else given),
    Field(pattern=r'^(-?\d{1,40}|[A-Za-z_][\w.]{0,39})$'),
]
"""Name of an obstacle: a whole number, or letters, digits, _ and ., of at most 40 characters."""


class CircleFields(Fields):
    """An obstacle [m]; id: by default its position in the list."""

    x: Number
    y: Number
    radius: Length
    radius_stddev: Length = 0.0
    id: Identity = ''

    def build(self) -> Shape:
        """Return the obstacle."""
        return Circle((self.x, self.y), self.radius, self.radius_stddev, name=self.id)


class BoxFields(CircleFields):
    """An obstacle of full lengths [m] at an angle [rad], rounded by its radius; a capsule where one length is 0."""

    radius: Length = 0.0
    size: Annotated[tuple[Length, Length], Strict(False)]
    yaw: Number = 0.0

    def build(self) -> Shape:
        """Return the obstacle."""
        return Box((self.x, self.y), self.size, self.yaw, self.radius, self.radius_stddev, name=self.id)


class HullFields(Fields):
    """An obstacle that is the convex hull of points [m], rounded by its radius."""

    points: Points
    radius: Length = 0.0
    radius_stddev: Length = 0.0
    id: Identity = ''

    def build(self) -> Shape:
        """Return the obstacle."""
        return Hull(self.points, self.radius, self.radius_stddev, name=self.id)


class GoalFields(Fields):
    """A goal [m]; name: what answers call it; object: id of the obstacle that it is, which does not block the paths to it."""

    position: Point
    name: Annotated[str, Field(min_length=1, max_length=80)] | None = None
    object: Identity | None = None


class BulgeFields(Fields):
    """A guess that passes to the left of the straight line, by the amplitude [m] half way."""

    amplitude: Number
    kind: Any = None


def _find_kind(obstacle: Any) -> str | None:
    kinds = {'points': '(hull)', 'size': '(box)', 'x': '(circle)', 'y': '(circle)'}
    given = obstacle if isinstance(obstacle, Mapping) else {'x'}
    return next((kind for field, kind in kinds.items() if field in given), None)


def _list_or(tag: str) -> Discriminator:
    return Discriminator(lambda given: '(list)' if isinstance(given, list) else tag)


AnyObstacle = Annotated[
    Annotated[CircleFields, Tag('(circle)')] | Annotated[BoxFields, Tag('(box)')] | Annotated[HullFields, Tag('(hull)')],
    Discriminator(
        _find_kind,
        custom_error_type='no_shape',
        custom_error_message='x, y and radius of a circle, x, y and size of a box, or points: two for a capsule, more for a hull',
    ),
]
AnyGoal = Annotated[Annotated[Point, Tag('(list)')] | Annotated[GoalFields, Tag('(goal)')], _list_or('(goal)')]
AnyGuess = Annotated[Annotated[Points, Tag('(list)')] | Annotated[BulgeFields, Tag('(guess)')], _list_or('(guess)')]
LengthOrPair = Annotated[
    Annotated[tuple[Length, Length], Strict(False), Tag('(list)')] | Annotated[Length, Tag('(number)')], _list_or('(number)')
]


class SceneFields(Fields):
    """The fields of a scene that are no parameters: positions, velocities and so on [m, m/s, m/s^2]; goal or goals.

    noise: c per step along x and y; guess: the path whose class alone is solved, as its points or its bulge.
    """

    start: Point
    start_velocity: Point = (0.0, 0.0)
    start_acceleration: Point = (0.0, 0.0)
    start_stddev: LengthOrPair = 0.0
    goal: AnyGoal | None = None
    goals: Annotated[list[AnyGoal], Field(min_length=1, max_length=MOST_GOALS)] | None = None
    noise: Annotated[tuple[Any, Any], Strict(False)] | None = None
    obstacles: Annotated[list[AnyObstacle], Field(max_length=MOST_OBSTACLES, default_factory=list)]
    guess: AnyGuess | None = None

    def build_hand(self) -> HandState:
        """Return the state of the hand at the start."""
        mean = np.ravel([self.start, self.start_velocity, self.start_acceleration])
        deviations = np.broadcast_to(np.asarray(self.start_stddev), 2)
        return HandState(0, mean, np.diag([*np.square(deviations), 0.0, 0.0, 0.0, 0.0]))

    def build_goals(self) -> GoalTable:
        """Return the goals; raises SceneError."""
        if (self.goal is None) == (self.goals is None):
            raise SceneError('goal', 'either goal or goals', 'neither' if self.goal is None else 'both')
        given = self.goals or ([] if self.goal is None else [self.goal])
        rows = [Goal(each.position, each.name, each.object) if isinstance(each, GoalFields) else each for each in given]
        return collect_goals('goals', rows)

    def build_obstacles(self) -> Obstacles:
        """Return the obstacles; raises SceneError, with a note for every further error."""
        return collect_obstacles(collect_all(_build_shape, enumerate(self.obstacles)))


KINDS: dict[str, type[Fields]] = {
    '(circle)': CircleFields,
    '(box)': BoxFields,
    '(hull)': HullFields,
    '(goal)': GoalFields,
    '(guess)': BulgeFields,
}
NAMES = {'': [*SceneFields.model_fields, *PARAMETERS]} | {tag: [*kind.model_fields] for tag, kind in KINDS.items()}
"""Names of the fields of a scene, and of the mappings in it by their tags."""


def load_scene(file: Path | str) -> ReachingScene:
    """Read a scene file. Raises SceneError, naming field, value and bound, and RecordingError for an unreadable file."""
    return parse_scene(read_document(Path(file)))


def parse_scene(document: object) -> ReachingScene:
    """Return the scene of a document of mappings, lists and numbers; raises SceneError, with a note for every further error."""
    if not isinstance(document, dict):
        raise SceneError('scene', 'a mapping of fields', reprlib.repr(document))
    errors: list[FocError] = []
    config, fields = collect(errors, _read_config, document), collect(errors, _read_fields, document)
    obstacles = None if fields is None else collect(errors, fields.build_obstacles)
    table = None if fields is None else collect(errors, fields.build_goals)
    if config is None or fields is None or obstacles is None or table is None:
        raise join_errors(errors)
    noise = None if fields.noise is None else np.array([config.foc.noise_x, config.foc.noise_y])
    scene = ReachingScene(fields.build_hand(), table.positions, obstacles, noise, None, config, table.names, table.objects)
    scene.check()
    _doubt_units(scene, fields.obstacles)
    if fields.guess is None:
        return scene
    if len(scene.goals) > 1:
        raise SceneError('guess', 'one goal, which it leads to', f'{len(scene.goals)} goals')
    bulge = fields.guess.amplitude if isinstance(fields.guess, BulgeFields) else 0.0
    via = None if isinstance(fields.guess, BulgeFields) else np.array(fields.guess).reshape(-1, 2)
    return scene.with_guess(guess_path(scene.hand.mean[:2], scene.goals[0], config.foc.steps, bulge, via))


def _read_config(scene: Mapping[str, Any]) -> Config:
    """Return the parameters of the scene, checked against their own bounds under the names of the fields."""
    given = [(field, parameter, scene[field]) for field, parameter in PARAMETERS.items() if field in scene]
    if isinstance(noise := scene.get('noise'), list) and len(noise) == 2:
        given += [('noise', f'foc.noise_{axis}', value) for axis, value in zip('xy', noise, strict=True)]
    config, errors = replace_values(Config(), {'duration.model': 'fixed'}), []
    for field, parameter, value in given:
        try:
            config = replace_values(config, {parameter: value})
        except ParameterError as error:
            errors.append(SceneError(field, error.expected, error.got))
    if not errors and config.foc.strategy != 'fixed':
        words = 'to be given with strategy fixed only', f'strategy {config.foc.strategy}'
        errors = [SceneError(field, *words) for field in ('tau', 'lambda') if field in scene]
    if errors:
        raise join_errors(errors)
    return config


def _read_fields(scene: Mapping[str, Any]) -> SceneFields:
    try:
        return SceneFields.model_validate({name: value for name, value in scene.items() if name not in PARAMETERS})
    except ValidationError as invalid:
        errors = [SceneError(*each) for each in describe_errors(invalid, NAMES)]
    raise join_errors(errors)


def _doubt_units(scene: ReachingScene, obstacles: Sequence[CircleFields | HullFields]) -> None:
    """Warn of numbers that are probably not in metres, seconds and radians."""
    farthest = max(math.dist(scene.hand.mean[:2], goal) for goal in scene.goals)
    if farthest > FASTEST * scene.duration_s:
        warn(f'goal: {farthest:g} m away, to be reached in {scene.duration_s:g} s: lengths are in metres, and times in seconds')
    for row, each in enumerate(obstacles):
        if isinstance(each, BoxFields) and abs(each.yaw) > TURN:
            warn(f'obstacles[{row}].yaw: {each.yaw:g} is more than a turn: angles are in radians')


def _build_shape(row: int, given: CircleFields | BoxFields | HullFields) -> Shape:
    try:
        return given.build()
    except SceneError as error:
        raise SceneError(error.field.replace('obstacle', f'obstacles[{row}]', 1), error.expected, error.got) from error
