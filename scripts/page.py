# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measured numbers as Markdown tables, and the blocks for them between HTML comments in the pages of doc/."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
IMAGES, SHARED = ROOT / 'doc' / 'images', ROOT.parent / 'shared' / 'data'
BLOCK = r'<!-- measured: (\w+) -->\n(.*?)<!-- end -->'


def format_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join(f'|{"|".join(cells)}|' for cells in lines)


def write_blocks(texts: Mapping[str, str], page: Path) -> None:
    """Print all texts, and write those into the page for which it has a block: it shows the main results only."""

    def renew(block: re.Match[str]) -> str:
        name = block[1]
        return f'<!-- measured: {name} -->\n\n{texts[name]}\n\n<!-- end -->' if name in texts else block[0]

    for name, text in texts.items():
        print(f'{name}\n{text}\n', flush=True)
    page.write_text(re.sub(BLOCK, renew, page.read_text(encoding='utf-8'), flags=re.DOTALL), encoding='utf-8')
