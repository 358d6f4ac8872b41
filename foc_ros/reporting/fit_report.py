"""A fit as a page: the fitted parameters with their intervals beside the given ones, and their scores."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from foc_ros.analysis.fitting.fit import (
    COMPARISON_COLUMNS,
    PARAMETER_COLUMNS,
    SCORE_COLUMNS,
    format_comparison,
    format_parameters,
    format_scores,
    make_verdict,
)
from foc_ros.io.outputs import FIT_PAGE

from .draw import get_class_style, open_figure
from .page import render_figure, render_list, render_page, render_pictures, render_table, write_page

WIDTH_IN, LINE_IN = 6.4, 0.34
CAPTION = (
    'Fitted values as multiples of the given ones, with 95 % intervals by bootstrap over recordings; the line is the given value.'
)


def write_report(directory: Path, title: str, answer: Mapping[str, Any]) -> None:
    """Write the page; answer: as of `fit --json`. Raises InputError where that cannot be done."""
    warnings = [*answer['warnings'], *(f'{name}: {reason}' for name, reason in answer['failed'].items())]
    commands = [('parameter file', answer['output']), *zip(('without ROS', 'with ROS'), answer['node'], strict=True)]
    body = (
        render_list(make_verdict(answer))
        + render_table(COMPARISON_COLUMNS, format_comparison(answer), 'Before and after')
        + _draw_parameters(answer['parameters'])
        + render_table(PARAMETER_COLUMNS, format_parameters(answer))
        + render_table(SCORE_COLUMNS, format_scores(answer), 'Scores')
        + render_table((), commands, 'Run the node with these parameters')
    )
    write_page(directory, FIT_PAGE, render_page(f'Fit: {title}', body, warnings))


def _draw_parameters(parameters: Mapping[str, Any]) -> str:
    """Return the picture of the parameters that can be drawn as a multiple of the given value."""
    drawn = {name: each for name, each in parameters.items() if each['given'] > 0.0 and each['value'] > 0.0}
    if not drawn:
        return ''
    with open_figure(WIDTH_IN, 0.9 + LINE_IN * len(drawn)) as figure:
        axes, (colour, _) = figure.subplots(), get_class_style(0)
        for row, each in enumerate(drawn.values()):
            ends = [end / each['given'] for end in each['interval'] if end is not None and end > 0.0]
            axes.plot(ends, [row] * len(ends), color=colour, linewidth=3.0, alpha=0.5, solid_capstyle='butt')
            axes.plot(each['value'] / each['given'], row, marker='o', color=colour)
        axes.axvline(1.0, color='0.4', linewidth=1.0)
        axes.set_yticks(range(len(drawn)), list(drawn))
        axes.set(xscale='log', xlabel='fitted / given', ylim=(len(drawn) - 0.4, -0.6))
        for set_format in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
            set_format('{x:g}')
        axes.tick_params(axis='x', which='minor', labelsize=7)
    return render_pictures([render_figure(figure, CAPTION)])
