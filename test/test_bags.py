# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags: no message is lost, no file is overwritten, every damage is reported, and every checksum is written and compared."""

import random
import re
import resource

import pytest
from bag_helpers import messages, write_bag, write_by_rosbags, write_mcap
from rosbags.rosbag2 import StoragePlugin

from foc_ros.analysis.recordings import BagRecording
from foc_ros.core.errors import FocWarning, RecordingError
from foc_ros.io.bags import TYPESTORE, BagReader


def read(path, chosen=None):
    with BagReader(path, chosen) as reader:
        return list(reader)


def assert_same(items, written):
    assert [(item.topic, item.log_ns) for item in items] == [(topic, stamp_ns) for topic, stamp_ns, _ in written]
    for item, (_, _, message) in zip(items, written, strict=True):
        assert bytes(TYPESTORE.serialize_cdr(item.message, message.__msgtype__)) == bytes(item.raw)
        assert bytes(item.raw) == bytes(TYPESTORE.serialize_cdr(message, message.__msgtype__))


def mcap(bag):
    return bag / f'{bag.name}.mcap'


def test_a_bag_is_read_as_it_was_written(tmp_path):
    bag = write_bag(tmp_path / 'one')
    assert sorted(each.name for each in bag.iterdir()) == ['metadata.yaml', 'one.mcap']
    with BagReader(bag) as reader:
        items = list(reader)
        assert reader.message_count == len(items) == len(messages())
        assert reader.duration_s == pytest.approx(0.68, abs=1e-6)
        assert reader.roles == {'hand_pose': '/hand_pose', 'obstacles': '/obstacles', 'goals': '/goals'}
    assert_same(items, messages())


@pytest.mark.parametrize('plugin', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize('whole', [True, False])
def test_bags_of_the_library_are_read_as_a_folder_and_as_a_file(tmp_path, plugin, whole):
    bag = tmp_path / 'old'
    write_by_rosbags(bag, messages(), version=8, storage_plugin=plugin)
    assert_same(sorted(read(bag if whole else next(bag.glob('old.*'))), key=lambda item: item.log_ns), messages())


def test_channels_that_are_not_needed_may_be_anything(tmp_path):
    """A JSON channel, one without a definition, the events of a service, and a definition that cannot be parsed."""
    odd = {
        '/notes': ('json', 'notes', 'jsonschema', b'{"type": "object"}'),
        '/plain': ('json', '', '', b''),
        '/foc/engage/_service_event': ('cdr', 'std_srvs/srv/SetBool_Event', 'ros2msg', b'service_msgs/ServiceEventInfo info'),
        '/odd': ('cdr', 'odd_msgs/msg/Odd', 'ros2msg', b'?!'),
    }
    write_mcap(tmp_path / 'mixed.mcap', messages(), odd=odd)
    assert_same(read(tmp_path / 'mixed.mcap'), messages())


def test_a_bag_is_written_as_a_whole_to_a_new_path_or_not_at_all(tmp_path):
    def interrupted():
        yield from messages()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_bag(tmp_path / 'half', interrupted())
    limit, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, most))  # writes beyond it fail like those to a full disk
    try:
        with pytest.raises(RecordingError, match='cannot be written'):
            write_bag(tmp_path / 'full', 10 * messages())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
    (tmp_path / 'file').write_text('not a directory')
    with pytest.raises(RecordingError, match=re.escape(str(tmp_path / 'file' / 'bag'))):
        write_bag(tmp_path / 'file' / 'bag')
    bag = write_bag(tmp_path / 'one')
    before = mcap(bag).read_bytes()
    with pytest.raises(RecordingError, match='exists already and is not overwritten'):
        write_bag(bag)
    assert mcap(bag).read_bytes() == before
    assert sorted(each.name for each in tmp_path.iterdir()) == ['file', 'one']


def write_part(path, share):
    """Write the first part of a file, which has a single chunk."""
    whole = mcap(write_bag(path.with_name('whole'))).read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])


@pytest.mark.parametrize(
    ('make', 'reason'),
    [
        (lambda path: None, 'no such file or directory'),
        (lambda path: path.mkdir(), 'no .mcap or .db3 file in the directory'),
        (lambda path: path.write_bytes(b''), 'the file is empty'),
        (lambda path: path.write_bytes(b'not a bag at all, whatever its name says'), 'cannot be read'),
        (lambda path: path.write_bytes(b'\x89MCAP0\r\n'), 'damaged or cut short'),
        (lambda path: write_part(path, 0.02), 'damaged or cut short: no whole chunk'),
        (lambda path: write_part(path, 0.6), 'damaged or cut short: no whole chunk'),
    ],
)
def test_a_path_that_is_no_bag_is_refused(tmp_path, make, reason):
    path = tmp_path / 'it.mcap'
    make(path)
    with pytest.raises(RecordingError, match=f'^{re.escape(str(path))}: {reason}'):
        read(path)


@pytest.mark.parametrize(('beyond', 'as_folder'), [(0, True), (4, False), (100, True), (400, False)])
def test_a_file_without_its_footer_is_read_up_to_its_last_whole_chunk(tmp_path, beyond, as_folder):
    """The recorder was killed: there is no metadata.yaml either."""
    (tmp_path / 'killed').mkdir()
    path = tmp_path / 'killed' / 'killed_0.mcap'
    ends = write_mcap(path, messages(), per_chunk=10)
    path.write_bytes(path.read_bytes()[: ends[2] + beyond])
    with pytest.warns(FocWarning, match=r'killed_0\.mcap: the recorder was killed; read up to the last whole chunk$'):
        items = read(path.parent if as_folder else path)
    assert_same(items, messages()[:30])
    with pytest.raises(RecordingError, match='the recorder was killed'):  # a part of a movement cannot be evaluated
        list(BagRecording('killed', path).items())


def mutants(data, count):
    """Yield copies with a changed bit, a changed byte, a block of zeros, or two bytes exchanged, at seeded places."""
    source = random.Random(7)
    for number in range(count):
        changed, place = bytearray(data), source.randrange(len(data) - 8)
        if number % 4 == 0:
            changed[place] ^= 1 << source.randrange(8)
        elif number % 4 == 1:
            changed[place] = source.randrange(256)
        elif number % 4 == 2:
            changed[place : place + 3] = bytes(3)
        else:
            changed[place], changed[place + 7] = changed[place + 7], changed[place]
        yield bytes(changed)


def test_no_mutant_of_a_written_file_is_read_with_another_content(tmp_path):
    def content(path):
        return [(item.topic, item.log_ns, bytes(item.raw)) for item in read(path)]

    bag, file, refused, total = write_bag(tmp_path / 'bag'), tmp_path / 'bad.mcap', 0, 0
    whole, data = content(bag), mcap(bag).read_bytes()
    for mutant in mutants(data, 200):
        file.write_bytes(mutant)
        try:
            assert content(file) == whole
        except RecordingError:
            refused += 1
        total += mutant != data
    assert refused == total > 100
