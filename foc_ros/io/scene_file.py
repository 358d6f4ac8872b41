# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A scene file (YAML or JSON) as one reaching problem, checked field by field.

Fields: start, goal or goals [m]; start_velocity [m/s], start_acceleration [m/s^2], start_stddev [m] (default 0); duration_s;
steps; noise [c_x, c_y] per step; eta, bound, risk, shortfall; strategy, with tau and lambda if it is `fixed`; hand_radius; plant,
plant_mass, plant_damping; obstacles: x, y, radius, radius_stddev, id, of boxes size and yaw, of hulls points instead of x, y;
guess; max_candidates.
A missing field has the default of its parameter.
"""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.config import Config, replace_values
from foc_ros.core.errors import FocError, ParameterError, SceneError, collect, collect_all, join_errors, suggest
from foc_ros.core.obstacles.shapes import Box, Hull
from foc_ros.core.scene import ReachingScene, check_outside
from foc_ros.core.types import Array, HandState, Obstacles, make_obstacles

from .documents import read_document

FARTHEST = 1e4
"""Bound of every length, velocity and acceleration of a scene, in SI units."""
MOST_OBSTACLES, MOST_GOALS, MOST_POINTS = 20_000, 256, 10_000
"""Bounds on the rows of a scene, those of the node's messages, and on the points of a guess."""
_ID = re.compile(r'-?\d{1,40}|[A-Za-z_][\w.]{0,39}')

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

STATE_FIELDS = ('start', 'start_velocity', 'start_acceleration', 'start_stddev')
FIELDS = (*STATE_FIELDS, 'goal', 'goals', 'noise', 'obstacles', 'guess', *PARAMETERS)
OBSTACLE_NUMBERS = {'x': -FARTHEST, 'y': -FARTHEST, 'radius': 0.0, 'radius_stddev': 0.0, 'yaw': -FARTHEST}
"""Fields of an obstacle that are numbers, with their lower bounds."""
OBSTACLE_FIELDS = (*OBSTACLE_NUMBERS, 'id', 'size', 'points')
_NUMERAL = re.compile(r'[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+')


def load_scene(file: Path | str) -> ReachingScene:
    """Read a scene file. Raises SceneError, naming field, value and bound, and RecordingError for an unreadable file."""
    return parse_scene(read_document(Path(file)))


def parse_scene(document: object) -> ReachingScene:
    """Return the scene of a document of mappings, lists and numbers; raises SceneError, with a note for every further error."""
    scene = _read_mapping('scene', document)
    errors = _find_unknown_fields('', scene, FIELDS)
    config = collect(errors, _read_config, scene)
    obstacles = collect(errors, _read_obstacles, scene.get('obstacles', []))
    hand, goals = collect(errors, _read_hand, scene), collect(errors, _read_goals, scene)
    guess = collect(errors, _read_guess, scene['guess']) if 'guess' in scene else None
    if config is None or obstacles is None or hand is None or goals is None or errors:
        raise join_errors(errors)
    start = hand.mean[:2]
    avoided, field = obstacles.grow(config.scene.hand_radius), 'goal' if 'goal' in scene else 'goals'
    collect_all(check_outside, [('start', start, avoided), *((field, goal, avoided) for goal in goals)])
    noise = np.array([config.foc.noise_x, config.foc.noise_y])
    if guess is None:
        return ReachingScene(hand, goals, obstacles, noise, None, config)
    if len(goals) > 1:
        raise SceneError('guess', 'one goal, which it leads to', f'{len(goals)} goals')
    return ReachingScene(hand, goals, obstacles, noise, guess_path(start, goals[0], config.foc.steps, *guess), config)


def guess_path(start: Array, goal: Array, steps: int, amplitude: float = 0.0, via: Array | None = None) -> Array:
    """Return positions at steps 0..N, (N + 1, 2) [m], from start (2,) to goal (2,), with the timing of a minimum-jerk movement.

    They are the share s = 10 r^3 - 15 r^4 + 6 r^5, r = k/N, along the straight line, plus amplitude sin(pi r) [m] to its left; or
    along the line through the points `via` (m, 2). If `via` has N + 1 points, it is returned as it is.
    """
    if via is not None and len(via) == steps + 1:
        return via
    ratio = np.arange(steps + 1) / steps
    progress = 10 * ratio**3 - 15 * ratio**4 + 6 * ratio**5
    if via is not None:
        points = np.vstack([start, via, goal])
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        return np.column_stack([np.interp(progress * length[-1], length, axis) for axis in points.T])
    direction = goal - start
    distance = float(np.hypot(*direction))
    if not distance:
        raise SceneError('guess', 'a goal away from the start', f'both at {start.tolist()}')
    left = np.array([-direction[1], direction[0]]) / distance
    path: Array = start + progress[:, None] * direction + amplitude * np.sin(np.pi * ratio)[:, None] * left
    return path


