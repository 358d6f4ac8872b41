"""doc/accuracy.md: text written by hand, with blocks of measured numbers between HTML comments."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'doc' / 'accuracy.md'
IMAGES = ROOT / 'doc' / 'images'


def format_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(cells) + ' |' for cells in lines)


def print_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a Markdown table, each row as soon as it is there."""
    print(format_table(head, ()), flush=True)
    for row in rows:
        print(format_table(row, ()).partition('\n')[0], flush=True)


def parse_setting(text: str) -> tuple[str, object]:
    """Return the name and the value of a text NAME=VALUE of the command line."""
    name, _, value = text.partition('=')
    return name, yaml.safe_load(value)


def find_blocks(page: str) -> dict[str, str]:
    """Return the text of the measured blocks of a page, by name."""
    return dict(re.findall(r'<!-- measured: (\w+) -->\n(.*?)<!-- end -->', page, re.DOTALL))


def replace_blocks(page: str, texts: Mapping[str, str]) -> str:
    """Return the page with new texts in those of its blocks that are named; a text for which it has no block is left out."""
    for name, text in texts.items():
        if name in find_blocks(page):
            mark = f'<!-- measured: {name} -->\n'
            before, _, rest = page.partition(mark)
            page = f'{before}{mark}\n{text}\n\n<!-- end -->{rest.partition("<!-- end -->")[2]}'
    return page


def write_blocks(texts: Mapping[str, str], page: Path = PAGE) -> None:
    """Print all texts, and write those into the page for which it has a block: it shows the main results only."""
    for name, text in texts.items():
        print(f'{name}\n{text}\n', flush=True)
    page.write_text(replace_blocks(page.read_text(encoding='utf-8'), texts), encoding='utf-8')
