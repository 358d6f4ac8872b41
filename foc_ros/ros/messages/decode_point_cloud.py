# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of a sensor_msgs/PointCloud2 as a table of obstacles: one row each, with x, y, z, radius and optional columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.polygons import tabulate_boxes
from foc_ros.core.types import Array

from .decode_poses import MAX_COORDINATE, Place, decode_stamp, stay
from .plane import NO_TRANSFORM, Transform, lift, make_heights, project

REQUIRED = ('x', 'y', 'z', 'radius')
COLUMNS = (*REQUIRED, 'radius_stddev', 'vx', 'vy', 'vz', 'size_x', 'size_y', 'yaw', 'size_z')
IDENTITY = 'id'
MAX_ROWS = 20_000
"""Largest number of obstacles in one message, or kept from markers."""

_LOWEST = np.array([[0.0 if name.startswith(('radius', 'size')) else -MAX_COORDINATE] for name in COLUMNS])
_DTYPES = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}
"""numpy's name of each sensor_msgs/PointField datatype."""


@dataclass(frozen=True)
class DecodedCloud:
    """Obstacles of one message; stamp_ns: 0 if unstamped; dropped: rows left out, by reason (`not_finite`, `duplicate_id`)."""

    obstacles: Obstacles
    stamp_ns: int
    frame_id: str
    dropped: Mapping[str, int]


def decode_point_cloud(message: Any, plane: str, place: Place = stay) -> DecodedCloud:
    """Decode the obstacles of a PointCloud2 and project them onto the task plane; a cloud without rows is an empty scene.

    An obstacle is a circle, or a box with rounded corners if its `size_x` or `size_y` is larger than 0. `size_z` is its full
    length along the normal of the plane; the height of an obstacle without it, or that moves along the normal, is not known.

    Coordinates, sizes and radii are floats of 4 or 8 bytes, `id` is an integer of any size (without it, the row number is the
    id), in either byte order, organised or not; other fields are skipped. A row with a number that is not finite is dropped and
    counted; of several rows with one id the last is used. Raises MessageError if the layout does not fit the data, a field is
    missing or of the wrong type, a radius, size or deviation is negative, a row with the fields of a box has neither size nor
    radius, a number is beyond MAX_COORDINATE, or a transform tilts sizes out of the plane, or turns boxes without a yaw.
    """
    stamp_ns = decode_stamp(message.header)
    frame_id, transform = place(message.header)
    table = read_table(message)
    if not len(table):
        return DecodedCloud(make_obstacles(), stamp_ns, frame_id, {})
    columns = _read_columns(table)
    if transform is not NO_TRANSFORM:
        _transform(columns, table.dtype.names or (), transform, plane)
    is_finite = np.logical_and.reduce(np.isfinite(columns))
    is_box = not {'size_x', 'size_y', 'yaw'}.isdisjoint(table.dtype.names or ())
    _check_numbers(columns, is_finite, is_box)
    rows = np.flatnonzero(is_finite)
    identities = table[IDENTITY] if IDENTITY in (table.dtype.names or ()) else np.arange(len(table))
    latest = dict(zip(identities[rows].tolist(), rows.tolist(), strict=True))
    kept = sorted(latest.items(), key=itemgetter(1))
    dropped = {'not_finite': len(table) - len(rows), 'duplicate_id': len(rows) - len(kept)}
    x_y_z, (radius, radius_stddev), v_xyz, box, (size_z,) = np.split(columns[:, [row for _, row in kept]], (3, 5, 8, 11))
    ids = tuple(str(identity) for identity, _ in kept)
    (centre, height), (velocity, climb) = project(x_y_z.T, plane), project(v_xyz.T, plane)
    heights = make_heights(height, np.where(climb == 0.0, size_z, 0.0))
    obstacles = make_obstacles(centre, radius, radius_stddev, ids, velocity, heights=heights)
    if is_box:
        vertices, corners = tabulate_boxes(box[:2].T, box[2])
        obstacles = replace(obstacles, vertices=vertices, corners=corners)
    return DecodedCloud(obstacles, stamp_ns, frame_id, {reason: count for reason, count in dropped.items() if count})


def read_table(message: Any) -> NDArray[np.void]:
    """Return the rows (n,) as a structured array with the columns of COLUMNS and `id` that the message has."""
    data, rows, width = message.data, int(message.height) * int(message.width), int(message.width)
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
    layout = _read_layout(message, step)
    octets = np.array(data, dtype=np.uint8) if isinstance(data, list) else np.frombuffer(data, dtype=np.uint8)
    lines = octets.reshape(int(message.height), row_step)[:, : width * step]
    return np.ascontiguousarray(lines).view(layout).reshape(rows)


