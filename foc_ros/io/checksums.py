"""Checksums (CRC-32) of MCAP files: they are added to a file after it has been written, and compared before a file is read.

The MCAP specification (https://mcap.dev/spec) has a checksum for every chunk, one for the data section, and one for the summary
section with the footer. A stored value of 0 means that there is no checksum. The library rosbags compares the checksums of the
chunks when it reads a file, and writes none.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO, NamedTuple
from zlib import crc32

from foc_ros.core.errors import RecordingError

_MAGIC = b'\x89MCAP0\r\n'
_HEAD = struct.Struct('<BQ')
"""Code and length of a record."""
_CRC = struct.Struct('<I')
_DATA_END, _CHUNK = 0x0F, 0x06
_CHUNK_CRC, _CHUNK_CONTENT = _HEAD.size + 24, _HEAD.size + 40
"""Offsets of the checksum and of the messages in a chunk that is not compressed."""
_BLOCK = 1 << 20


class _Layout(NamedTuple):
    """Offsets in a file: the end of the data section, the start of the summary section, and the checksum of the summary section.

    The checksum of the summary covers all bytes from the start of the section to the checksum itself, which is in the footer.
    """

    data_end: int
    summary_start: int
    summary_crc: int


def add_checksums(file: Path) -> None:
    """Write the checksums into a file that has a summary section and no compression. Raises OSError if it cannot be written."""
    with file.open('r+b') as stream:
        layout = _find_layout(stream)
        assert layout is not None
        place = len(_MAGIC)
        while place < layout.data_end:
            code, length = _HEAD.unpack(_read(stream, place, _HEAD.size))
            end = place + _HEAD.size + length
            if code == _CHUNK:
                _write_crc(stream, place + _CHUNK_CRC, _compute_crc(stream, place + _CHUNK_CONTENT, end))
            place = end
        _write_crc(stream, layout.data_end + _HEAD.size, _compute_crc(stream, 0, layout.data_end))
        _write_crc(stream, layout.summary_crc, _compute_crc(stream, layout.summary_start, layout.summary_crc))


def check_checksums(file: Path) -> None:
    """Raise RecordingError if a section differs from its checksum. The reader finds damaged chunks and a damaged layout."""
    with file.open('rb') as stream:
        layout = _find_layout(stream)
        if layout is None:
            return
        _check_section(stream, 'summary', layout.summary_start, layout.summary_crc, layout.summary_crc)
        _check_section(stream, 'data', 0, layout.data_end, layout.data_end + _HEAD.size)


def _find_layout(stream: BinaryIO) -> _Layout | None:
    """Return the offsets of the sections, or None if no footer that follows a data section is at the end of the file."""
    footer = stream.seek(0, 2) - len(_MAGIC) - _HEAD.size - 20
    if footer < 0 or _read(stream, footer, _HEAD.size) != _HEAD.pack(0x02, 20):
        return None
    (start,) = struct.unpack('<Q', _read(stream, footer + _HEAD.size, 8))
    summary_start = start if 0 < start <= footer else footer
    data_end = summary_start - _HEAD.size - _CRC.size
    if data_end < 0 or _read(stream, data_end, _HEAD.size) != _HEAD.pack(_DATA_END, _CRC.size):
        return None
    return _Layout(data_end, summary_start, footer + _HEAD.size + 16)


def _check_section(stream: BinaryIO, name: str, start: int, end: int, place: int) -> None:
    (stated,) = _CRC.unpack(_read(stream, place, _CRC.size))
    if stated and stated != _compute_crc(stream, start, end):
        raise RecordingError(f'damaged: the {name} section differs from its checksum')


def _compute_crc(stream: BinaryIO, start: int, end: int) -> int:
    crc = 0
    for place in range(start, end, _BLOCK):
        crc = crc32(_read(stream, place, min(_BLOCK, end - place)), crc)
    return crc


def _read(stream: BinaryIO, place: int, size: int) -> bytes:
    stream.seek(place)
    return stream.read(size)


def _write_crc(stream: BinaryIO, place: int, crc: int) -> None:
    stream.seek(place)
    stream.write(_CRC.pack(crc))
