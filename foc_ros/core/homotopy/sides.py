"""The side on which a path really passes an obstacle: independent of how the path was found."""

from __future__ import annotations

import numpy as np

from foc_ros.core.errors import SceneError
from foc_ros.core.kernels import Flags, Matrix, Tensor, Vector, compiled_exactly
from foc_ros.core.types import LEFT, RIGHT, Array, Obstacles

from .crossing import TURN, direction, straight


def compute_swept_angles(path: Array, centres: Array) -> Array:
    """Angle that a path sweeps about each centre, anticlockwise positive.

    path (m, 2) [m], m >= 1; centres (n, 2), or (m, n, 2) where they move: the centre at each point of the path. Returns (n,)
    [rad]: exact where no step turns by pi or more about a centre.
    """
    return sweep_angles(*_checked(path, centres))


def path_sides(path: Array, obstacles: Obstacles, centres: Array | None = None) -> dict[str, int]:
    """Side on which a path passes each obstacle, by id.

    path (m, 2) [m]; centres (m, n, 2): where the obstacles are at each point of the path, if they move. A path that sweeps
    clockwise about a centre has it on its right, so it passes on the left: LEFT; else RIGHT. An obstacle is passed when the
    foot of its centre on the chord from the first to the last point lies strictly between the two (seen from the obstacle,
    where it moves), or when the path winds about it by more than half a turn; obstacles behind the hand or beyond the end are
    not.
    """
    path, centres = _checked(path, obstacles.centre if centres is None else centres)
    angles = sweep_angles(path, centres)
    sides = zip(obstacles.ids, angles.tolist(), passed(path, centres, angles).tolist(), strict=True)
    return {identity: LEFT if angle < 0.0 else RIGHT for identity, angle, is_passed in sides if is_passed}


@compiled_exactly
def sweep_angles(path: Matrix, centres: Tensor) -> Vector:
    """Return the angle (n,) [rad] that a path (m, 2) sweeps about centres (m, n, 2), or (1, n, 2) where they stand still.

    It is the difference of the directions at the ends, and a turn for each crossing of the ray from the centre along -x.
    """
    m, n = len(path), centres.shape[1]
    angles = np.empty(n)
    for k in range(n):
        x, y = path[0, 0] - centres[0, k, 0], path[0, 1] - centres[0, k, 1]
        begins, before, turns = direction(complex(x, y)), complex(x, y), 0
        for t in range(1, m):
            at = min(t, len(centres) - 1)
            x, y = path[t, 0] - centres[at, k, 0], path[t, 1] - centres[at, k, 1]
            turns += straight(before, complex(x, y))
            before = complex(x, y)
        angles[k] = direction(before) - begins + TURN * turns
    return angles


@compiled_exactly
def is_same_class(angles: Vector, others: Vector) -> bool:
    """Tell whether two paths with the same ends, which sweep angles (n,) each, pass all centres on the same sides."""
    return bool((np.abs(angles - others) < np.pi).all())


@compiled_exactly
def passed(path: Matrix, centres: Tensor, angles: Vector) -> Flags:
    """Tell which centres (m, n, 2) or (1, n, 2) a path (m, 2) that sweeps angles (n,) about them passes."""
    flags = np.zeros(len(angles), np.bool_)
    for k in range(len(angles)):
        x, y = path[0, 0] - centres[0, k, 0], path[0, 1] - centres[0, k, 1]
        along_x, along_y = path[-1, 0] - centres[-1, k, 0] - x, path[-1, 1] - centres[-1, k, 1] - y
        foot = -(x * along_x + y * along_y)
        flags[k] = 0.0 < foot < along_x * along_x + along_y * along_y or abs(angles[k]) > np.pi
    return flags


def _checked(path: Array, centres: Array) -> tuple[Array, Array]:
    """Return a path (m, 2), and centres as (m, n, 2) or (1, n, 2), as the kernels take them."""
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise SceneError('path', 'points (m, 2), m >= 1', f'an array {path.shape}')
    if centres.ndim == 3 and len(centres) != len(path):
        raise SceneError('centres', f'one row for each of the {len(path)} points', f'{len(centres)} rows')
    rows = centres if centres.ndim == 3 else centres[None]
    return np.ascontiguousarray(path, dtype=float), np.ascontiguousarray(rows, dtype=float)
