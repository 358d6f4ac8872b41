"""Moments, tracks and movements: what reports are made of."""

from __future__ import annotations

import numpy as np
import pytest
from report_samples import START_NS, prediction, predictions, samples, scene

from foc_ros.core.types import HandSample
from foc_ros.reporting.snapshots import Track, movements, snapshot_of_prediction, track_of


def test_moment_keeps_the_numbers() -> None:
    made = prediction(START_NS, np.zeros(2), 0.6)
    moment = snapshot_of_prediction(made, *scene())
    assert [way.label for way in moment.ways] == ['goal0:+1', 'goal0:-1', 'goal1:+1-post']
    assert moment.unsolved == (('goal1:+1+post', 'eta_unreachable'),)
    best = moment.ways[0]
    np.testing.assert_array_equal(best.path, made.candidates[0].solution.path)
    np.testing.assert_allclose(best.covariance[-1], np.diag([0.011**2, 0.005**2]))
    assert best.cost_ratio == 1.0
    assert moment.ways[1].cost_ratio == pytest.approx(made.candidates[1].cost / made.candidates[0].cost)


def test_speed_is_that_of_the_velocity() -> None:
    way = snapshot_of_prediction(prediction(START_NS, np.zeros(2)), *scene()).ways[0]
    lengths = np.linalg.norm(np.diff(way.path, axis=0), axis=1)
    assert np.sum((way.speed[1:] + way.speed[:-1]) / 2 * 0.05) == pytest.approx(lengths.sum(), rel=0.02)


def test_track_drops_what_comes_late() -> None:
    made = samples()
    shuffled = [*made[:20], made[5], made[19], *made[20:]]
    track = track_of(shuffled)
    assert list(track.stamps_ns) == [sample.stamp_ns for sample in made]
    assert len(track.positions) == len(made)


def test_track_of_nothing_is_empty() -> None:
    track = track_of([])
    assert track.velocity.shape == (0, 2)
    assert movements(track, 0.05) == []


def test_one_sample_stands_still() -> None:
    np.testing.assert_array_equal(track_of([HandSample(5, np.ones(2))]).velocity, np.zeros((1, 2)))


def test_velocity_of_a_straight_line() -> None:
    stamps = START_NS + np.cumsum(np.random.default_rng(1).integers(5, 80, 40)) * 1_000_000
    positions = np.outer((stamps - START_NS) * 1e-9, [0.3, -0.2])
    np.testing.assert_allclose(Track(stamps, positions).velocity, np.tile([0.3, -0.2], (40, 1)), atol=1e-9)


def test_movements_are_found_where_they_are() -> None:
    spans = movements(track_of(samples(3)), 0.05)
    times = (np.array(spans) - START_NS) * 1e-9
    assert len(spans) == 3
    np.testing.assert_allclose(times, [[0.5, 1.5], [2.0, 3.0], [3.5, 4.5]], atol=0.15)


def test_trembling_is_no_movement() -> None:
    random = np.random.default_rng(3)
    track = Track(START_NS + np.arange(300) * 10_000_000, random.normal(scale=0.003, size=(300, 2)))
    assert np.linalg.norm(track.velocity, axis=1).max() > 0.05
    assert movements(track, 0.05) == []


def test_moments_of_the_same_prediction_count() -> None:
    made = samples()
    assert [snapshot_of_prediction(each, *scene()).stamp_ns for each in predictions(made)] == [
        each.stamp_ns for each in made[::4]
    ]
