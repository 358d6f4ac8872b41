# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node publishes the predictions of a replay, to the last bit, when a bag's raw messages are sent over DDS."""

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from bag_helpers import CONFIG, messages, write_bag  # noqa: E402
from bag_helpers import TYPES as BAG_TYPES  # noqa: E402
from message_helpers import cloud, obstacle_table, pose_array  # noqa: E402
from node_helpers import TYPES, Bench, figures  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

from foc_ros.analysis.replay import Replay  # noqa: E402
from foc_ros.core.classes.library import is_same_recording  # noqa: E402
from foc_ros.core.config import Config, flatten, replace_values  # noqa: E402
from foc_ros.io.bags import BagReader  # noqa: E402
from foc_ros.ros.messages.encode_prediction import encode_outputs  # noqa: E402

SECONDS = 0.2
LV = replace_values(Config(), {'foc.eta': 0.3, 'foc.steps': 20, 'foc.noise_x': 0.02, 'foc.noise_y': 0.02})
LEARNING = {'experience.learning': 'online', 'rate_hz': 10.0, 'foc.steps': 20, 'homotopy.max_candidates': 2}
NO_LIMITS = {'scene.timeout_s': 0.0, 'estimator.hand_timeout_s': 0.0, 'budget_s': 0.0}


def messages_in_space():
    """Return a reach that goes down to a goal, over a low obstacle and past one of any height."""
    columns = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'size_z')]
    scene = obstacle_table([(0.15, 0.0, 0.02, 0.03, 0.04), (0.2, 0.02, 0.0, 0.02, 0.0)], columns)
    found = []
    for topic, stamp_ns, message in messages(SECONDS):
        if topic == '/obstacles':
            message = cloud(BAG_TYPES, scene, stamp_ns)
        elif topic == '/goals':
            message = pose_array(BAG_TYPES, [(0.3, 0.0, 0.2)])
        else:
            message.pose.position.z = 0.4 - 0.5 * message.pose.position.x
        found.append((topic, stamp_ns, message))
    return found


CASES = {
    'lv': (LV, lambda: messages(SECONDS)),
    'heights': (CONFIG, messages_in_space),
    '1 kHz': (CONFIG, lambda: messages(0.1, rate_hz=1000.0)),
    'learning': (replace_values(Config(), LEARNING), lambda: messages(1.0)),
}
"""Parameters, and the messages of a recording."""


def sent(message):
    """Return the message after serialisation, with its float32 fields rounded."""
    return deserialize_message(serialize_message(message), type(message))


@pytest.mark.parametrize('case', CASES)
def test_the_node_publishes_what_replay_computes(ros, tmp_path, case):
    config, make_messages = CASES[case]
    config = replace_values(config, NO_LIMITS)
    bench, replay, expected = Bench(ros, **flatten(config)), Replay(config), []
    with BagReader(write_bag(tmp_path / 'reach', make_messages())) as reader:
        for step in replay.steps(reader):
            bench.deliver(step.item.role, bytes(step.item.raw))
            if step.prediction is not None:
                expected.append(encode_outputs(step.prediction, 'xy', TYPES))
    count = len(expected)
    assert count > 3
    assert max(each['prediction'].width for each in expected) == 2 * (config.foc.steps + 1)
    for name in ('prediction', 'path', 'markers'):
        assert bench.wait_for(name, count) == [sent(each[name]) for each in expected]
    for received, each in zip(bench.wait_for('likelihoods', count), expected, strict=True):
        assert received.layout == sent(each['likelihoods']).layout
        assert np.array_equal(received.data, each['likelihoods'].data, equal_nan=True)  # of shares without a candidate
    skipped = figures(bench.health()).get('count hand_skipped', '0')
    assert skipped == str(replay.intake.counts.get('hand_skipped', 0))
    assert (skipped != '0') == (case == '1 kHz')
    live, learnt = (each.learnt.movements.finish().learnt for each in (bench.node.pipeline, replay.pipeline))
    assert (len(live) > 0) == (case == 'learning')
    assert all(is_same_recording(*each) for each in zip(live, learnt, strict=True))
