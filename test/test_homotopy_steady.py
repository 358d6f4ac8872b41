# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Labels and lists of candidates are steady under noise, and all classes of the Avoiding task are found."""

import numpy as np
import pytest
from homotopy_scenes import AVOIDING, avoiding, find

from foc_ros.core.obstacle_table import make_obstacles

TICKS = 400


def count_changes(centre, radius, goals, hand=(0.0, 0.0), k=4, remember=True):
    """How often the set of labels changes under 1 mm of noise on hand and obstacles."""
    rng = np.random.default_rng(5)
    centre = np.array(centre, dtype=float)
    previous, count, last = (), 0, None
    for _ in range(TICKS):
        obstacles = make_obstacles(centre + rng.normal(0.0, 0.001, centre.shape), radius)
        noisy = np.asarray(hand) + rng.normal(0.0, 0.001, 2)
        found = find(obstacles, goals, noisy, rng.normal(0.0, 0.02, 2), k=k, previous=previous)
        labels = {one.label for one in found.candidates}
        count += last is not None and labels != last
        previous, last = found.candidates if remember else (), labels
    return count


@pytest.mark.parametrize(
    ('centre', 'radius', 'k'),
    [
        pytest.param([(0.0, 0.05), (0.15, 0.0)], 0.02, 4, id='obstacle abeam of the hand'),
        pytest.param([(0.15, 0.035), (0.15, -0.035)], 0.03, 4, id='gap about to close'),
        pytest.param([(0.08, 0.0), (0.15, 0.0), (0.22, 0.0)], 0.02, 3, id='room for one of two equally long classes'),
    ],
)
def test_candidates_stay_under_noise(centre, radius, k):
    loose = count_changes(centre, radius, (0.3, 0.0), k=k, remember=False)
    assert loose > 100, 'the scene is no test'
    assert count_changes(centre, radius, (0.3, 0.0), k=k) <= 8


def test_a_clearly_better_class_replaces_one_that_was_there():
    centre, radius = np.array([[0.1, 0.0], [0.2, 0.05], [0.2, -0.05]]), 0.02
    before = find(make_obstacles(centre, radius), (0.3, 0.0), k=2)
    moved = make_obstacles(centre + np.array([0.0, 0.06]), radius)
    after = find(moved, (0.3, 0.0), k=2, previous=before.candidates)
    fresh = find(moved, (0.3, 0.0), k=2)
    assert {one.label for one in after.candidates} == {one.label for one in fresh.candidates}


def find_gaps(path, obstacles):
    """Gap taken in each row, from low x, of a path upwards through rows at three heights."""
    taken = []
    for y in np.unique(obstacles.centre[:, 1]):
        crossed = np.flatnonzero((path[:-1, 1] < y) & (path[1:, 1] >= y))
        row = np.sort(obstacles.centre[obstacles.centre[:, 1] == y, 0])
        taken.append(tuple(np.searchsorted(row, path[crossed, 0]).tolist()))
    return tuple(taken)


@pytest.mark.skipif(not AVOIDING.is_dir(), reason='optional data ../shared/data/d3il_avoiding is not there')
@pytest.mark.parametrize('line', ['its four goals', 'one goal beyond'])
def test_all_24_classes_of_the_avoiding_task_are_found(line):
    obstacles, goals = avoiding()
    found = find(obstacles, goals if line == 'its four goals' else [[0.5, 0.6]], hand=(0.525, -0.28), k=24, steps=400)
    taken = {find_gaps(one.guess, obstacles) for one in found.candidates}
    assert len(found.candidates) == 24 == len(taken)
    assert all(len(row) == 1 for rows in taken for row in rows)