def _read_config(scene: Mapping[str, Any]) -> Config:
    """Return the parameters of the scene, checked against their own bounds under the names of the fields."""
    given = [(field, parameter, scene[field]) for field, parameter in PARAMETERS.items() if field in scene]
    if 'noise' in scene:
        x, y = _read_list('noise', scene['noise'], 2)
        given += [('noise', 'foc.noise_x', x), ('noise', 'foc.noise_y', y)]
    config, errors = replace_values(Config(), {'duration.model': 'fixed'}), []
    for field, parameter, value in given:
        try:
            config = replace_values(config, {parameter: _convert_numeral(value)})
        except ParameterError as error:
            errors.append(SceneError(field, error.expected, error.got))
    if not errors and config.foc.strategy != 'fixed':
        words = 'to be given with strategy fixed only', f'strategy {config.foc.strategy}'
        errors = [SceneError(field, *words) for field in ('tau', 'lambda') if field in scene]
    if errors:
        raise join_errors(errors)
    return config


def _read_hand(scene: Mapping[str, Any]) -> HandState:
    if 'start' not in scene:
        raise SceneError('start', 'two numbers', 'nothing')
    stddev = scene.get('start_stddev', 0.0)
    pair = stddev if isinstance(stddev, list) else [stddev, stddev]
    points = [(field, scene.get(field, [0.0, 0.0])) for field in STATE_FIELDS[:3]]
    *mean, deviations = collect_all(_read_point, [*points, ('start_stddev', pair, 0.0)])
    return HandState(0, np.ravel(mean), np.diag([*np.square(deviations), 0.0, 0.0, 0.0, 0.0]))


def _read_goals(scene: Mapping[str, Any]) -> Array:
    if ('goal' in scene) == ('goals' in scene):
        raise SceneError('goal', 'either goal or goals', 'both' if 'goal' in scene else 'neither')
    if 'goal' in scene:
        return np.array([_read_point('goal', scene['goal'])])
    goals = _read_points('goals', scene['goals'], MOST_GOALS)
    if not goals:
        raise SceneError('goals', 'at least one point', '[]')
    return np.array(goals)


def _read_obstacles(given: object) -> Obstacles:
    rows: dict[str, tuple[Array, Array, float, float]] = {}
    errors: list[FocError] = []
    for place, each in enumerate(_read_rows('obstacles', given, MOST_OBSTACLES)):
        row = collect(errors, _read_obstacle, place, each, rows)
        if row is not None:
            rows[row[0]] = row[1]
    if errors:
        raise join_errors(errors)
    centres, polygons, radii, stddevs = zip(*rows.values(), strict=True) if rows else ((), (), (), 0.0)
    return make_obstacles(centres, radii, stddevs, tuple(rows), polygons=polygons)


def _read_obstacle(place: int, given: object, before: Container[str]) -> tuple[str, tuple[Array, Array, float, float]]:
    """Return the id of an obstacle, which must differ from those before it, and its centre, polygon, radius and deviation."""
    field = f'obstacles[{place}]'
    obstacle = _read_mapping(field, given)
    errors = _find_unknown_fields(f'{field}.', obstacle, OBSTACLE_FIELDS)
    identity = collect(errors, _read_identity, f'{field}.id', obstacle.get('id', place), before)
    numbers = collect(errors, _read_obstacle_numbers, field, obstacle)
    if identity is None or numbers is None or errors:
        raise join_errors(errors)
    return identity, (*_read_polygon(field, obstacle, numbers), numbers['radius'], numbers['radius_stddev'])


