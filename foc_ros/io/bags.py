"""ROS 2 bags, read and written without ROS.

The messages read are counted against the number that the bag states, and its bytes are compared with its checksums, so that none
is lost or changed unnoticed. Every fault of the file is raised as one :class:`RecordingError` with its name and the reason.
"""

from __future__ import annotations

import re
import shutil
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from heapq import merge
from pathlib import Path, PurePath
from types import TracebackType
from typing import Any

import yaml
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat
from rosbags.rosbag2 import Reader, StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from foc_ros.core.errors import RecordingError

from . import topics
from .checksums import add_checksums, check_checksums
from .mcap_files import McapFile

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

    Other topics are not read, and their definitions are not parsed.

    path: bag directory, or one .mcap or .db3 file; chosen: topic by name of the input, overriding names and types. Attributes:
    roles: the topic of every input found; message_count: of the whole bag; duration_s: from the first to the last message;
    warnings: what was wrong with the file and could be read all the same. Raises RecordingError on opening and on iteration.
    """

    def __init__(self, path: Path | str, chosen: Mapping[str, str] | None = None) -> None:
        self.path = Path(path)
        self._chosen = chosen

    def __enter__(self) -> BagReader:
        self._stack = ExitStack()
        try:
            with _named_errors(self.path):
                self._open()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stack.close()

    def __iter__(self) -> Iterator[Item]:
        """Yield every message of an input."""
        roles = {topic: role for role, topic in self.roles.items()} | self._transforms
        needed = [each for each in self._connections if each.topic in roles]
        typestore = _build_typestore(needed)
        counts: Counter[str] = Counter()
        with _named_errors(self.path):
            for connection, log_ns, raw in self._read(needed):
                counts[connection.topic] += 1
                message = typestore.deserialize_cdr(raw, connection.msgtype)
                yield Item(roles[connection.topic], connection.topic, log_ns, message, raw)
            missing = sum(each.msgcount for each in needed) - counts.total()
            if missing or (self.message_count != self._counted and not self.warnings):
                found = self._counted - missing
                raise RecordingError(f'damaged or cut short: {found} of its {self.message_count} messages can be read')
            if not counts[self.roles[topics.HAND]]:
                raise RecordingError(f'topic {self.roles[topics.HAND]} holds no message')

    def describe_connection(self, topic: str) -> dict[str, Any]:
        """Return a topic's type, definitions and offered quality of service, as a writer needs them."""
        connection = next(each for each in self._connections if each.topic == topic)
        offered = connection.ext.offered_qos_profiles if isinstance(connection.ext, ConnectionExtRosbag2) else []
        return {'msgtype': connection.msgtype, 'typestore': _build_typestore([connection]), 'offered_qos_profiles': offered}

    def _open(self) -> None:
        _refuse_unreadable(self.path)
        stated = _read_metadata(self.path)
        self.warnings: list[str] = []
        if self.path.suffix == '.mcap' or (stated.get('storage_identifier') == 'mcap' and not stated.get('compression_mode')):
            self._open_mcap(stated)
        else:
            reader = self._stack.enter_context(Reader(self.path))
            self._connections = reader.connections
            self._read: Callable[[Collection[Connection]], Iterator[tuple[Connection, int, bytes]]] = reader.messages
            self.message_count, self.duration_s = reader.message_count, reader.duration * 1e-9
            self._counted = sum(each.msgcount for each in reader.connections)
        if not self.message_count:
            raise RecordingError('damaged or cut short: no whole chunk' if self.warnings else 'holds no messages')
        self.roles = self._assign_topics()
        self._transforms = topics.find_transforms({each.topic: each.msgtype for each in self._connections})

    def _open_mcap(self, stated: Mapping[str, Any]) -> None:
        """Open the files of a bag; stated: what its metadata.yaml says about them, nothing for a single file."""
        names = stated.get('relative_file_paths')
        paths = [self.path / PurePath(each).name for each in names] if names else sorted(self.path.glob('*.mcap')) or [self.path]
        files = []
        for path in paths:
            check_checksums(path)
            file = McapFile(path)
            self._stack.callback(file.close)
            files.append(file)
            if file.is_cut:
                self.warnings.append(f'{path.name}: the recorder was killed; read up to the last whole chunk')
        self._connections = [each._replace(owner=file) for file in files for each in file.connections]
        self._counted = sum(file.message_count for file in files)
        self.message_count = self._counted if self.warnings else stated.get('message_count', self._counted)
        times_ns = [each for file in files if file.message_count for each in file.times_ns] or [0]
        self.duration_s = (max(times_ns) - min(times_ns)) * 1e-9

        def read(needed: Collection[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
            parts = [file.messages([each for each in needed if each.owner is file]) for file in files]
            return merge(*parts, key=lambda part: part[1])

        self._read = read

    def _assign_topics(self) -> dict[str, str]:
        kinds = {each.topic: each.msgtype for each in self._connections}
        roles = topics.assign_topics(kinds, self._chosen)
        for each in self._connections:
            if each.topic in roles.values() and each.msgtype != kinds[each.topic]:
                raise RecordingError(f'topic {each.topic}: expected one message type, got {each.msgtype} and {kinds[each.topic]}')
        return roles


class BagWriter:
    """A new bag, within a context manager: a directory with metadata.yaml and one .mcap file with checksums, rosbag2 version 9.

    An existing path is refused, and an unfinished bag is removed. Raises RecordingError.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._connections: dict[str, Connection] = {}

    def __enter__(self) -> BagWriter:
        with self._named_errors():
            check_new_bag(self.path)
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


def check_bag(path: Path) -> None:
    """Raise RecordingError for a path that is clearly no bag, without opening it."""
    with _named_errors(path):
        _refuse_unreadable(path)


def check_new_bag(path: Path) -> None:
    """Raise RecordingError if a bag cannot be written to a path because it exists."""
    if path.exists():
        raise RecordingError(f'{path}: exists already and is not overwritten; choose another name')


def _build_typestore(connections: Iterable[Connection]) -> Typestore:
    """Return the types of some connections by the definitions in the bag, or by :data:`TYPESTORE` if it has none."""
    typestore = get_typestore(Stores.EMPTY)
    for each in connections:
        if each.msgdef.format == MessageDefinitionFormat.MSG:
            typestore.register(get_types_from_msg(each.msgdef.data, each.msgtype))
        elif each.msgdef.format == MessageDefinitionFormat.IDL:
            for part in re.split(r'^=+\nIDL: .*\n', each.msgdef.data, flags=re.MULTILINE):
                typestore.register(get_types_from_idl(part) if part else {})
        else:
            return TYPESTORE
    return typestore


def _read_metadata(path: Path) -> dict[str, Any]:
    """Return what metadata.yaml says about a bag; without the file, that it has MCAP files."""
    file = path / 'metadata.yaml'
    if not path.is_dir() or not file.exists():
        return {'storage_identifier': 'mcap'} if path.is_dir() else {}
    stated: dict[str, Any] = yaml.safe_load(file.read_text('utf-8'))['rosbag2_bagfile_information']
    return stated


def _refuse_unreadable(path: Path) -> None:
    """Raise RecordingError for the usual mistakes; the reader finds the others."""
    if not path.exists():
        raise RecordingError('no such file or directory')
    if path.is_dir() and not (path / 'metadata.yaml').exists() and not any(path.glob('*.mcap')):
        raise RecordingError('no metadata.yaml and no .mcap file in the directory: not a bag')
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
