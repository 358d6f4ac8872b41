"""A scene file (YAML or JSON) to one reaching problem, checked field by field.

Fields: start, goal or goals [m]; start_velocity [m/s], start_acceleration [m/s^2], start_stddev [m] (default 0); duration_s;
steps; noise [c_x, c_y], per step as it is; eta; strategy, with tau and lambda where it is `fixed`; obstacles: x, y, radius,
radius_stddev, id; guess; max_candidates. What is not given keeps the default of the parameter of that name.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.config import Config, updated
from foc_ros.core.errors import ParameterError, SceneError
from foc_ros.core.types import Array, HandState, Obstacles, Record, make_obstacles

from .documents import read_document
from .guess import guess_path

FARTHEST = 1e4
"""Bound on every length, velocity and acceleration of a scene, in SI units."""

PARAMETERS = {
    'duration_s': 'duration.fixed_s',
    'steps': 'foc.steps',
    'eta': 'foc.eta',
    'strategy': 'foc.strategy',
    'tau': 'foc.tau',
    'lambda': 'foc.lam',
    'max_candidates': 'homotopy.max_candidates',
}
"""Fields that are parameters, with their bounds."""

STATE_FIELDS = ('start', 'start_velocity', 'start_acceleration', 'start_stddev')
FIELDS = (*STATE_FIELDS, 'goal', 'goals', 'noise', 'obstacles', 'guess', *PARAMETERS)
OBSTACLE_FIELDS = ('x', 'y', 'radius', 'radius_stddev', 'id')
_NUMERAL = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+')


@dataclass(frozen=True, eq=False)
class SceneFile(Record):
    """One reaching problem.

    hand: where it starts; goals (g, 2) [m]; obstacles; noise (2,): c per step; guess (N + 1, 2) [m]: the only class to be solved,
    None where classes are searched; config: the parameters that the file sets, the others at their defaults.
    """

    hand: HandState
    goals: Array
    obstacles: Obstacles
    noise: Array
    guess: Array | None
    config: Config

    @property
    def duration_s(self) -> float:
        """Duration of the movement [s]."""
        return self.config.duration.fixed_s


def load_scene(file: Path | str) -> SceneFile:
    """Read a scene file. Raises SceneError, naming field, value and bound, and RecordingError for a file that cannot be read."""
    return parse_scene(read_document(Path(file)))


def parse_scene(document: object) -> SceneFile:
    """Return the scene that a document of mappings, lists and numbers describes; raises SceneError."""
    scene = _mapping('scene', document, FIELDS)
    config = _config(scene)
    obstacles = _obstacles(scene.get('obstacles', []))
    hand, goals = _hand(scene), _goals(scene)
    _outside('start', hand.mean[:2], obstacles)
    for goal in goals:
        _outside('goal' if 'goal' in scene else 'goals', goal, obstacles)
    noise = np.array([config.foc.noise_x, config.foc.noise_y])
    guess = _guess(scene['guess'], hand.mean[:2], goals, config.foc.steps) if 'guess' in scene else None
    return SceneFile(hand, goals, obstacles, noise, guess, config)


def _config(scene: Mapping[str, Any]) -> Config:
    """Return the parameters the scene sets, checked against their own bounds under the scene's names."""
    given = {parameter: (field, scene[field]) for field, parameter in PARAMETERS.items() if field in scene}
    if 'noise' in scene:
        given |= dict(
            zip(('foc.noise_x', 'foc.noise_y'), (('noise', each) for each in _list('noise', scene['noise'], 2)), strict=True)
        )
    config = updated(Config(), {'duration.model': 'fixed'})
    for parameter, (field, value) in given.items():
        try:
            config = updated(config, {parameter: value if field == 'strategy' else _numeral(value)})
        except ParameterError as error:
            raise SceneError(field, error.expected, error.got) from error
    for field in ('tau', 'lambda'):
        if field in scene and config.foc.strategy != 'fixed':
            raise SceneError(field, 'to be given with strategy fixed only', f'strategy {config.foc.strategy}')
    return config


def _hand(scene: Mapping[str, Any]) -> HandState:
    if 'start' not in scene:
        raise SceneError('start', 'two numbers', 'nothing')
    rest = [0.0, 0.0]
    velocity, acceleration = scene.get('start_velocity', rest), scene.get('start_acceleration', rest)
    mean = [*_point('start', scene['start']), *_point('start_velocity', velocity), *_point('start_acceleration', acceleration)]
    stddev = scene.get('start_stddev', 0.0)
    pair = _list('start_stddev', stddev, 2) if isinstance(stddev, list) else [stddev, stddev]
    variance = [_number('start_stddev', each, 0.0) ** 2 for each in pair]
    return HandState(0, np.array(mean), np.diag([*variance, 0.0, 0.0, 0.0, 0.0]))


