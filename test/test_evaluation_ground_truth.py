"""Rows of obstacles, the recorded path, and the goal that it reached, against values computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.analysis.evaluation.observations import (
    RecordedPath,
    find_open_gaps,
    find_rows_ahead,
)
from foc_ros.core.classes.rows import find_direction, find_rows, locate_rows
from foc_ros.core.learning.movements import find_reached_goal
from foc_ros.core.obstacles.shapes import Box, Circle, Shape, collect_obstacles
from foc_ros.core.types import LEFT, RIGHT, make_obstacles

DIRECTION = np.array([1.0, 0.0])


def test_obstacles_that_overlap_along_the_direction_stand_in_one_row() -> None:
    centre = np.array([[3.0, 0.0], [1.0, 1.0], [1.15, -1.0], [2.0, 0.0]])
    ends = np.zeros(2), np.array([[4.0, 0.0]])
    assert find_rows(make_obstacles(centre, 0.1), DIRECTION, *ends).tolist() == [2, 0, 0, 1]
    assert find_rows(make_obstacles(), DIRECTION, *ends).shape == (0,)


def test_a_row_stands_at_the_middle_of_its_obstacles() -> None:
    np.testing.assert_allclose(locate_rows(np.array([3.0, 1.0, 1.2]), np.array([1, 0, 0])), [1.1, 3.0])


def test_a_row_is_passed_for_good_only_when_the_path_does_not_come_back() -> None:
    place = np.array([0.0, 1.5, 0.5, 2.5])
    assert find_rows_ahead(np.array([1.0, 2.0, 3.0]), place).tolist() == [True, True, False]
    assert find_rows_ahead(np.array([1.0, 2.0, 3.0]), place[1:]).tolist() == [True, True, False]
    assert find_rows_ahead(np.array([1.0, 2.0, 3.0]), place[3:]).tolist() == [False, False, False]


def test_the_direction_is_towards_the_mean_of_the_goals() -> None:
    np.testing.assert_allclose(find_direction(np.array([1.0, 1.0]), np.array([[2.0, 3.0], [0.0, 3.0]])), [0.0, 1.0])
    np.testing.assert_allclose(find_direction(np.zeros(2), np.zeros((1, 2))), [1.0, 0.0])


START, END = np.zeros(2), np.array([[2.0, 0.0]])
WALLS = [Box((1.0, side * 0.5), (3.0, 0.1), name=f'wall{side}') for side in (-1, 1)]


def find_ways(*shapes: Shape, hand_radius: float = 0.0) -> tuple[list[int], list[list[list[int]]]]:
    """Return the row of each obstacle, and the sides of the open gaps of each row."""
    obstacles = collect_obstacles(shapes)
    row = find_rows(obstacles, DIRECTION, START, END)
    return row.tolist(), [sides.tolist() for sides in find_open_gaps(obstacles, row, DIRECTION, hand_radius)]


def test_a_wall_is_in_no_row_and_a_box_across_the_way_is() -> None:
    across = Box((0.5, 0.0), (0.05, 0.4)), Box((1.5, 0.1), (0.4, 0.05), np.pi / 2)
    assert find_ways(*across, *WALLS)[0] == [0, 1, -1, -1]
    assert find_ways(Box((1.0, 0.3), (1.0, 0.05)), Box((2.5, 0.0), (0.1, 2.0)))[0] == [0, -1]  # beside a part; behind the goal
    assert find_ways(Circle((1.0, 30.0), radius=20.0))[0] == [0]


def test_boxes_overlap_along_the_direction_with_their_extents() -> None:
    long, turned = Box((1.0, 0.3), (1.0, 0.1)), Box((1.0, 0.3), (1.0, 0.1), np.pi / 2)
    assert find_ways(long, Box((1.4, -0.3), (0.1, 0.1)))[0] == [0, 0]
    assert find_ways(turned, Box((1.4, -0.3), (0.1, 0.1)))[0] == [0, 1]
    assert find_ways(Box((1.0, 0.3), (0.2, 0.1), radius=0.3), Box((1.4, -0.3), (0.1, 0.1)))[0] == [0, 0]


def test_gaps_too_narrow_for_the_hand_are_closed() -> None:
    right, left = Box((1.0, -0.2), (0.1, 0.3)), Box((1.0, 0.2), (0.1, 0.2))  # gaps of 0.10, 0.15 and 0.15 m
    through = [[RIGHT, RIGHT], [LEFT, RIGHT], [LEFT, LEFT]]
    for hand_radius, is_open in ((0.0, [True] * 3), (0.06, [False, True, True]), (0.08, [False] * 3)):
        row, (gaps,) = find_ways(right, left, *WALLS, hand_radius=hand_radius)
        assert row == [0, 0, -1, -1]
        assert gaps == [[*sides, 0, 0] for sides, each in zip(through, is_open, strict=True) if each]
    assert find_ways(right, left, hand_radius=0.08)[1] == [[through[0], through[2]]]


def test_the_gap_between_turned_boxes_is_their_distance() -> None:
    for gap, count in ((0.1, 3), (0.099, 2)):
        first = Box((1.0, 0.0), (0.2, 0.2), np.pi / 4)
        second = Box((1.0, 0.1 * np.sqrt(2.0) + gap + 0.02 + 0.05), (0.3, 0.1), radius=0.02)
        assert len(find_ways(first, second, hand_radius=0.04999)[1][0]) == count


GOALS = np.array([[1.0, 0.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ('path', 'expected'),
    [
        pytest.param([(0.0, 0.0), (0.9, 0.0), (1.1, 0.1), (1.3, 0.1)], (0, 1), id='overshoots'),
        pytest.param([(0.0, 0.0), (0.9, 0.0), (0.1, 0.9)], (1, 2), id='both, the last counts'),
        pytest.param([(0.0, 0.0), (0.2, 0.1)], (None, 1), id='none'),
    ],
)
def test_the_goal_reached_is_the_last_one_that_the_path_came_near(path, expected) -> None:
    assert find_reached_goal(np.array(path), GOALS) == expected


def test_a_single_goal_is_reached_wherever_the_path_is_nearest() -> None:
    assert find_reached_goal(np.array([(0.0, 0.0), (0.5, 0.0), (0.4, 0.0)]), GOALS[:1]) == (0, 1)


def test_progress_is_the_share_of_distance_and_noise_at_rest_adds_none() -> None:
    rest = np.array([[0.0, 0.0], [0.001, 0.0], [-0.001, 0.0], [0.001, 0.001]])
    positions = np.vstack([rest, [[0.25, 0.0], [0.5, 0.0], [1.0, 0.0]], [[1.0, 0.1]]])
    path = RecordedPath(np.arange(8) * 100_000_000, positions, GOALS)
    assert path.goal == 0 and path.end_ns == 600_000_000
    np.testing.assert_allclose(path.progress, [0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 1.0])


def test_true_positions_are_interpolated_and_unknown_beyond_the_end() -> None:
    path = RecordedPath(np.array([0, 500_000_000, 1_000_000_000]), np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]), GOALS)
    np.testing.assert_allclose(
        path.interpolate(250_000_000, np.array([0.25, 0.5, 1.0])), [[0.5, 0.0], [0.75, 0.0], [np.nan, np.nan]]
    )
