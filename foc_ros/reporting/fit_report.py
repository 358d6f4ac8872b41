# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A fit as a page: the fitted parameters with their intervals beside the given ones, and their scores."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from foc_ros.analysis.fitting.fit import make_tables, make_verdict
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config
from foc_ros.io.outputs import FIT_PAGE

from .draw import get_class_style
from .example import draw_example, warn_of_few
from .page import Picture, Section, explain_tables, make_chart, write_page

WIDTH_IN, LINE_IN = 6.4, 0.34
CAPTION = (
    'Fitted values as multiples of the given ones, with 95 % intervals by bootstrap over recordings; the line is the given value.'
)
EXPLANATIONS = {
    'nat': 'the unit of a natural logarithm of a probability. 0.69 nat more mean twice the probability for what really happened.',
    'above uniform': 'compared with a guess that finds all answers equally likely. 0 is no better than this guess.',
    'log-likelihood': 'the logarithm of the probability of what the hand really did. More is better.',
    'log-density': 'how probable the true positions were. More is better; of a negative log-density less is better.',
    'region of 90 %': 'should hold 90 % of the true positions.',
    '90 % ellipse': 'should hold 90 % of the true positions, if the hand takes the likeliest path.',
    'held out': 'scored on recordings that were left out of the fit, so that it cannot have learnt them by heart.',
    '95 %': 'the interval within which the value would come out from other recordings of this kind; wide means: not well known.',
}
"""What the words in headings, columns and rows mean."""


def write_report(
    directory: Path,
    title: str,
    answer: Mapping[str, Any],
    recordings: Mapping[str, Recording] | None = None,
    config: Config | None = None,
) -> None:
    """Write the page; answer: as of `fit --json`, of recordings, with the fitted configuration.

    Raises InputError where that cannot be done.
    """
    count, failed = answer['recordings'], [f'{name}: {reason}' for name, reason in answer['failed'].items()]
    commands = [('parameter file', answer['output']), *zip(('without ROS', 'with ROS'), answer['node'], strict=True)]
    fitted = f'{len(answer["parameters"])} parameters were fitted to {count} recordings.'
    sections = [
        Section('In short', [fitted, *make_verdict(answer)]),
        *draw_example(recordings, config),
        Section(pictures=_draw_parameters(answer['parameters'])),
        *explain_tables(make_tables(answer), EXPLANATIONS),
        Section('Run the node with these parameters', rows=commands),
    ]
    warnings = [*warn_of_few(count, 'recordings'), *answer['warnings'], *failed]
    write_page(directory, FIT_PAGE, f'Fit: {title}', sections, warnings, config)


def _draw_parameters(parameters: Mapping[str, Any]) -> list[Picture]:
    """Return the picture of the parameters that can be drawn as a multiple of the given value."""
    drawn = {name: each for name, each in parameters.items() if each['given'] > 0.0 and each['value'] > 0.0}
    if not drawn:
        return []
    return [make_chart((WIDTH_IN, 0.9 + LINE_IN * len(drawn)), CAPTION, _draw_multiples, drawn)]


def _draw_multiples(axes: Any, drawn: Mapping[str, Any]) -> None:
    colour, _ = get_class_style(0)
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
