"""One MCAP file: its channels of ROS messages, and the messages of those that are needed.

Channels with another encoding than that of ROS, such as JSON, are left out, and no definition of a message is parsed here. A file
without its footer, whose recorder was killed, is read up to its last whole chunk.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema, Statistics
from mcap.stream_reader import MAGIC_SIZE, StreamReader
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinition, MessageDefinitionFormat
from rosbags.rosbag2.metadata import parse_qos

MAGIC = b'\x89MCAP0\r\n'
FORMATS = {'ros2msg': MessageDefinitionFormat.MSG, 'ros2idl': MessageDefinitionFormat.IDL}


class McapFile:
    """A file, to be closed after use.

    Attributes: path; connections, in rosbags' terms, with the number of messages that the file states or, without a footer, has;
    message_count, of all channels; times_ns, of the first and the last message; is_cut, whether the footer is missing.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._stream = path.open('rb')
        try:
            self.is_cut = not _has_footer(self._stream)
            summary = None if self.is_cut else make_reader(self._stream).get_summary()
            statistics = summary.statistics if summary is not None else None
            if summary is None or statistics is None:
                schemas, channels, statistics = self._scan()
            else:
                schemas, channels = summary.schemas, summary.channels
        except BaseException:
            self.close()
            raise
        counts = statistics.channel_message_counts
        self.message_count = statistics.message_count
        self.times_ns = statistics.message_start_time, statistics.message_end_time
        self.connections = [
            _describe(channel, schemas.get(channel.schema_id), counts.get(channel.id, 0))
            for channel in channels.values()
            if channel.message_encoding == 'cdr' and channel.schema_id in schemas
        ]

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def messages(self, connections: Collection[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield connection, log time [ns] and bytes of every message of some connections, in order of log time."""
        wanted = {each.id: each for each in connections}
        if self.is_cut:
            found = [each for each in self._records() if isinstance(each, Message) and each.channel_id in wanted]
            for message in sorted(found, key=lambda each: each.log_time):
                yield wanted[message.channel_id], message.log_time, message.data
            return
        self._stream.seek(0)
        reader = make_reader(self._stream, validate_crcs=True)
        for _, channel, message in reader.iter_messages(topics={each.topic for each in connections}):
            if channel.id in wanted:
                yield wanted[channel.id], message.log_time, message.data

    def _records(self) -> Iterator[object]:
        """Yield the records of the file, those of its chunks too; without a footer, up to the last whole one."""
        self._stream.seek(0)
        try:
            yield from StreamReader(self._stream, validate_crcs=True).records
        except (EndOfFile, struct.error):  # the last record has no end, or no head
            if not self.is_cut:
                raise

    def _scan(self) -> tuple[dict[int, Schema], dict[int, Channel], Statistics]:
        """Return schemas and channels by id, and the statistics, of a file that has no summary of them."""
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        counts: Counter[int] = Counter()
        start_ns, end_ns = 1 << 63, 0
        for record in self._records():
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                counts[record.channel_id] += 1
                start_ns, end_ns = min(start_ns, record.log_time), max(end_ns, record.log_time)
        statistics = Statistics(0, len(channels), dict(counts), 0, counts.total(), end_ns, start_ns, 0, len(schemas))
        return schemas, channels, statistics


def _has_footer(stream: BinaryIO) -> bool:
    """Return whether the file ends as a whole one does."""
    size = stream.seek(0, 2)
    stream.seek(max(size - MAGIC_SIZE, 0))
    has_magic = stream.read() == MAGIC and size > MAGIC_SIZE
    stream.seek(0)
    return has_magic


def _describe(channel: Channel, schema: Schema | None, count: int) -> Connection:
    assert schema is not None
    form = FORMATS.get(schema.encoding, MessageDefinitionFormat.NONE)
    definition = MessageDefinition(form, schema.data.decode(errors='replace'))
    qos = parse_qos(channel.metadata.get('offered_qos_profiles', ''))
    extension = ConnectionExtRosbag2(channel.message_encoding, qos)
    return Connection(channel.id, channel.topic, schema.name, definition, '', count, extension, None)
