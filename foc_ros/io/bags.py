# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 bags, read and written without ROS.

The messages read are counted against the number that the bag states, and its bytes are compared with its checksums. Every fault
of the file is raised as one :class:`RecordingError` with its name and the reason; what is missing from a recording that can be
read all the same is a :class:`FocWarning`.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from heapq import merge
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from foc_ros.core.errors import FocError, RecordingError, warn

try:
    import mcap  # noqa: F401  of `bag_files`
    import zstandard  # a requirement of mcap
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
except ImportError as error:
    raise FocError(f'recordings need the package {error.name}: pip install mcap rosbags') from error

from . import topics
from .bag_files import TYPESTORE as TYPESTORE
from .bag_files import Channel, McapFile, SqliteFile, add_checksums

FILE_TYPES: dict[str, type[McapFile | SqliteFile]] = {'.mcap': McapFile, '.db3': SqliteFile}
COMPRESSED = ('.zstd', '.zst')
"""What follows these suffixes where the file as a whole is compressed."""
LARGEST_MESSAGE = 100_000_000
"""Size of a compressed message above which it is not unpacked [bytes]; a cloud of a million points has 32 MB."""


@dataclass(frozen=True)
class Item:
    """One recorded message: the name of its input, its topic, log time [ns], the message or its MessageError, and its bytes."""

    role: str
    topic: str
    log_ns: int
    message: Any
    raw: bytes


