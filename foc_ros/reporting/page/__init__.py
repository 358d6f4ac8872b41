# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""HTML pages from the Jinja templates of this folder, which escape all text. Each page is one file that needs no network."""

from __future__ import annotations

import base64
import os
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

from foc_ros.core.config import Config, flatten
from foc_ros.core.errors import FocError
from foc_ros.io.outputs import MARK, check_replaceable, make_folder, write_whole
from foc_ros.reporting.draw import open_figure

try:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
except ImportError as error:
    raise FocError("pages need Jinja2: install python3-jinja2, or pip install 'foc_ros[report]'") from error

Picture = tuple[str, str]
Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]
FOLDER = Path(__file__).parent
POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""Content security policy of every page: a browser shows what the page holds and fetches nothing."""

_TEMPLATES = Environment(autoescape=True, undefined=StrictUndefined, loader=FileSystemLoader(FOLDER), trim_blocks=True)
_TEMPLATES.globals.update(policy=POLICY, mark=MARK, source=lambda name: (FOLDER / name).read_text(encoding='utf-8'))
_TEMPLATES.policies['json.dumps_kwargs'] = {'allow_nan': False, 'separators': (',', ':')}


def render(template: str, **values: Any) -> str:
    """Return the page of a template of this folder."""
    return _TEMPLATES.get_template(template).render(values)


@dataclass(frozen=True)
class Section:
    """A part of a page: sentences, notes that explain the pictures and the table below them, whichever of them it has."""

    heading: str = ''
    sentences: Sequence[str] = ()
    notes: Sequence[str] = ()
    pictures: Sequence[Picture] = ()
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()


def write_page(
    directory: Path, name: str, title: str, sections: Sequence[Section], warnings: Sequence[str], config: Config | None
) -> None:
    """Write a page with warnings on top, and what made it below; raises InputError where it cannot be written, or replaced."""
    check_replaceable('--report', directory / name)
    page = render('study.html', title=title, sections=sections, warnings=warnings, **describe_origin(config))
    with make_folder('--report', directory), write_whole(directory / name) as unfinished:
        unfinished.write_text(page, encoding='utf-8', errors='replace')


def describe_origin(config: Config | None) -> dict[str, Any]:
    """Return for the footer of a page what made it, and the parameters that do not have their defaults."""
    system = f'{platform.system()} on {platform.machine()} with {os.cpu_count()} processors, Python {platform.python_version()}'
    made = f'Made by foc_ros {version("foc_ros")} on {datetime.now().astimezone():%Y-%m-%d}; {system}.'
    changed = None
    if config is not None:
        standard = flatten(Config())
        changed = {name: value for name, value in flatten(config).items() if value != standard[name]}
        # of a file only its name
        changed = {name: Path(value).name if isinstance(value, str) else f'{value}' for name, value in changed.items()}
    return {'made': made, 'changed': changed}


def make_picture(figure: Any, caption: str) -> Picture:
    """Return a matplotlib figure with its caption for a section."""
    png = BytesIO()
    figure.savefig(png, format='png', bbox_inches='tight', pad_inches=0.08, metadata={'Software': MARK})
    return base64.b64encode(png.getvalue()).decode('ascii'), caption


def explain_tables(tables: Iterable[Table], explanations: Mapping[str, str]) -> list[Section]:
    """Return tables as sections, each with the explanations of the words that stand in it first."""
    left, sections = dict(explanations), []
    for heading, columns, rows in tables:
        words = ' '.join((heading, *columns, *(cell for row in rows for cell in row)))
        notes = [f'{name}: {left.pop(name)}' for name in explanations if name in left and name in words]
        sections.append(Section(heading, notes=notes, columns=columns, rows=rows))
    return sections


def make_chart(size_in: tuple[float, float], caption: str, draw: Callable[..., None], *given: Any) -> Picture:
    """Return a chart for a section, drawn on axes by a function; its legend is below, where it covers nothing."""
    with open_figure(*size_in) as figure:
        draw(axes := figure.subplots(), *given)
        handles, labels = axes.get_legend_handles_labels()
        named = dict(zip(labels, handles, strict=True))  # each label once
        if named:
            look = {'loc': 'outside lower center', 'ncols': 3, 'frameon': False, 'fontsize': 'small', 'handlelength': 4.0}
            figure.legend(named.values(), named.keys(), **look)
    return make_picture(figure, caption)
