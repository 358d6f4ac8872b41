# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whole figures for print: a prediction, a scene, the movements of a recording, a moment of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import Array

from . import draw
from .draw import Bounds, Span, compute_bounds, open_figure
from .legend import draw_legend, measure_legend
from .views import HandTrajectory, build_snapshot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_IN = 6.4


def draw_snapshot(axes: Any, snapshot: Prediction, bounds: Bounds, hand: Array | None = None) -> None:
    """Draw a scene with the candidates in it, lettered in order of likelihood, the hand and a legend of all that is drawn.

    hand (s, 2): where it is now [m], if it is not drawn yet.
    """
    draw.draw_scene(axes, snapshot.obstacles, snapshot.goal_positions, bounds, names=snapshot.goal_names)
    draw.draw_candidates(axes, snapshot, draw.number_labels(snapshot))
    if hand is not None and len(hand):
        draw.draw_hand_now(axes, hand)
    draw_legend(axes, None if snapshot.candidates_with_likelihood else 'no candidate could be solved')


def plot_prediction(prediction: Prediction, axes: Any = None) -> Any:
    """Draw a prediction with its obstacles and goals.

    Parameters
    ----------
    prediction : Prediction
        Its candidates are drawn from the hand on, the thicker the more likely, with ellipses of one standard deviation of the
        position: filled for motor noise, dashed for the total uncertainty of the most likely one. Those without a likelihood, and
        those that lead through an obstacle, are pale, with the reason beside them.
    axes : matplotlib.axes.Axes, optional
        Where to draw; axes of a new pyplot figure by default. The legend takes a part of their place.

    Returns
    -------
    matplotlib.axes.Axes
        The axes that hold the drawing.
    """
    import matplotlib.pyplot as plt

    snapshot = build_snapshot(prediction)
    hand, bounds = _frame_scene(snapshot)
    with plt.rc_context(draw.STYLE):
        if axes is None:
            axes = plt.figure(figsize=(WIDTH_IN, _get_height(bounds, snapshot)), layout='constrained').subplots()
        draw_snapshot(axes, snapshot, bounds, hand)
    return axes


def write_picture(file: Path | str, prediction: Prediction) -> None:
    """Write a picture of a prediction, in the format of the file's suffix.

    Raises InputError if the suffix is not that of a picture format or the file cannot be written.
    """
    draw.save_figure(make_scene_figure(build_snapshot(prediction)), file)


def make_scene_figure(snapshot: Prediction) -> Figure:
    """Return a figure of one snapshot: scene, candidates and legend."""
    hand, bounds = _frame_scene(snapshot)
    with open_figure(WIDTH_IN, _get_height(bounds, snapshot)) as figure:
        draw_snapshot(figure.subplots(), snapshot, bounds, hand)
    return figure


def make_recording_figure(
    hand: HandTrajectory, obstacles: Obstacles, goals: Array, spans: Sequence[Span], bounds: Bounds
) -> Figure:
    """Return a figure of all movements of a recording, numbered; spans: start and end [ns] of each movement."""
    with open_figure(WIDTH_IN, _get_height(bounds)) as figure:
        axes = figure.subplots()
        draw.draw_scene(axes, obstacles, goals, bounds, named=False)
        axes.plot(*hand.positions.T, color='0.8', linewidth=0.8)
        for number, span in enumerate(spans):
            draw.draw_movement(axes, hand.positions[hand.between(*span)], number)
    return figure


def make_moment_figure(hand: HandTrajectory, snapshot: Prediction, span: Span) -> Figure:
    """Return a figure of one snapshot with the hand during a movement, whose start and end [ns] are span."""
    paths, during = snapshot.candidates_with_likelihood, hand.positions[hand.between(*span)]
    bounds = compute_bounds(snapshot.obstacles, snapshot.goal_positions, paths, during)
    with open_figure(WIDTH_IN, _get_height(bounds, snapshot)) as figure:
        axes = figure.subplots()
        draw.draw_hand(axes, hand, snapshot.stamp_ns, span)
        draw_snapshot(axes, snapshot, bounds)
    return figure


def _frame_scene(snapshot: Prediction) -> tuple[Array, Bounds]:
    """Return the hand, where the newest path begins, (s, 2) [m], and the limits of a scene."""
    newest = sorted(snapshot.candidates, key=lambda each: each.age_s)[:1]
    hand = np.array([each.candidate.guess[0] for each in newest]).reshape(-1, 2)
    return hand, compute_bounds(snapshot.obstacles, snapshot.goal_positions, snapshot.candidates, hand)


def _get_height(bounds: Bounds, snapshot: Prediction | None = None) -> float:
    """Return the height [in] of a scene with equal axes, its axis labels and a legend of candidates."""
    height = float(np.clip(0.9 * WIDTH_IN * (bounds[3] - bounds[2]) / (bounds[1] - bounds[0]), 2.0, 7.0)) + 0.6
    if snapshot is None:
        return height
    return height + measure_legend(snapshot)
