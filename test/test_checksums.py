# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checksums: a written bag has all of them, and a bag that differs from its own is never used."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from bag_helpers import write_bag

from foc_ros.core.errors import RecordingError
from foc_ros.io.bags import BagReader

ROOT = Path(__file__).resolve().parents[1]
PACKAGED = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
Content = list[tuple[str, int, bytes]]


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp('whole') / 'bag')


def read(path: Path) -> Content:
    with BagReader(path) as reader:
        return [(item.topic, item.log_ns, bytes(item.raw)) for item in reader]


def mutants(data: bytes, count: int) -> Iterator[bytes]:
    """Yield copies with a changed bit, a changed byte, a block of zeros, or two bytes exchanged, at seeded places."""
    source = random.Random(7)
    for number in range(count):
        changed, place = bytearray(data), source.randrange(len(data) - 8)
        if number % 4 == 0:
            changed[place] ^= 1 << source.randrange(8)
        elif number % 4 == 1:
            changed[place] = source.randrange(256)
        elif number % 4 == 2:
            changed[place : place + 3] = bytes(3)
        else:
            changed[place], changed[place + 7] = changed[place + 7], changed[place]
        yield bytes(changed)


def test_no_mutant_of_a_written_file_is_read_with_another_content(bag: Path, tmp_path: Path) -> None:
    whole, data, refused, total = read(bag), (bag / 'bag.mcap').read_bytes(), 0, 0
    file = tmp_path / 'bad.mcap'
    for mutant in mutants(data, 200):
        file.write_bytes(mutant)
        try:
            assert read(file) == whole
        except RecordingError:
            refused += 1
        total += mutant != data
    assert refused == total > 100


def test_an_independent_reader_finds_every_checksum_right(bag: Path) -> None:
    stream_reader = pytest.importorskip('mcap.stream_reader', reason='the mcap library is not installed')
    for file in (bag / 'bag.mcap', PACKAGED):
        with file.open('rb') as stream:
            records = {type(each).__name__: each for each in stream_reader.StreamReader(stream, emit_chunks=True).records}
        assert records['Chunk'].uncompressed_crc and records['DataEnd'].data_section_crc and records['Footer'].summary_crc
        with file.open('rb') as stream:
            assert sum(1 for _ in stream_reader.StreamReader(stream, validate_crcs=True).records) > 10
