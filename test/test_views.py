# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Views of predictions: those of the records and of the node's messages agree, and tracks keep their letters over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from report_samples import START_NS, prediction, predictions, samples, scene, widen

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import LEFT, RIGHT, Status, describe_class
from foc_ros.core.types import HandSample
from foc_ros.io.bags import TYPESTORE
from foc_ros.reporting.received import is_same_prediction, read_snapshot
from foc_ros.reporting.tracks import Slots, build_candidate_tracks
from foc_ros.reporting.views import CandidateView, HandTrajectory, Snapshot, build_hand_trajectory, build_snapshot, parse_label
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud
from foc_ros.ros.messages.types import RosbagsTypes

TYPES = RosbagsTypes(TYPESTORE)
NOWHERE = np.zeros(2)


def test_a_snapshot_holds_the_numbers_of_its_prediction_and_names_classes_in_words() -> None:
    made = prediction(START_NS, NOWHERE, 0.6)
    snapshot = build_snapshot(made)
    assert [each.label for each in snapshot.candidates] == ['goal0:+1', 'goal0:-1', 'goal1:+1-post']
    words = ['goal0: left of 1', 'goal0: right of 1', 'goal1: left of 1, right of post']
    assert [each.description for each in snapshot.candidates] == words
    (lost,) = snapshot.unsolved
    assert (lost.label, lost.status) == ('goal1:+1+post', 'eta_unreachable')
    assert lost.reason == f'eta unreachable: out of reach; remedy: {Status.ETA_UNREACHABLE.remedy}'
    best = snapshot.candidates[0]
    np.testing.assert_array_equal(best.path, made.candidates[0].solution.path)
    np.testing.assert_allclose(best.covariance[-1], np.diag([0.011**2, 0.005**2]))
    np.testing.assert_array_equal(snapshot.hand, NOWHERE)
    assert (snapshot.stamp_ns, best.cost_ratio) == (START_NS, 1.0)
    assert snapshot.candidates[1].cost_ratio == pytest.approx(made.candidates[1].cost / made.candidates[0].cost)
    lengths = np.linalg.norm(np.diff(best.path, axis=0), axis=1)
    assert np.sum((best.speed[1:] + best.speed[:-1]) / 2 * 0.05) == pytest.approx(lengths.sum(), rel=0.02)
    one = build_snapshot(replace(made, goal_positions=made.goal_positions[:1]))
    assert [each.description for each in (*one.candidates[:1], *one.unsolved)] == ['left of 1', 'left of 1, left of post']
    assert describe_class(()) == 'direct'


def test_the_motor_noise_and_the_unknown_share_are_kept() -> None:
    made = replace(prediction(START_NS, NOWHERE), unknown=0.25)
    assert not build_snapshot(made).candidates[0].is_widened
    snapshot = build_snapshot(widen(made))
    assert snapshot.candidates[0].is_widened and snapshot.unknown_share == 0.25
    np.testing.assert_array_equal(snapshot.candidates[0].covariance, 3.0 * snapshot.candidates[0].motor_covariance)


def test_a_trajectory_leaves_late_samples_out() -> None:
    made = samples()
    hand = build_hand_trajectory([*made[:20], made[5], made[19], *made[20:]])
    assert list(hand.stamps_ns) == [sample.stamp_ns for sample in made]
    np.testing.assert_array_equal(hand.positions, [sample.position for sample in made])


def test_velocity() -> None:
    stamps = START_NS + np.cumsum(np.random.default_rng(1).integers(5, 80, 40)) * 1_000_000
    positions = np.outer((stamps - START_NS) * 1e-9, [0.3, -0.2])
    np.testing.assert_allclose(HandTrajectory(stamps, positions).velocity, np.tile([0.3, -0.2], (40, 1)), atol=1e-9)
    np.testing.assert_array_equal(build_hand_trajectory([HandSample(5, np.ones(2))]).velocity, np.zeros((1, 2)))
    empty = build_hand_trajectory([])
    assert (empty.velocity.shape, empty.find_movements(0.05)) == ((0, 2), [])


def test_movements_are_found_where_they_are_and_tremor_is_none() -> None:
    spans = build_hand_trajectory(samples(3)).find_movements(0.05)
    np.testing.assert_allclose((np.array(spans) - START_NS) * 1e-9, [[0.5, 1.5], [2.0, 3.0], [3.5, 4.5]], atol=0.15)
    random = np.random.default_rng(3)
    hand = HandTrajectory(START_NS + np.arange(300) * 10_000_000, random.normal(scale=0.003, size=(300, 2)))
    assert np.linalg.norm(hand.velocity, axis=1).max() > 0.05
    assert hand.find_movements(0.05) == []


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_the_messages_hold_everything_that_a_report_shows(plane: str) -> None:
    """Also when another class is the most likely one by hysteresis, and after serialisation."""
    made = replace(prediction(START_NS, np.array([0.01, -0.02])), most_likely='goal1:+1-post')
    statuses = Status.DEADLINE, Status.COMPROMISED, Status.ESTIMATED
    ended = [
        replace(each, solution=replace(each.solution, status=status))
        for each, status in zip(made.candidates, statuses, strict=False)
    ]
    made = replace(made, candidates=(*ended, *made.candidates[len(ended) :]))
    messages = encode_prediction_cloud(made, plane, TYPES), encode_likelihoods(made, TYPES)
    carried = [TYPESTORE.deserialize_cdr(TYPESTORE.serialize_cdr(each, each.__msgtype__), each.__msgtype__) for each in messages]
    read, known = read_snapshot(*carried, plane, *scene()), build_snapshot(made)
    assert (read.stamp_ns, read.most_likely) == (known.stamp_ns, known.most_likely)
    assert [each.label for each in read.candidates] == [each.label for each in known.candidates]
    assert read.candidates[0].label == 'goal1:+1-post'
    assert read.is_late and {each.status for each in read.candidates} == set(statuses)
    for got, expected in zip(read.candidates, known.candidates, strict=True):
        for name in ('description', 'status', 'likelihood', 'effort', 'cost_ratio', 'eta'):
            assert getattr(got, name) == getattr(expected, name)
        for name in ('times', 'path', 'velocity', 'speed', 'covariance', 'motor_covariance'):
            np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-6, atol=1e-8)


