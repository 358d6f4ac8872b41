"""Figures for print: a prediction in its scene, all movements of a recording, one movement at one prediction."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from foc_ros.core.errors import InputError
from foc_ros.core.obstacles.geometry import find_limits
from foc_ros.core.types import NANOSECONDS, Array, Obstacles, PredictedCandidate, Prediction
from foc_ros.io.outputs import MARK, PICTURE_SUFFIXES

from .drawing import (
    CLASSES,
    ELLIPSE_HANDLES,
    HATCH,
    STDDEVS,
    STYLE,
    Bounds,
    describe_in_legend,
    draw_candidates,
    draw_hand,
    draw_movement,
    draw_scene,
    draw_speeds,
    draw_tag,
    get_class_style,
    get_letter,
    open_figure,
)
from .snapshots import CandidateView, HandTrajectory, UnsolvedView, build_candidate_views, build_unsolved_views

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .track_association import CandidateTracks

METADATA: dict[str, dict[str, str | None]] = {
    '.png': {'Software': MARK},
    '.pdf': {'Creator': MARK, 'CreationDate': None},
    '.svg': {'Creator': MARK, 'Date': None},
}
"""What a picture says of itself, by its format; without its date it is the same file each time."""
WIDTH_IN = 6.4
NOWHERE: Array = np.zeros((0, 2))
LINE_IN = 0.2
"""Height of a line of the legend [in]."""


def draw_likelihoods(axes: Any, tracks: CandidateTracks, origin_ns: int) -> None:
    """Draw the likelihoods of the tracks that have a slot over time [s].

    A track has a gap where it has no candidate. The share of the candidates of which no likelihood is known is hatched.
    """
    times = (np.array([each.stamp_ns for each in tracks.snapshots]) - origin_ns) / NANOSECONDS
    drawn = {track: values for track, values in tracks.likelihoods().items() if track in tracks.slots}
    for rank, (track, (first, values)) in enumerate(drawn.items()):
        colour, dash = get_class_style(tracks.slots[track])
        axes.plot(
            times[first : first + len(values)], values, color=colour, linestyle=dash, linewidth=1.8, marker='.', markersize=2.5
        )
        known = np.flatnonzero(np.isfinite(values))
        row = known[(2 * rank + 1) * len(known) // (2 * len(drawn))]
        draw_tag(axes, (times[first + row], values[row]), get_letter(tracks.slots[track]), colour)
    unknown = np.array([each.unknown_share for each in tracks.snapshots])
    if unknown.any():
        look = {'facecolor': 'none', 'edgecolor': '0.6', 'hatch': HATCH, 'linewidth': 0.0, 'step': 'mid'}
        axes.fill_between(times, 1.0 - unknown, 1.0, label='share of what is unknown', **look)
        axes.legend(loc='lower left', fontsize=7)
    axes.set(ylim=(-0.03, 1.03), ylabel='likelihood')
    axes.tick_params(labelbottom=False)


def plot_prediction(prediction: Prediction, axes: Any = None) -> Any:
    """Draw a prediction with its obstacles and goals.

    Parameters
    ----------
    prediction : Prediction
        Its candidates are drawn, the thicker the more likely, with ellipses of one standard deviation of the position: filled for
        motor noise, dashed for the total uncertainty. Those without a likelihood are grey, and the legend gives the reason.
    axes : matplotlib.axes.Axes, optional
        Where to draw; axes of a new pyplot figure by default.

    Returns
    -------
    matplotlib.axes.Axes
        The axes that hold the drawing.
    """
    import matplotlib.pyplot as plt

    goals = len(prediction.goals)
    views = build_candidate_views(prediction.candidates, goals), build_unsolved_views(prediction.candidates, goals)
    starts = np.array([each.candidate.guess[0] for each in prediction.candidates[:1]]).reshape(-1, 2)
    bounds = _compute_scene_bounds(prediction.obstacles, prediction.goals, *views, starts)
    with plt.rc_context(STYLE):
        if axes is None:
            axes = plt.figure(figsize=(WIDTH_IN, _get_height(bounds, *views)), layout='constrained').subplots()
        _draw_views(axes, prediction.obstacles, prediction.goals, *views, starts, bounds)
    return axes


def plot_outcomes(
    file: Path | str, obstacles: Obstacles, goals: Array, outcomes: Sequence[PredictedCandidate], start: Array
) -> None:
    """Write a picture of candidates in their scene, in the format of the file's suffix.

    goals (g, 2), start (2,) [m]. Raises InputError if the suffix is not that of a picture format or the file cannot be written.
    """
    views = build_candidate_views(outcomes, len(goals)), build_unsolved_views(outcomes, len(goals))
    save_figure(make_scene_figure(obstacles, goals, *views, start[None]), file)


def make_scene_figure(
    obstacles: Obstacles,
    goals: Array,
    candidates: Sequence[CandidateView],
    unsolved: Sequence[UnsolvedView] = (),
    starts: Array = NOWHERE,
) -> Figure:
    """Return a figure of one scene with the candidates in it and a legend; starts (s, 2) [m]: positions of the hand."""
    bounds = _compute_scene_bounds(obstacles, goals, candidates, unsolved, starts)
    with open_figure(WIDTH_IN, _get_height(bounds, candidates, unsolved)) as figure:
        _draw_views(figure.subplots(), obstacles, goals, candidates, unsolved, starts, bounds)
    return figure


def _draw_views(
    axes: Any,
    obstacles: Obstacles,
    goals: Array,
    candidates: Sequence[CandidateView],
    unsolved: Sequence[UnsolvedView],
    starts: Array,
    bounds: Bounds,
) -> None:
    draw_scene(axes, obstacles, goals, bounds)
    draw_candidates(axes, candidates, number_labels(candidates), unsolved)
    axes.plot(*starts.T, marker='o', markersize=6, linestyle='', color='black', zorder=6)


def _compute_scene_bounds(
    obstacles: Obstacles, goals: Array, candidates: Sequence[CandidateView], unsolved: Sequence[UnsolvedView], starts: Array
) -> Bounds:
    return compute_bounds(obstacles, goals, candidates, *(each.path for each in unsolved), starts)


def make_recording_figure(
    hand: HandTrajectory, obstacles: Obstacles, goals: Array, spans: Sequence[tuple[int, int]], bounds: Bounds
) -> Figure:
    """Return a figure of all movements of a recording, numbered; spans: start and end [ns] of each movement."""
    with open_figure(WIDTH_IN, _get_height(bounds)) as figure:
        axes = figure.subplots()
        draw_scene(axes, obstacles, goals, bounds, named=False)
        axes.plot(*hand.positions.T, color='0.8', linewidth=0.8)
        for number, span in enumerate(spans):
            draw_movement(axes, hand.positions[hand.between(*span)], number)
    return figure


def make_snapshot_figure(
    hand: HandTrajectory, tracks: CandidateTracks, row: int, span: tuple[int, int], bounds: Bounds
) -> Figure:
    """Return a figure of one snapshot during a movement: the scene above, likelihoods and speeds of the whole movement below.

    row: of the snapshot in the tracks; span: start and end [ns] of the movement.
    """
    snapshot, slots = tracks.snapshots[row], tracks.slots_at(row)
    origin_ns = int(hand.stamps_ns[0])
    now_s, begin_s, end_s = ((stamp - origin_ns) / NANOSECONDS for stamp in (snapshot.stamp_ns, *span))
    heights = [_get_height(bounds, snapshot.candidates, snapshot.unsolved), 2.1, 1.9]
    with open_figure(WIDTH_IN, sum(heights)) as figure:
        scene, likelihoods, speeds = figure.subplots(3, 1, height_ratios=heights)
        draw_scene(scene, snapshot.obstacles, snapshot.goals, bounds)
        draw_candidates(scene, snapshot.candidates, slots, snapshot.unsolved)
        draw_hand(scene, hand, snapshot.stamp_ns, span)
        draw_likelihoods(likelihoods, tracks.between(*span), origin_ns)
        draw_speeds(speeds, hand, snapshot, slots, span, origin_ns)
        for axes in (likelihoods, speeds):
            axes.axvline(now_s, color='0.4', linewidth=1.0, linestyle=':')
            axes.set_xlim(begin_s, end_s)
        scene.set_title(f'at {now_s:.2f} s')
    return figure


def number_labels(candidates: Sequence[CandidateView]) -> dict[str, int]:
    """Return slots of the candidates of a single prediction, by label; candidates beyond the number of slots have none."""
    return {each.label: number for number, each in enumerate(candidates[:CLASSES])}


def compute_bounds(
    obstacles: Obstacles, goals: Array, candidates: Sequence[CandidateView], *points: Array, margin: float = 0.04
) -> Bounds:
    """Return limits of x and y [m] around obstacles, goals, candidates with their ellipses, and further points (m, 2).

    margin: as a share of the greater side.
    """
    shapes = find_limits(obstacles, STDDEVS * obstacles.radius_stddev)
    spread = [(each.path, STDDEVS * np.sqrt(np.diagonal(each.covariance, axis1=1, axis2=2))) for each in candidates]
    edges = [centre + sign * width for centre, width in spread for sign in (-1.0, 1.0)]
    enclosed = np.concatenate([*shapes, *edges, np.reshape(goals, (-1, 2)), *points])
    low, high = (enclosed.min(axis=0), enclosed.max(axis=0)) if len(enclosed) else (np.zeros(2), np.ones(2))
    added = margin * max(*(high - low), 0.05)
    return float(low[0] - added), float(high[0] + added), float(low[1] - added), float(high[1] + added)


def save_figure(figure: Figure, file: Path | str) -> None:
    """Write a figure as PNG, PDF or SVG, by the file's suffix; raises InputError if that is not possible."""
    suffix = Path(file).suffix.lower()
    if suffix not in PICTURE_SUFFIXES:
        raise InputError('picture file', f'a name that ends in {", ".join(PICTURE_SUFFIXES)}', str(file))
    try:
        figure.savefig(file, bbox_inches='tight', pad_inches=0.08, metadata=METADATA[suffix])
    except OSError as error:
        raise InputError('picture file', 'a file that can be written', f'{file}: {error.strerror or error}') from error


def _get_height(bounds: Bounds, candidates: Sequence[CandidateView] = (), unsolved: Sequence[UnsolvedView] = ()) -> float:
    """Return the height [in] of a scene with equal axes, its axis labels and a legend of candidates."""
    height = 0.9 * WIDTH_IN * (bounds[3] - bounds[2]) / (bounds[1] - bounds[0])
    texts = [describe_in_legend(each) for each in candidates] + [describe_in_legend(each) for each in unsolved]
    lines = sum(1 + text.count('\n') for text in texts) + (len(ELLIPSE_HANDLES) if candidates else 0)
    return float(np.clip(height, 2.0, 7.0)) + 0.6 + LINE_IN * lines
