# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Shapes of obstacles as a user gives them, checked, and as rows of the table that the core computes with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import wraps
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.errors import SceneError, explain_keywords
from foc_ros.core.obstacle_table import UNKNOWN_HEIGHTS, Obstacles, make_obstacles
from foc_ros.core.support import check_array, check_number, check_vector
from foc_ros.core.types import Array

from .polygons import make_box_polygon, make_hull_polygon
from .table_checks import check_obstacles

MOST_VERTICES = 16
"""Most vertices of a convex hull that a user gives."""
T = TypeVar('T', bound='type[Shape]')


def accept_center(shape: T) -> T:
    """Let the constructor of a shape take `center` for `centre`, both spellings being common, and explain other keywords."""
    changed: Any = explain_keywords('obstacle')(shape)
    create = changed.__init__

    @wraps(create)
    def create_with_center(self: Shape, *args: Any, **values: Any) -> None:
        if 'center' in values:
            if args or 'centre' in values:
                raise SceneError('obstacle.center', 'one centre', 'two')
            values['centre'] = values.pop('center')
        create(self, *args, **values)

    changed.__init__ = create_with_center
    return shape


class Shape:
    """What the shapes have in common: an uncertain radius, a velocity, a name, an uncertain centre, heights."""

    kind: ClassVar[str] = 'shape'
    centre: ArrayLike
    radius: float
    radius_stddev: float
    velocity: ArrayLike
    name: str
    centre_stddev: float
    heights: ArrayLike | None = None

    @property
    def polygon(self) -> Array:
        """Vertices of the polygon whose surroundings the obstacle is, (v, 2), anticlockwise, relative to the centre [m]."""
        return np.zeros((1, 2))

    def _check(self, *vectors: str) -> None:
        for field in ('velocity', *vectors):
            vector = check_vector(f'obstacle.{field}', getattr(self, field), 2)
            object.__setattr__(self, field, tuple(vector.tolist()))
        for field in ('radius', 'radius_stddev', 'centre_stddev'):
            object.__setattr__(self, field, check_number(f'obstacle.{field}', getattr(self, field), low=0.0))
        if self.heights is not None:
            lowest, highest = check_vector('obstacle.heights', self.heights, 2).tolist()
            if lowest >= highest:
                raise SceneError('obstacle.heights', 'the lowest point below the highest', [lowest, highest])
            object.__setattr__(self, 'heights', (lowest, highest))
        if not isinstance(self.name, str):
            raise SceneError('obstacle.name', 'a text', repr(self.name))
        if self.radius == 0.0 and len(self.polygon) == 1:
            raise SceneError('obstacle.radius', f'a number > 0 m for a {self.kind} without any size', self.radius)

    def __repr__(self) -> str:
        """Say kind, name, centre and radius."""
        x, y = np.asarray(self.centre).tolist()
        return f'<{type(self).__name__} {self.name + " " if self.name else ""}at ({x:g}, {y:g}) m, radius {self.radius:g} m>'


@accept_center
@dataclass(frozen=True, repr=False)
class Circle(Shape):
    """A circular obstacle in the task plane.

    Parameters
    ----------
    centre : array_like of shape (2,)
        Position of the centre [m]; `center` is taken, too.
    radius : float
        Mean radius [m], larger than 0.
    radius_stddev : float
        Standard deviation of the radius [m].
    velocity : array_like of shape (2,)
        Velocity of the centre [m/s], taken as constant over the horizon.
    name : str
        Name used in labels such as ``goal0:+post``; by default the number of the obstacle in its list.
    centre_stddev : float
        Standard deviation of the centre along each axis [m].
    heights : array_like of shape (2,), optional
        Lowest and highest point along the normal of the plane [m]. Without them the obstacle blocks at every height.

    Raises
    ------
    SceneError
        For a wrong shape, a number that is not finite, a radius that is not positive or a negative standard deviation.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003, name='cup')
    <Circle cup at (0.15, 0.01) m, radius 0.03 m>
    """

    kind = 'circle'
    centre: ArrayLike
    radius: float
    radius_stddev: float = 0.0
    velocity: ArrayLike = (0.0, 0.0)
    name: str = ''
    centre_stddev: float = 0.0
    heights: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._check('centre')