def test_messages_of_unknown_obstacles_of_nothing_and_of_different_predictions() -> None:
    made, other = prediction(START_NS, NOWHERE), prediction(START_NS + 20_000_000, NOWHERE)
    cloud, likelihoods = encode_prediction_cloud(made, 'xy', TYPES), encode_likelihoods(made, TYPES)
    read = read_snapshot(cloud, likelihoods, 'xy', made.obstacles.take([1]), made.goal_positions)
    assert [each.description for each in read.candidates] == ['', '', '']
    above = replace(made.obstacles, heights=np.array([[-np.inf, np.inf], [0.2, 0.3]]))
    assert read_snapshot(cloud, likelihoods, 'xy', above, made.goal_positions).cleared == ['post'], (
        'the hand is at a height of 0.1 m'
    )
    nothing = Prediction(START_NS, 'world', 0.1, (), None)
    read = read_snapshot(encode_prediction_cloud(nothing, 'xy', TYPES), encode_likelihoods(nothing, TYPES), 'xy', *scene())
    assert (read.candidates, read.most_likely) == ((), None)
    assert is_same_prediction(cloud, likelihoods) and not is_same_prediction(cloud, encode_likelihoods(other, TYPES))
    with pytest.raises(MessageError, match='likelihoods'):
        read_snapshot(cloud, encode_likelihoods(other, TYPES), 'xy', *scene())


IDS = ('1', '12', 'post-2', '+')
STEP_NS = 20_000_000
WAYS: dict[str, int] = {}
"""Number of the class of each label."""


def snapshot(number: int, *labels: str, goals: tuple[tuple[float, float], ...] = ((1.0, 0.0), (1.0, 1.0))) -> Snapshot:
    obstacles = make_obstacles([[0.1 * i, 0.0] for i in range(len(IDS))], 0.01, ids=IDS)
    empty = np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, 2))
    head = '', False, 1.0 / max(len(labels), 1), 1.0, 1.0, 0.9, np.zeros(0)
    candidates = tuple(CandidateView(label, *head, *empty, WAYS.setdefault(label, len(WAYS))) for label in labels)
    return Snapshot(number * STEP_NS, obstacles, np.array(goals), candidates, labels[0] if labels else None)


@pytest.mark.parametrize(
    ('label', 'goal', 'sides'),
    [
        ('goal0:', 'goal0', {}),
        ('goal1:+1-12', 'goal1', {'1': LEFT, '12': RIGHT}),
        ('goal0:+12-1', 'goal0', {'12': LEFT, '1': RIGHT}),
        ('goal0:-post-2+1', 'goal0', {'post-2': RIGHT, '1': LEFT}),
        ('goal0:++-1', 'goal0', {'+': LEFT, '1': RIGHT}),
    ],
)
def test_a_label_is_split_into_goal_and_sides(label: str, goal: str, sides: dict[str, int]) -> None:
    assert parse_label(label, IDS) == (goal, sides)


def test_letters_and_colours_differ_while_there_are_any_and_are_kept_over_an_absence() -> None:
    slots = Slots()
    assert slots.assign(range(6)) == list(range(6)), 'in order of likelihood'
    assert slots.assign([7, 3]) == [6, 3], 'a letter that has been free for longest'
    assert slots.assign([3, 0, 8]) == [3, 0, 7]
    assert slots.assign([8, 0, 9]) == [7, 0, 8], 'and of another colour'
    many = slots.assign(range(20, 33))
    assert sorted(many[:12]) == list(range(12)) and many[12] is None
    assert len({slot % 6 for slot in many[:6]}) == 6
    assert slots.assign([3])[0] in range(12)


def test_tracks_are_numbered_from_0_whatever_the_classes_are_called() -> None:
    """The rows of a report's tracks are their numbers, and its recording may begin after the classes were numbered."""
    renamed = [
        replace(each, candidates=tuple(replace(view, way=view.way + 70) for view in each.candidates))
        for each in (snapshot(0, 'goal0:+1', 'goal0:-1'), snapshot(1, 'goal0:-1', 'goal1:'))
    ]
    tracks = build_candidate_tracks(renamed)
    assert [dict(each) for each in tracks.tracks] == [{'goal0:+1': 0, 'goal0:-1': 1}, {'goal0:-1': 1, 'goal1:': 2}]
    assert list(tracks.likelihoods()) == [0, 1, 2]
    assert [build_snapshot(each).stamp_ns for each in predictions(samples())] == [each.stamp_ns for each in samples()[::4]]
