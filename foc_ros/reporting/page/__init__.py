# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""HTML pages from the Jinja templates of this folder. Each page is one file that needs no network.

Text is escaped by the templates. HTML that a function below returns may be joined and passed to `render_page` as a body.
"""

from __future__ import annotations

import base64
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

from foc_ros.core.config import Config, flatten
from foc_ros.core.errors import FocError, InputError
from foc_ros.io.outputs import MARK, check_replaceable

try:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
except ImportError as error:
    raise FocError("pages need Jinja2: install python3-jinja2, or pip install 'foc_ros[report]'") from error

FOLDER = Path(__file__).parent
POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""Content security policy of every page: a browser shows what the page holds and fetches nothing."""


def read_part(name: str) -> str:
    """Return the text of a file of this folder."""
    return (FOLDER / name).read_text(encoding='utf-8')


_TEMPLATES = Environment(autoescape=True, undefined=StrictUndefined, loader=FileSystemLoader(FOLDER), trim_blocks=True)
_TEMPLATES.globals.update(policy=POLICY, mark=MARK, source=read_part)
_TEMPLATES.policies['json.dumps_kwargs'] = {'allow_nan': False, 'separators': (',', ':')}
_PARTS: Any = _TEMPLATES.get_template('parts.html').module


def render(template: str, **values: Any) -> str:
    """Return the page of a template of this folder."""
    return _TEMPLATES.get_template(template).render(values)


def write_page(directory: Path, name: str, page: str) -> None:
    """Write a page to a folder, which is made if necessary; raise InputError if that cannot be done.

    A page that foc_ros has made is replaced; another file of that name is not.
    """
    check_replaceable('--report', directory / name)
    try:
        directory.mkdir(parents=True, exist_ok=True)
        (directory / name).write_text(page, encoding='utf-8', errors='replace')
    except OSError as error:
        raise InputError('--report', 'a folder that can be written', f'{directory}: {error.strerror}') from error


def render_page(title: str, body: str, warnings: Sequence[str] = (), config: Config | None = None) -> str:
    """Return a page with a title, warnings on top, a body of HTML, and what made it: program, date, machine, parameters."""
    system = f'{platform.system()} on {platform.machine()} with {os.cpu_count()} processors, Python {platform.python_version()}'
    made = f'Made by foc_ros {version("foc_ros")} on {datetime.now().astimezone():%Y-%m-%d}; {system}.'
    changed = None if config is None else list_changed(config)
    return render('frame.html', title=title, body=body, warnings=warnings, made=made, changed=changed)


def list_changed(config: Config) -> dict[str, str]:
    """Return the parameters that do not have their defaults; of a file only its name."""
    standard = flatten(Config())
    changed = {name: value for name, value in flatten(config).items() if value != standard[name]}
    return {name: Path(value).name if isinstance(value, str) else f'{value}' for name, value in changed.items()}


def render_table(columns: Sequence[str], rows: Iterable[Sequence[str]], heading: str = '', notes: Iterable[str] = ()) -> str:
    """Return a table as HTML, below a heading and notes that explain it; the first cell of a row is its heading."""
    return str(_PARTS.table(columns, rows, heading, notes))


def render_list(sentences: Iterable[str], heading: str = '') -> str:
    """Return sentences as HTML, one below the other, below a heading if one is given."""
    return str(_PARTS.list(sentences, heading))


def render_figure(figure: Any, caption: str) -> str:
    """Return a matplotlib figure with its caption as HTML that contains it as PNG."""
    png = BytesIO()
    figure.savefig(png, format='png', bbox_inches='tight', pad_inches=0.08, metadata={'Software': MARK})
    return str(_PARTS.picture(base64.b64encode(png.getvalue()).decode('ascii'), caption))


def render_pictures(figures: Iterable[str]) -> str:
    """Return figures as HTML, as many side by side as the screen has room for."""
    return str(_PARTS.pictures(figures))


def render_tables(tables: Iterable[tuple[str, Sequence[str], Sequence[Sequence[str]]]], explanations: Mapping[str, str]) -> str:
    """Return tables (heading, columns, rows) as HTML, each with the explanations of the words that stand in it first."""
    left, html = dict(explanations), ''
    for heading, columns, rows in tables:
        words = ' '.join((heading, *columns, *(cell for row in rows for cell in row)))
        notes = [f'{name}: {left.pop(name)}' for name in explanations if name in left and name in words]
        html += render_table(columns, rows, heading, notes)
    return html


def place_legend(figure: Any, columns: int = 3) -> None:
    """Write the legend of the axes of a figure below them, where it covers nothing."""
    handles, labels = figure.axes[0].get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True))  # each label once
    figure.legend(named.values(), named.keys(), loc='outside lower center', ncols=columns, frameon=False, fontsize='small')
