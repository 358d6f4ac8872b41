# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One SQLite file of a recording (.db3), in all versions that rosbag2 has written.

A file whose recorder was killed has a log of its last transactions beside it. It is read with them, from a copy: SQLite would
otherwise write into the recording.
"""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

from foc_ros.core.errors import RecordingError

from .channels import Channel

LOGS = ('-wal', '-journal')
"""What SQLite appends to the name of a file for its log of transactions."""
_WAL_FLAG = 18
"""Place of the byte that is 2 in a file that has a `-wal` beside it while it is written."""


class SqliteFile:
    """A file, to be closed after use, with the attributes of :class:`foc_ros.io.mcap_files.McapFile`."""

    is_counted = False

    def __init__(self, path: Path) -> None:
        self._stack = ExitStack()
        try:
            self._open(path)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file, and remove its copy if there is one."""
        self._stack.close()

    def messages(self, channels: list[Channel]) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield channel, log time [ns] and bytes of every message of some channels, in the order of their log times."""
        by_key = {each.key: each for each in channels}
        keys = ', '.join(map(str, by_key))
        query = f'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({keys}) ORDER BY timestamp, rowid'  # noqa: S608
        for key, log_ns, raw in self._database.execute(query):
            yield by_key[key], log_ns, raw if isinstance(raw, bytes) else b''

    def _open(self, path: Path) -> None:
        path = path.resolve()  # the logs are beside the file itself, not beside a link to it
        logs = [log for log in (path.with_name(path.name + end) for end in LOGS) if log.exists() and log.stat().st_size]
        self.loss = f'the recorder was killed: what it had not written to {logs[0].name} is missing' if logs else ''
        if logs:
            folder = Path(self._stack.enter_context(TemporaryDirectory()))
            for each in (path, *logs):
                shutil.copyfile(each, folder / each.name)
            path = folder / path.name
        mode = 'rw' if logs else 'ro&immutable=1'
        # in a URI, a file name may not contain %, # and ? as they are
        self._database = sqlite3.connect(f'file:{quote(bytes(path))}?mode={mode}', uri=True)
        self._stack.callback(self._database.close)
        (state,) = self._database.execute('PRAGMA quick_check(1)').fetchone()
        if state != 'ok':
            raise RecordingError(f'damaged: {" ".join(state.split())}')
        with path.open('rb') as stream:
            is_logged = stream.read(_WAL_FLAG + 1)[_WAL_FLAG:] == b'\2'
        self.channels = list(self._list_channels())
        found = "count(*), sum(typeof(timestamp) <> 'integer'), max(rowid) - min(rowid) + 1, min(timestamp), max(timestamp)"
        row = self._database.execute(f'SELECT {found} FROM messages NOT INDEXED').fetchone()  # noqa: S608
        self.message_count, untimed, written, *times_ns = row
        if untimed:
            raise RecordingError(f'damaged: {untimed} of its {self.message_count} messages have no time')
        self.times_ns = times_ns[0] or 0, times_ns[1] or 0
        gaps = (written or 0) - self.message_count
        self.doubt = f'{gaps} messages between its first and its last are missing' if gaps else ''
        if is_logged and not logs:
            self.doubt = 'written with a -wal file, which is not here; the last messages may be missing'
        if lost := self.message_count - sum(each.count for each in self.channels):
            raise RecordingError(f'damaged: {lost} of its {self.message_count} messages belong to no topic')

    def _list_channels(self) -> Iterator[Channel]:
        columns = {row[1] for row in self._database.execute('PRAGMA table_info(topics)')}
        qos = 'offered_qos_profiles' if 'offered_qos_profiles' in columns else "''"
        definitions = {}
        if self._database.execute('PRAGMA table_info(message_definitions)').fetchone():  # since ROS 2 Iron
            query = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
            definitions = {kind: (form, text) for kind, form, text in self._database.execute(query)}
        counts = dict(self._database.execute('SELECT topic_id, count(*) FROM messages NOT INDEXED GROUP BY topic_id'))
        query = f'SELECT id, name, type, serialization_format, {qos} FROM topics ORDER BY id'  # noqa: S608
        for key, topic, kind, encoding, offered in self._database.execute(query):
            yield Channel(key, topic, kind or '', encoding, *definitions.get(kind, ('', '')), offered, counts.get(key, 0))
