"""The messages that the page sends, as checked records. No field of them names a file, a topic or a parameter."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from foc_ros.core.errors import InputError, SceneError
from foc_ros.core.support import check_number

from .scene import BOUNDS, MOST_GOALS, MOST_OBSTACLES, PlayScene, Point, make_box, make_circle

LONGEST_MESSAGE = 65_536
"""Bytes of a message, at most."""
LATEST_MS = 1e10
"""Bound on the page's clock, which begins when the page is opened [ms]."""
SIZES = (0.002, 0.3)
"""Bounds on radii and lengths of obstacles [m]."""
MOST_TRIALS = 200
LARGEST_SEED = 2**31 - 1
ASSISTANCE = ('mixed', 'with', 'without')
"""Trials with guidance: half of them in random order, all, none."""
PARAMETERS = ('standard', 'mine')
JOBS = ('report', 'fit', 'compare')


@dataclass(frozen=True)
class HandMessage:
    """The hand at a time of the page's clock [ms]; event_ms: of the input that moved it, None if it did not move."""

    t_ms: float
    position: Point
    event_ms: float | None


@dataclass(frozen=True)
class SceneMessage:
    """A new scene."""

    scene: PlayScene


@dataclass(frozen=True)
class ShuffleMessage:
    """Random obstacles, by a seed."""

    seed: int


@dataclass(frozen=True)
class GuidanceMessage:
    """Whether the hand is guided."""

    is_on: bool


@dataclass(frozen=True)
class RecordMessage:
    """Begin or end a recording without tasks."""

    is_on: bool


@dataclass(frozen=True)
class TasksMessage:
    """Begin tasks.

    seed: of all random choices; assistance: one of ASSISTANCE; is_blinded: without predictions on the page; is_shuffled: with new
    obstacles in every trial.
    """

    trials: int
    seed: int
    assistance: str
    is_blinded: bool
    is_shuffled: bool


@dataclass(frozen=True)
class StopMessage:
    """End the tasks."""


@dataclass(frozen=True)
class ParametersMessage:
    """Predict with one of PARAMETERS."""

    name: str


@dataclass(frozen=True)
class JobMessage:
    """Begin one of JOBS."""

    name: str


Message = (
    HandMessage
    | SceneMessage
    | ShuffleMessage
    | GuidanceMessage
    | RecordMessage
    | TasksMessage
    | StopMessage
    | ParametersMessage
    | JobMessage
)


def parse_message(text: str | bytes) -> Message:
    """Return the message in a text of JSON; raises InputError, which names field, value and bound."""
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError('message', 'JSON', repr(text)) from error
    if not isinstance(given, dict):
        raise InputError('message', 'an object', repr(given))
    kind = _read_choice(given, 'type', tuple(_PARSERS))
    return _PARSERS[kind](given)


def _check_fields(given: object, name: str, fields: Collection[str]) -> Mapping[str, Any]:
    """Return an object that has exactly the given fields, besides `type`."""
    if not isinstance(given, dict):
        raise InputError(name, 'an object', repr(given))
    for field in fields:
        if field not in given:
            raise InputError(f'{name}.{field}', 'a value', 'none')
    for field in given:
        if field not in fields and field != 'type':
            raise InputError(name, f'the fields {", ".join(fields) or "none"}', repr(field))
    return given


def _read_choice(given: Mapping[str, Any], field: str, choices: Collection[str]) -> str:
    value = given.get(field)
    if not isinstance(value, str) or value not in choices:
        raise InputError(field, f'one of {", ".join(choices)}', repr(value))
    return value


def _read_flag(given: Mapping[str, Any], field: str) -> bool:
    if not isinstance(given[field], bool):
        raise InputError(field, 'true or false', repr(given[field]))
    return bool(given[field])


def _read_whole(given: Mapping[str, Any], field: str, low: int, high: int) -> int:
    value = given[field]
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError(field, f'a whole number in [{low}, {high}]', repr(value))
    return value


def _read_point(given: Mapping[str, Any], name: str) -> Point:
    low_x, high_x, low_y, high_y = BOUNDS
    return check_number(f'{name}.x', given['x'], low_x, high_x), check_number(f'{name}.y', given['y'], low_y, high_y)


