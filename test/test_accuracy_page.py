"""doc/accuracy.md has a block for everything that its script measures, and no block is empty."""

import importlib
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))

page = importlib.import_module('accuracy.page')
MEASURED = {'guarantee', 'outcomes', 'curves', 'algorithm1', 'reference', 'shapes', 'bounds'}


def test_the_page_shows_every_measurement_with_its_picture():
    text = page.PAGE.read_text(encoding='utf-8')
    blocks = page.find_blocks(text)
    assert set(blocks) == MEASURED
    for name, block in blocks.items():
        rows = block.strip().splitlines()
        assert len(rows) >= 7, name
        assert len({row.count('|') for row in rows}) == 1, f'{name}: the rows differ in length'
    for picture in ('guarantee', 'effort_over_eta', 'algorithm1'):
        assert f'(images/{picture}.png)' in text
        assert (page.IMAGES / f'{picture}.png').is_file()


def test_replacing_a_block_leaves_the_rest_of_the_page_unchanged():
    text = page.PAGE.read_text(encoding='utf-8')
    table = page.format_table(['a', 'b'], [['1', '2']])
    assert table == '| a | b |\n| --- | --- |\n| 1 | 2 |'
    once = page.replace_blocks(text, {'curves': table})
    assert page.find_blocks(once) == page.find_blocks(text) | {'curves': f'\n{table}\n\n'}
    assert page.replace_blocks(once, {'curves': page.find_blocks(text)['curves'].strip()}) == text
    with pytest.raises(KeyError, match='no block speed'):
        page.replace_blocks(text, {'speed': table})
