# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The legend of a scene: its candidates with their classes in words, and the signs; below the axes, so that it covers nothing."""

from __future__ import annotations

from textwrap import fill
from typing import Any
from weakref import WeakKeyDictionary

from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.ros.messages.ranking import describe_candidate

SIZE_PT, COLUMNS = 8.0, 70
"""Size of the text, where there is room for it [pt], and characters in a line of a candidate."""
LINE = 1.35
"""Height of a line, in parts of the size of its text."""
_PLACES: WeakKeyDictionary[Any, tuple[Any, Any]] = WeakKeyDictionary()
"""Subplot and place of axes before a legend took a part of it."""


def describe_in_legend(candidate: PredictedCandidate, goals: int, letter: str = ' ', reason: str = '') -> str:
    """Return the line of a candidate; goals: number of goals; reason: why it is a ghost."""
    name = describe_candidate(candidate, goals)
    if len(name) > 60:  # the words of a class with many obstacles would leave no room for the plot
        name = candidate.label
    if not candidate.has_likelihood:
        return f'{letter}    - %  {name}; {candidate.reason}'
    found = 'estimated' if candidate.is_estimated else 'compromised'
    words = '' if candidate.is_solved else f'; {found}: eta {candidate.eta:.3f}'
    return f'{letter}  {100 * candidate.likelihood:3.0f} %  {name}{words}{f"; {reason}" if reason else ""}'


def measure_legend(snapshot: Prediction) -> float:
    """Return the height of the legend of a scene that is as wide as a page [in], with its signs except those of a moving hand."""
    signs = 6 + any(not each.is_solved for each in snapshot.candidates_with_likelihood)
    texts = [fill(describe_in_legend(each, len(snapshot.goal_positions)), COLUMNS) for each in snapshot]
    lines = sum(1 + text.count('\n') for text in texts) + -(-signs // 2)
    return lines * LINE * SIZE_PT / 72.0 + 0.05


def draw_legend(axes: Any, title: str | None = None) -> None:
    """Write everything that is drawn on axes into a legend, in a part of their place.

    The text is as small as the place needs. A second call replaces the legend of the first.
    """
    from matplotlib.lines import Line2D  # `draw` says what to do where it is missing

    figure, name = axes.figure, f'legend {id(axes)}'
    for earlier in [each for each in figure.axes if each.get_gid() == name]:
        earlier.remove()
    slot, place = _PLACES.setdefault(axes, (axes.get_subplotspec(), axes.get_position(original=True)))
    width_in, height_in = figure.get_figwidth() * place.width, figure.get_figheight() * place.height
    is_narrow = width_in < 3.5
    columns, sign_columns = (40, 1) if is_narrow else (COLUMNS, 2)
    named = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    shares = {label: float(label.partition('%')[0][1:].strip().replace('-', '-1')) for label in named if '%  ' in label}
    candidates = sorted(shares, key=lambda label: (-shares[label], label))
    if any(isinstance(named[label], Line2D) and named[label].get_linestyle() == ':' for label in candidates):
        named['dotted: not known to avoid as surely as wanted'] = Line2D([], [], color='0.35', linestyle=':', linewidth=2.0)
    signs = [label for label in named if label not in candidates]
    texts = [fill(label, columns, subsequent_indent=' ' * 10) for label in candidates]
    lines = sum(1 + text.count('\n') for text in texts) + -(-len(signs) // sign_columns) + (title is not None)
    size_pt = min(SIZE_PT, 72.0 * width_in / (0.62 * (columns + 5)))
    wanted_in = min(lines * LINE * size_pt / 72.0 + 0.05, 0.5 * height_in)
    size_pt = min(size_pt, 72.0 * (wanted_in - 0.05) / (LINE * max(lines, 1)))
    below = _take_place(axes, slot, place, height_in, wanted_in)
    below.set(gid=name)
    below.axis('off')
    look = {'borderaxespad': 0.0, 'borderpad': 0.0, 'labelspacing': 0.25, 'handlelength': 2.0, 'frameon': False}
    font, handles = {'family': 'monospace', 'size': size_pt}, [named[label] for label in candidates]
    below.add_artist(below.legend(handles, texts, title=title, loc='upper left', prop=font, **look))
    handles, font = [named[label] for label in signs], {'size': size_pt}
    below.legend(handles, signs, loc='lower left', ncols=sign_columns, columnspacing=2.0, prop=font, **look)


def _take_place(axes: Any, slot: Any, place: Any, height_in: float, wanted_in: float) -> Any:
    """Return new axes of a height [in] below axes, which become so much smaller."""
    figure = axes.figure
    gap_in = 0.0 if figure.get_layout_engine() else 0.5  # of the labels below axes
    parts = [max(height_in - wanted_in - gap_in, 0.2 * height_in), gap_in, wanted_in]
    if slot is None:
        bottom = place.y0 + place.height * (gap_in + wanted_in) / sum(parts)
        axes.set_position((place.x0, bottom, place.width, place.y1 - bottom))
        return figure.add_axes((place.x0, place.y0, place.width, place.height * wanted_in / sum(parts)))
    parts = [each for each in parts if each]
    rows = slot.subgridspec(len(parts), 1, height_ratios=parts, hspace=0.0)
    axes.set_subplotspec(rows[0])
    return figure.add_subplot(rows[-1])
