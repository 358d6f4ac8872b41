#!/usr/bin/env python3
"""Make the picture of the README's Python example: run the example and save the figure that it draws.

python scripts/make_api_picture.py [FILE]
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from foc_ros.reporting.draw import save_figure

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / 'doc' / 'images' / 'api.png'


def find_example() -> str:
    """Return the Python code that the README shows."""
    found = re.search(r'^```python\n(.*?)^```', (ROOT / 'README.md').read_text('utf-8'), re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError('README.md shows no Python code')
    return found.group(1)


def make_figure() -> Figure:
    """Return the figure that the example draws."""
    names: dict[str, object] = {}
    exec(compile(find_example(), 'README.md', 'exec'), names)
    axes: Any = names['axes']
    figure: Figure = axes.figure
    return figure


if __name__ == '__main__':
    mpl.use('Agg')
    parser = argparse.ArgumentParser(description="Make the picture of the README's Python example.")
    parser.add_argument('file', nargs='?', type=Path, default=PICTURE)
    save_figure(make_figure(), parser.parse_args().file)
