"""doc/accuracy.md has a place for everything that its script measures, and nothing in it is left empty."""

import importlib
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))

page = importlib.import_module('accuracy.page')
MEASURED = {'guarantee', 'outcomes', 'curves', 'algorithm1', 'reference'}


def test_every_measurement_is_on_the_page_with_its_numbers_and_pictures():
    text = page.PAGE.read_text(encoding='utf-8')
    blocks = page.blocks(text)
    assert set(blocks) == MEASURED
    for name, block in blocks.items():
        rows = block.strip().splitlines()
        assert len(rows) >= 7, name
        assert len({row.count('|') for row in rows}) == 1, f'{name}: a row of another length'
    for picture in ('guarantee', 'effort_over_eta', 'algorithm1'):
        assert f'(images/{picture}.png)' in text
        assert (page.IMAGES / f'{picture}.png').is_file()


def test_filling_a_block_leaves_the_rest_as_it_is():
    text = page.PAGE.read_text(encoding='utf-8')
    table = page.table(['a', 'b'], [['1', '2']])
    assert table == '| a | b |\n| --- | --- |\n| 1 | 2 |'
    once = page.filled(text, {'curves': table})
    assert page.blocks(once) == page.blocks(text) | {'curves': f'\n{table}\n\n'}
    assert page.filled(once, {'curves': page.blocks(text)['curves'].strip()}) == text
    with pytest.raises(KeyError, match='no block speed'):
        page.filled(text, {'speed': table})
