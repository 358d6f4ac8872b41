"""On which side a path passes an obstacle, computed from the path alone, whatever method found the path.

A path crosses the ray that leaves an obstacle's centre along -x. The number of these crossings (anticlockwise ones positive) and
the directions of the two ends, as seen from the centre, give the angle that the path sweeps about the centre.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.errors import SceneError
from foc_ros.core.kernels import Flags, Matrix, Tensor, Vector, compiled_exactly
from foc_ros.core.obstacles.rounded_polygon import TURN, Polygons, tabulate_polygons
from foc_ros.core.types import LEFT, RIGHT, Array, Obstacles


def compute_swept_angles(path: Array, centres: Array) -> Array:
    """Compute the angle (n,) [rad] that a path (m, 2) [m] sweeps about each centre, anticlockwise positive.

    centres (n, 2) [m], or (m, n, 2) if they move: the centres at each point of the path. The angle is exact if no step of the
    path turns by pi or more about a centre. Raises SceneError if the shapes do not fit each other.
    """
    return sweep_angles(*_check_shapes(path, centres))


def find_path_sides(path: Array, obstacles: Obstacles, centres: Array | None = None) -> dict[str, int]:
    """Find the side on which a path passes each obstacle.

    A path that sweeps clockwise about a centre passes the obstacle on the left. A path passes an obstacle if the foot of
    some point of its polygon on the chord from the first to the last point lies strictly between the two, or if the path winds
    about the centre by more than half a turn. If the obstacle moves, points are relative to it.

    Parameters
    ----------
    path : Array
        Points (m, 2) [m], m >= 1.
    obstacles : Obstacles
        The n obstacles.
    centres : Array, optional
        Centres (m, n, 2) [m] of the obstacles at each point of the path, if they move.

    Returns
    -------
    dict[str, int]
        LEFT or RIGHT by the id of each obstacle that is passed.

    Raises
    ------
    SceneError
        If the shapes do not fit each other.
    """
    path, centres = _check_shapes(path, obstacles.centre if centres is None else centres)
    angles = sweep_angles(path, centres)
    is_passed = find_passed(path, centres, tabulate_polygons(obstacles), angles).tolist()
    return {identity: LEFT if angles[k] < 0.0 else RIGHT for k, identity in enumerate(obstacles.ids) if is_passed[k]}


@compiled_exactly
def count_crossing(a_x: float, a_y: float, b_x: float, b_y: float) -> int:
    """Count how often the straight line from a to b, relative to a centre, crosses the ray of the centre: -1, 0 or 1."""
    left = a_x * b_y - a_y * b_x
    if a_y >= 0.0:
        return 1 if b_y < 0.0 and left > 0.0 else 0
    return -1 if b_y >= 0.0 and left < 0.0 else 0


@compiled_exactly
def sweep_angles(path: Matrix, centres: Tensor) -> Vector:
    """Compute the angles (n,) [rad] that a path (m, 2) sweeps about centres (m, n, 2), or (1, n, 2) if they stand still.

    The angle is the difference between the directions of the two ends, and one turn for each crossing of the ray.
    """
    m, n = len(path), centres.shape[1]
    angles = np.empty(n)
    for k in range(n):
        x, y = path[0, 0] - centres[0, k, 0], path[0, 1] - centres[0, k, 1]
        # a negative zero counts as zero here, as it does in `count_crossing`
        first, crossings = np.arctan2(y + 0.0, x + 0.0), 0
        for t in range(1, m):
            at, x_before, y_before = min(t, len(centres) - 1), x, y
            x, y = path[t, 0] - centres[at, k, 0], path[t, 1] - centres[at, k, 1]
            crossings += count_crossing(x_before, y_before, x, y)
        angles[k] = np.arctan2(y + 0.0, x + 0.0) - first + TURN * crossings
    return angles


@compiled_exactly
def is_same_class(angles: Vector, others: Vector) -> bool:
    """Tell whether two paths with the same ends, which sweep the angles (n,) [rad], pass all n centres on the same sides."""
    return bool((np.abs(angles - others) < np.pi).all())


@compiled_exactly
def find_passed(path: Matrix, centres: Tensor, polygons: Polygons, angles: Vector) -> Flags:
    """Tell which obstacles a path (m, 2) passes that sweeps the angles (n,) about their centres; 15 us in NumPy.

    centres (m, n, 2), or (1, n, 2) if they stand still.
    """
    is_passed = np.zeros(len(angles), np.bool_)
    for k in range(len(angles)):
        x, y = path[0, 0] - centres[0, k, 0], path[0, 1] - centres[0, k, 1]
        along_x, along_y = path[-1, 0] - centres[-1, k, 0] - x, path[-1, 1] - centres[-1, k, 1] - y
        first, last = np.inf, -np.inf
        for vertex in polygons.vertices[k, : polygons.corners[k]]:
            foot = (vertex[0] - x) * along_x + (vertex[1] - y) * along_y
            first, last = min(first, foot), max(last, foot)
        is_passed[k] = (last > 0.0 and first < along_x * along_x + along_y * along_y) or abs(angles[k]) > np.pi
    return is_passed


def _check_shapes(path: Array, centres: Array) -> tuple[Array, Array]:
    """Return a path (m, 2), and centres as (m, n, 2) or (1, n, 2), in the form that the kernels take."""
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise SceneError('path', 'points (m, 2), m >= 1', f'an array {path.shape}')
    if centres.ndim == 3 and len(centres) != len(path):
        raise SceneError('centres', f'one row for each of the {len(path)} points', f'{len(centres)} rows')
    rows = centres if centres.ndim == 3 else centres[None]
    return np.ascontiguousarray(path, dtype=float), np.ascontiguousarray(rows, dtype=float)
