# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whole figures for print: a prediction, a scene, a moment of a recording; and their legends.

A legend is below the axes, so that it covers nothing: the candidates with their classes in words, and the signs.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from foc_ros.core.errors import warn
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import Array

from . import draw
from .draw import Bounds, Figure, Span, compute_bounds, open_figure
from .views import SLOTS, HandTrajectory, build_snapshot, find_entered

WIDTH_IN = 6.4
SIZE_PT, COLUMNS = 7.5, 70
"""Size of the text, where there is room for it [pt], and characters in a line of a candidate."""
LEAST_PT = 5.0
"""Size of the text below which nobody can read it, and the legend is left out [pt]."""
LINE = 1.35
"""Height of a line, in parts of the size of its text."""
_DRAWN: WeakKeyDictionary[Any, set[Any]] = WeakKeyDictionary()
"""What `plot_prediction` drew on axes."""
_PLACES: WeakKeyDictionary[Any, tuple[Any, Any]] = WeakKeyDictionary()
"""Subplot and place of axes before a legend took a part of it."""


def draw_snapshot(axes: Any, snapshot: Prediction, bounds: Bounds, hand: Array | None = None, is_alone: bool = False) -> None:
    """Draw a scene with the candidates in it, lettered in order of likelihood, the hand and a legend of all that is drawn.

    hand (s, 2): where it is now [m], if it is not drawn yet; is_alone: whether the figure becomes higher by the legend.
    """
    draw.draw_scene(axes, snapshot.obstacles, snapshot.goal_positions, bounds, names=snapshot.goal_names)
    shown = snapshot.candidates_with_likelihood
    slots = {each.label: slot for slot, each in enumerate(shown[:SLOTS])}
    draw.draw_candidates(axes, snapshot, slots)
    if hand is not None and len(hand):
        draw.draw_hand_now(axes, hand)
    draw_legend(axes, _describe_trouble(snapshot), is_alone)
    draw.draw_letters(axes, snapshot, slots)


def _describe_trouble(snapshot: Prediction) -> str | None:
    """Return what a reader has to know before all else: that nothing could be solved, or where the hand is now."""
    if not snapshot.candidates_with_likelihood:
        return 'no candidate could be solved'
    entered = find_entered(snapshot)
    return f'the hand is inside obstacle {", ".join(entered)}' if entered else None


def plot_prediction(prediction: Prediction, axes: Any = None) -> Any:
    """Draw a prediction with its obstacles and goals, on axes of a new pyplot figure by default; return the axes.

    What an earlier call drew on them is replaced. The legend takes a part of their place. It is left out, with a FocWarning,
    where nobody could read it.
    """
    import matplotlib.pyplot as plt

    snapshot = build_snapshot(prediction)
    hand, bounds = _frame_scene(snapshot)
    is_alone = axes is None
    with plt.rc_context(draw.STYLE):
        if axes is None:
            axes = plt.figure(figsize=(WIDTH_IN, _get_height(bounds)), layout='constrained').subplots()
        for earlier in _DRAWN.pop(axes, set()) & {*axes.get_children()}:  # those that are there still
            earlier.remove()
        others = {*axes.get_children()}
        draw_snapshot(axes, snapshot, bounds, hand, is_alone)
        _DRAWN[axes] = {*axes.get_children()} - others
    return axes


def write_picture(file: Path, prediction: Prediction) -> None:
    """Write a picture of a prediction as PNG, PDF or SVG, by the file's suffix; raises InputError if it cannot be written."""
    draw.save_figure(make_scene_figure(build_snapshot(prediction)), file)


def make_scene_figure(snapshot: Prediction) -> Figure:
    """Return a figure of one snapshot: scene, candidates and legend."""
    hand, bounds = _frame_scene(snapshot)
    with open_figure(WIDTH_IN, _get_height(bounds)) as figure:
        draw_snapshot(figure.subplots(), snapshot, bounds, hand, is_alone=True)
    return figure


def make_moment_figure(hand: HandTrajectory, snapshot: Prediction, span: Span) -> Figure:
    """Return a figure of one snapshot with the hand during a movement, whose start and end [ns] are span."""
    paths, during = snapshot.candidates_with_likelihood, hand.positions[hand.between(*span)]
    bounds = compute_bounds(snapshot.obstacles, snapshot.goal_positions, paths, during)
    with open_figure(WIDTH_IN, _get_height(bounds)) as figure:
        axes = figure.subplots()
        draw.draw_hand(axes, hand, snapshot.stamp_ns, span)
        draw_snapshot(axes, snapshot, bounds, is_alone=True)
    return figure


