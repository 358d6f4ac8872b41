"""The candidates of random scenes agree with a brute-force search over all patterns of sides."""

import numpy as np
import pytest
from homotopy_brute_force import shortest_by_pattern
from homotopy_scenes import CLEARANCE, GOAL, find, patterns, random_scene

from foc_ros.core.types import make_obstacles

K = 6
TIE = 0.01


def compare(seed: int):
    rng = np.random.default_rng(seed)
    obstacles = random_scene(rng, int(rng.integers(1, 9)))
    expected = shortest_by_pattern(np.zeros(2), GOAL, obstacles.centre, obstacles.radius + CLEARANCE)
    found = find(obstacles, k=K)
    return found, patterns(found, obstacles.ids), expected


@pytest.mark.parametrize('batch', range(20))
def test_the_shortest_classes_are_found_and_none_is_invented(batch):
    for seed in range(25 * batch, 25 * (batch + 1)):
        found, ours, expected = compare(seed)
        assert len(ours) == len(found.candidates) == min(K, len(expected)), f'scene {seed}'
        assert set(ours) <= set(expected), f'scene {seed}: invented'
        last = max(ours.values())
        missed = [pattern for pattern, length in expected.items() if pattern not in ours and length < last * (1 - TIE)]
        assert not missed, f'scene {seed}: missed {missed}'


@pytest.mark.parametrize('batch', range(4))
def test_lengths_are_those_of_the_shortest_paths_to_one_percent(batch):
    for seed in range(1000 + 25 * batch, 1000 + 25 * (batch + 1)):
        _, ours, expected = compare(seed)
        for pattern, length in ours.items():
            # the brute force's polygons go round the circles, so its arcs are up to 0.6 % longer
            assert expected[pattern] * (1 - 0.006) <= length <= expected[pattern] * (1 + 0.01), f'scene {seed}'


def test_brute_force_agrees_with_the_closed_form_for_one_circle():
    expected = shortest_by_pattern(np.zeros(2), GOAL, np.array([[0.175, 0.0]]), np.array([0.05]))
    arc = np.pi - 2 * np.arccos(0.05 / 0.175)
    exact = 2 * np.sqrt(0.175**2 - 0.05**2) + 0.05 * arc
    assert set(expected) == {(1,), (-1,)}
    assert expected[(1,)] == pytest.approx(exact, rel=0.006)


def test_a_path_over_two_circles_and_back_between_them_and_a_third():
    centre = np.array([[0.1866, 0.0914], [0.2434, 0.0164], [0.1862, 0.0495]])
    radius = np.array([0.0355, 0.029, 0.0346])
    obstacles = make_obstacles(centre, radius - CLEARANCE)
    found = patterns(find(obstacles), obstacles.ids)
    assert found[1, -1, 1] == pytest.approx(0.511, rel=0.01)
    assert found.keys() == shortest_by_pattern(np.zeros(2), GOAL, centre, radius).keys()
