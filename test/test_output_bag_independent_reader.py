# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The output bag, read with the mcap library and its ROS 2 decoder, which share no code with the writer."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from bag_helpers import CONFIG, GOAL, messages, ns, reach, write_bag, write_parameters

from foc_ros.analysis.replay import replay
from foc_ros.cli.main import main

mcap_reader = pytest.importorskip('mcap.reader', reason='the mcap library is not installed')
mcap_decoder = pytest.importorskip('mcap_ros2.decoder', reason='mcap-ros2-support is not installed')

SECONDS = 0.1
DTYPES = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}


@pytest.fixture(scope='module')
def decoded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[object]]:
    """Messages by topic as the independent reader decodes them."""
    folder = tmp_path_factory.mktemp('independent')
    bag = write_bag(folder / 'reach', messages(seconds=SECONDS))
    assert main(['replay', str(bag), '--output', str(folder / 'out'), '--params', write_parameters(folder)]) == 0
    topics: dict[str, list[object]] = {'bag': [bag], 'out': [folder / 'out']}
    with (folder / 'out' / 'out.mcap').open('rb') as stream:
        reader = mcap_reader.make_reader(stream, decoder_factories=[mcap_decoder.DecoderFactory()])
        for _, channel, message, ros in reader.iter_decoded_messages():
            assert message.log_time > 0
            topics.setdefault(channel.topic, []).append(ros)
    return topics


def rows(cloud: object) -> np.ndarray:
    names, formats, offsets = zip(*((each.name, '<' + DTYPES[each.datatype], each.offset) for each in cloud.fields), strict=True)
    kind = np.dtype({'names': names, 'formats': formats, 'offsets': offsets, 'itemsize': cloud.point_step})
    return np.frombuffer(bytes(cloud.data), dtype=kind)


def stamp_ns(message: object) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_topics_and_counts(decoded: dict[str, list[object]]) -> None:
    poses = len(reach(SECONDS))
    assert {topic: len(found) for topic, found in decoded.items() if topic not in ('bag', 'out')} == {
        '/hand_pose': poses,
        '/obstacles': 1,
        '/goals': 1,
        '/foc/prediction': poses,
        '/foc/likelihoods': poses,
        '/foc/likelihoods_by_name': poses,
        '/foc/path': poses,
        '/foc/markers': poses,
    }


def test_metadata_agrees_with_the_messages(decoded: dict[str, list[object]]) -> None:
    information = yaml.safe_load((decoded['out'][0] / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert information['version'] == 9 and information['storage_identifier'] == 'mcap'
    assert information['message_count'] == sum(len(found) for topic, found in decoded.items() if topic.startswith('/'))
    assert information['relative_file_paths'] == ['out.mcap']


def test_rows_of_the_prediction_are_read_by_field_name(decoded: dict[str, list[object]]) -> None:
    steps = CONFIG.foc.steps
    predictions = list(replay(decoded['bag'][0], CONFIG))
    clouds, tables = decoded['/foc/prediction'], decoded['/foc/likelihoods']
    assert (
        [stamp_ns(cloud) for cloud in clouds]
        == [prediction.stamp_ns for prediction in predictions]
        == [ns(t) for t, _ in reach(SECONDS)]
    )
    for prediction, cloud, likelihoods in zip(predictions, clouds, tables, strict=True):
        assert cloud.header.frame_id == 'world'
        table = rows(cloud)
        names = 'x y z t vx vy vz xx xy xz yy yz zz candidate likelihood compromised'
        assert ' '.join(table.dtype.names) == f'{names} motor_xx motor_xy motor_xz motor_yy motor_yz motor_zz goal way status'
        assert len(table) == (steps + 1) * len(prediction.candidates_with_likelihood) and np.isfinite(table['x']).all()
        *labels, rest = likelihoods.layout.dim[0].label.split(';')
        assert rest == 'other'
        assert labels[0] == prediction.most_likely and sorted(labels) == sorted(
            each.candidate.label for each in prediction.solved_candidates
        )
        by_label = {outcome.candidate.label: outcome for outcome in prediction.solved_candidates}
        for index, label in enumerate(labels):
            part, solution = table[table['candidate'] == index], by_label[label].solution
            assert np.allclose(np.column_stack([part['x'], part['y']]), solution.path, atol=1e-6)
            height = by_label[label].height
            assert height is not None and np.allclose(height.mean[[0, -1], 0], [0.1, 0.0], atol=1e-6)
            assert np.allclose(part['t'], solution.times, atol=1e-6) and np.allclose(part['z'], height.mean[:, 0], atol=1e-6)
            assert np.allclose(part['zz'], height.stddev**2, rtol=1e-5, atol=1e-12)
            assert np.allclose(part['xx'], solution.covariance[:, 0, 0], rtol=1e-6)
            assert np.allclose(part['likelihood'], by_label[label].likelihood)
            assert np.allclose([part['x'][-1], part['y'][-1]], GOAL[0, :2], atol=1e-6)
