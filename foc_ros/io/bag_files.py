# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The files of a recording, MCAP or SQLite: their channels, the messages of those that are needed, and checksums.

A message type is named `pkg/msg/Type`; older recorders leave `msg` out. What is not in the encoding of ROS 2 is not read.
"""

from __future__ import annotations

import re
import shutil
import sqlite3
import struct
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from mmap import mmap
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote
from zlib import crc32

from mcap.exceptions import EndOfFile
from mcap.records import Channel as ChannelRecord
from mcap.records import Footer, Message, Schema, Statistics
from mcap.stream_reader import StreamReader
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import parse_qos
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from foc_ros.core.errors import MessageError, RecordingError, warn

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
"""Message definitions for written bags, and for what a recording does not define itself."""
MAGIC = b'\x89MCAP0\r\n'
FOOTER_BYTES = 37
"""Size of the end of an MCAP file: the footer, and MAGIC."""


@dataclass(frozen=True, eq=False)
class Channel:
    """A topic of one file.

    kind: message type; form, definition: language and text of its definition, if it is stored; qos: the offered quality of
    service as YAML; count: number of messages; key: the channel within its file.
    """

    key: int
    topic: str
    kind: str
    encoding: str
    form: str
    definition: str
    qos: str
    count: int

    @property
    def is_read(self) -> bool:
        """Whether the messages have the encoding of ROS 2."""
        return self.encoding == 'cdr' and bool(self.kind)

    @cached_property
    def msgtype(self) -> str:
        """The message type as ROS 2 names it, also where that of DDS is stored; for a channel that is not read, this in words."""
        name = self.kind.replace('::', '/')
        name = re.sub(r'^(\w+)/(?:msg/)?(?:dds_/)?(\w+?)_*$', r'\1/msg/\2', name)
        if self.is_read:
            return name
        if self.encoding == 'ros1':
            return f'{name} in ROS 1 encoding, which is not read: convert the recording to ROS 2'
        return f'{name or "no type"} in encoding {self.encoding or "unknown"}, which is not read'

    @cached_property
    def typestore(self) -> Typestore:
        """The definitions of the recording, and :data:`TYPESTORE` for what they do not contain."""
        store, text = get_typestore(Stores.EMPTY), '\n'.join(self.definition.splitlines())
        try:
            if self.form == 'ros2idl':
                for part in re.split(r'^=+\nIDL: .*\n', text, flags=re.MULTILINE):
                    store.register(get_types_from_idl(part) if part else {})
            elif self.form == 'ros2msg' and text.strip():
                store.register(get_types_from_msg(text, self.msgtype))
        except Exception:  # any text may stand there
            warn(f'topic {self.topic}: its definition of {self.msgtype} cannot be read, and that of ROS is used')
        store.fielddefs = {**TYPESTORE.fielddefs, **store.fielddefs}
        store.types = {**TYPESTORE.types, **store.types}
        return store

    def read_qos(self) -> list[Qos]:
        """Return the offered quality of service, none where the recorder stored something else."""
        try:
            return parse_qos(self.qos)
        except Exception:  # any text may stand there, and no message depends on it
            return []

    def decode(self, raw: bytes) -> Any:
        """Return a message, or the MessageError that says why the bytes are none."""
        reason = Exception()
        # beyond the three zeros that rosbags allows behind a message, rclpy ignores up to eight
        for end in [len(raw) - zeros for zeros in (0, 4, 8) if not any(raw[len(raw) - zeros :])]:
            try:
                return self.typestore.deserialize_cdr(raw[:end], self.msgtype)
            except Exception as error:  # wrong bytes make the decoder fail in many ways
                reason = error
        return MessageError('message', f'a serialized {self.msgtype}', f'{len(raw)} other bytes ({reason})')


class McapFile:
    """An MCAP file, read by the library mcap; a stack closes it.

    It is read from begin to end once before its messages are, which compares the checksums of the chunks and of the data section.
    So no optional record is needed. A file without its footer, whose recorder was killed, is read up to its last whole chunk.

    Attributes, also of :class:`SqliteFile`: channels; message_count, also of messages without a channel; times_ns, of the first
    and the last message; loss, why messages that the recorder received are missing, empty if the file is whole; doubt, why they
    may be missing where nothing states their number; is_counted, whether the file itself states how many messages it has.
    """

    doubt = ''

    def __init__(self, path: Path, stack: ExitStack) -> None:
        self._stream = stack.enter_context(path.open('rb'))
        self._stream.seek(max(self._stream.seek(0, 2) - FOOTER_BYTES, len(MAGIC)))
        is_ended = self._stream.read().endswith(MAGIC)
        self.loss = '' if is_ended else 'the recorder was killed; read up to the last whole chunk'
        schemas, records = {0: Schema(id=0, data=b'', encoding='', name='')}, dict[int, ChannelRecord]()
        counts, stated, first_ns, last_ns, self._is_in_order = Counter[int](), None, 1 << 64, 0, True
        for record in self._read_records(is_checked=True):
            match record:
                case Message():
                    counts[record.channel_id] += 1
                    self._is_in_order &= last_ns <= record.log_time
                    first_ns, last_ns = min(first_ns, record.log_time), max(last_ns, record.log_time)
                case Schema():
                    schemas[record.id] = record
                case ChannelRecord():
                    records[record.id] = record
                case Statistics():
                    stated = record.message_count
                case Footer():
                    self._check_summary(record)
        self.message_count, self.times_ns, self.is_counted = counts.total(), (first_ns, last_ns), stated is not None
        if stated not in (None, self.message_count):
            raise RecordingError(f'damaged or cut short: {self.message_count} of its {stated} messages can be read')
        self.channels = []
        for key, each in records.items():
            schema, qos = schemas.get(each.schema_id, schemas[0]), each.metadata.get('offered_qos_profiles', '')
            definition = schema.encoding, schema.data.decode(errors='replace')
            self.channels.append(Channel(key, each.topic, schema.name, each.message_encoding, *definition, qos, counts[key]))

    def messages(self, channels: list[Channel]) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield channel, log time [ns] and bytes of every message of some channels, in the order of their log times."""
        by_key = {each.key: each for each in channels}
        records = self._read_records(is_checked=False)
        found = (each for each in records if isinstance(each, Message) and each.channel_id in by_key)
        for message in found if self._is_in_order else sorted(found, key=lambda each: each.log_time):
            yield by_key[message.channel_id], message.log_time, message.data

    def _read_records(self, *, is_checked: bool) -> Iterator[object]:
        self._stream.seek(0)
        try:
            yield from StreamReader(self._stream, validate_crcs=is_checked).records
        except (EndOfFile, struct.error):  # the last record has no end, or no head
            if not self.loss:
                raise

    def _check_summary(self, footer: Footer) -> None:
        """Raise RecordingError if the summary section differs from its checksum, which the library does not compare."""
        end = self._stream.tell()  # of the footer
        self._stream.seek(footer.summary_start or end + len(MAGIC) - FOOTER_BYTES)
        if footer.summary_crc not in (0, crc32(self._stream.read(end - self._stream.tell() - 4))):
            raise RecordingError('damaged: the summary section differs from its checksum')
        self._stream.seek(end)


