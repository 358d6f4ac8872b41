# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings as recorders, converters and accidents leave them: each is read as a whole, or what is missing is named."""

import os
import re
import sqlite3
import warnings
from functools import partial

import pytest
import zstandard
from bag_helpers import STORE, messages, write_bag, write_mcap
from mcap.writer import CompressionType, IndexType

from foc_ros.analysis.recordings import BagRecording
from foc_ros.cli.main import main
from foc_ros.core.errors import FocWarning, MessageError, RecordingError
from foc_ros.io import bags
from foc_ros.io.bags import BagReader

SHORT = messages(seconds=0.3)
WHOLE = sorted((topic, stamp_ns, bytes(STORE.serialize_cdr(made, made.__msgtype__))) for topic, stamp_ns, made in SHORT)
SHORT_KINDS = {topic: made.__msgtype__ for topic, _, made in SHORT}
TOPICS = 'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT'
MESSAGES = 'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)'


def read(path, **options):
    with BagReader(path, **options) as reader:
        return sorted((item.topic, item.log_ns, item.raw) for item in reader)


def write_sqlite(file, content=WHOLE, encoding='cdr', rename=str, mode='DELETE'):
    """Write a file as ROS 2 Foxy does, which has no definitions; return the open database."""
    database = sqlite3.connect(file)
    database.execute(f'PRAGMA journal_mode={mode}')
    database.execute(f"{TOPICS}, offered_qos_profiles TEXT DEFAULT '')")
    database.execute(MESSAGES)
    keys = {topic: key for key, topic in enumerate(SHORT_KINDS, 1)}
    rows = [(key, topic, rename(SHORT_KINDS[topic]), encoding) for topic, key in keys.items()]
    database.executemany('INSERT INTO topics(id, name, type, serialization_format) VALUES(?, ?, ?, ?)', rows)
    values = [(keys[topic], stamp_ns, raw) for topic, stamp_ns, raw in content]
    database.executemany('INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)', values)
    database.commit()
    return database


def metadata(files, count):
    return f'rosbag2_bagfile_information:\n  relative_file_paths: [{files}]\n  message_count: {count}\n'


def write_metadata(folder, names, count):
    (folder / 'metadata.yaml').write_text(metadata(', '.join(names), count))


def write_either(file):
    file.parent.mkdir(exist_ok=True)
    if file.suffix == '.mcap':
        write_mcap(file, SHORT)
    else:
        write_sqlite(file).close()
    return file


def change_rows(database, statement, values):
    database.executemany(statement, values)
    database.commit()
    database.close()


@pytest.mark.parametrize('share', [1.0, 0.5])
def test_a_killed_sqlite_recorder_leaves_a_log_that_is_read_with_a_warning(tmp_path, share):
    first = len(WHOLE) // 2
    database = write_sqlite(tmp_path / 'live.db3', WHOLE[:first], mode='WAL')
    database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
    for topic, stamp_ns, raw in WHOLE[first:]:
        (key,) = database.execute('SELECT id FROM topics WHERE name = ?', (topic,)).fetchone()
        database.execute('INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)', (key, stamp_ns, raw))
        database.commit()
    (tmp_path / 'copy').mkdir()
    file = tmp_path / 'copy' / 'killed_0.db3'
    file.write_bytes((tmp_path / 'live.db3').read_bytes())
    log = (tmp_path / 'live.db3-wal').read_bytes()
    file.with_name('killed_0.db3-wal').write_bytes(log[: int(share * len(log))])
    database.close()
    before = sorted(each.name for each in file.parent.iterdir())
    with pytest.warns(FocWarning, match=r'killed_0\.db3: the recorder was killed: what it had not written to killed_0\.db3-wal'):
        found = read(file)
    assert found == WHOLE if share == 1.0 else first < len(found) < len(WHOLE)
    with pytest.raises(RecordingError, match='the recorder was killed'):  # a part of a movement cannot be evaluated
        list(BagRecording('killed', file.parent).items())
    assert sorted(each.name for each in file.parent.iterdir()) == before
    file.with_name('killed_0.db3-wal').unlink()
    with pytest.warns(FocWarning, match='written with a -wal file, which is not here; the last messages may be missing'):
        assert len(read(file)) == first
    write_metadata(file.parent, [file.name], len(WHOLE))
    with pytest.warns(FocWarning, match=f'metadata.yaml states {len(WHOLE)} messages, and the files hold {first}'):
        read(file.parent)


