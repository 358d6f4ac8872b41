"""One MCAP file: its channels, and the messages of those that are needed.

The summary at the end of a file is used only where it describes everything; otherwise the file is scanned. A file without its
footer, whose recorder was killed, is read up to its last whole chunk.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Channel as ChannelRecord
from mcap.records import Message, Schema, Statistics
from mcap.stream_reader import StreamReader
from mcap.summary import Summary

from foc_ros.core.errors import RecordingError

from .channels import Channel
from .checksums import check_checksums

MAGIC = b'\x89MCAP0\r\n'
FOOTER, FOOTER_SIZE = b'\x02' + struct.pack('<Q', 20), 29
"""Code and length of the last record, and its whole size [bytes]."""


class McapFile:
    """A file, to be closed after use.

    Attributes: channels; message_count, of all channels; times_ns, of the first and the last message; loss, why messages that the
    recorder received are missing, empty if the file is whole; doubt, why they may be missing where nothing states their number;
    is_counted, whether the file itself states how many messages it has, and has them.
    """

    def __init__(self, path: Path) -> None:
        check_checksums(path)
        self._stream = path.open('rb')
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def messages(self, channels: list[Channel]) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield channel, log time [ns] and bytes of every message of some channels, in the order of their log times."""
        by_key = {each.key: each for each in channels}
        if self._is_indexed:
            self._stream.seek(0)
            reader = make_reader(self._stream, validate_crcs=True)
            found: Iterator[Message] = (
                message for _, _, message in reader.iter_messages(topics={each.topic for each in channels})
            )
        else:
            messages = [each for each in self._records() if isinstance(each, Message) and each.channel_id in by_key]
            found = iter(sorted(messages, key=lambda each: each.log_time))
        for message in found:
            if message.channel_id in by_key:
                yield by_key[message.channel_id], message.log_time, message.data

    def _open(self) -> None:
        is_cut = not _has_footer(self._stream)
        self.doubt = ''
        self.loss = 'the recorder was killed; read up to the last whole chunk' if is_cut else ''
        summary = None if is_cut else self._read_summary()
        self._is_indexed = self.is_counted = summary is not None
        if summary is None:
            summary = self._scan()
        statistics, schemas = summary.statistics, summary.schemas
        self.message_count = statistics.message_count
        self.times_ns = statistics.message_start_time, statistics.message_end_time
        self.channels = [
            _describe(channel, schemas.get(channel.schema_id), statistics.channel_message_counts.get(channel.id, 0))
            for channel in summary.channels.values()
        ]

    def _read_summary(self) -> Summary | None:
        """Return the summary at the end of the file, None where it does not describe everything."""
        try:
            summary = make_reader(self._stream).get_summary()
            return summary if summary is not None and _is_complete(summary) else None
        except Exception:  # the offset in the footer may lead anywhere
            return None

    def _records(self) -> Iterator[object]:
        """Yield the records of the file, those of its chunks too; without a footer, up to the last whole one."""
        self._stream.seek(0)
        try:
            yield from StreamReader(self._stream, validate_crcs=True).records
        except (EndOfFile, struct.error):  # the last record has no end, or no head
            if not self.loss:
                raise

    def _scan(self) -> Summary:
        """Return the summary of the records themselves, which must be as many as the statistics state if there are any."""
        summary, counts, start_ns, end_ns = Summary(), Counter[int](), 1 << 64, 0
        for record in self._records():
            if isinstance(record, Schema):
                summary.schemas[record.id] = record
            elif isinstance(record, ChannelRecord):
                summary.channels[record.id] = record
            elif isinstance(record, Message):
                counts[record.channel_id] += 1
                start_ns, end_ns = min(start_ns, record.log_time), max(end_ns, record.log_time)
            elif isinstance(record, Statistics):
                self.is_counted = True
                if record.message_count != counts.total():
                    words = f'{counts.total()} of its {record.message_count} messages can be read'
                    raise RecordingError(f'damaged or cut short: {words}')
        if lost := sum(count for key, count in counts.items() if key not in summary.channels):
            raise RecordingError(f'damaged: {lost} of its {counts.total()} messages belong to no channel')
        sizes = len(summary.schemas), len(summary.channels)
        summary.statistics = Statistics(0, sizes[1], dict(counts), 0, counts.total(), end_ns, start_ns, 0, sizes[0])
        return summary


def _has_footer(stream: BinaryIO) -> bool:
    """Return whether the file ends as a whole one does."""
    size = stream.seek(0, 2)
    stream.seek(max(size - len(MAGIC) - FOOTER_SIZE, 0))
    end = stream.read()
    stream.seek(0)
    return size > len(MAGIC) + FOOTER_SIZE and end.startswith(FOOTER) and end.endswith(MAGIC)


def _is_complete(summary: Summary) -> bool:
    """Return whether a summary has all of its records, each of which is optional."""
    stated = summary.statistics
    if stated is None or set(stated.channel_message_counts) - set(summary.channels):
        return False
    schemas = {each.schema_id for each in summary.channels.values()} - {0}
    return (
        (len(summary.channels), len(summary.chunk_indexes)) == (stated.channel_count, stated.chunk_count)
        and schemas <= set(summary.schemas)
        and sum(stated.channel_message_counts.values()) == stated.message_count
        and (stated.chunk_count > 0 or stated.message_count == 0)
    )


def _describe(channel: ChannelRecord, schema: Schema | None, count: int) -> Channel:
    name, form, text = ('', '', b'') if schema is None else (schema.name, schema.encoding, schema.data)
    qos = channel.metadata.get('offered_qos_profiles', '')
    return Channel(channel.id, channel.topic, name, channel.message_encoding, form, text.decode(errors='replace'), qos, count)
