"""The frame of all pages: title, warnings, facts and what a page is about; dark and light, for screens from a phone's on.

Text comes in as it is and is escaped here, once; what is called `body` is HTML made by the functions below.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<style>
{style}</style>
</head>
<body>
<header><h1>{title}</h1><button id="theme" type="button" aria-label="dark or light">◐</button></header>
{warnings}
{body}
<script>
{script}</script>
</body>
</html>
"""
POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""What a browser may do for a page: show what the page holds, and fetch nothing from anywhere."""


def page_of(title: str, body: str, warnings: Sequence[str] = ()) -> str:
    """Return a page; warnings: lines on top."""
    return TEMPLATE.format(
        title=html.escape(title),
        policy=html.escape(POLICY),
        style=_read('frame.css'),
        script=_read('frame.js'),
        warnings=''.join(f'<p class="warning">{html.escape(text)}</p>' for text in warnings),
        body=body,
    )


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; the first cell of a row is its heading, columns may be left out."""
    head = f'<thead><tr>{_cells("th", columns)}</tr></thead>' if columns else ''
    lines = ''.join(f'<tr>{_cells("th", row[:1])}{_cells("td", row[1:])}</tr>' for row in rows)
    return f'<div class="wide"><table>{head}<tbody>{lines}</tbody></table></div>'


def picture(file: Path, caption: str) -> str:
    """Return a PNG file as a figure that the page holds itself."""
    data, text = base64.b64encode(file.read_bytes()).decode('ascii'), html.escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'


def pictures(figures: Iterable[str]) -> str:
    """Return figures beside one another, as many as the screen has room for."""
    return f'<div class="pictures">{"".join(figures)}</div>'


def data_script(name: str, value: Any) -> str:
    """Return a value as JSON inside a page: no character in it can end the script or begin another tag."""
    text = json.dumps(value, allow_nan=False, separators=(',', ':'))
    for character in '<>&':
        text = text.replace(character, f'\\u{ord(character):04x}')
    return f'<script type="application/json" id="{html.escape(name)}">{text}</script>'


def own_part(name: str) -> str:
    """Return a piece of HTML of this folder."""
    return _read(name)


def own_scripts(*names: str) -> str:
    """Return scripts of this folder as one, which runs after the frame's own."""
    text = '\n'.join(_read(name) for name in names)
    return f'<script>\ndocument.addEventListener("DOMContentLoaded", () => {{\n{text}}});\n</script>'


def plotly_script() -> str:
    """Return the plotting library, which has to be installed, with its licence header."""
    from plotly.offline import get_plotlyjs

    return f'<script>{get_plotlyjs()}</script>'


def _cells(kind: str, texts: Sequence[str]) -> str:
    return ''.join(f'<{kind}>{html.escape(text)}</{kind}>' for text in texts)


def _read(name: str) -> str:
    return (HERE / name).read_text(encoding='utf-8')
