# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The side on which a path passes an obstacle, by the angle that the path sweeps about its centre."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.classes import compute_swept_angles, find_path_sides
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.solution import LEFT, RIGHT

ABEAM = make_obstacles([[0.5, 0.0]], 0.1, ids=('post',))


def bowed(amplitude: float, m: int = 101) -> np.ndarray:
    share = np.linspace(0.0, 1.0, m)
    return np.column_stack([share, amplitude * np.sin(np.pi * share)])


def test_swept_angle_of_a_quarter_circle_and_of_two_turns():
    angle = np.linspace(0.0, np.pi / 2, 50)
    assert compute_swept_angles(np.column_stack([np.cos(angle), np.sin(angle)]), np.zeros((1, 2))) == pytest.approx([np.pi / 2])
    twice = np.column_stack([np.cos(8 * angle), -np.sin(8 * angle)])
    assert compute_swept_angles(twice, np.array([[0.0, 0.0], [3.0, 0.0]])) == pytest.approx([-4 * np.pi, 0.0])


def test_obstacles_behind_the_start_and_beyond_the_end_are_not_passed():
    obstacles = make_obstacles([[-0.1, 0.05], [1.2, 0.0], [0.5, 0.0]], 0.05)
    assert find_path_sides(bowed(0.3), obstacles) == {'2': LEFT}


def test_a_moving_obstacle_counts_where_it_is_at_each_step():
    path = bowed(0.0)
    crossing = np.stack([np.full(101, 0.5), np.linspace(0.4, -0.4, 101) + 0.1], axis=1)[:, None]
    # half way, when the hand passes, it has come no nearer than 0.1 m to the left
    assert find_path_sides(path, ABEAM, crossing) == {'post': RIGHT}
    assert find_path_sides(path, ABEAM, crossing - [0.0, 0.2]) == {'post': LEFT}


def test_centres_of_another_number_of_points_are_refused():
    with pytest.raises(SceneError, match='centres: expected one row for each of the 101 points, got 3 rows'):
        find_path_sides(bowed(0.1), ABEAM, np.zeros((3, 1, 2)))
    with pytest.raises(SceneError, match='path: expected points'):
        find_path_sides(np.zeros((3, 3)), ABEAM)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.floats(-0.9, 0.9), st.floats(-3.0, 3.0), st.floats(0.05, 0.95), st.floats(-0.8, 0.8))
def test_side_of_a_bowed_path_is_that_of_the_line_above_or_below(amplitude, angle, x, y):
    path = bowed(amplitude, 400)
    height = amplitude * np.sin(np.pi * x)
    if abs(y - height) < 1e-3:
        return
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    obstacles = make_obstacles([turn @ [x, y]], 0.01)
    assert find_path_sides(path @ turn.T, obstacles) == {'0': LEFT if height > y else RIGHT}
