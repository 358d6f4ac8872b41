# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The output bag, read with the mcap library and its ROS 2 decoder, which share no code with the writer."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from bag_helpers import CONFIG, messages, reach, write_bag, write_parameters

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
    predictions = list(replay(decoded['bag'][0], CONFIG))
    for prediction, cloud, likelihoods in zip(predictions, decoded['/foc/prediction'], decoded['/foc/likelihoods'], strict=True):
        assert stamp_ns(cloud) == prediction.stamp_ns and cloud.header.frame_id == 'world'
        table = rows(cloud)
        assert len(table) == (CONFIG.foc.steps + 1) * len(prediction.candidates_with_likelihood)
        *labels, rest = likelihoods.layout.dim[0].label.split(';')
        assert rest == 'other' and labels[0] == prediction.most_likely
        by_label = {each.label: each for each in prediction.solved_candidates}
        assert sorted(labels) == sorted(by_label)
        for index, label in enumerate(labels):
            part, known = table[table['candidate'] == index], by_label[label]
            assert np.allclose(np.column_stack([part['x'], part['y']]), known.solution.path, atol=1e-6)
            assert np.allclose(part['t'], known.times, atol=1e-6) and np.allclose(part['z'], known.height.mean[:, 0], atol=1e-6)
            assert np.allclose(part['xx'], known.covariance[:, 0, 0], rtol=1e-6)
            assert np.allclose(part['likelihood'], known.likelihood)
