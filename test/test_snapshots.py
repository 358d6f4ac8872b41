"""Snapshots of predictions, the trajectory of the hand and its movements: the contents of reports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from report_samples import START_NS, prediction, predictions, samples

from foc_ros.core.types import HandSample, Status, describe_class
from foc_ros.reporting.snapshots import HandTrajectory, build_hand_trajectory, build_snapshot


def test_a_snapshot_holds_the_numbers_of_its_prediction() -> None:
    made = prediction(START_NS, np.zeros(2), 0.6)
    snapshot = build_snapshot(made)
    assert [each.label for each in snapshot.candidates] == ['goal0:+1', 'goal0:-1', 'goal1:+1-post']
    (lost,) = snapshot.unsolved
    assert (lost.label, lost.status) == ('goal1:+1+post', 'eta_unreachable')
    assert lost.reason == f'eta unreachable: out of reach; remedy: {Status.ETA_UNREACHABLE.remedy}'
    best = snapshot.candidates[0]
    np.testing.assert_array_equal(best.path, made.candidates[0].solution.path)
    np.testing.assert_allclose(best.covariance[-1], np.diag([0.011**2, 0.005**2]))
    assert best.cost_ratio == 1.0
    assert snapshot.candidates[1].cost_ratio == pytest.approx(made.candidates[1].cost / made.candidates[0].cost)


def test_classes_are_named_in_words_with_the_goal_where_there_are_several() -> None:
    made = prediction(START_NS, np.zeros(2))
    assert [each.description for each in build_snapshot(made).candidates] == [
        'goal0: left of 1', 'goal0: right of 1', 'goal1: left of 1, right of post',
    ]  # fmt: skip
    one = build_snapshot(replace(made, goals=made.goals[:1]))
    assert [each.description for each in (*one.candidates[:1], *one.unsolved)] == ['left of 1', 'left of 1, left of post']
    assert describe_class(()) == 'direct'


def test_the_unknown_share_is_that_of_the_prediction() -> None:
    assert build_snapshot(replace(prediction(START_NS, np.zeros(2)), unknown=0.25)).unknown_share == 0.25


def test_the_motor_noise_is_kept_beside_the_total_uncertainty() -> None:
    made = prediction(START_NS, np.zeros(2))
    first = made.candidates[0]
    assert not build_snapshot(made).candidates[0].is_widened
    wide = replace(first, solution=first.solution.with_covariance(2.0 * first.solution.covariance))
    view = build_snapshot(replace(made, candidates=(wide, *made.candidates[1:]))).candidates[0]
    assert view.is_widened
    np.testing.assert_array_equal(view.covariance, 2.0 * view.motor_covariance)
    np.testing.assert_array_equal(wide.motor_covariance, first.solution.covariance)


def test_speed_is_that_of_the_velocity() -> None:
    candidate = build_snapshot(prediction(START_NS, np.zeros(2))).candidates[0]
    lengths = np.linalg.norm(np.diff(candidate.path, axis=0), axis=1)
    assert np.sum((candidate.speed[1:] + candidate.speed[:-1]) / 2 * 0.05) == pytest.approx(lengths.sum(), rel=0.02)


def test_a_late_sample_is_left_out() -> None:
    made = samples()
    shuffled = [*made[:20], made[5], made[19], *made[20:]]
    hand = build_hand_trajectory(shuffled)
    assert list(hand.stamps_ns) == [sample.stamp_ns for sample in made]
    assert len(hand.positions) == len(made)


def test_no_samples_make_an_empty_trajectory() -> None:
    hand = build_hand_trajectory([])
    assert hand.velocity.shape == (0, 2)
    assert hand.find_movements(0.05) == []


def test_a_single_sample_has_no_velocity() -> None:
    np.testing.assert_array_equal(build_hand_trajectory([HandSample(5, np.ones(2))]).velocity, np.zeros((1, 2)))


def test_velocity_of_a_straight_line() -> None:
    stamps = START_NS + np.cumsum(np.random.default_rng(1).integers(5, 80, 40)) * 1_000_000
    positions = np.outer((stamps - START_NS) * 1e-9, [0.3, -0.2])
    np.testing.assert_allclose(HandTrajectory(stamps, positions).velocity, np.tile([0.3, -0.2], (40, 1)), atol=1e-9)


def test_movements_are_found_where_they_are() -> None:
    spans = build_hand_trajectory(samples(3)).find_movements(0.05)
    times = (np.array(spans) - START_NS) * 1e-9
    assert len(spans) == 3
    np.testing.assert_allclose(times, [[0.5, 1.5], [2.0, 3.0], [3.5, 4.5]], atol=0.15)


def test_tremor_is_no_movement() -> None:
    random = np.random.default_rng(3)
    hand = HandTrajectory(START_NS + np.arange(300) * 10_000_000, random.normal(scale=0.003, size=(300, 2)))
    assert np.linalg.norm(hand.velocity, axis=1).max() > 0.05
    assert hand.find_movements(0.05) == []


def test_a_snapshot_has_the_stamp_of_its_prediction() -> None:
    made = samples()
    assert [build_snapshot(each).stamp_ns for each in predictions(made)] == [each.stamp_ns for each in made[::4]]
