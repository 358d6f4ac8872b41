"""ROS 2 bags, read and written without ROS.

The messages read are counted against the number that the bag states, and its bytes are compared with its checksums, so that none
is lost or changed unnoticed. Every fault of the file is raised as one :class:`RecordingError` with its name and the reason.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_typestore

from foc_ros.core.errors import RecordingError

from . import topics
from .checksums import add_checksums, check_checksums

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
"""Message definitions for written bags, and for bags without definitions (sqlite3 before ROS 2 Iron)."""


@dataclass(frozen=True)
class Item:
    """One recorded message: the name of its input, its topic, log time [ns], the decoded message, and its bytes."""

    role: str
    topic: str
    log_ns: int
    message: Any
    raw: bytes


class BagReader:
    """The predictor's inputs in a recording, as an iterator in order of log time, within a context manager.

    path: bag directory, or one .mcap or .db3 file; chosen: topic by name of the input, overriding names and types. Attributes:
    roles: the topic of every input found; message_count: of the whole bag; duration_s: from the first to the last message.
    Raises RecordingError on opening and on iteration.
    """

    def __init__(self, path: Path | str, chosen: Mapping[str, str] | None = None) -> None:
        self.path = Path(path)
        self._chosen = chosen

    def __enter__(self) -> BagReader:
        with _named_errors(self.path):
            _refuse_unreadable(self.path)
            for file in [self.path] if self.path.is_file() else self.path.glob('*.mcap'):
                if file.suffix == '.mcap':
                    check_checksums(file)
            self._reader = AnyReader([self.path], default_typestore=TYPESTORE)
            self._reader.open()
            try:
                self.message_count = self._reader.message_count
                if not self.message_count:
                    raise RecordingError('holds no messages')
                self.duration_s = self._reader.duration * 1e-9
                self.roles = self._assign_topics()
            except BaseException:
                self._reader.close()
                raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._reader.close()

    def __iter__(self) -> Iterator[Item]:
        """Yield every message of an input; all other messages are read too, and counted."""
        roles = {topic: role for role, topic in self.roles.items()}
        counts: Counter[str] = Counter()
        with _named_errors(self.path):
            for connection, log_ns, raw in self._reader.messages():
                role = roles.get(connection.topic)
                counts[role or ''] += 1
                if role is not None:
                    yield Item(role, connection.topic, log_ns, self._reader.deserialize(raw, connection.msgtype), raw)
            if counts.total() != self.message_count:
                raise RecordingError(f'damaged or cut short: {counts.total()} of its {self.message_count} messages can be read')
            if not counts[topics.HAND]:
                raise RecordingError(f'topic {self.roles[topics.HAND]} holds no message')

    def _assign_topics(self) -> dict[str, str]:
        kinds = {each.topic: each.msgtype for each in self._reader.connections}
        roles = topics.assign_topics(kinds, self._chosen)
        for each in self._reader.connections:
            if each.topic in roles.values() and each.msgtype != kinds[each.topic]:
                raise RecordingError(f'topic {each.topic}: expected one message type, got {each.msgtype} and {kinds[each.topic]}')
        return roles

    def describe_connection(self, topic: str) -> dict[str, Any]:
        """Return a topic's type, definitions and offered quality of service, as a writer needs them."""
        connection = next(each for each in self._reader.connections if each.topic == topic)
        offered = connection.ext.offered_qos_profiles if isinstance(connection.ext, ConnectionExtRosbag2) else []
        return {'msgtype': connection.msgtype, 'typestore': self._reader.typestore, 'offered_qos_profiles': offered}


class BagWriter:
    """A new bag, within a context manager: a directory with metadata.yaml and one .mcap file with checksums, rosbag2 version 9.

    An existing path is refused, and an unfinished bag is removed. Raises RecordingError.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._connections: dict[str, Connection] = {}

    def __enter__(self) -> BagWriter:
        with self._named_errors():
            if self.path.exists():
                raise RecordingError(f'{self.path}: exists already and is not overwritten; choose another name')
            self._writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.open()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        is_finished = False
        try:
            with self._named_errors():
                self._writer.__exit__(kind, error, trace)
                if kind is None:
                    add_checksums(self.path / f'{self.path.name}.mcap')
                is_finished = kind is None
        finally:
            if not is_finished:
                shutil.rmtree(self.path, ignore_errors=True)

    def write(self, topic: str, message: Any, log_ns: int) -> None:
        """Write a message made with :data:`TYPESTORE`."""
        kind = message.__msgtype__
        self.write_raw(topic, kind, TYPESTORE.serialize_cdr(message, kind), log_ns)

    def write_raw(self, topic: str, kind: str, raw: bytes | memoryview, log_ns: int) -> None:
        """Write the bytes of a message whose type :data:`TYPESTORE` knows."""
        self._write(topic, log_ns, raw, {'msgtype': kind, 'typestore': TYPESTORE})

    def copy(self, item: Item, reader: BagReader) -> None:
        """Write a message as it was read, with its topic's definitions and offered quality of service."""
        connection = {} if item.topic in self._connections else reader.describe_connection(item.topic)
        self._write(item.topic, item.log_ns, item.raw, connection)

    def _write(self, topic: str, log_ns: int, raw: bytes | memoryview, connection: Mapping[str, Any]) -> None:
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, **connection)
        with self._named_errors():
            self._writer.write(self._connections[topic], log_ns, raw)

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        try:
            yield
        except (OSError, WriterError) as error:
            raise RecordingError(f'{self.path}: cannot be written: {error}') from error


def _refuse_unreadable(path: Path) -> None:
    """Raise RecordingError for the usual mistakes; the reader finds the others."""
    if not path.exists():
        raise RecordingError('no such file or directory')
    if path.is_dir() and not (path / 'metadata.yaml').exists():
        raise RecordingError('no metadata.yaml in the directory: not a bag, or its recorder was killed (ros2 bag reindex helps)')
    if path.is_file() and path.suffix not in ('.mcap', '.db3'):
        raise RecordingError('expected a bag directory, a .mcap or a .db3 file')
    if path.is_file() and not path.stat().st_size:
        raise RecordingError('the file is empty')


@contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    """Turn every error of a reader into one RecordingError with the name of the file.

    A damaged file makes the readers fail in many ways (their own errors, struct, seek, decompression, Unicode, SQLite), so all
    exceptions are caught; nothing but reading happens inside.
    """
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f'{path}: {error}') from error
    except Exception as error:
        reason = ' '.join(str(error).split()) or type(error).__name__
        raise RecordingError(f'{path}: cannot be read, it is damaged or cut short ({reason})') from error
