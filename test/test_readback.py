"""What the node publishes tells as much of a prediction as reports show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from report_samples import START_NS, prediction, scene

from foc_ros.core.errors import MessageError
from foc_ros.core.types import Prediction
from foc_ros.io.bags import TYPESTORE
from foc_ros.reporting.readback import belong_together, snapshot_of_messages
from foc_ros.reporting.snapshots import snapshot_of_prediction
from foc_ros.ros.messages.outputs import likelihood_array, prediction_cloud
from foc_ros.ros.messages.types import RosbagsTypes

TYPES = RosbagsTypes(TYPESTORE)
PLANES = ('xy', 'xz', 'yz')


@pytest.mark.parametrize('plane', PLANES)
def test_round_trip(plane: str) -> None:
    made = prediction(START_NS, np.array([0.01, -0.02]))
    told = snapshot_of_messages(prediction_cloud(made, plane, TYPES), likelihood_array(made, TYPES), plane, *scene())
    known = snapshot_of_prediction(made, *scene())
    assert (told.stamp_ns, told.most_likely) == (known.stamp_ns, known.most_likely)
    assert [way.label for way in told.ways] == [way.label for way in known.ways]
    for got, expected in zip(told.ways, known.ways, strict=True):
        for name in ('likelihood', 'effort', 'cost_ratio', 'eta'):
            assert getattr(got, name) == getattr(expected, name)
        for name in ('times', 'path', 'speed', 'covariance'):
            np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-6, atol=1e-8)


def test_the_most_likely_by_hysteresis_comes_first() -> None:
    made = replace(prediction(START_NS, np.zeros(2)), most_likely='goal1:+1-post')
    told = snapshot_of_messages(prediction_cloud(made, 'xy', TYPES), likelihood_array(made, TYPES), 'xy', *scene())
    assert told.most_likely == told.ways[0].label == 'goal1:+1-post'
    assert [way.label for way in told.ways] == [way.label for way in snapshot_of_prediction(made, *scene()).ways]


def test_nothing_solved() -> None:
    made = Prediction(START_NS, 'world', 0.1, (), None)
    told = snapshot_of_messages(prediction_cloud(made, 'xy', TYPES), likelihood_array(made, TYPES), 'xy', *scene())
    assert (told.ways, told.most_likely) == ((), None)


def test_others_are_told_apart() -> None:
    one, two = prediction(START_NS, np.zeros(2), 0.6), prediction(START_NS, np.zeros(2), 0.61)
    cloud = prediction_cloud(one, 'xy', TYPES)
    assert belong_together(cloud, likelihood_array(one, TYPES))
    assert not belong_together(cloud, likelihood_array(two, TYPES))
    with pytest.raises(MessageError, match='likelihoods'):
        snapshot_of_messages(cloud, likelihood_array(two, TYPES), 'xy', *scene())


def test_survives_the_wire() -> None:
    made = prediction(START_NS, np.zeros(2))
    cloud, table = prediction_cloud(made, 'xy', TYPES), likelihood_array(made, TYPES)
    carried = [TYPESTORE.deserialize_cdr(TYPESTORE.serialize_cdr(m, m.__msgtype__), m.__msgtype__) for m in (cloud, table)]
    assert belong_together(*carried)
