# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Views of predictions: those of the records and of the node's messages agree, and tracks keep their letters over time."""

from dataclasses import replace

import numpy as np
import pytest
from report_samples import START_NS, prediction, samples, scene

from foc_ros.core.solution import Status
from foc_ros.io.bags import TYPESTORE
from foc_ros.reporting.views import HandTrajectory, Slots, build_hand_trajectory, build_snapshot, is_late, read_snapshot
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud
from foc_ros.ros.messages.ranking import compute_cost_ratios
from foc_ros.ros.messages.types import RosbagsTypes

TYPES = RosbagsTypes(TYPESTORE)


def test_movements_are_found_where_they_are_and_tremor_is_none():
    spans = build_hand_trajectory(samples(3)).find_movements(0.05)
    np.testing.assert_allclose((np.array(spans) - START_NS) * 1e-9, [[0.5, 1.5], [2.0, 3.0], [3.5, 4.5]], atol=0.15)
    random = np.random.default_rng(3)
    hand = HandTrajectory(START_NS + np.arange(300) * 10_000_000, random.normal(scale=0.003, size=(300, 2)))
    assert np.linalg.norm(hand.velocity, axis=1).max() > 0.05
    assert hand.find_movements(0.05) == []


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_the_messages_hold_everything_that_a_report_shows(plane):
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
    assert [each.label for each in read] == [each.label for each in known.candidates_with_likelihood]
    assert read.candidates[0].label == 'goal1:+1-post'
    assert is_late(read) and {each.status for each in read.candidates} == set(statuses)
    ratios = [compute_cost_ratios(each.candidates_with_likelihood) for each in (read, known)]
    assert ratios[0] == pytest.approx(ratios[1])
    for got, expected in zip(read, known.candidates_with_likelihood, strict=True):
        for name in ('description', 'status', 'likelihood', 'effort', 'eta'):
            assert getattr(got, name) == getattr(expected, name)
        for name in ('times', 'mean', 'covariance', 'motor_covariance'):
            np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-6, atol=1e-8)


def test_letters_and_colours_differ_while_there_are_any_and_are_kept_over_an_absence():
    slots = Slots()
    assert slots.assign(range(6)) == list(range(6)), 'in order of likelihood'
    assert slots.assign([7, 3]) == [6, 3], 'a letter that has been free for longest'
    assert slots.assign([3, 0, 8]) == [3, 0, 7]
    assert slots.assign([8, 0, 9]) == [7, 0, 8], 'and of another colour'
    many = slots.assign(range(20, 33))
    assert sorted(many[:12]) == list(range(12)) and many[12] is None
    assert len({slot % 6 for slot in many[:6]}) == 6
    assert slots.assign([3])[0] in range(12)
