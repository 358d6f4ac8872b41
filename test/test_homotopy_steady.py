"""Labels and lists of candidates are steady under noise, and all classes of the Avoiding task are found."""

import csv
from collections import Counter

import numpy as np
import pytest
from homotopy_scenes import AVOIDING, avoiding, find

from foc_ros.core.types import make_obstacles

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


def test_a_symmetric_obstacle_keeps_its_two_labels():
    assert count_changes([(0.15, 0.0)], 0.03, (0.3, 0.0)) == 0


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


def test_an_obstacle_added_elsewhere_leaves_the_names_as_they_are():
    centre = [(0.1, 0.01), (0.22, -0.02)]
    one = find(make_obstacles(centre, 0.02, ids=('a', 'b')))
    other = find(make_obstacles([(-0.2, 0.1), *centre], 0.02, ids=('new', 'a', 'b')))
    assert [a.label for a in one.candidates] == [b.label for b in other.candidates]


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


def tracks(count):
    """State means (m, 6) along the first recordings of the Avoiding task, with the speed of its differences."""
    with (AVOIDING / 'recordings.csv').open() as file:
        rows = list(csv.DictReader(file))
    for name in list(dict.fromkeys(row['recording'] for row in rows))[:count]:
        t, x, y = np.array([[float(row[key]) for key in ('t_s', 'x_m', 'y_m')] for row in rows if row['recording'] == name]).T
        yield np.column_stack([x, y, np.gradient(x, t), np.gradient(y, t)])


def find_named(candidates):
    return {(one.goal, identity) for one in candidates for identity, _ in one.sides}


@pytest.mark.skipif(not AVOIDING.is_dir(), reason='optional data ../shared/data/d3il_avoiding is not there')
def test_along_the_avoiding_task_the_list_changes_only_when_it_must():
    """While the names stay, classes that enter are among the best of a search without memory, and those that leave are not."""
    obstacles, goals = avoiding()
    count = Counter()
    for track in tracks(6):
        previous = ()
        for mean in track:
            seen = {'goals': goals, 'hand': mean[:2], 'velocity': mean[2:], 'k': 8, 'steps': 20}
            found = find(obstacles, previous=previous, **seen).candidates
            fresh = find(obstacles, **seen).candidates
            labels, before, best = ({one.label for one in each} for each in (found, previous, fresh))
            count['samples'] += 1
            if previous and labels != before:
                count['names' if find_named(found) != find_named(previous) else 'ranking'] += 1
                if find_named(found) == find_named(previous) == find_named(fresh):
                    assert labels - before <= best
                    assert not (before - labels) & best
            again = {one.label for one in find(obstacles, previous=found, **seen).candidates}
            assert again == labels
            previous = found
    assert count['names'] and count['ranking'] < count['samples'] / 5
