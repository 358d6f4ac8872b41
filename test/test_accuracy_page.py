# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""doc/accuracy.md has blocks for the main results of its script, and no block is empty."""

import importlib
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))

page = importlib.import_module('page')
PAGE = ROOT / 'doc' / 'accuracy.md'
MEASURED = {'guarantee', 'outcomes', 'reference', 'shapes', 'bounds'}
"""The blocks that `benchmarks/accuracy.py` measures."""


def test_the_page_shows_the_main_measurements_with_their_pictures():
    text = PAGE.read_text(encoding='utf-8')
    blocks = page.find_blocks(text)
    assert set(blocks) >= MEASURED
    for name, block in ((name, blocks[name]) for name in MEASURED):
        rows = block.strip().splitlines()
        assert len(rows) >= 7, name
        assert len({row.count('|') for row in rows}) == 1, f'{name}: the rows differ in length'
    for picture in ('guarantee', 'effort_over_eta'):
        assert f'(images/{picture}.png)' in text
        assert (page.IMAGES / f'{picture}.png').is_file()
