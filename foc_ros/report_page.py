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
{pictures}
</body>
</html>
"""
PREDICTIONS = """<h2>Predictions</h2>
<p>Each picture shows one moment of a movement.</p>
<ul>
<li>Above, the scene. Black: the hand (dot), where it came from (solid), and where it really went (dotted), which the prediction
did not know. Ways that were predicted: the darker, the more likely, with ellipses of one standard deviation of the position.</li>
<li>Letters name the ways. In the label of a way, <code>+1</code> says that it passes obstacle 1 on the left, <code>-1</code> on
the right, seen in the direction of travel; obstacles that do not matter are left out.</li>
<li>Below, the whole movement: likelihood of each way, and speed, measured (black) and predicted. The dotted upright is the
moment above. A line goes on when obstacles are left behind and so drop out of the label of its way.</li>
</ul>
"""


def page_of(title: str, pictures: Mapping[Path, str], facts: Mapping[str, str], warnings: Sequence[str]) -> str:
    """Return the page.

    pictures: caption by PNG file, the one of the whole recording first; facts: table on top; warnings: lines above it.
    """
    figures = [_figure(file, caption) for file, caption in pictures.items()]
    moments = f'{PREDICTIONS}<div class="pictures">{"".join(figures[1:])}</div>'
    return TEMPLATE.format(
        title=html.escape(title),
        warnings=''.join(f'<p class="warning">{html.escape(text)}</p>' for text in warnings),
        facts=''.join(f'<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>' for name, text in facts.items()),
        pictures=f'<h2>The recording</h2>{figures[0]}{moments}' if figures else '',
    )


def _figure(file: Path, caption: str) -> str:
    data, text = base64.b64encode(file.read_bytes()).decode('ascii'), html.escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'