@pytest.mark.parametrize(
    'options',
    [
        {'compression': CompressionType.LZ4, 'use_summary_offsets': False, 'enable_crcs': False},
        {'repeat_channels': False, 'use_statistics': False, 'index_types': IndexType.NONE, 'repeat_schemas': False},
    ],
)
def test_every_record_of_a_summary_is_optional(tmp_path, options):
    write_mcap(tmp_path / 'lean.mcap', SHORT, per_chunk=7, **options)
    assert read(tmp_path / 'lean.mcap') == WHOLE


@pytest.mark.parametrize(('kind', 'is_folder'), [('.mcap', True), ('.db3', False)])
def test_files_and_messages_may_be_compressed(tmp_path, kind, is_folder):
    plain, packed = write_either(tmp_path / f'plain{kind}'), tmp_path / 'bag' / f'plain{kind}.zstd'
    packed.parent.mkdir()
    packed.write_bytes(zstandard.compress(plain.read_bytes()))
    write_metadata(packed.parent, [f'somewhere/plain{kind}'], len(WHOLE))
    assert read(packed.parent if is_folder else packed) == WHOLE
    packed.write_bytes(packed.read_bytes()[:-40])
    with pytest.raises(RecordingError, match='damaged'):
        read(packed, is_whole=True)
    write_sqlite(tmp_path / 'single.db3', [(topic, stamp_ns, zstandard.compress(raw)) for topic, stamp_ns, raw in WHOLE]).close()
    assert read(tmp_path / 'single.db3') == WHOLE


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'not the metadata of this bag, and not used'),
        (metadata('', 3), 'it names no file'),
        (metadata('other.db3', 3), 'it names other.db3, and here is one.mcap'),
        (metadata('one.mcap', 3), 'metadata.yaml is wrong: it states 3'),
        (metadata('one.mcap', 99), 'states 99 messages'),
        (metadata('one.mcap, two.mcap', 19), 'two.mcap, which .* missing'),
    ],
)
def test_wrong_metadata_is_named_and_hides_nothing(tmp_path, text, words):
    bag = write_bag(tmp_path / 'one', SHORT)
    (bag / 'metadata.yaml').write_text(text)
    with pytest.warns(FocWarning, match=words):
        assert read(bag) == WHOLE


@pytest.mark.parametrize('has_metadata', [True, False])
@pytest.mark.parametrize('lost', [0, 1])
def test_a_missing_part_of_a_split_recording_is_named(tmp_path, lost, has_metadata):
    parts = [f'split_{part}.db3' for part in range(3)]
    for part, name in enumerate(parts):
        write_sqlite(tmp_path / name, [*WHOLE[part::3]]).close()
    if has_metadata:
        write_metadata(tmp_path, parts, len(WHOLE))
    assert read(tmp_path) == WHOLE
    (tmp_path / parts[lost]).unlink()
    with pytest.warns(FocWarning, match=rf'split_{lost}\.db3(, which metadata\.yaml names,)? is missing'):
        assert len(read(tmp_path)) == len(WHOLE) - len(WHOLE[lost::3])
    with pytest.raises(RecordingError, match=rf'split_{lost}\.db3.* is missing'):
        list(BagRecording('split', tmp_path).items())


@pytest.mark.parametrize('name', ['a%20b', 'a?mode=rw', "it's", 'été 手', '-x', 'a\nb'])
@pytest.mark.parametrize('kind', ['.mcap', '.db3'])
def test_a_path_opens_the_file_that_it_names(tmp_path, name, kind):
    for other in ('a b', 'a', 'A', 'a%2520b'):
        (tmp_path / other).mkdir(exist_ok=True)
        if not (tmp_path / other / f'{other}.db3').exists():  # where the file system does not tell `a` from `A`
            write_sqlite(tmp_path / other / f'{other}.db3', WHOLE[:3]).close()
    assert read(write_either(tmp_path / name / f'{name}{kind}')) == WHOLE


@pytest.mark.parametrize(('topic', 'wrong'), [('/hand_pose', b''), ('/obstacles', bytes(500)), ('/goals', b'?!' * 40)])
def test_a_message_that_cannot_be_decoded_is_counted_and_the_rest_is_replayed(tmp_path, capsys, topic, wrong):
    place = [each[0] for each in WHOLE].index(topic) + 1
    changed = [*WHOLE[:place], (topic, WHOLE[place][1], wrong), *WHOLE[place + 1 :]]
    write_sqlite(tmp_path / 'one.db3', changed).close()
    assert main(['replay', str(tmp_path / 'one.db3')]) == 0
    out, err = capsys.readouterr()
    assert f'{topic[1:]}_invalid 1' in out and '1 of ' in err and f'a serialized {SHORT_KINDS[topic]}' in err


