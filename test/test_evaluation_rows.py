"""Rows of obstacles, the path really taken, and the goal it reached, against values found by hand."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.analysis.evaluation.path import Path, reached
from foc_ros.analysis.evaluation.rows import axis, lines, rows, to_pass

ALONG = np.array([1.0, 0.0])


def test_obstacles_that_overlap_along_the_way_stand_in_one_row() -> None:
    centre = np.array([[3.0, 0.0], [1.0, 1.0], [1.15, -1.0], [2.0, 0.0]])
    assert rows(centre, np.full(4, 0.1), ALONG).tolist() == [2, 0, 0, 1]
    assert rows(np.zeros((0, 2)), np.zeros(0), ALONG).shape == (0,)


def test_a_row_stands_at_the_middle_of_its_obstacles() -> None:
    np.testing.assert_allclose(lines(np.array([3.0, 1.0, 1.2]), np.array([1, 0, 0])), [1.1, 3.0])


def test_a_row_is_passed_for_good_only_when_the_path_does_not_come_back() -> None:
    place = np.array([0.0, 1.5, 0.5, 2.5])
    assert to_pass(np.array([1.0, 2.0, 3.0]), place).tolist() == [True, True, False]
    assert to_pass(np.array([1.0, 2.0, 3.0]), place[1:]).tolist() == [True, True, False]
    assert to_pass(np.array([1.0, 2.0, 3.0]), place[3:]).tolist() == [False, False, False]


def test_the_way_leads_to_the_middle_of_the_goals() -> None:
    np.testing.assert_allclose(axis(np.array([1.0, 1.0]), np.array([[2.0, 3.0], [0.0, 3.0]])), [0.0, 1.0])
    np.testing.assert_allclose(axis(np.zeros(2), np.zeros((1, 2))), [1.0, 0.0])


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
    assert reached(np.array(path), GOALS) == expected


def test_a_single_goal_is_reached_wherever_the_path_is_nearest() -> None:
    assert reached(np.array([(0.0, 0.0), (0.5, 0.0), (0.4, 0.0)]), GOALS[:1]) == (0, 1)


def test_progress_is_way_travelled_and_noise_at_rest_is_none() -> None:
    rest = np.array([[0.0, 0.0], [0.001, 0.0], [-0.001, 0.0], [0.001, 0.001]])
    positions = np.vstack([rest, [[0.25, 0.0], [0.5, 0.0], [1.0, 0.0]], [[1.0, 0.1]]])
    path = Path(np.arange(8) * 100_000_000, positions, GOALS)
    assert path.goal == 0 and path.end_ns == 600_000_000
    np.testing.assert_allclose(path.progress, [0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 1.0])


def test_true_positions_are_interpolated_and_unknown_beyond_the_end() -> None:
    path = Path(np.array([0, 500_000_000, 1_000_000_000]), np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]), GOALS)
    np.testing.assert_allclose(path.at(250_000_000, np.array([0.25, 0.5, 1.0])), [[0.5, 0.0], [0.75, 0.0], [np.nan, np.nan]])