def _goals(scene: Mapping[str, Any]) -> Array:
    if ('goal' in scene) == ('goals' in scene):
        raise SceneError('goal', 'either goal or goals', 'both' if 'goal' in scene else 'neither')
    if 'goal' in scene:
        return np.array([_point('goal', scene['goal'])])
    goals = _list('goals', scene['goals'])
    if not goals:
        raise SceneError('goals', 'at least one point', '[]')
    return np.array([_point(f'goals[{row}]', goal) for row, goal in enumerate(goals)])


def _obstacles(given: object) -> Obstacles:
    rows: dict[str, list[float]] = {}
    for place, each in enumerate(_list('obstacles', given)):
        field = f'obstacles[{place}]'
        obstacle = _mapping(field, each, OBSTACLE_FIELDS)
        for needed in ('x', 'y', 'radius'):
            if needed not in obstacle:
                raise SceneError(f'{field}.{needed}', 'a number', 'nothing')
        identity = obstacle.get('id', place)
        if isinstance(identity, bool) or not re.fullmatch(r'-?\d+|[A-Za-z_][\w.]*', str(identity)):
            raise SceneError(f'{field}.id', 'a whole number or a name of letters, digits, _ and .', reprlib.repr(identity))
        if str(identity) in rows:
            raise SceneError(f'{field}.id', 'another id than the obstacles before it', reprlib.repr(identity))
        stddev = _number(f'{field}.radius_stddev', obstacle.get('radius_stddev', 0.0), 0.0)
        position = [_number(f'{field}.{axis}', obstacle[axis]) for axis in ('x', 'y')]
        rows[str(identity)] = [*position, _number(f'{field}.radius', obstacle['radius'], 0.0), stddev]
    table = np.array(list(rows.values())).reshape(-1, 4)
    return make_obstacles(table[:, :2], table[:, 2], table[:, 3], tuple(rows))


def _guess(given: object, start: Array, goals: Array, steps: int) -> Array:
    if len(goals) > 1:
        raise SceneError('guess', 'one goal, which it leads to', f'{len(goals)} goals')
    if isinstance(given, list):
        points = np.array([_point(f'guess[{row}]', point) for row, point in enumerate(given)]).reshape(-1, 2)
        return guess_path(start, goals[0], steps, via=points)
    mapping = _mapping('guess', given, ('amplitude', 'kind'))
    if 'amplitude' not in mapping:
        raise SceneError('guess.amplitude', 'a number', 'nothing')
    return guess_path(start, goals[0], steps, amplitude=_number('guess.amplitude', mapping['amplitude']))


def _outside(field: str, point: Array, obstacles: Obstacles) -> None:
    for name, centre, radius in zip(obstacles.ids, obstacles.centre, obstacles.radius, strict=True):
        distance = float(np.hypot(*(point - centre)))
        if distance < radius:
            found = f'{point.tolist()}, {distance:.4g} m from its centre'
            raise SceneError(field, f'a point outside obstacle {name}, of radius {radius:g} m', found)


def _mapping(field: str, value: object, known: tuple[str, ...]) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise SceneError(field, 'a mapping of fields', reprlib.repr(value))
    for name in value:
        if name not in known:
            raise SceneError(field, f'only the fields {", ".join(known)}', reprlib.repr(name))
    return value


def _list(field: str, value: object, length: int | None = None) -> list[Any]:
    if not isinstance(value, list) or len(value) != (len(value) if length is None else length):
        raise SceneError(field, 'a list' if length is None else f'a list of {length} numbers', reprlib.repr(value))
    return value


def _point(field: str, value: object) -> list[float]:
    return [_number(field, each) for each in _list(field, value, 2)]


def _number(field: str, value: object, low: float = -FARTHEST) -> float:
    number = _numeral(value)
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not low <= number <= FARTHEST:
        raise SceneError(field, f'a number in [{low:g}, {FARTHEST:g}]', reprlib.repr(value))
    return float(number)


def _numeral(value: object) -> object:
    """Read 1e6 as the number it is: YAML 1.1 takes it for a text."""
    return float(value) if isinstance(value, str) and _NUMERAL.fullmatch(value) else value