def _parse_hand(given: Mapping[str, Any]) -> HandMessage:
    _check_fields(given, 'hand', ('t', 'x', 'y', 'event'))
    event = given['event']
    t_ms = check_number('hand.t', given['t'], 0.0, LATEST_MS)
    event_ms = None if event is None else check_number('hand.event', event, 0.0, LATEST_MS)
    return HandMessage(t_ms, _read_point(given, 'hand'), event_ms)


def _parse_scene(given: Mapping[str, Any]) -> SceneMessage:
    _check_fields(given, 'scene', ('obstacles', 'goals'))
    rows = {}
    for name, least, most in (('obstacles', 0, MOST_OBSTACLES), ('goals', 1, MOST_GOALS)):
        rows[name] = given[name]
        if not isinstance(rows[name], list) or not least <= len(rows[name]) <= most:
            got = len(rows[name]) if isinstance(rows[name], list) else repr(rows[name])
            raise SceneError(name, f'a list of {least} to {most}', got)
    obstacles = tuple(_parse_obstacle(each, f'obstacles[{row}]') for row, each in enumerate(rows['obstacles']))
    goals = tuple(
        _read_point(_check_fields(each, f'goals[{row}]', ('x', 'y')), f'goals[{row}]') for row, each in enumerate(rows['goals'])
    )
    return SceneMessage(PlayScene(obstacles, goals))


def _parse_obstacle(given: object, name: str) -> Any:
    if not isinstance(given, dict):
        raise InputError(name, 'an object', repr(given))
    if _read_choice(given, 'kind', ('circle', 'box')) == 'circle':
        _check_fields(given, name, ('kind', 'x', 'y', 'radius'))
        return make_circle(_read_point(given, name), check_number(f'{name}.radius', given['radius'], *SIZES))
    _check_fields(given, name, ('kind', 'x', 'y', 'size_x', 'size_y', 'yaw'))
    lengths = [check_number(f'{name}.{field}', given[field], *SIZES) for field in ('size_x', 'size_y')]
    return make_box(_read_point(given, name), lengths, check_number(f'{name}.yaw', given['yaw'], -math.pi, math.pi))


def _parse_shuffle(given: Mapping[str, Any]) -> ShuffleMessage:
    return ShuffleMessage(_read_whole(_check_fields(given, 'shuffle', ('seed',)), 'seed', 0, LARGEST_SEED))


def _parse_tasks(given: Mapping[str, Any]) -> TasksMessage:
    _check_fields(given, 'tasks', ('trials', 'seed', 'assistance', 'blinded', 'shuffled'))
    return TasksMessage(
        _read_whole(given, 'trials', 1, MOST_TRIALS),
        _read_whole(given, 'seed', 0, LARGEST_SEED),
        _read_choice(given, 'assistance', ASSISTANCE),
        _read_flag(given, 'blinded'),
        _read_flag(given, 'shuffled'),
    )


def _parse_switch(record: Callable[[bool], Message]) -> Callable[[Mapping[str, Any]], Message]:
    return lambda given: record(_read_flag(_check_fields(given, 'message', ('on',)), 'on'))


def _parse_name(record: Callable[[str], Message], choices: Collection[str]) -> Callable[[Mapping[str, Any]], Message]:
    return lambda given: record(_read_choice(_check_fields(given, 'message', ('name',)), 'name', choices))


def _parse_empty(message: Message) -> Callable[[Mapping[str, Any]], Message]:
    def parse(given: Mapping[str, Any]) -> Message:
        _check_fields(given, 'message', ())
        return message

    return parse


_PARSERS: dict[str, Callable[[Mapping[str, Any]], Message]] = {
    'hand': _parse_hand,
    'scene': _parse_scene,
    'shuffle': _parse_shuffle,
    'guidance': _parse_switch(GuidanceMessage),
    'record': _parse_switch(RecordMessage),
    'tasks': _parse_tasks,
    'stop': _parse_empty(StopMessage()),
    'parameters': _parse_name(ParametersMessage, PARAMETERS),
    'job': _parse_name(JobMessage, JOBS),
}
