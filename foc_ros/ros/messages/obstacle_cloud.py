"""A sensor_msgs/PointCloud2 read as a table of obstacles, one row each: x, y, z, radius and optional columns."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import MessageError
from foc_ros.core.types import Array, Obstacles, make_obstacles

from .inputs import MAX_COORDINATE, stamp_of
from .plane import project

REQUIRED = ('x', 'y', 'z', 'radius')
OPTIONAL = ('radius_stddev', 'vx', 'vy', 'vz')
COLUMNS = (*REQUIRED, *OPTIONAL)
IDENTITY = 'id'
MAX_ROWS = 20_000
"""Obstacles in one message, or held from markers; more is no scene a hand moves in."""

_LEAST = np.array([[0.0 if name.startswith('radius') else -MAX_COORDINATE] for name in COLUMNS])
_KINDS = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}
"""numpy's name of each sensor_msgs/PointField datatype."""


@dataclass(frozen=True)
class CloudScene:
    """Obstacles as one message gives them.

    stamp_ns: 0 where unstamped; dropped: rows left out, by reason (`not_finite`, `duplicate_id`).
    """

    obstacles: Obstacles
    stamp_ns: int
    frame_id: str
    dropped: dict[str, int]


def cloud_obstacles(message: Any, plane: str) -> CloudScene:
    """Return the obstacles of a PointCloud2, projected onto the task plane.

    Coordinates and radii are floats of either size, `id` is an integer of any size (else the row number names the obstacle), in
    either byte order, organised or not; other fields are skipped. No rows: an empty scene. A row with a number that is not finite
    is dropped and counted; of rows with one id the last holds. Raises MessageError where the layout does not fit the data, a
    field is missing or of the wrong type, a radius or deviation is negative, or a number is beyond MAX_COORDINATE.
    """
    stamp_ns, frame_id = stamp_of(message.header), str(message.header.frame_id)
    table = _table(message)
    if not len(table):
        return CloudScene(make_obstacles(), stamp_ns, frame_id, {})
    columns = _columns(table)
    finite = np.logical_and.reduce(np.isfinite(columns))
    _check(columns, finite)
    rows = np.flatnonzero(finite)
    kept = _last_of_each(table[IDENTITY] if IDENTITY in (table.dtype.names or ()) else np.arange(len(table)), rows)
    dropped = {'not_finite': len(table) - len(rows), 'duplicate_id': len(rows) - len(kept)}
    obstacles = _obstacles(columns, kept, plane)
    return CloudScene(obstacles, stamp_ns, frame_id, {reason: count for reason, count in dropped.items() if count})


def _table(message: Any) -> NDArray[np.void]:
    """Return the rows (n,) as a structured array over the message's bytes, with the columns that matter."""
    data, rows, width = _bytes(message.data), int(message.height) * int(message.width), int(message.width)
    if rows > MAX_ROWS:
        raise MessageError('height * width', f'at most {MAX_ROWS} obstacles', rows)
    step = int(message.point_step)
    row_step = int(message.row_step) if message.height > 1 else width * step
    expected = int(message.height) * row_step
    if len(data) != expected or row_step < width * step:
        size = f'{message.height} rows of row_step {message.row_step} and {width} points of point_step {step}'
        raise MessageError('data', f'{max(expected, rows * step)} bytes ({size})', len(data))
    if not rows:
        return np.empty(0, dtype=[])
    layout = _layout(message, step)
    lines = data.reshape(int(message.height), row_step)[:, : width * step]
    return np.ascontiguousarray(lines).view(layout).reshape(rows)


def _layout(message: Any, step: int) -> np.dtype[np.void]:
    names = [str(field.name) for field in message.fields]
    for name in REQUIRED:
        if name not in names:
            raise MessageError('fields', f'a field {name} (needed are {", ".join(REQUIRED)})', ', '.join(names) or 'no fields')
    order, members = '>' if message.is_bigendian else '<', {}
    for field in message.fields:
        name, kind = str(field.name), _KINDS.get(int(field.datatype), '')
        if name not in (*REQUIRED, *OPTIONAL, IDENTITY):
            continue
        wanted = 'iu' if name == IDENTITY else 'f'
        if not kind or kind[0] not in wanted:
            raise MessageError(f'fields[{name}].datatype', 'an integer (1-6)' if name == IDENTITY else '7 or 8', field.datatype)
        if int(field.count) not in (0, 1):
            raise MessageError(f'fields[{name}].count', '1', field.count)
        if name in members:
            raise MessageError('fields', f'one field {name}', names.count(name))
        if int(field.offset) + int(kind[1]) > step:
            raise MessageError(f'fields[{name}].offset', f'{kind[1]} bytes inside point_step {step}', field.offset)
        members[name] = (order + kind, int(field.offset))
    formats, offsets = zip(*members.values(), strict=True)
    return np.dtype({'names': list(members), 'formats': list(formats), 'offsets': list(offsets), 'itemsize': step})


def _columns(table: NDArray[np.void]) -> Array:
    """Return the numbers of the rows as COLUMNS (8, n); optional ones that are absent are 0."""
    columns = np.zeros((len(COLUMNS), len(table)))
    with np.errstate(invalid='ignore'):  # a signalling NaN is a NaN like others; its row is left out later
        for name in table.dtype.names or ():
            if name != IDENTITY:
                columns[COLUMNS.index(name)] = table[name]
    return columns


def _check(columns: Array, finite: NDArray[np.bool_]) -> None:
    wrong = ((columns < _LEAST) | (columns > MAX_COORDINATE)) & finite
    if wrong.any():
        column, row = np.argwhere(wrong)[0]
        name, value = COLUMNS[column], columns[column, row]
        unit = 'm/s' if name.startswith('v') else 'm'
        raise MessageError(f'{name}[{row}]', f'a number in [{_LEAST[column, 0]:g}, {MAX_COORDINATE:g}] {unit}', f'{value:g}')


def _last_of_each(identities: NDArray[Any], rows: NDArray[np.intp]) -> dict[str, int]:
    """Return the last of the given rows for each identity, in the order of the table."""
    latest = dict(zip(identities[rows].tolist(), rows.tolist(), strict=True))
    return {str(identity): row for identity, row in sorted(latest.items(), key=itemgetter(1))}


def _obstacles(columns: Array, kept: dict[str, int], plane: str) -> Obstacles:
    x_y_z, (radius, radius_stddev), velocity = np.split(columns[:, list(kept.values())], (3, 5))
    return make_obstacles(project(x_y_z.T, plane)[0], radius, radius_stddev, tuple(kept), project(velocity.T, plane)[0])


def _bytes(data: Any) -> NDArray[np.uint8]:
    if not len(data) or isinstance(data, list):
        return np.array(data, dtype=np.uint8)
    return np.frombuffer(data, dtype=np.uint8)
