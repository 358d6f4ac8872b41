"""The same classes whatever the order of the obstacles and wherever the scene lies; mirrored, with the sides changed."""

import numpy as np
import pytest
from homotopy_scenes import GOAL, find, gap_to_circles, random_scene
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.classes import find_path_sides
from foc_ros.core.types import make_obstacles

scenes = st.tuples(st.integers(0, 2**32 - 1), st.integers(1, 9))
ALL = settings(max_examples=60, deadline=None, derandomize=True)


def made(scene):
    seed, n = scene
    return random_scene(np.random.default_rng(seed), n)


def summary(found):
    return [(one.label, round(one.length, 9)) for one in found.candidates]


@ALL
@given(scenes, st.randoms(use_true_random=False))
def test_order_of_obstacles_does_not_matter(scene, random):
    obstacles = made(scene)
    order = list(range(len(obstacles)))
    random.shuffle(order)
    one, other = find(obstacles), find(obstacles.take(order))
    assert summary(one) == summary(other)
    for a, b in zip(one.candidates, other.candidates, strict=True):
        np.testing.assert_allclose(a.guess, b.guess, atol=1e-12)


@ALL
@given(scenes, st.floats(-np.pi, np.pi), st.floats(-2, 2), st.floats(-2, 2))
def test_turned_and_shifted(scene, angle, x, y):
    obstacles, shift = made(scene), np.array([x, y])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = make_obstacles(obstacles.centre @ turn.T + shift, obstacles.radius, ids=obstacles.ids)
    velocity = np.array([0.2, 0.1])
    one = find(obstacles, velocity=velocity)
    other = find(moved, goals=turn @ GOAL + shift, hand=shift, velocity=turn @ velocity)
    assert [a.label for a in one.candidates] == [b.label for b in other.candidates]
    for a, b in zip(one.candidates, other.candidates, strict=True):
        # the outlines of circles do not turn with the scene
        np.testing.assert_allclose(a.guess @ turn.T + shift, b.guess, atol=2e-3)


@ALL
@given(scenes)
def test_mirrored(scene):
    obstacles, flip = made(scene), np.array([1.0, -1.0])
    one, other = find(obstacles), find(make_obstacles(obstacles.centre * flip, obstacles.radius))
    changed = str.maketrans('+-', '-+')
    assert [a.label.translate(changed) for a in one.candidates] == [b.label for b in other.candidates]
    for a, b in zip(one.candidates, other.candidates, strict=True):
        np.testing.assert_allclose(a.guess * flip, b.guess, atol=1e-9)


@ALL
@given(scenes)
def test_guesses_are_clear_and_really_in_their_class(scene):
    obstacles = made(scene)
    found = find(obstacles, steps=200)
    assert found.candidates
    assert len({one.label for one in found.candidates}) == len(found.candidates)
    for one in found.candidates:
        assert one.guess.shape == (201, 2)
        np.testing.assert_allclose(one.guess[[0, -1]], [[0.0, 0.0], GOAL], atol=1e-12)
        assert gap_to_circles(one.guess, obstacles) > -1e-9
        sides = find_path_sides(one.guess, obstacles)
        assert {identity: sides[identity] for identity, _ in one.sides} == dict(one.sides)
        assert one.label == 'goal0:' + ''.join(('+' if side > 0 else '-') + identity for identity, side in one.sides)
        steps = np.hypot(*np.diff(one.guess, axis=0).T).sum()
        assert steps == pytest.approx(one.length, rel=0.02)


@ALL
@given(scenes)
def test_the_same_answer_every_time(scene):
    obstacles = made(scene)
    for a, b in zip(find(obstacles).candidates, find(obstacles).candidates, strict=True):
        assert a.label == b.label
        np.testing.assert_array_equal(a.guess, b.guess)
