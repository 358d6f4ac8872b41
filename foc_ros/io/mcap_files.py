# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One MCAP file: its channels, the messages of those that are needed, and the checksums of a new one.

The file is read from begin to end once before its messages are, by the library mcap, which compares the checksums of the chunks
and of the data section. So no optional record is needed: neither the summary nor any index. A file without its footer, whose
recorder was killed, is read up to its last whole chunk.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

from mcap.exceptions import EndOfFile
from mcap.records import Channel as ChannelRecord
from mcap.records import Message, Schema, Statistics
from mcap.stream_reader import StreamReader

from foc_ros.core.errors import RecordingError

from .channels import Channel

MAGIC = b'\x89MCAP0\r\n'
FOOTER_BYTES = 37
"""Size of the end of a file: the footer, and MAGIC."""
_HEAD, _CRC = struct.Struct('<BQ'), struct.Struct('<I')
"""Code and length of a record; a checksum."""
_FOOTER, _CHUNK, _DATA_END = 0x02, 0x06, 0x0F


class McapFile:
    """A file, to be closed after use.

    Attributes: channels; message_count, of all channels; times_ns, of the first and the last message; loss, why messages that the
    recorder received are missing, empty if the file is whole; doubt, why they may be missing where nothing states their number;
    is_counted, whether the file itself states how many messages it has, and has them.
    """

    doubt = ''

    def __init__(self, path: Path) -> None:
        self._stream = path.open('rb')
        try:
            has_footer = _has_footer(self._stream)
            self.loss = '' if has_footer else 'the recorder was killed; read up to the last whole chunk'
            if has_footer:
                _check_summary(self._stream)
            self._scan()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def messages(self, channels: list[Channel]) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield channel, log time [ns] and bytes of every message of some channels, in the order of their log times."""
        by_key = {each.key: each for each in channels}
        records = self._records(is_checked=False)
        found = (each for each in records if isinstance(each, Message) and each.channel_id in by_key)
        for message in found if self._is_in_order else sorted(found, key=lambda each: each.log_time):
            yield by_key[message.channel_id], message.log_time, message.data

    def _records(self, *, is_checked: bool) -> Iterator[object]:
        """Yield the records of the file, those of its chunks too; without a footer, up to the last whole one."""
        self._stream.seek(0)
        try:
            yield from StreamReader(self._stream, validate_crcs=is_checked).records
        except (EndOfFile, struct.error):  # the last record has no end, or no head
            if not self.loss:
                raise

    def _scan(self) -> None:
        """Find the channels and count the messages, which must be as many as the statistics state if there are any."""
        schemas: dict[int, Schema] = {}
        records: dict[int, ChannelRecord] = {}
        counts, stated, first_ns, last_ns, self._is_in_order = Counter[int](), None, 1 << 64, 0, True
        for record in self._records(is_checked=True):
            if isinstance(record, Message):
                counts[record.channel_id] += 1
                self._is_in_order &= last_ns <= record.log_time
                first_ns, last_ns = min(first_ns, record.log_time), max(last_ns, record.log_time)
            elif isinstance(record, Schema):
                schemas.setdefault(record.id, record)
            elif isinstance(record, ChannelRecord):
                records.setdefault(record.id, record)
            elif isinstance(record, Statistics):
                stated = record.message_count
        self.message_count, self.times_ns, self.is_counted = counts.total(), (first_ns, last_ns), stated is not None
        if stated not in (None, self.message_count):
            raise RecordingError(f'damaged or cut short: {self.message_count} of its {stated} messages can be read')
        if lost := sum(count for key, count in counts.items() if key not in records):
            raise RecordingError(f'damaged: {lost} of its {self.message_count} messages belong to no channel')
        self.channels = [_describe(each, schemas.get(each.schema_id), counts[key]) for key, each in records.items()]


def _has_footer(stream: BinaryIO) -> bool:
    """Return whether the file ends as a whole one does."""
    size = stream.seek(0, 2)
    stream.seek(max(size - FOOTER_BYTES, 0))
    end = stream.read()
    return size > FOOTER_BYTES + len(MAGIC) and end.startswith(b'\x02') and end.endswith(MAGIC)


def _check_summary(stream: BinaryIO) -> None:
    """Raise RecordingError if the summary of a file differs from its checksum, which the library mcap does not compare."""
    with mmap(stream.fileno(), 0, access=ACCESS_READ) as content, memoryview(content) as data:
        start, _, stated = struct.unpack_from('<QQI', data, len(data) - FOOTER_BYTES + _HEAD.size)
        if stated and stated != crc32(data[start or len(data) - FOOTER_BYTES : len(data) - len(MAGIC) - _CRC.size]):
            raise RecordingError('damaged: the summary section differs from its checksum')


def _describe(channel: ChannelRecord, schema: Schema | None, count: int) -> Channel:
    name, form, text = ('', '', b'') if schema is None else (schema.name, schema.encoding, schema.data)
    qos = channel.metadata.get('offered_qos_profiles', '')
    return Channel(channel.id, channel.topic, name, channel.message_encoding, form, text.decode(errors='replace'), qos, count)


def add_checksums(file: Path) -> None:
    """Write the checksums (CRC-32) into a whole file without compression: rosbags writes none. Raises OSError if that fails.

    MCAP (https://mcap.dev/spec) has one for each chunk, for the data section, and for the summary with the footer.
    """
    with file.open('r+b') as stream, mmap(stream.fileno(), 0) as content, memoryview(content) as data:
        start, summary, code = len(MAGIC), 0, 0
        while code != _FOOTER:
            code, length = _HEAD.unpack_from(data, start)
            inside, end = start + _HEAD.size, start + _HEAD.size + length
            places = {  # where the checksum of a record is, and of what
                _CHUNK: (inside + 24, inside + 40, end),
                _DATA_END: (inside, 0, start),
                _FOOTER: (end - _CRC.size, summary, end - _CRC.size),
            }
            if code in places:
                place, begin, stop = places[code]
                _CRC.pack_into(data, place, crc32(data[begin:stop]))
            summary = end if code == _DATA_END else summary
            start = end
