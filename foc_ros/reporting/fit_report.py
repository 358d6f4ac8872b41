"""A fit as a page: the parameters with their intervals, beside those given, and what they are worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from foc_ros.core.errors import InputError

from .drawing import class_style, new_figure
from .page import page_of, picture, pictures, table
from .plots import save

PAGE = 'fit.html'
WIDTH_IN, LINE_IN = 6.4, 0.34
WORDS = (
    'Fitted values as multiples of those given, with 95 % intervals by bootstrap over recordings; the line is the value given.'
)


def write_report(directory: Path, title: str, answer: Mapping[str, Any], scores: Mapping[str, str]) -> None:
    """Write the page; answer: as of `fit --json`; scores: the words for each score. Raises InputError where that fails."""
    warnings = [*answer['warnings'], *(f'{name}: {reason}' for name, reason in answer['failed'].items())]
    rows = [_cells(name, each) for name, each in answer['parameters'].items()]
    worth = [
        (scores[score], name, '-' if value is None else f'{value:.3f}')
        for score, values in answer['scores'].items()
        for name, value in values.items()
    ]
    body = (
        _picture(answer['parameters'])
        + table(('parameter', 'given', 'fitted', '95 %', 'by'), rows)
        + '<h2>What they are worth</h2>'
        + table(('score', 'under', 'value'), worth)
        + '<h2>The node with them</h2>'
        + table((), [('parameter file', answer['output']), *zip(('without ROS', 'with ROS'), answer['node'], strict=True)])
    )
    try:
        directory.mkdir(parents=True, exist_ok=True)
        (directory / PAGE).write_text(page_of(f'Fit: {title}', body, warnings), encoding='utf-8')
    except OSError as error:
        raise InputError('--report', 'a folder that can be written', f'{directory}: {error.strerror}') from error


def _cells(name: str, each: Mapping[str, Any]) -> Sequence[str]:
    low, high = ('-' if end is None else f'{end:.4g}' for end in each['interval'])
    return name, f'{each["given"]:.4g}', f'{each["value"]:.4g}', f'{low} to {high}', each['how']


def _picture(parameters: Mapping[str, Any]) -> str:
    """Return the picture of those that can be drawn as a multiple of what was given."""
    drawn = {name: each for name, each in parameters.items() if each['given'] > 0.0 and each['value'] > 0.0}
    if not drawn:
        return ''
    with new_figure(WIDTH_IN, 0.9 + LINE_IN * len(drawn)) as figure:
        axes = figure.subplots()
        for row, each in enumerate(drawn.values()):
            ends = [end / each['given'] for end in each['interval'] if end is not None and end > 0.0]
            colour, _ = class_style(0)
            axes.plot(ends, [row] * len(ends), color=colour, linewidth=3.0, alpha=0.5, solid_capstyle='butt')
            axes.plot(each['value'] / each['given'], row, marker='o', color=colour)
        axes.axvline(1.0, color='0.4', linewidth=1.0)
        axes.set_yticks(range(len(drawn)), list(drawn))
        axes.set(xscale='log', xlabel='fitted / given', ylim=(len(drawn) - 0.4, -0.6))
        for formatted in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
            formatted('{x:g}')
        axes.tick_params(axis='x', which='minor', labelsize=7)
    with TemporaryDirectory() as scratch:
        file = Path(scratch) / 'fit.png'
        save(figure, file)
        return pictures([picture(file, WORDS)])
