"""doc/accuracy.md: what is written by hand, with blocks of what was measured between marks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'doc' / 'accuracy.md'
IMAGES = ROOT / 'doc' / 'images'


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(cells) + ' |' for cells in lines)


def blocks(page: str) -> dict[str, str]:
    """Return what stands between the marks of a page, by name."""
    return dict(re.findall(r'<!-- measured: (\w+) -->\n(.*?)<!-- end -->', page, re.DOTALL))


def filled(page: str, texts: Mapping[str, str]) -> str:
    """Return the page with new texts in some of its blocks; KeyError where it has no such block."""
    unknown = set(texts) - set(blocks(page))
    if unknown:
        raise KeyError(f'doc/accuracy.md has no block {", ".join(sorted(unknown))}')
    for name, text in texts.items():
        mark = f'<!-- measured: {name} -->\n'
        before, _, rest = page.partition(mark)
        page = f'{before}{mark}\n{text}\n\n<!-- end -->{rest.partition("<!-- end -->")[2]}'
    return page


def write(texts: Mapping[str, str], page: Path = PAGE) -> None:
    """Fill the page's blocks."""
    page.write_text(filled(page.read_text(encoding='utf-8'), texts), encoding='utf-8')