def _read_layout(message: Any, step: int) -> np.dtype[np.void]:
    names = [str(field.name) for field in message.fields]
    for name in REQUIRED:
        if name not in names:
            raise MessageError('fields', f'a field {name} (needed are {", ".join(REQUIRED)})', ', '.join(names) or 'no fields')
    order, members = '>' if message.is_bigendian else '<', {}
    for field in message.fields:
        name, dtype = str(field.name), _DTYPES.get(int(field.datatype), ' ')
        if name not in (*COLUMNS, IDENTITY):
            continue
        if dtype[0] not in ('iu' if name == IDENTITY else 'f'):
            raise MessageError(f'fields[{name}].datatype', 'an integer (1-6)' if name == IDENTITY else '7 or 8', field.datatype)
        if int(field.count) not in (0, 1):
            raise MessageError(f'fields[{name}].count', '1', field.count)
        if name in members:
            raise MessageError('fields', f'one field {name}', names.count(name))
        if int(field.offset) + int(dtype[1]) > step:
            raise MessageError(f'fields[{name}].offset', f'{dtype[1]} bytes inside point_step {step}', field.offset)
        members[name] = (order + dtype, int(field.offset))
    formats, offsets = zip(*members.values(), strict=True)
    return np.dtype({'names': list(members), 'formats': list(formats), 'offsets': list(offsets), 'itemsize': step})


def _read_columns(table: NDArray[np.void]) -> Array:
    """Return the numbers of the rows, (12, n), in the order of COLUMNS; columns that the message does not have are 0."""
    columns = np.zeros((len(COLUMNS), len(table)))
    with np.errstate(invalid='ignore'):  # numpy warns of a signalling NaN, whose row is dropped like that of any other NaN
        for name in table.dtype.names or ():
            if name != IDENTITY:
                columns[COLUMNS.index(name)] = table[name]
    return columns


def _transform(columns: Array, names: tuple[str, ...], transform: Transform, plane: str) -> None:
    """Transform the columns of a message with some names in place: positions, velocities and the yaw of boxes."""
    rotation, sizes = transform.rotation, [name for name in ('size_x', 'size_y', 'size_z') if name in names]
    if sizes:
        tilt = float(np.abs(project((rotation @ lift(np.eye(2), 0.0, plane).T).T, plane)[1]).max())
        if tilt > 1e-3:
            wanted = 'boxes that the transform leaves in the task plane'
            raise MessageError(f'fields[{sizes[0]}]', wanted, f'a tilt of {tilt:.3g}')
    with np.errstate(invalid='ignore', over='ignore'):  # rows that are not finite are dropped
        if {'size_x', 'size_y'} & set(sizes):
            if 'yaw' not in names:
                raise MessageError('fields', 'a field yaw, because the transform turns the boxes', ', '.join(names))
            yaw = columns[COLUMNS.index('yaw')]
            axis = project(lift(np.column_stack([np.cos(yaw), np.sin(yaw)]), 0.0, plane) @ rotation.T, plane)[0]
            yaw[:] = np.arctan2(axis[:, 1], axis[:, 0])
        columns[:3] = transform.apply(columns[:3].T).T
        columns[5:8] = rotation @ columns[5:8]


def _check_numbers(columns: Array, is_finite: NDArray[np.bool_], is_box: bool) -> None:
    """Raise MessageError for a number out of its bounds, and where boxes are possible, for a row without any extent."""
    is_wrong = ((columns < _LOWEST) | (columns > MAX_COORDINATE)) & is_finite
    if is_wrong.any():
        column, row = np.argwhere(is_wrong)[0]
        name, value = COLUMNS[column], columns[column, row]
        unit = 'm/s' if name.startswith('v') else 'rad' if name == 'yaw' else 'm'
        raise MessageError(f'{name}[{row}]', f'a number in [{_LOWEST[column, 0]:g}, {MAX_COORDINATE:g}] {unit}', f'{value:g}')
    is_empty = (columns[[COLUMNS.index(name) for name in ('radius', 'size_x', 'size_y')]] == 0.0).all(axis=0) & is_finite
    for row in np.flatnonzero(is_empty & is_box)[:1]:
        raise MessageError(f'radius[{row}]', 'a number > 0 m where size_x and size_y are 0', 0)