def _frame_scene(snapshot: Prediction) -> tuple[Array, Bounds]:
    """Return the hand, where the newest path begins, (s, 2) [m], and the limits of a scene."""
    newest = sorted(snapshot.candidates, key=lambda each: each.age_s)[:1]
    hand = np.array([each.candidate.guess[0] for each in newest]).reshape(-1, 2)
    return hand, compute_bounds(snapshot.obstacles, snapshot.goal_positions, snapshot.candidates, hand)


def _get_height(bounds: Bounds) -> float:
    return float(np.clip(0.85 * WIDTH_IN * (bounds[3] - bounds[2]) / (bounds[1] - bounds[0]), 2.0, 7.0)) + 0.55


def draw_legend(axes: Any, title: str | None = None, is_added: bool = False) -> None:
    """Write all that is drawn on axes into a legend, in a part of their place; a second call replaces it.

    One that nobody could read is left out, with a warning.

    is_added: whether the figure becomes higher by it; otherwise the text is as small as the place needs.
    """
    from matplotlib.lines import Line2D
    from matplotlib.transforms import ScaledTranslation

    figure, name = axes.figure, f'legend {id(axes)}'
    for earlier in [each for each in figure.axes if each.get_gid() == name]:
        earlier.remove()
    if is_added:
        figure.get_layout_engine().execute(figure)  # the axes have all of the figure only then
    slot = axes.get_subplotspec()
    place = axes.get_position(original=True) if is_added or slot is None else slot.get_position(figure)
    slot, place = _PLACES.setdefault(axes, (slot, place))
    width_in = figure.get_figwidth() * place.width
    columns, sign_columns = (40, 1) if width_in < 3.5 else (COLUMNS, 2)
    handles, labels = axes.get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True))
    for handle, label in zip(handles, labels, strict=True):
        if named[label] is not handle:
            handle.set_label('_nolegend_')  # a legend that the user adds has each sign once, too
    candidates = sorted((label for label in named if named[label].get_gid()), key=lambda label: (named[label].get_gid(), label))
    if any(line.get_linestyle() == ':' for line in axes.lines):
        named['dotted: not known to avoid as surely as wanted'] = Line2D([], [], color='0.35', linestyle=':', linewidth=2.0)
    signs = [label for label in named if label not in candidates]
    texts = [fill(label, columns, subsequent_indent=' ' * 10) for label in candidates]
    lines = sum(1 + text.count('\n') for text in texts) + -(-len(signs) // sign_columns) + (title is not None)
    size_pt = min(SIZE_PT, 72.0 * width_in / (0.62 * (columns + 5)))
    wanted_in = lines * LINE * size_pt / 72.0 + 0.05
    height_in = figure.get_figheight() * place.height
    if is_added:
        figure.set_figheight(figure.get_figheight() + wanted_in)
        height_in += wanted_in
    wanted_in = min(wanted_in, 0.5 * height_in)
    size_pt = min(size_pt, 72.0 * (wanted_in - 0.05) / (LINE * max(lines, 1)))
    if size_pt < LEAST_PT:
        reason = f'no room for a legend in axes of {width_in:.1f} x {height_in:.1f} in, its text would have {size_pt:.1f} pt'
        warn('; '.join(filter(None, [title, f'{reason}: it is left out; draw in larger axes'])))
        return
    below = _take_place(axes, slot, place, height_in, wanted_in)
    below.set(gid=name)
    below.axis('off')
    look: dict[str, Any] = {'borderaxespad': 0.0, 'borderpad': 0.0, 'labelspacing': 0.25, 'handlelength': 2.0, 'frameon': False}
    words = {'title': title, 'title_fontsize': size_pt, 'prop': {'family': 'monospace', 'size': size_pt}}
    upper = below.add_artist(below.legend([named[label] for label in candidates], texts, loc='upper left', **words, **look))
    down = ScaledTranslation(0.0, -upper.get_window_extent().height / figure.dpi - 0.08, figure.dpi_scale_trans)
    look |= {'loc': 'upper left', 'bbox_to_anchor': (0.0, 1.0), 'bbox_transform': below.transAxes + down}
    handles, font = [named[label] for label in signs], {'size': size_pt}
    below.legend(handles, signs, ncols=sign_columns, columnspacing=2.0, prop=font, **look)


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