def add_checksums(file: Path) -> None:
    """Write the checksums into an MCAP file without compression (https://mcap.dev/spec): rosbags writes none. Raises OSError."""
    chunk, data_end, footer, head = 0x06, 0x0F, 0x02, struct.Struct('<BQ')
    with file.open('r+b') as stream, mmap(stream.fileno(), 0) as content, memoryview(content) as data:
        start, summary, code = len(MAGIC), 0, 0
        while code != footer:
            code, length = head.unpack_from(data, start)
            inside, end = start + head.size, start + head.size + length
            places = {  # where the checksum of a record is, and of what
                chunk: (inside + 24, inside + 40, end),
                data_end: (inside, 0, start),
                footer: (end - 4, summary, end - 4),
            }
            if code in places:
                place, begin, stop = places[code]
                struct.pack_into('<I', data, place, crc32(data[begin:stop]))
            summary = end if code == data_end else summary
            start = end


class SqliteFile:
    """A file of SQLite in any version that rosbag2 has written; a stack closes it.

    With the log of a recorder that was killed it is read from a copy: SQLite would otherwise write into the recording.
    """

    is_counted = False

    def __init__(self, path: Path, stack: ExitStack) -> None:
        path = path.resolve()  # the logs are beside the file itself, not beside a link to it
        beside = [path.with_name(path.name + end) for end in ('-wal', '-journal')]
        logs = [log for log in beside if log.exists() and log.stat().st_size]
        self.loss = f'the recorder was killed: what it had not written to {logs[0].name} is missing' if logs else ''
        if logs:
            folder = Path(stack.enter_context(TemporaryDirectory()))
            for each in (path, *logs):
                shutil.copyfile(each, folder / each.name)
            path = folder / path.name
        mode = 'rw' if logs else 'ro&immutable=1'
        # in a URI, a file name may not contain %, # and ? as they are
        self._database = sqlite3.connect(f'file:{quote(bytes(path))}?mode={mode}', uri=True)
        stack.callback(self._database.close)
        (state,) = self._database.execute('PRAGMA quick_check(1)').fetchone()
        if state != 'ok':
            raise RecordingError(f'damaged: {" ".join(state.split())}')
        self._find_channels()
        found = "count(*), sum(typeof(timestamp) <> 'integer'), max(rowid) - min(rowid) + 1, min(timestamp), max(timestamp)"
        row = self._database.execute(f'SELECT {found} FROM messages NOT INDEXED').fetchone()  # noqa: S608
        self.message_count, untimed, written, *self.times_ns = row
        if untimed:
            raise RecordingError(f'damaged: {untimed} of its {self.message_count} messages have no time')
        gaps = (written or 0) - self.message_count
        self.doubt = f'{gaps} messages between its first and its last are missing' if gaps else ''
        with path.open('rb') as stream:
            is_logged = stream.read(19)[18:] == b'\2'  # there was a `-wal` beside it while it was written
        if is_logged and not logs:
            self.doubt = 'written with a -wal file, which is not here; the last messages may be missing'

    def messages(self, channels: list[Channel]) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield channel, log time [ns] and bytes of every message of some channels, in the order of their log times."""
        by_key = {each.key: each for each in channels}
        keys = ', '.join(map(str, by_key))
        query = f'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({keys}) ORDER BY timestamp, rowid'  # noqa: S608
        for key, log_ns, raw in self._database.execute(query):
            yield by_key[key], log_ns, raw if isinstance(raw, bytes) else b''

    def _find_channels(self) -> None:
        definitions = {}
        if self._database.execute('PRAGMA table_info(message_definitions)').fetchone():  # since ROS 2 Iron
            query = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
            definitions = {kind: (form, text) for kind, form, text in self._database.execute(query)}
        counts = dict(self._database.execute('SELECT topic_id, count(*) FROM messages NOT INDEXED GROUP BY topic_id'))
        topics = self._database.execute('SELECT * FROM topics ORDER BY id')
        names = [name for name, *_ in topics.description]
        self.channels = []
        for row in topics:
            topic = dict(zip(names, row, strict=True))
            key, kind, qos = topic['id'], topic['type'] or '', topic.get('offered_qos_profiles', '')
            definition = definitions.get(kind, ('', ''))
            encoding = topic['serialization_format']
            self.channels.append(Channel(key, topic['name'], kind, encoding, *definition, qos, counts.get(key, 0)))
