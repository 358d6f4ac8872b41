"""The page of a report: one HTML file that holds its pictures and needs no network, for screens from a phone's on."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from pathlib import Path

TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 88rem; padding: 1rem; }}
table {{ border-collapse: collapse; }}
td, th {{ border-bottom: 1px solid #8886; padding: .25rem .75rem .25rem 0; text-align: left; vertical-align: top; }}
.pictures {{ display: grid; gap: 1rem; grid-template-columns: repeat(auto-fill, minmax(min(100%, 26rem), 1fr)); }}
figure {{ margin: 0; }}
img {{ background: white; border-radius: .4rem; max-width: 100%; }}
.warning {{ border-left: .3rem solid #D55E00; padding-left: .7rem; }}
</style>
</head>
<body>
<h1>{title}</h1>
{warnings}
<table>{facts}</table>
<h2>The recording</h2>
<figure>{overview}<figcaption>All movements, numbered. Discs are obstacles, with the pale ring two standard deviations of
their radius wide; stars are goals.</figcaption></figure>
<h2>Predictions</h2>
<p>Each picture holds one moment: behind the dot the way the hand came (solid), before it the way it took afterwards (dotted),
which the prediction did not know. The ways that were predicted are coloured by likelihood; their ellipses are two standard
deviations of the position. Below, over the whole movement: the likelihood of every way (letters as in the scene; the dotted
line is the moment), and the speed, measured (black) and predicted. In the name of a way, <code>+1</code> says that it passes
obstacle 1 on the left, <code>-1</code> on the right, seen in the direction of travel.</p>
<div class="pictures">{pictures}</div>
</body>
</html>
"""


def page_of(title: str, pictures: Mapping[Path, str], facts: Mapping[str, str], warnings: Sequence[str]) -> str:
    """Return the page; pictures: caption by PNG file, the overview first; facts: table on top; warnings: lines above it."""
    figures = [_figure(file, caption) for file, caption in pictures.items()]
    return TEMPLATE.format(
        title=html.escape(title),
        warnings=''.join(f'<p class="warning">{html.escape(text)}</p>' for text in warnings),
        facts=''.join(f'<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>' for name, text in facts.items()),
        overview=figures[0] if figures else '',
        pictures=''.join(f'<figure>{figure}</figure>' for figure in figures[1:]),
    )


def _figure(file: Path, caption: str) -> str:
    data = base64.b64encode(file.read_bytes()).decode('ascii')
    return f'<img alt="{html.escape(caption)}" src="data:image/png;base64,{data}"><figcaption>{html.escape(caption)}</figcaption>'
