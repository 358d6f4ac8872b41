"""Shapes of obstacles as a user gives them, checked, and as rows of the table that the core computes with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.checks import check_number, check_vector
from foc_ros.core.errors import SceneError
from foc_ros.core.types import Obstacles, make_obstacles


@dataclass(frozen=True, repr=False)
class Circle:
    """A circular obstacle in the task plane.

    Parameters
    ----------
    centre : array_like of shape (2,)
        Position of the centre [m].
    radius : float
        Mean radius [m], larger than 0. It includes the radius of the hand.
    radius_stddev : float
        Standard deviation of the radius [m].
    velocity : array_like of shape (2,)
        Velocity of the centre [m/s], taken as constant over the horizon.
    name : str
        Name used in labels such as ``goal0:+post``; by default the number of the obstacle in its list.
    centre_stddev : float
        Standard deviation of the centre along each axis [m].

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

    centre: ArrayLike
    radius: float
    radius_stddev: float = 0.0
    velocity: ArrayLike = (0.0, 0.0)
    name: str = ''
    centre_stddev: float = 0.0

    def __post_init__(self) -> None:
        for field in ('centre', 'velocity'):
            vector = check_vector(f'obstacle.{field}', getattr(self, field), 2)
            object.__setattr__(self, field, tuple(vector.tolist()))
        for field in ('radius', 'radius_stddev', 'centre_stddev'):
            object.__setattr__(self, field, check_number(f'obstacle.{field}', getattr(self, field), low=0.0))
        if self.radius == 0.0:
            raise SceneError('obstacle.radius', 'a number > 0 m', self.radius)
        if not isinstance(self.name, str):
            raise SceneError('obstacle.name', 'a text', repr(self.name))

    def __repr__(self) -> str:
        """Say name, centre and radius."""
        x, y = np.asarray(self.centre).tolist()
        return f'<Circle {self.name + " " if self.name else ""}at ({x:g}, {y:g}) m, radius {self.radius:g} m>'


def collect_obstacles(shapes: Iterable[Circle] | Obstacles) -> Obstacles:
    """Return the table of some shapes, or a table as it is.

    Raises SceneError, which names the place in the list, for anything else or a name that occurs twice.
    """
    if isinstance(shapes, Obstacles):
        return shapes
    circles = list(shapes)
    for row, each in enumerate(circles):
        if not isinstance(each, Circle):
            raise SceneError(f'obstacles[{row}]', 'a Circle', repr(each))
    names = tuple(each.name or str(row) for row, each in enumerate(circles))
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise SceneError('obstacles', 'a different name for each obstacle', f'{twice!r} twice')
    return make_obstacles(
        np.array([each.centre for each in circles], dtype=float),
        [each.radius for each in circles],
        [each.radius_stddev for each in circles],
        names,
        np.array([each.velocity for each in circles], dtype=float).reshape(-1, 2),
        np.array([each.centre_stddev**2 * np.eye(2) for each in circles]).reshape(-1, 2, 2),
    )
