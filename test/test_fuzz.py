# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Any messages in any order, and damaged recordings and tables: no exception, nothing is lost unsaid, no number is not finite.

FOC_ROS_FUZZ: the number of messages, 1,000 by default. A live node among faulty publishers is that of `scripts/stress.py soak`.
"""

import json
import os
import random
import re
import struct
import time
from dataclasses import asdict

import numpy as np
import pytest
from bag_helpers import messages, write_mcap, write_parameters
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType
from message_helpers import BAGS, SECOND, cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped
from message_helpers import read_columns as columns
from test_unusual_recordings import WHOLE, write_metadata, write_sqlite

from foc_ros.cli.main import main
from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import Pipeline
from foc_ros.io import topics
from foc_ros.io.bags import BagReader
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.encode_prediction import encode_outputs

COUNT = int(os.environ.get('FOC_ROS_FUZZ', '1000'))
LENGTH = 20
CONFIG = replace_values(Config(), {'foc.steps': 10, 'homotopy.max_candidates': 2, 'rate_hz': 1000.0})
THOROUGH = settings(
    max_examples=max(COUNT // LENGTH, 1), suppress_health_check=list(HealthCheck), deadline=None, derandomize=True, database=None
)


def intake_of(known):
    """Return a new intake, without a scene or with a scene and a goal, so that poses lead to predictions."""
    intake = Intake(Pipeline(CONFIG))
    if known:
        intake.take(topics.CLOUD, cloud(BAGS, obstacle_table([(0.1, 0.05, 0.0, 0.02)]), 11 * SECOND))
        intake.take(topics.GOALS, pose_array(BAGS, [(0.3, 0.0, 0.0)]))
    return intake


def check_finite(sent):
    """Check that all numbers are finite, but for those of what is no candidate: it has a likelihood alone."""
    labels = sent['likelihoods'].layout.dim[0].label.split(';')
    for label, row in zip(labels, np.reshape(sent['likelihoods'].data, (-1, 4)), strict=False):
        assert np.isfinite(row[:1] if label in ('unknown', 'other') else row).all()
    assert all(np.isfinite(column.astype(float)).all() for column in columns(sent['prediction']).values())
    for name in sent.keys() - {'likelihoods', 'prediction'}:
        json.dumps(asdict(sent[name]), allow_nan=False, default=np.ndarray.tolist)


def test_any_messages_in_any_order():
    seen = {'predicted': 0, 'refused': 0}

    @THOROUGH
    @given(st.sampled_from([True, True, True, False]), st.lists(inputs(BAGS), min_size=LENGTH, max_size=LENGTH))
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
            check_finite(encode_outputs(prediction, 'xy', BAGS))
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
PLAIN = ('x', 'y', 'z', 'radius')
LAYOUTS = (
    [(name, '<f4') for name in PLAIN],
    [(name, '>f4') for name in PLAIN],
    [*((name, '<f8') for name in PLAIN), ('radius_stddev', '<f4'), ('id', '<u4')],
    [(name, '<f4') for name in (*PLAIN, 'vx', 'vy', 'vz')],
    [('x', '<f4'), ('y', '<f4'), ('z', '<i4'), ('radius', '<f4')],
    [('x', '<f4'), ('y', '<f4'), ('intensity', '<f4')],
)
DAMAGES = st.sampled_from(
    [{}] * 8
    + [{'data': b''}, {'data': b'abc'}, {'width': 0}, {'width': 2**32 - 1}, {'height': 7}, {'point_step': 0}]
    + [{'point_step': 2**32 - 1}, {'row_step': 1}, {'fields': []}, {'is_bigendian': True}, {'height': 2**16, 'width': 2**16}]
)
MARKERS = st.fixed_dictionaries(
    {
        'position': POINTS,
        'scale': st.one_of(st.just((0.04, 0.04, 0.04)), POINTS),
        'ns': st.sampled_from(['a', 'b;c', '']),
        'id': st.integers(-2, 2),
        'type': st.sampled_from([2, 2, 3, 1, 9, 77]),
        'action': st.sampled_from([0, 0, 0, 2, 3, 1, -4]),
        'lifetime': st.sampled_from([0, 0, 0.1, 3, -1]),
        'stamp_ns': STAMPS,
        'frame_id': FRAMES,
    }
)


@st.composite
def clouds(draw, types):
    layout = draw(st.sampled_from(LAYOUTS))
    rows = draw(st.lists(st.tuples(*[FLOAT32] * 4), max_size=4))
    table = np.zeros(len(rows), dtype=layout)
    with np.errstate(all='ignore'):
        for i, row in enumerate(rows):
            for name, value in zip((layout[0][0], layout[1][0], layout[2][0], layout[-1][0]), row, strict=True):
                table[name][i] = value if table.dtype[name].kind == 'f' else 7
    if 'radius' in (table.dtype.names or ()) and draw(st.booleans()):
        table['radius'] = 0.02
    return cloud(types, table, draw(STAMPS), draw(FRAMES), **draw(DAMAGES))


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
        st.lists(MARKERS, max_size=3).map(
            lambda given: (topics.MARKERS, marker_array(types, *(marker(types, **each) for each in given)))
        ),
    )


FEW = 8
LONGEST_S = 10.0
"""Time of the processor for one command: other programs may keep it waiting for longer."""
GIVEN = messages(seconds=0.3)
POSES = sum(topic == '/hand_pose' for topic, _, _ in GIVEN)
WRITERS = (
    {},
    {'use_chunking': False},
    {'compression': CompressionType.LZ4, 'enable_crcs': False},
    {'index_types': IndexType.NONE, 'repeat_channels': False},
)


def write_recording(folder, source):
    """Write a recording of a kind by chance into a new folder, and return its file."""
    folder.mkdir(parents=True)
    kind = source.randrange(6)
    if kind < 4:
        write_mcap(folder / 'one.mcap', GIVEN, per_chunk=7, **WRITERS[kind])
        return folder / 'one.mcap'
    write_sqlite(folder / 'one.db3', mode='WAL' if kind == 5 else 'DELETE').close()
    return folder / 'one.db3'


def change_bytes(data, source):
    start, size, kind = source.randrange(len(data)), source.choice((1, 9, 200)), source.randrange(4)
    if kind == 0:
        changed = bytearray(data)
        for _ in range(source.choice((1, 3, 30))):
            changed[source.randrange(len(data))] ^= 1 << source.randrange(8)
        return bytes(changed)
    if kind == 1:
        return data[:start]
    return data[:start] + (data[start : start + size] * 2 if kind == 2 else b'') + data[start + size :]


def change_records(data, source):
    places = [8]
    while places[-1] < len(data) - 8:
        places.append(places[-1] + 9 + struct.unpack_from('<Q', data, places[-1] + 1)[0])
    row = source.randrange(len(places) - 1)
    start, end = places[row : row + 2]
    return data[:start] + source.choice((0, 2)) * data[start:end] + data[end:]


def run_in_time(capsys, *arguments):
    """Run a command that ends in time, with a known code, and in words unless that is 0; return its code and what it said."""
    begin = time.process_time()
    code = main([str(each) for each in arguments])
    assert time.process_time() - begin < LONGEST_S
    out, err = capsys.readouterr()
    assert code in (0, 2, 3) and (code == 0 or err) and 'Traceback' not in err
    return code, out, err


def check_recording(folder, number, capsys):
    source = random.Random(number)
    file = write_recording(folder / str(number), source)
    if source.random() < 0.5:
        write_metadata(file.parent, [file.name], len(WHOLE))
    change = change_records if file.suffix == '.mcap' and source.random() < 0.4 else change_bytes
    file.write_bytes(change(file.read_bytes(), source))
    path = source.choice((file, file.parent))
    code, out, err = run_in_time(capsys, 'replay', path, '--json', '--params', write_parameters(folder))
    if code == 0 and not err:
        assert json.loads(out)['summary']['samples'] == POSES, number
        with BagReader(path) as reader:
            assert len(list(reader)) >= len(WHOLE), number  # SQLite alone does not tell a doubled row from two


def check_tables(folder, number, capsys):
    source, tables = random.Random(number), folder / str(number)
    tables.mkdir()
    rows = [f'{name},{0.02 * i:.2f},{0.001 * i * i:.4f},0.1' for name in ('a', 'b') for i in range(20)]
    texts = {
        'recordings.csv': '\n'.join(['recording,t_s,x_m,y_m', *rows, '']),
        'goals.csv': 'x_m,y_m\n0.3,0.1\n0.4,0\n',
        'obstacles.csv': 'x_m,y_m,radius_m\n0.15,0,0.03\n',
    }
    changed = source.choice((*texts, 'recordings.csv', 'recordings.csv'))
    for name, text in texts.items():
        data = text.replace(',', source.choice(',,;\t')).encode()
        (tables / name).write_bytes(change_bytes(data, source) if name == changed else data)
    code, out, _ = run_in_time(capsys, 'convert', tables, '--output', tables / 'bags')
    assert code != 3
    if code == 0:
        given = (tables / 'recordings.csv').read_text().splitlines()[1:]
        read = re.search(r'with (\d+) hand poses', out)
        assert read is not None and int(read[1]) == sum(bool(line.strip()) for line in given), number


@pytest.mark.parametrize('check', [check_recording, check_tables])
def test_damaged_inputs_end_in_words(tmp_path, capsys, check):
    for number in range(FEW):
        check(tmp_path, number, capsys)
