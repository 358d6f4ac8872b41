# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged recordings and tables: bits, cuts, and records left out or doubled end in words, and nothing is lost unsaid."""

import json
import random
import re
import struct
import time

import pytest
from bag_helpers import messages, write_mcap, write_parameters
from mcap.writer import CompressionType, IndexType
from test_unusual_recordings import WHOLE, write_metadata, write_sqlite

from foc_ros.cli.main import main
from foc_ros.io.bags import BagReader

FEW = 16
LONGEST_S = 10.0
"""Time of the processor for one command: other programs may keep it waiting for longer."""
GIVEN = messages(seconds=0.3)
POSES = sum(topic == '/hand_pose' for topic, _, _ in GIVEN)
WRITERS = (
    {},
    {'use_chunking': False},
    {'compression': CompressionType.LZ4, 'enable_crcs': False},
    {'index_types': IndexType.NONE, 'repeat_channels': False},
)


def write_recording(folder, source):
    """Write a recording of a kind by chance into a new folder, and return its file."""
    folder.mkdir(parents=True)
    kind = source.randrange(6)
    if kind < 4:
        write_mcap(folder / 'one.mcap', GIVEN, per_chunk=7, **WRITERS[kind])
        return folder / 'one.mcap'
    write_sqlite(folder / 'one.db3', mode='WAL' if kind == 5 else 'DELETE').close()
    return folder / 'one.db3'


def change_bytes(data, source):
    """Change bits, cut the end, or leave out or double a part."""
    start, size = source.randrange(len(data)), source.choice((1, 9, 200))
    kind = source.randrange(4)
    if kind == 0:
        changed = bytearray(data)
        for _ in range(source.choice((1, 3, 30))):
            changed[source.randrange(len(data))] ^= 1 << source.randrange(8)
        return bytes(changed)
    if kind == 1:
        return data[:start]
    return data[:start] + (data[start : start + size] * 2 if kind == 2 else b'') + data[start + size :]


def change_records(data, source):
    """Leave out or double one record of an MCAP file."""
    places = [8]
    while places[-1] < len(data) - 8:
        places.append(places[-1] + 9 + struct.unpack_from('<Q', data, places[-1] + 1)[0])
    row = source.randrange(len(places) - 1)
    start, end = places[row : row + 2]
    return data[:start] + source.choice((0, 2)) * data[start:end] + data[end:]


def check_recording(folder, number, capsys):
    source = random.Random(number)
    file = write_recording(folder / str(number), source)
    if source.random() < 0.5:
        write_metadata(file.parent, [file.name], len(WHOLE))
    change = change_records if file.suffix == '.mcap' and source.random() < 0.4 else change_bytes
    file.write_bytes(change(file.read_bytes(), source))
    begin = time.process_time()
    path = source.choice((file, file.parent))
    code = main(['replay', str(path), '--json', '--params', write_parameters(folder)])
    assert time.process_time() - begin < LONGEST_S
    out, err = capsys.readouterr()
    assert code in (0, 2, 3) and (code == 0 or err) and 'Traceback' not in err
    if code == 0 and not err:
        assert json.loads(out)['summary']['samples'] == POSES, number
        with BagReader(path) as reader:
            assert len(list(reader)) >= len(WHOLE), number  # SQLite alone does not tell a doubled row from two


def check_tables(folder, number, capsys):
    source, tables = random.Random(number), folder / str(number)
    tables.mkdir()
    rows = [f'{name},{0.02 * i:.2f},{0.001 * i * i:.4f},0.1' for name in ('a', 'b') for i in range(20)]
    texts = {
        'recordings.csv': '\n'.join(['recording,t_s,x_m,y_m', *rows, '']),
        'goals.csv': 'x_m,y_m\n0.3,0.1\n0.4,0\n',
        'obstacles.csv': 'x_m,y_m,radius_m\n0.15,0,0.03\n',
    }
    changed = source.choice((*texts, 'recordings.csv', 'recordings.csv'))
    for name, text in texts.items():
        data = text.replace(',', source.choice(',,;\t')).encode()
        (tables / name).write_bytes(change_bytes(data, source) if name == changed else data)
    begin = time.process_time()
    code = main(['convert', str(tables), '--output', str(tables / 'bags')])
    assert time.process_time() - begin < LONGEST_S
    out, err = capsys.readouterr()
    assert code in (0, 2) and (code == 0 or err) and 'Traceback' not in err
    if code == 0:
        given = (tables / 'recordings.csv').read_text().splitlines()[1:]
        read = re.search(r'with (\d+) hand poses', out)
        assert read is not None and int(read[1]) == sum(bool(line.strip()) for line in given), number


CHECKS = {'recordings': check_recording, 'tables': check_tables}


@pytest.mark.parametrize('kind', CHECKS)
def test_damaged_inputs_end_in_words(tmp_path, capsys, kind):
    for number in range(FEW):
        CHECKS[kind](tmp_path, number, capsys)
