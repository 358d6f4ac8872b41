# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of a sensor_msgs/PointCloud2 as a table of obstacles: one row each, with x, y, z, radius and optional columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.polygons import tabulate_boxes
from foc_ros.core.types import Array

from .decode_poses import MAX_COORDINATE, FrameLookup, decode_stamp, keep_frame
from .plane import NO_TRANSFORM, Transform, lift, make_heights, project

REQUIRED = ('x', 'y', 'z', 'radius')
COLUMNS = (*REQUIRED, 'radius_stddev', 'vx', 'vy', 'vz', 'size_x', 'size_y', 'yaw', 'size_z')
IDENTITY = 'id'
MAX_ROWS = 20_000
"""Largest number of obstacles in one message, or kept from markers."""
_DTYPES = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}
"""numpy's name of each sensor_msgs/PointField datatype."""
Columns = dict[str, Array]
"""The numbers (n,) of all COLUMNS by name; 0 where the message has none."""


@dataclass(frozen=True)
class DecodedCloud:
    """Obstacles of one message; stamp_ns: 0 if unstamped; dropped: rows left out, by reason (`not_finite`, `duplicate_id`)."""

    obstacles: Obstacles
    stamp_ns: int
    frame_id: str
    dropped: Mapping[str, int]


def decode_point_cloud(message: Any, plane: str, look_up: FrameLookup = keep_frame) -> DecodedCloud:
    """Decode the obstacles of a PointCloud2 and project them onto the task plane; a cloud without rows is an empty scene.

    An obstacle is a circle, or a box with rounded corners if its `size_x` or `size_y` is larger than 0. The height of an obstacle
    without `size_z`, or that moves along the normal, is not known. Coordinates, sizes and radii are floats of 4 or 8 bytes, `id`
    is an integer of any size (without it, the row number is the id), in either byte order, organised or not; other fields are
    skipped. A row with a number that is not finite is dropped and counted; of several rows with one id the last is used. Raises
    MessageError if the layout does not fit the data, a field is missing or of the wrong type, a radius, size or deviation is
    negative, a row with the fields of a box has neither size nor radius, a number is beyond MAX_COORDINATE, or a transform tilts
    sizes out of the plane, or turns boxes without a yaw.
    """
    stamp_ns = decode_stamp(message.header)
    frame_id, transform = look_up(message.header)
    table = read_table(message)
    given = set(table.dtype.names or ())
    with np.errstate(invalid='ignore'):  # numpy warns of a signalling NaN, whose row is dropped like that of any other NaN
        columns = {name: np.array(table[name], float) if name in given else np.zeros(len(table)) for name in COLUMNS}
    if transform is not NO_TRANSFORM:
        columns = _transform(columns, given, transform, plane)
    is_finite = np.logical_and.reduce([np.isfinite(column) for column in columns.values()])
    is_box = not given.isdisjoint(('size_x', 'size_y', 'yaw'))
    _check_numbers(columns, is_finite, is_box)
    rows = np.flatnonzero(is_finite)
    identities = table[IDENTITY] if IDENTITY in given else np.arange(len(table))
    latest = dict(zip(identities[rows].tolist(), rows.tolist(), strict=True))
    kept = np.array(sorted(latest.values()), dtype=np.intp)
    dropped = {'not_finite': len(table) - len(rows), 'duplicate_id': len(rows) - len(kept)}
    used = {name: column[kept] for name, column in columns.items()}
    centre, height = project(_stack(used, 'x', 'y', 'z'), plane)
    velocity, climb = project(_stack(used, 'vx', 'vy', 'vz'), plane)
    heights = make_heights(height, np.where(climb == 0.0, used['size_z'], 0.0))
    ids = tuple(map(str, identities[kept].tolist()))
    obstacles = make_obstacles(centre, used['radius'], used['radius_stddev'], ids, velocity, heights=heights)
    if is_box:
        vertices, corners = tabulate_boxes(_stack(used, 'size_x', 'size_y'), used['yaw'])
        obstacles = replace(obstacles, vertices=vertices, corners=corners)
    return DecodedCloud(obstacles, stamp_ns, frame_id, {reason: count for reason, count in dropped.items() if count})


def read_table(message: Any) -> NDArray[np.void]:
    """Return the rows (n,) as a structured array with the columns of COLUMNS and `id` that the message has."""
    data, rows, width = message.data, int(message.height) * int(message.width), int(message.width)
    if rows > MAX_ROWS:
        raise MessageError('height * width', f'at most {MAX_ROWS} obstacles', rows)
    step = int(message.point_step)
    is_plain = message.height < 2 and len(data) == rows * step  # a single line needs no row_step
    row_step = width * step if is_plain else int(message.row_step)
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


def _stack(columns: Columns, *names: str) -> Array:
    return np.column_stack([columns[name] for name in names])


def _transform(columns: Columns, given: set[str], transform: Transform, plane: str) -> Columns:
    rotation, sizes = transform.rotation, [name for name in ('size_x', 'size_y', 'size_z') if name in given]
    if sizes:
        tilt = float(np.abs(project(lift(np.eye(2), 0.0, plane) @ rotation.T, plane)[1]).max())
        if tilt > 1e-3:
            wanted = 'boxes that the transform leaves in the task plane'
            raise MessageError(f'fields[{sizes[0]}]', wanted, f'a tilt of {tilt:.3g}')
    is_box = not given.isdisjoint(('size_x', 'size_y'))
    if is_box and 'yaw' not in given:
        raise MessageError('fields', 'a field yaw, because the transform turns the boxes', ', '.join(sorted(given)))
    with np.errstate(invalid='ignore', over='ignore'):  # rows that are not finite are dropped
        moved = dict(zip(('x', 'y', 'z'), transform.apply(_stack(columns, 'x', 'y', 'z')).T, strict=True))
        moved |= zip(('vx', 'vy', 'vz'), rotation @ _stack(columns, 'vx', 'vy', 'vz').T, strict=True)
        if is_box:
            along = np.column_stack([np.cos(columns['yaw']), np.sin(columns['yaw'])])
            axis = project(lift(along, 0.0, plane) @ rotation.T, plane)[0]
            moved['yaw'] = np.arctan2(axis[:, 1], axis[:, 0])
    return columns | moved


def _check_numbers(columns: Columns, is_finite: NDArray[np.bool_], is_box: bool) -> None:
    for name, column in columns.items():
        low = 0.0 if name.startswith(('radius', 'size')) else -MAX_COORDINATE
        for row in np.flatnonzero(((column < low) | (column > MAX_COORDINATE)) & is_finite)[:1]:
            unit = 'm/s' if name.startswith('v') else 'rad' if name == 'yaw' else 'm'
            raise MessageError(f'{name}[{row}]', f'a number in [{low:g}, {MAX_COORDINATE:g}] {unit}', f'{column[row]:g}')
    is_empty = ~_stack(columns, 'radius', 'size_x', 'size_y').any(axis=1) & is_finite
    for row in np.flatnonzero(is_empty & is_box)[:1]:
        raise MessageError(f'radius[{row}]', 'a number > 0 m where size_x and size_y are 0', 0)
