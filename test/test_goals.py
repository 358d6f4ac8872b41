"""The goal that a path reached."""

import numpy as np
import pytest

from foc_ros.core.goals import find_reached_goal

GOALS = np.array([[0.3, 0.0], [0.3, 0.2]])


@pytest.mark.parametrize(
    ('path', 'expected'),
    [
        ([(0.0, 0.0), (0.2, 0.0), (0.31, 0.0)], (0, 2)),
        ([(0.0, 0.0), (0.3, 0.01), (0.3, 0.19), (0.0, 0.2)], (1, 2)),
        ([(0.0, 0.0), (0.1, 0.0), (0.15, 0.0)], (None, 2)),
    ],
)
def test_the_goal_reached_is_the_last_one_that_the_path_came_near(path, expected):
    assert find_reached_goal(np.array(path), GOALS) == expected


def test_a_single_goal_is_reached_at_the_nearest_position():
    assert find_reached_goal(np.array([(0.0, 0.0), (0.5, 0.0), (0.4, 0.0)]), GOALS[:1]) == (0, 2)


def test_a_given_distance_decides_for_every_goal():
    path = np.array([(0.0, 0.0), (0.26, 0.0)])
    assert find_reached_goal(path, GOALS, 0.05) == (0, 1)
    assert find_reached_goal(path, GOALS, 0.03) == (None, 1)
    assert find_reached_goal(path, GOALS[:0]) == (None, 1)