@pytest.mark.parametrize('form', [r'\1/\2', r'\1::msg::\2', r'\1::msg::dds_::\2_'])
def test_a_type_name_may_be_that_of_older_recorders(tmp_path, form):
    rename = partial(re.sub, r'(\w+)/msg/(\w+)', form)
    write_sqlite(tmp_path / 'one.db3', rename=rename).close()
    assert read(tmp_path / 'one.db3') == WHOLE
    write_mcap(tmp_path / 'one.mcap', SHORT, kinds={kind: rename(kind) for kind in SHORT_KINDS.values()})
    assert read(tmp_path / 'one.mcap') == WHOLE


@pytest.mark.parametrize(
    ('encoding', 'words'),
    [('ros1', 'in ROS 1 encoding, which is not read: convert'), ('json', 'in encoding json, which'), ('', 'in encoding unknown')],
)
def test_an_encoding_that_is_not_read_is_named(tmp_path, encoding, words):
    write_sqlite(tmp_path / 'one.db3', encoding=encoding).close()
    odd = {topic: (encoding, kind.replace('/msg/', '/'), 'ros1msg', b'') for topic, kind in SHORT_KINDS.items()}
    write_mcap(tmp_path / 'one.mcap', [], odd=odd)
    for name in ('one.db3', 'one.mcap'):
        with pytest.raises(RecordingError, match=rf'/hand_pose \(geometry_msgs/msg/PoseStamped {words}'):
            read(tmp_path / name)


@pytest.mark.parametrize(
    ('change', 'is_told'),
    [
        (lambda text: text.replace('\n', '\r\n'), False),
        (lambda text: text.partition('=====')[0], False),
        (lambda text: '', False),
        (lambda text: '?!', True),
    ],
)
def test_definitions_may_be_those_of_another_system(tmp_path, change, is_told):
    """With the line ends of Windows, without those of other types, empty, or such that they cannot be parsed."""
    database = write_sqlite(tmp_path / 'one.db3')
    database.execute('CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT, encoded_message_definition TEXT)')
    texts = {kind: change(STORE.generate_msgdef(kind, ros_version=2)[0]) for kind in SHORT_KINDS.values()}
    change_rows(database, "INSERT INTO message_definitions VALUES(?, 'ros2msg', ?)", list(texts.items()))
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter('always')
        with BagReader(tmp_path / 'one.db3') as reader:
            assert not any(isinstance(item.message, MessageError) for item in reader)
    assert bool(issued) == is_told and all('cannot be read, and that of ROS is used' in str(each.message) for each in issued)


def test_a_file_name_need_not_be_text(tmp_path, capsys):
    """As a name in Latin-1 that was written by another system."""
    file = tmp_path / os.fsdecode(b'caf\xe9.db3')
    write_sqlite(file).close()
    report, output = str(tmp_path / 'report'), str(tmp_path / os.fsdecode(b'\xe9'))
    assert main(['replay', str(file), '--report', report, '--output', output]) == 0
    assert capsys.readouterr().err == ''
    assert 'caf?.db3' in (tmp_path / 'report' / 'index.html').read_text('utf-8')


def test_a_bag_of_ros_1_is_named(tmp_path):
    (tmp_path / 'old.bag').write_bytes(b'#ROSBAG V2.0\n')
    with pytest.raises(RecordingError, match='a bag of ROS 1: convert it to ROS 2'):
        read(tmp_path / 'old.bag')


@pytest.mark.parametrize('time', [None, 'noon', 0.5])
def test_a_message_without_a_time_is_named(tmp_path, capsys, time):
    change_rows(write_sqlite(tmp_path / 'one.db3'), 'UPDATE messages SET timestamp = ? WHERE id = 4', [(time,)])
    assert main(['replay', str(tmp_path / 'one.db3')]) == 2
    assert capsys.readouterr().err.endswith(f'damaged: 1 of its {len(WHOLE)} messages have no time\n')


def test_a_compressed_message_does_not_fill_the_memory(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(bags, 'LARGEST_MESSAGE', 100_000)
    packed = [(topic, stamp_ns, zstandard.compress(raw)) for topic, stamp_ns, raw in WHOLE]
    place = [each[0] for each in packed].index('/hand_pose') + 3
    packed[place] = (*packed[place][:2], zstandard.compress(bytes(200_000)))
    write_sqlite(tmp_path / 'one.db3', packed).close()
    assert main(['replay', str(tmp_path / 'one.db3')]) == 0
    assert 'hand_pose_invalid 1' in capsys.readouterr().out
