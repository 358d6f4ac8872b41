"""The node's messages contain everything that a report shows of a prediction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from report_samples import START_NS, prediction, scene

from foc_ros.core.errors import MessageError
from foc_ros.core.types import Prediction
from foc_ros.io.bags import TYPESTORE
from foc_ros.reporting.snapshots import build_snapshot, is_same_prediction, read_snapshot
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud
from foc_ros.ros.messages.types import RosbagsTypes

TYPES = RosbagsTypes(TYPESTORE)
PLANES = ('xy', 'xz', 'yz')


@pytest.mark.parametrize('plane', PLANES)
def test_round_trip(plane: str) -> None:
    made = prediction(START_NS, np.array([0.01, -0.02]))
    read = read_snapshot(encode_prediction_cloud(made, plane, TYPES), encode_likelihoods(made, TYPES), plane, *scene())
    known = build_snapshot(made)
    assert (read.stamp_ns, read.most_likely) == (known.stamp_ns, known.most_likely)
    assert [each.label for each in read.candidates] == [each.label for each in known.candidates]
    for got, expected in zip(read.candidates, known.candidates, strict=True):
        for name in ('description', 'is_compromised', 'likelihood', 'effort', 'cost_ratio', 'eta'):
            assert getattr(got, name) == getattr(expected, name)
        for name in ('times', 'path', 'velocity', 'speed', 'covariance', 'motor_covariance'):
            np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-6, atol=1e-8)


def test_the_most_likely_candidate_by_hysteresis_is_first() -> None:
    made = replace(prediction(START_NS, np.zeros(2)), most_likely='goal1:+1-post')
    read = read_snapshot(encode_prediction_cloud(made, 'xy', TYPES), encode_likelihoods(made, TYPES), 'xy', *scene())
    assert read.most_likely == read.candidates[0].label == 'goal1:+1-post'
    assert [each.label for each in read.candidates] == [each.label for each in build_snapshot(made).candidates]


def test_a_label_with_an_unknown_obstacle_has_no_description() -> None:
    made = prediction(START_NS, np.zeros(2))
    messages = encode_prediction_cloud(made, 'xy', TYPES), encode_likelihoods(made, TYPES)
    read = read_snapshot(*messages, 'xy', made.obstacles.take([1]), made.goals)
    assert [each.description for each in read.candidates] == ['', '', '']


def test_nothing_solved() -> None:
    made = Prediction(START_NS, 'world', 0.1, (), None)
    read = read_snapshot(encode_prediction_cloud(made, 'xy', TYPES), encode_likelihoods(made, TYPES), 'xy', *scene())
    assert (read.candidates, read.most_likely) == ((), None)


def test_messages_of_different_predictions_are_refused() -> None:
    one, two = prediction(START_NS, np.zeros(2)), prediction(START_NS + 20_000_000, np.zeros(2))
    cloud = encode_prediction_cloud(one, 'xy', TYPES)
    assert is_same_prediction(cloud, encode_likelihoods(one, TYPES))
    assert not is_same_prediction(cloud, encode_likelihoods(two, TYPES))
    with pytest.raises(MessageError, match='likelihoods'):
        read_snapshot(cloud, encode_likelihoods(two, TYPES), 'xy', *scene())


def test_messages_match_after_serialisation() -> None:
    made = prediction(START_NS, np.zeros(2))
    cloud, table = encode_prediction_cloud(made, 'xy', TYPES), encode_likelihoods(made, TYPES)
    carried = [TYPESTORE.deserialize_cdr(TYPESTORE.serialize_cdr(m, m.__msgtype__), m.__msgtype__) for m in (cloud, table)]
    assert is_same_prediction(*carried)