@accept_center
@dataclass(frozen=True, repr=False)
class Box(Shape):
    """A rectangular obstacle in the task plane, with corners that are sharp or rounded; a wall is a long thin box.

    Parameters
    ----------
    centre : array_like of shape (2,)
        Position of the centre [m]; `center` is taken, too.
    size : array_like of shape (2,)
        Full lengths along its own axes [m]. One length 0 makes a capsule.
    yaw : float
        Angle from the x axis of the plane to the first axis of the box [rad].
    radius : float
        Mean distance by which the box extends beyond its size on all sides, with round corners [m].
    radius_stddev : float
        Standard deviation of that distance [m].
    velocity : array_like of shape (2,)
        Velocity of the centre [m/s], taken as constant over the horizon. The box does not turn.
    name : str
        Name used in labels such as ``goal0:+post``; by default the number of the obstacle in its list.
    centre_stddev : float
        Standard deviation of the centre along each axis [m].
    heights : array_like of shape (2,), optional
        Lowest and highest point along the normal of the plane [m]. Without them the obstacle blocks at every height.

    Raises
    ------
    SceneError
        For a wrong shape, a number that is not finite, a negative size, or no size and no radius.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.Box((0.15, 0.01), size=(0.1, 0.04), yaw=0.3, name='tray')
    <Box tray at (0.15, 0.01) m, size 0.1 x 0.04 m, radius 0 m>
    """

    kind = 'box'
    centre: ArrayLike
    size: ArrayLike
    yaw: float = 0.0
    radius: float = 0.0
    radius_stddev: float = 0.0
    velocity: ArrayLike = (0.0, 0.0)
    name: str = ''
    centre_stddev: float = 0.0
    heights: ArrayLike | None = None

    def __post_init__(self) -> None:
        size = check_vector('obstacle.size', self.size, 2)
        if size.min() < 0.0:
            raise SceneError('obstacle.size', 'two numbers >= 0 m', size.tolist())
        object.__setattr__(self, 'size', tuple(size.tolist()))
        object.__setattr__(self, 'yaw', check_number('obstacle.yaw', self.yaw))
        self._check('centre')

    @property
    def polygon(self) -> Array:
        """Vertices of the polygon, (v, 2), anticlockwise, relative to the centre [m]."""
        return make_box_polygon(self.size, self.yaw)

    def __repr__(self) -> str:
        """Say name, centre, size and radius."""
        length, width = np.asarray(self.size).tolist()
        return super().__repr__().replace(', radius', f', size {length:g} x {width:g} m, radius')


class _HullOfPoints(Shape):
    """What shapes have in common whose polygon is the convex hull of some points."""

    def _list_points(self) -> Array:
        raise NotImplementedError

    @property
    def centre(self) -> ArrayLike:  # type: ignore[override]
        """Mean of the corners, (2,) [m]."""
        return make_hull_polygon(self._list_points())[0]

    @property
    def polygon(self) -> Array:
        """Vertices of the polygon, (v, 2), anticlockwise, relative to the centre [m]."""
        return make_hull_polygon(self._list_points())[1]


@explain_keywords('obstacle')
@dataclass(frozen=True, repr=False)
class Capsule(_HullOfPoints):
    """All points within a radius of a line, such as a tool or an arm.

    Parameters
    ----------
    start, end : array_like of shape (2,)
        Ends of the line [m].
    radius : float
        Mean radius [m], larger than 0 if the two ends are the same.
    radius_stddev : float
        Standard deviation of the radius [m].
    velocity : array_like of shape (2,)
        Velocity [m/s], taken as constant over the horizon. The capsule does not turn.
    name : str
        Name used in labels such as ``goal0:+post``; by default the number of the obstacle in its list.
    centre_stddev : float
        Standard deviation of the centre along each axis [m].
    heights : array_like of shape (2,), optional
        Lowest and highest point along the normal of the plane [m]. Without them the obstacle blocks at every height.

    Raises
    ------
    SceneError
        For a wrong shape, a number that is not finite, a negative radius or standard deviation, or no size and no radius.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.Capsule((0.1, 0.0), (0.2, 0.05), radius=0.01, name='tool')
    <Capsule tool at (0.15, 0.025) m, radius 0.01 m>
    """

    kind = 'capsule'
    start: ArrayLike
    end: ArrayLike
    radius: float
    radius_stddev: float = 0.0
    velocity: ArrayLike = (0.0, 0.0)
    name: str = ''
    centre_stddev: float = 0.0
    heights: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._check('start', 'end')

    def _list_points(self) -> Array:
        return np.array([self.start, self.end])


