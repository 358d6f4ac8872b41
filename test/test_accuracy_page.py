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


def test_replacing_a_block_leaves_the_rest_of_the_page_unchanged():
    text = PAGE.read_text(encoding='utf-8')
    table = page.format_table(['a', 'b'], [['1', '2']])
    assert table == '| a | b |\n| --- | --- |\n| 1 | 2 |'
    once = page.replace_blocks(text, {'bounds': table})
    assert page.find_blocks(once) == page.find_blocks(text) | {'bounds': f'\n{table}\n\n'}
    assert page.replace_blocks(once, {'bounds': page.find_blocks(text)['bounds'].strip()}) == text


def test_a_result_without_a_block_is_printed_and_not_lost(tmp_path, capsys):
    file = tmp_path / 'page.md'
    file.write_text('<!-- measured: speed -->\n<!-- end -->\n', encoding='utf-8')
    page.write_blocks({'speed': 'fast', 'size': 'small'}, file)
    assert file.read_text('utf-8') == '<!-- measured: speed -->\n\nfast\n\n<!-- end -->\n'
    assert 'size\nsmall\n' in capsys.readouterr().out
