"""The side on which a path really passes an obstacle: independent of how the path was found."""

from __future__ import annotations

import numpy as np

from foc_ros.foc.errors import SceneError
from foc_ros.foc.records import LEFT, RIGHT, Array, Obstacles

from .crossing import Complex


def swept_angles(path: Array, centres: Array) -> Array:
    """Angle that a path sweeps about each centre, anticlockwise positive.

    path (m, 2) [m], m >= 1; centres (n, 2), or (m, n, 2) where they move: the centre at each point of the path. Returns (n,)
    [rad]: the sum of the signed angles between neighbouring points, so it is exact where no step turns by pi or more about a
    centre.
    """
    return swept_seen(_relative(path, centres))


def path_sides(path: Array, obstacles: Obstacles, centres: Array | None = None) -> dict[str, int]:
    """Side on which a path passes each obstacle, by id.

    path (m, 2) [m]; centres (m, n, 2): where the obstacles are at each point of the path, if they move. A path that sweeps
    clockwise about a centre has it on its right, so it passes on the left: LEFT; else RIGHT. An obstacle is passed when the
    foot of its centre on the chord from the first to the last point lies strictly between the two (seen from the obstacle,
    where it moves), or when the path winds about it by more than half a turn; obstacles behind the hand or beyond the end are
    not.
    """
    relative = _relative(path, obstacles.centre if centres is None else centres)
    if not len(obstacles):
        return {}
    swept = swept_seen(relative)
    chord = relative[-1] - relative[0]
    foot = -(relative[0] * chord.conj()).real
    passed = ((foot > 0.0) & (foot < np.abs(chord) ** 2)) | (np.abs(swept) > np.pi)
    return {obstacles.ids[i]: LEFT if swept[i] < 0.0 else RIGHT for i in np.flatnonzero(passed)}


def swept_seen(seen: Complex) -> Array:
    """Angle swept by the points of a path as seen from each centre, complex (m, n); returns (n,) [rad]."""
    turned: Array = np.angle(seen[1:] * seen[:-1].conj()).sum(axis=0)
    return turned


def _relative(path: Array, centres: Array) -> Complex:
    """Path as seen from each centre, complex (m, n)."""
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise SceneError('path', 'points (m, 2), m >= 1', f'an array {path.shape}')
    if centres.ndim == 3 and len(centres) != len(path):
        raise SceneError('centres', f'one row for each of the {len(path)} points', f'{len(centres)} rows')
    offset = path[:, None, :] - centres
    seen: Complex = offset[..., 0] + 1j * offset[..., 1]
    return seen