@explain_keywords('obstacle')
@dataclass(frozen=True, repr=False)
class Hull(_HullOfPoints):
    """The convex hull of some points, with corners that are sharp or rounded.

    Parameters
    ----------
    points : array_like of shape (q, 2)
        Points [m] whose hull has 16 corners at most.
    radius : float
        Mean distance by which the obstacle extends beyond the hull [m], larger than 0 if all points are the same.
    radius_stddev : float
        Standard deviation of that distance [m].
    velocity : array_like of shape (2,)
        Velocity [m/s], taken as constant over the horizon. The hull does not turn.
    name : str
        Name used in labels such as ``goal0:+post``; by default the number of the obstacle in its list.
    centre_stddev : float
        Standard deviation of the centre along each axis [m].
    heights : array_like of shape (2,), optional
        Lowest and highest point along the normal of the plane [m]. Without them the obstacle blocks at every height.

    Raises
    ------
    SceneError
        For a wrong shape, a number that is not finite, too many corners, or no size and no radius.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.Hull([(0.1, 0.0), (0.2, 0.0), (0.15, 0.06)], name='wedge')
    <Hull wedge at (0.15, 0.02) m, radius 0 m>
    """

    kind = 'hull'
    points: ArrayLike
    radius: float = 0.0
    radius_stddev: float = 0.0
    velocity: ArrayLike = (0.0, 0.0)
    name: str = ''
    centre_stddev: float = 0.0
    heights: ArrayLike | None = None

    def __post_init__(self) -> None:
        points = check_array('obstacle.points', self.points, (None, 2))
        if not len(points):
            raise SceneError('obstacle.points', 'one point at least', 'none')
        object.__setattr__(self, 'points', tuple(map(tuple, points.tolist())))
        if len(self.polygon) > MOST_VERTICES:
            raise SceneError('obstacle.points', f'a hull of at most {MOST_VERTICES} corners', len(self.polygon))
        self._check()

    def _list_points(self) -> Array:
        return np.array(self.points)


def collect_obstacles(shapes: Iterable[Shape] | Shape | Obstacles) -> Obstacles:
    """Return the table of some shapes or of one, or a table whose rows can be used.

    Raises SceneError, which names the place in the list, for anything else or a name that occurs twice.
    """
    if isinstance(shapes, Obstacles):
        return check_obstacles(shapes)
    if not isinstance(shapes, (Shape, Iterable)):
        raise SceneError('obstacles', 'a list of Circle, Box, Capsule and Hull', repr(shapes))
    given = [shapes] if isinstance(shapes, Shape) else list(shapes)
    for row, each in enumerate(given):
        if not isinstance(each, Shape):
            raise SceneError(f'obstacles[{row}]', 'a Circle, Box, Capsule or Hull', repr(each))
    names = tuple(each.name or str(row) for row, each in enumerate(given))
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise SceneError('obstacles', 'a different name for each obstacle', f'{twice!r} twice')
    return make_obstacles(
        np.array([each.centre for each in given], dtype=float),
        [each.radius for each in given],
        [each.radius_stddev for each in given],
        names,
        np.array([each.velocity for each in given], dtype=float).reshape(-1, 2),
        np.array([each.centre_stddev**2 * np.eye(2) for each in given]).reshape(-1, 2, 2),
        [each.polygon for each in given],
        np.array([UNKNOWN_HEIGHTS if each.heights is None else each.heights for each in given]).reshape(-1, 2),
    )
