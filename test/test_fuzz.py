# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Any messages in any order: no exception, no number that is not finite, and no prediction without a new pose.

FOC_ROS_FUZZ: the number of messages, 1,000 by default. A live node among faulty publishers is that of `scripts/stress.py soak`.
"""

import os
from dataclasses import fields, is_dataclass

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from message_helpers import SECOND, cloud, marker, marker_array, message_types, obstacle_table, pose_array, pose_stamped
from message_helpers import read_columns as columns

from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import Pipeline
from foc_ros.io import topics
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.encode_prediction import encode_outputs

COUNT = int(os.environ.get('FOC_ROS_FUZZ', '1000'))
LENGTH = 20
TYPES = message_types('rosbags')
CONFIG = replace_values(Config(), {'foc.steps': 10, 'homotopy.max_candidates': 2, 'rate_hz': 1000.0})
THOROUGH = settings(
    max_examples=max(COUNT // LENGTH, 1), suppress_health_check=list(HealthCheck), deadline=None, derandomize=True, database=None
)


def intake_of(known):
    """Return a new intake, without a scene or with a scene and a goal, so that poses lead to predictions."""
    intake = Intake(Pipeline(CONFIG))
    if known:
        intake.take(topics.CLOUD, cloud(TYPES, obstacle_table([(0.1, 0.05, 0.0, 0.02)]), 11 * SECOND))
        intake.take(topics.GOALS, pose_array(TYPES, [(0.3, 0.0, 0.0)]))
    return intake


def numbers(message):
    """Yield every number of an output message; of a cloud, those of its rows."""
    if hasattr(message, 'point_step'):
        for column in columns(message).values():
            yield from column.astype(float).tolist()
    elif isinstance(message, (int, float)):
        yield float(message)
    elif isinstance(message, (list, tuple, np.ndarray)):
        for each in message:
            yield from numbers(each)
    elif is_dataclass(message):
        for each in fields(message):
            yield from numbers(getattr(message, each.name))


def is_finite(name, message):
    """Return whether all numbers are finite, but for those of what is no candidate: it has a likelihood alone."""
    if name != 'likelihoods':
        return all(map(np.isfinite, numbers(message)))
    labels, table = message.layout.dim[0].label.split(';'), np.reshape(message.data, (-1, 4))
    candidates = [label not in ('unknown', 'other') for label in labels]
    return bool(np.isfinite(table[:, 0]).all() and np.isfinite(table[: len(candidates)][candidates[: len(table)]]).all())


def test_any_messages_in_any_order():
    seen = {'predicted': 0, 'refused': 0}

    @THOROUGH
    @given(st.sampled_from([True, True, True, False]), st.lists(inputs(TYPES), min_size=LENGTH, max_size=LENGTH))
    def play(known, messages):
        intake = intake_of(known)
        pipeline = intake.pipeline
        for role, message in messages:
            verdict = intake.take(role, message)
            seen['refused'] += verdict is None or not verdict.is_taken
            if role != topics.HAND or verdict is None or not verdict.is_taken:
                continue
            prediction = pipeline.predict() if pipeline.is_due else None
            if prediction is None:
                continue
            seen['predicted'] += 1
            stamp = message.header.stamp
            assert prediction.stamp_ns == stamp.sec * 1_000_000_000 + stamp.nanosec
            sent = encode_outputs(prediction, 'xy', TYPES)
            assert all(is_finite(name, each) for name, each in sent.items())
            assert pipeline.predict() is None, 'predicted twice from one pose'

    play()
    assert seen['predicted'] > COUNT / 100 and seen['refused'] > COUNT / 20, 'otherwise nothing is tested'


EXTREMES = (float('nan'), float('inf'), float('-inf'), 1e4, -1e4, 1e30, -1e30, 1e-300, 0.0, -0.0)
PLACES = st.floats(-0.5, 0.5)
NUMBERS = st.one_of(PLACES, PLACES, PLACES, st.sampled_from(EXTREMES), st.floats())
FLOAT32 = st.one_of(PLACES, PLACES, st.sampled_from(EXTREMES[:7]), st.floats(width=32)).map(np.float32)
MOVING = st.integers(10 * SECOND, 13 * SECOND)
STAMPS = st.one_of(MOVING, MOVING, st.integers(-SECOND, (2**31 - 1) * SECOND), st.just(0))
FRAMES = st.sampled_from(['world'] * 6 + ['camera', ''])
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
LAYOUTS = (
    [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('radius', '<f4')],
    [('x', '>f4'), ('y', '>f4'), ('z', '>f4'), ('radius', '>f4')],
    [('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('radius', '<f8'), ('radius_stddev', '<f4'), ('id', '<u4')],
    [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('radius', '<f4'), ('vx', '<f4'), ('vy', '<f4'), ('vz', '<f4')],
    [('x', '<f4'), ('y', '<f4'), ('z', '<i4'), ('radius', '<f4')],
    [('x', '<f4'), ('y', '<f4'), ('intensity', '<f4')],
)
DAMAGES = st.sampled_from(
    [{}] * 8
    + [{'data': b''}, {'data': b'abc'}, {'width': 0}, {'width': 2**32 - 1}, {'height': 7}, {'point_step': 0}]
    + [{'point_step': 2**32 - 1}, {'row_step': 1}, {'fields': []}, {'is_bigendian': True}, {'height': 2**16, 'width': 2**16}]
)


@st.composite
def clouds(draw, types):
    layout = draw(st.sampled_from(LAYOUTS))
    rows = draw(st.lists(st.tuples(*[FLOAT32] * 4), max_size=4))
    table = obstacle_table([], layout) if not rows else np.zeros(len(rows), dtype=layout)
    with np.errstate(all='ignore'):
        for i, row in enumerate(rows):
            for name, value in zip((layout[0][0], layout[1][0], layout[2][0], layout[-1][0]), row, strict=True):
                table[name][i] = value if table.dtype[name].kind == 'f' else 7
    if 'radius' in (table.dtype.names or ()) and draw(st.booleans()):
        table['radius'] = 0.02
    return cloud(types, table, draw(STAMPS), draw(FRAMES), **draw(DAMAGES))


@st.composite
def markers(draw, types):
    made = [
        marker(
            types,
            draw(POINTS),
            draw(st.one_of(st.just((0.04, 0.04, 0.04)), POINTS)),
            ns=draw(st.sampled_from(['a', 'b;c', ''])),
            id=draw(st.integers(-2, 2)),
            type=draw(st.sampled_from([2, 2, 3, 1, 9, 77])),
            action=draw(st.sampled_from([0, 0, 0, 2, 3, 1, -4])),
            lifetime=draw(st.sampled_from([0, 0, 0.1, 3, -1])),
            stamp_ns=draw(STAMPS),
            frame_id=draw(FRAMES),
        )
        for _ in range(draw(st.integers(0, 3)))
    ]
    return marker_array(types, *made)


def inputs(types):
    """Return the strategy of (topic, message); most messages are hand poses."""
    hands = st.builds(lambda *given: (topics.HAND, pose_stamped(types, *given)), POINTS, STAMPS, FRAMES)
    steady = st.builds(lambda at, stamp: (topics.HAND, pose_stamped(types, at, stamp)), st.tuples(*[PLACES] * 3), STAMPS)
    return st.one_of(
        steady,
        hands,
        st.builds(lambda *given: (topics.GOAL, pose_stamped(types, *given)), POINTS, STAMPS, FRAMES),
        st.builds(lambda *given: (topics.GOALS, pose_array(types, *given)), st.lists(POINTS, max_size=3), FRAMES),
        clouds(types).map(lambda message: (topics.CLOUD, message)),
        markers(types).map(lambda message: (topics.MARKERS, message)),
    )