class BagReader:
    """The predictor's inputs in a recording, as an iterator in order of log time, within a context manager.

    path: bag directory, with or without metadata.yaml, or one .mcap or .db3 file; each file may be compressed with zstd. chosen:
    topic by name of the input. is_whole: whether a recording of which a part is missing is an error; otherwise it is a warning.
    Other topics are not read. Raises RecordingError on opening and on iteration.

    Attributes: roles, the topic of every input found; message_count, of the bag; duration_s, from its first to its last message.
    """

    def __init__(self, path: Path | str, chosen: Mapping[str, str] | None = None, *, is_whole: bool = False) -> None:
        self.path = Path(path)
        self._chosen, self._is_whole = chosen, is_whole

    def __enter__(self) -> BagReader:
        check_bag(self.path)
        with ExitStack() as stack, _named_errors(self.path):
            self._open(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def __iter__(self) -> Iterator[Item]:
        with _named_errors(self.path):
            needed = [each for each in self._channels if each.is_read and each.topic in self._names]
            parts = [file.messages([each for each in file.channels if each in needed]) for file in self._files]
            for channel, log_ns, stored in merge(*parts, key=lambda each: each[1]):
                raw = _decompress(stored) if stored.startswith(b'\x28\xb5\x2f\xfd') else stored  # CDR begins with a zero
                yield Item(self._names[channel.topic], channel.topic, log_ns, channel.decode(raw), raw)

    def find_channel(self, topic: str) -> Channel:
        """Return the channel of a topic that is read."""
        return next(each for each in self._channels if each.topic == topic and each.is_read)

    def _open(self, stack: ExitStack) -> None:
        paths, stated, missing = _list_files(self.path) if self.path.is_dir() else ([self.path], None, '')
        self._files = [_open_file(each, stack) for each in paths]
        self._channels = [each for file in self._files for each in file.channels]
        self.message_count = sum(file.message_count for file in self._files)
        if not self.message_count:
            is_cut = any(file.loss for file in self._files)
            raise RecordingError('damaged or cut short: no whole chunk' if is_cut else 'holds no messages')
        if lost := self.message_count - sum(each.count for each in self._channels):
            raise RecordingError(f'damaged: {lost} of its {self.message_count} messages belong to no topic')
        times_ns = [each for file in self._files if file.message_count for each in file.times_ns]
        self.duration_s = (max(times_ns) - min(times_ns)) * 1e-9
        for path, file in zip(paths, self._files, strict=True):
            if file.loss:
                self._report_loss(f'{path.name}: {file.loss}')
            elif file.doubt and stated is None:
                warn(f'{self.path}: {path.name}: {file.doubt}')
        words = f'states {stated} messages, and the files hold {self.message_count}'
        if missing:
            self._report_loss(missing if stated is None else f'{missing}; it {words}')
        elif stated is not None and stated != self.message_count:
            if stated < self.message_count or all(file.is_counted for file in self._files):
                warn(f'{self.path}: metadata.yaml is wrong: it {words}')
            else:
                self._report_loss(f'metadata.yaml {words}')
        self._assign_topics()

    def _assign_topics(self) -> None:
        """Find the topics of the inputs; a topic that is read hides one of the same name that is not."""
        kinds = {each.topic: each.msgtype for each in sorted(self._channels, key=lambda each: each.is_read)}
        self.roles = topics.assign_topics(kinds, self._chosen)
        self._names = {topic: role for role, topic in self.roles.items()} | topics.find_transforms(kinds)
        for each in self._channels:
            if each.is_read and each.topic in self.roles.values() and each.msgtype != kinds[each.topic]:
                raise RecordingError(f'topic {each.topic}: expected one message type, got {each.msgtype} and {kinds[each.topic]}')
        hand = self.roles[topics.HAND]
        if not any(each.count for each in self._channels if each.topic == hand and each.is_read):
            raise RecordingError(f'topic {hand} holds no message')

    def _report_loss(self, text: str) -> None:
        if self._is_whole:
            raise RecordingError(text)
        warn(f'{self.path}: {text}')


class BagWriter:
    """A new bag, within a context: a directory with metadata.yaml and one .mcap file with checksums; else RecordingError."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._connections: dict[str, Connection] = {}

    def __enter__(self) -> BagWriter:
        with self._named_errors():
            try:
                self._writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
                self._writer.open()
            except WriterError:
                check_new_bag(self.path)  # also if another process has made it meanwhile
                raise
        self._undo = ExitStack()
        self._undo.callback(shutil.rmtree, self.path, ignore_errors=True)
        return self

    def __exit__(self, *error: Any) -> None:
        with self._undo, self._named_errors():
            self._writer.__exit__(*error)
            if error[0] is None:
                add_checksums(self.path / f'{self.path.name}.mcap')
                self._undo.pop_all()

    def write(self, topic: str, message: Any, log_ns: int) -> None:
        """Write a message made with :data:`TYPESTORE`."""
        kind = message.__msgtype__
        self.write_raw(topic, kind, TYPESTORE.serialize_cdr(message, kind), log_ns)

    def write_raw(self, topic: str, kind: str, raw: bytes | memoryview, log_ns: int) -> None:
        """Write the bytes of a message whose type :data:`TYPESTORE` knows."""
        self._write(topic, log_ns, raw, {'msgtype': kind, 'typestore': TYPESTORE})

    def copy(self, item: Item, reader: BagReader) -> None:
        """Write a message as it was read, with its topic's definitions and offered quality of service."""
        connection: dict[str, Any] = {}
        if item.topic not in self._connections:
            given = reader.find_channel(item.topic)
            connection = {'msgtype': given.msgtype, 'typestore': given.typestore, 'offered_qos_profiles': given.read_qos()}
        self._write(item.topic, item.log_ns, item.raw, connection)

    def _write(self, topic: str, log_ns: int, raw: bytes | memoryview, connection: Mapping[str, Any]) -> None:
        with self._named_errors():
            if topic not in self._connections:
                self._connections[topic] = self._writer.add_connection(topic, **connection)
            self._writer.write(self._connections[topic], log_ns, raw)

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        try:
            yield
        except (OSError, WriterError, ValueError, KeyError) as error:  # such as a type without a definition
            raise RecordingError(f'{self.path}: cannot be written: {error}') from error


def check_bag(path: Path) -> None:
    """Raise RecordingError for a path that is clearly no bag, without opening it."""
    with _named_errors(path):
        if not path.exists():
            raise RecordingError('no such file or directory')
        if path.is_dir() and not any(map(is_bag_file, path.iterdir())):
            raise RecordingError('no .mcap or .db3 file in the directory: not a bag')
        if path.is_file() and path.suffix == '.bag':
            raise RecordingError('a bag of ROS 1: convert it to ROS 2, for example with rosbags-convert')
        if not path.is_dir() and not is_bag_file(path):
            raise RecordingError('expected a bag directory, a .mcap or a .db3 file')
        if path.is_file() and not path.stat().st_size:
            raise RecordingError('the file is empty')


def check_new_bag(path: Path) -> None:
    """Raise RecordingError if a bag cannot be written to a path because it exists."""
    if path.exists():
        raise RecordingError(f'{path}: exists already and is not overwritten; choose another name')


def is_bag_file(path: Path) -> bool:
    """Return whether a file has the name of a recording."""
    return path.is_file() and _strip_compression(path.name).endswith(tuple(FILE_TYPES))


def _strip_compression(name: str) -> str:
    return PurePath(name).stem if name.endswith(COMPRESSED) else name


def _open_file(path: Path, stack: ExitStack) -> McapFile | SqliteFile:
    if path.suffix in COMPRESSED:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        with zstandard.open(path, 'rb') as packed, (folder / path.stem).open('wb') as unpacked:
            shutil.copyfileobj(packed, unpacked)
        path = folder / path.stem
    return FILE_TYPES[path.suffix](path, stack)


def _decompress(data: bytes) -> bytes:
    """Return the content of compressed bytes; the bytes themselves where they are damaged, or would fill the memory."""
    try:
        content = zstandard.ZstdDecompressor().stream_reader(data).read(LARGEST_MESSAGE + 1)
    except zstandard.ZstdError:
        return data
    return content if len(content) <= LARGEST_MESSAGE else data


def _list_files(folder: Path) -> tuple[list[Path], int | None, str]:
    """Return the files of a bag directory, the number of messages that its metadata.yaml states, if any, and which files lack."""
    found: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        if is_bag_file(path):
            found.setdefault(_strip_compression(path.name), path)
    names, count = _read_metadata(folder / 'metadata.yaml', found)
    if count is None:
        return list(found.values()), None, _find_gap(found)
    if others := [name for name in found if name not in names]:
        warn(f'{folder}: {", ".join(others)}, which metadata.yaml does not name, is not read')
    missing = ', '.join(name for name in names if name not in found)
    words = f'{missing}, which metadata.yaml names, is missing' if missing else ''
    return [found[name] for name in names if name in found], count, words


def _read_metadata(file: Path, found: Collection[str]) -> tuple[list[str], int | None]:
    """Return the files and the number of messages that a metadata.yaml states, no number if it is not that of the files found."""
    if not file.exists():
        return [], None
    try:
        stated = yaml.safe_load(file.read_text('utf-8'))['rosbag2_bagfile_information']
        count = stated['message_count']
        names = list(dict.fromkeys(_strip_compression(PurePath(each).name) for each in stated['relative_file_paths']))
        if not names or type(count) is not int:
            raise ValueError('it names no file, or no number of messages')
        if not set(names) & set(found):
            raise ValueError(f'it names {", ".join(names)}, and here is {", ".join(found)}')
    except Exception as error:  # whatever stands in it
        kind = '' if isinstance(error, ValueError) else f'{type(error).__name__}: '
        warn(f'{file}: not the metadata of this bag, and not used ({kind}{" ".join(str(error).split())})')
        return [], None
    return names, count


def _find_gap(names: Collection[str]) -> str:
    """Return in words which file lacks among those of a recorder, which numbers the parts of a recording from 0."""
    parts = [part for name in names if (part := re.fullmatch(r'(.*_)(\d+)(\.\w+)', name))]
    numbers, stems = {int(part[2]) for part in parts}, {(part[1], part[3]) for part in parts}
    missing = next((number for number in range(max(numbers, default=0)) if number not in numbers), None)
    if missing is None or len(numbers) < max(2, len(names)) or len(stems) > 1:
        return ''
    return f'{parts[0][1]}{missing}{parts[0][3]} is missing, by the numbers of the other files'


@contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    """Turn every error of a reader into one RecordingError with the name of the file: damage makes them fail in many ways."""
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f'{path}: {error}') from error
    except PermissionError as error:
        raise RecordingError(f'{path}: cannot be read: {error.strerror}') from error
    except Exception as error:
        reason = ' '.join(str(error).split()) or type(error).__name__
        raise RecordingError(f'{path}: cannot be read, it is damaged or cut short ({reason})') from error
