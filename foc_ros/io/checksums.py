# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checksums (CRC-32) of MCAP files: those that the libraries do not write or compare.

The MCAP specification (https://mcap.dev/spec) has a checksum for every chunk, one for the data section, and one for the summary
section with the footer. A stored value of 0 means that there is no checksum. The library rosbags writes none, and the library
mcap never compares that of the summary.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

from foc_ros.core.errors import RecordingError

MAGIC = b'\x89MCAP0\r\n'
FOOTER = struct.Struct('<BQQQI8s')
"""The end of a file: code and length of the footer, begin of the summary section and of its offsets, its checksum, and MAGIC."""
_HEAD = struct.Struct('<BQ')
"""Code and length of a record."""
_CRC = struct.Struct('<I')
_FOOTER, _CHUNK, _DATA_END = 0x02, 0x06, 0x0F
_CHUNK_CRC, _CHUNK_CONTENT = _HEAD.size + 24, _HEAD.size + 40
"""Offsets of the checksum and of the messages in a chunk that is not compressed."""
_BLOCK = 1 << 20


def add_checksums(file: Path) -> None:
    """Write the checksums into a whole file without compression. Raises OSError if it cannot be written."""
    with file.open('r+b') as stream:
        start, summary, code = len(MAGIC), 0, 0
        while code != _FOOTER:
            code, length = _HEAD.unpack(_read(stream, start, _HEAD.size))
            end = start + _HEAD.size + length
            if code == _CHUNK:
                _write_crc(stream, start + _CHUNK_CRC, _compute_crc(stream, start + _CHUNK_CONTENT, end))
            elif code == _DATA_END:
                _write_crc(stream, start + _HEAD.size, _compute_crc(stream, 0, start))
                summary = end
            elif code == _FOOTER:
                _write_crc(stream, end - _CRC.size, _compute_crc(stream, summary, end - _CRC.size))
            start = end


def check_summary(stream: BinaryIO) -> None:
    """Raise RecordingError if the summary section of a file with a footer differs from its checksum."""
    footer = stream.seek(0, 2) - FOOTER.size
    _, _, start, _, stated, _ = FOOTER.unpack(_read(stream, footer, FOOTER.size))
    start = start if len(MAGIC) < start <= footer else footer
    if stated and stated != _compute_crc(stream, start, footer + FOOTER.size - len(MAGIC) - _CRC.size):
        raise RecordingError('damaged: the summary section differs from its checksum')


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