def _read_obstacle_numbers(field: str, obstacle: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of an obstacle by field; those that it may lack are 0."""
    given = [name for name in OBSTACLE_NUMBERS if name in obstacle]
    numbers = collect_all(_read_number, [(f'{field}.{name}', obstacle[name], OBSTACLE_NUMBERS[name]) for name in given])
    return {'radius': 0.0, 'radius_stddev': 0.0, 'yaw': 0.0} | dict(zip(given, numbers, strict=True))


def _read_identity(field: str, identity: object, before: Container[str]) -> str:
    if type(identity) not in (int, str) or not _ID.fullmatch(str(identity)):
        expected = 'a whole number, or a name of letters, digits, _ and ., of at most 40 characters'
        raise SceneError(field, expected, reprlib.repr(identity))
    if str(identity) in before:
        raise SceneError(field, 'another id than the obstacles before it', reprlib.repr(identity))
    return str(identity)


def _read_polygon(field: str, obstacle: Mapping[str, Any], numbers: Mapping[str, float]) -> tuple[Array, Array]:
    """Return centre and polygon, as `Obstacles` has them: a hull where there are points, a box where there is a size.

    numbers: those of the obstacle, by field.
    """
    kind = next((name for name in ('points', 'size') if name in obstacle), 'radius')
    needed, unused = {'points': ((), 'xy'), 'size': ('xy', ''), 'radius': (('x', 'y', 'radius'), ('yaw',))}[kind]
    errors = [SceneError(f'{field}.{name}', 'a number', 'nothing') for name in needed if name not in obstacle]
    errors += [
        SceneError(f'{field}.{name}', 'to be given with a size, and without points', reprlib.repr(obstacle[name]))
        for name in (*unused, *(('size', 'yaw') if kind == 'points' else ()))
        if name in obstacle
    ]
    if errors:
        raise join_errors(errors)
    centre, radius = np.array([numbers.get(axis, 0.0) for axis in 'xy']), numbers['radius']
    if kind == 'radius':
        return centre, np.zeros((1, 2))
    points = _read_points(f'{field}.points', obstacle['points']) if kind == 'points' else []
    size = _read_point(f'{field}.size', obstacle['size'], 0.0) if kind == 'size' else []
    try:
        shape = Box(centre, size, numbers['yaw'], radius) if kind == 'size' else Hull(points, radius)
    except SceneError as error:
        raise SceneError(error.field.replace('obstacle.', f'{field}.', 1), error.expected, error.got) from error
    return np.array(shape.centre), shape.polygon


def _read_guess(given: object) -> tuple[float, Array | None]:
    """Return amplitude [m] and points of a guess, as `guess_path` takes them."""
    if isinstance(given, list):
        return 0.0, np.array(_read_points('guess', given)).reshape(-1, 2)
    mapping = _read_mapping('guess', given)
    if errors := _find_unknown_fields('guess.', mapping, ('amplitude', 'kind')):
        raise join_errors(errors)
    if 'amplitude' not in mapping:
        raise SceneError('guess.amplitude', 'a number', 'nothing')
    return _read_number('guess.amplitude', mapping['amplitude']), None


def _read_mapping(field: str, value: object) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise SceneError(field, 'a mapping of fields', reprlib.repr(value))
    return value


def _find_unknown_fields(prefix: str, fields: Mapping[str, Any], known: tuple[str, ...]) -> list[FocError]:
    """Return an error for each unknown field."""
    names = ', '.join(known)
    return [
        SceneError(f'{prefix}{str(name)[:40]}', f'a known field{suggest(name, known) or f": {names}"}', reprlib.repr(value))
        for name, value in fields.items()
        if name not in known
    ]


def _read_list(field: str, value: object, length: int) -> list[Any]:
    if not isinstance(value, list) or len(value) != length:
        raise SceneError(field, f'a list of {length} numbers', reprlib.repr(value))
    return value


def _read_rows(field: str, value: object, most: int) -> list[Any]:
    if not isinstance(value, list):
        raise SceneError(field, 'a list', reprlib.repr(value))
    if len(value) > most:
        raise SceneError(field, f'a list of at most {most}', f'one of {len(value)}')
    return value


def _read_point(field: str, value: object, low: float = -FARTHEST) -> list[float]:
    return [_read_number(field, each, low) for each in _read_list(field, value, 2)]


def _read_points(field: str, value: object, most: int = MOST_POINTS) -> list[list[float]]:
    points = _read_rows(field, value, most)
    return collect_all(_read_point, [(f'{field}[{row}]', point) for row, point in enumerate(points)])


def _read_number(field: str, value: object, low: float = -FARTHEST) -> float:
    number = _convert_numeral(value)
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not low <= number <= FARTHEST:
        raise SceneError(field, f'a number in [{low:g}, {FARTHEST:g}]', reprlib.repr(value))
    return float(number)


def _convert_numeral(value: object) -> object:
    """Convert a text such as '1e6' to a number: YAML 1.1 does not take it for one; 1e400 is none."""
    is_numeral = isinstance(value, str) and _NUMERAL.fullmatch(value) is not None
    return float(value) if is_numeral and math.isfinite(float(value)) else value  # type: ignore[arg-type]
