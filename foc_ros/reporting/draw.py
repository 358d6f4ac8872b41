"""Pictures for print, by matplotlib: scenes with candidates, the measured hand, likelihoods and speeds.

Every picture shows the same thing in the same way. A path is a solid line that begins at the hand, and is the thicker the more
likely it is; it is dotted if it avoids the obstacles less surely than wanted. A path that is no proper prediction, because it
could not be solved or leads through an obstacle, is a ghost: pale, with the reason beside it. Colours are those of Okabe and Ito,
which can be told apart without perception of hue, and a letter stands beside each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from string import ascii_uppercase
from textwrap import fill
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from foc_ros.core.errors import FocError, InputError
from foc_ros.core.obstacles.geometry import find_limits, trace_obstacle
from foc_ros.core.types import NANOSECONDS, Array, Obstacles, PredictedCandidate, Prediction
from foc_ros.io.outputs import MARK, PICTURE_SUFFIXES

from .views import (
    COLOURS,
    SLOTS,
    CandidateTracks,
    CandidateView,
    HandTrajectory,
    Snapshot,
    UnsolvedView,
    build_candidate_views,
    build_snapshot,
    build_unsolved_views,
)

try:
    import matplotlib as mpl
    from matplotlib.colors import to_rgba
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Ellipse, Patch, Polygon
    from matplotlib.rcsetup import cycler
except ImportError as error:
    raise FocError("pictures need matplotlib: install python3-matplotlib, or pip install 'foc_ros[report]'") from error

CLASS_COLOURS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9')[:COLOURS]
"""Colours of Okabe and Ito, without yellow (invisible on white) and black (used for the measured hand)."""
GHOST_COLOUR = '#777777'
"""Colour of a ghost, and of a candidate without a letter."""
STDDEVS = 1.0
"""Size of ellipses and rings in standard deviations."""
ELLIPSES_PER_CANDIDATE = 8
LONGEST_WORDS = 60
"""Number of characters in the words of a class beyond which the legend has its label only."""
NAMED_OBSTACLES = 30
"""The obstacles of larger scenes are drawn without their ids."""
LEGEND_PT, NARROW_IN = 8.0, 3.5
"""Size of the text of a legend, where there is room for it [pt], and the width below which its lines are shorter [in]."""
COLUMNS, NARROW_COLUMNS = 62, 40
"""Characters in a line of a legend."""
MOTOR_NOISE = 'motor noise, which eta is about: one standard deviation'
TOTAL = 'total uncertainty of the most likely path, likewise'
"""The two ellipses in the legend."""
LABELS_IN = 0.5
"""Height of the labels below axes [in]."""
WIDTH_IN = 6.4
STYLE = {
    'font.size': 10,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'grid.color': '0.92',
    'axes.axisbelow': True,
    'axes.prop_cycle': cycler('color', CLASS_COLOURS),
    'savefig.dpi': 110,
}
METADATA: dict[str, dict[str, str | None]] = {
    '.png': {'Software': MARK},
    '.pdf': {'Creator': MARK, 'CreationDate': None},
    '.svg': {'Creator': MARK, 'Date': None},
}
"""What a picture says of itself, by its format; without its date it is the same file each time."""

_PLACES: WeakKeyDictionary[Any, tuple[Any, Any]] = WeakKeyDictionary()
"""Subplot and place of axes before a legend took a part of it."""

Bounds = tuple[float, float, float, float]
"""Limits of x, then of y [m]."""
Span = tuple[int, int]
"""Start and end [ns]."""


@contextmanager
def open_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """Yield an empty figure of the given size [in]; what is drawn within the context has the common style."""
    with mpl.rc_context(STYLE):
        yield Figure(figsize=(width_in, height_in), layout='constrained')


def save_figure(figure: Figure, file: Path | str) -> None:
    """Write a figure as PNG, PDF or SVG, by the file's suffix; raises InputError if that is not possible."""
    suffix = Path(file).suffix.lower()
    if suffix not in PICTURE_SUFFIXES:
        raise InputError('picture file', f'a name that ends in {", ".join(PICTURE_SUFFIXES)}', str(file))
    try:
        figure.savefig(file, bbox_inches='tight', pad_inches=0.08, metadata=METADATA[suffix])
    except OSError as error:
        raise InputError('picture file', 'a file that can be written', f'{file}: {error.strerror or error}') from error


def get_class_style(number: int) -> tuple[str, str]:
    """Return colour and dash of a line in a chart of numbered things."""
    return CLASS_COLOURS[number % COLOURS], ('-', '--')[number // COLOURS % 2]


def get_letter(slot: int | None) -> str:
    """Return the letter of a slot, a blank if there is no slot."""
    return ' ' if slot is None else ascii_uppercase[slot]


def get_candidate_style(slot: int | None, likelihood: float, is_compromised: bool = False) -> dict[str, Any]:
    """Return the line style of a candidate: the colour of its slot, dotted if compromised, the thicker the more likely."""
    colour = GHOST_COLOUR if slot is None else CLASS_COLOURS[slot % COLOURS]
    return {'color': colour, 'linestyle': ':' if is_compromised else '-', 'linewidth': 1.2 + 3.0 * likelihood}


def number_labels(candidates: Sequence[CandidateView]) -> dict[str, int]:
    """Return slots of the candidates of a single prediction, by label; candidates beyond the number of slots have none."""
    return {each.label: number for number, each in enumerate(candidates[:SLOTS])}


def compute_ellipse_axes(covariance: Array) -> tuple[Array, Array, Array]:
    """Return greater and smaller standard deviation and the angle of the greater [degrees]; covariance (..., 2, 2)."""
    variances, vectors = np.linalg.eigh(covariance)
    stddevs = np.sqrt(np.maximum(variances, 0.0))
    return stddevs[..., 1], stddevs[..., 0], np.degrees(np.arctan2(vectors[..., 1, 1], vectors[..., 0, 1]))


def make_stddev_ellipse(centre: Array, covariance: Array, stddevs: float = STDDEVS) -> Ellipse:
    """Return the ellipse of the given number of standard deviations; centre (2,) [m], covariance (2, 2) [m^2]."""
    greater, smaller, angle = compute_ellipse_axes(covariance)
    return Ellipse(tuple(centre), 2.0 * stddevs * float(greater), 2.0 * stddevs * float(smaller), angle=float(angle))


def make_obstacle_patch(obstacles: Obstacles, row: int, growth: float, **look: Any) -> Patch:
    """Return the shape of one obstacle, larger by a growth [m]; look: of the patch."""
    if obstacles.corners[row] == 1:  # matplotlib's circle is smooth at any magnification
        return Circle(obstacles.centre[row], obstacles.radius[row] + growth, **look)
    return Polygon(trace_obstacle(obstacles, row, growth), **look)


def compute_bounds(
    obstacles: Obstacles, goals: Array, candidates: Sequence[CandidateView | UnsolvedView], *points: Array, margin: float = 0.04
) -> Bounds:
    """Return limits of x and y [m] around obstacles, goals, paths and further points (m, 2); ellipses do not widen them.

    margin: as a share of the greater side.
    """
    shapes = find_limits(obstacles, STDDEVS * obstacles.radius_stddev)
    enclosed = np.concatenate([*shapes, *(each.path for each in candidates), np.reshape(goals, (-1, 2)), *points])
    low, high = (enclosed.min(axis=0), enclosed.max(axis=0)) if len(enclosed) else (np.zeros(2), np.ones(2))
    added = margin * max(*(high - low), 0.05)
    return float(low[0] - added), float(high[0] + added), float(low[1] - added), float(high[1] + added)


def draw_scene(axes: Any, obstacles: Obstacles, goals: Array, bounds: Bounds, named: bool = True) -> None:
    """Draw obstacles and goals.

    An obstacle has its mean radius, in a pale ring as wide as the standard deviation of the radius. named: whether the
    goals (g, 2) are numbered, as in the labels of candidates.
    """
    for row, (name, centre) in enumerate(zip(obstacles.ids, obstacles.centre, strict=True)):
        ring = STDDEVS * float(obstacles.radius_stddev[row])
        looks: list[tuple[float, dict[str, Any]]] = [
            (0.0, {'facecolor': '0.65', 'edgecolor': '0.35', 'linewidth': 0.8, 'label': 'obstacle'})
        ]
        if ring:
            look = {'facecolor': '0.88', 'edgecolor': '0.7', 'linewidth': 0.6, 'label': 'standard deviation of its radius'}
            looks.insert(0, (ring, look))
        for growth, look in looks:
            axes.add_patch(make_obstacle_patch(obstacles, row, growth, **look))
        if len(obstacles) <= NAMED_OBSTACLES:
            axes.text(*centre, name, ha='center', va='center', fontsize=8, clip_on=True)
    for number, goal in enumerate(goals):
        look = {'marker': '*', 'markersize': 12, 'color': 'black', 'markerfacecolor': 'white', 'linestyle': ''}
        axes.plot(*goal, zorder=5, label='goal', **look)
        if named:
            axes.annotate(f'goal{number}', goal, xytext=(6, 6), textcoords='offset points', fontsize=8, zorder=6)
    axes.set(xlim=bounds[:2], ylim=bounds[2:], xlabel='x [m]', ylabel='y [m]')
    axes.set_aspect('equal')


def draw_candidates(axes: Any, snapshot: Snapshot, slots: Mapping[str, int]) -> None:
    """Draw the candidates of a snapshot, the most likely on top; slots: by label, a candidate without one has no letter.

    Motor noise is filled; only the most likely candidate has its total uncertainty, too. Ghosts have their reasons beside them.
    """
    ghosts = [(lost.path, describe_in_legend(lost), snapshot.describe_ghost(lost)) for lost in snapshot.unsolved]
    for rank, each in reversed(list(enumerate(snapshot.candidates))):
        letter = get_letter(slots.get(each.label))
        reason = snapshot.describe_ghost(each)
        if reason:
            ghosts.append((each.curve, describe_in_legend(each, letter, reason), reason))
        else:
            style = get_candidate_style(slots.get(each.label), each.likelihood, each.is_compromised)
            _draw_ellipses(axes, each, style['color'], is_total=rank == 0)
            axes.plot(*each.curve.T, zorder=3, label=describe_in_legend(each, letter), **style)
            draw_tag(axes, each.path[int((0.45 + 0.12 * (rank % 3)) * (len(each.path) - 1))], letter, style['color'])
    for number, (curve, label, reason) in enumerate(ghosts):
        _draw_ghost(axes, curve, label, reason, number)


def _draw_ghost(axes: Any, curve: Array, label: str, reason: str, number: int) -> None:
    axes.plot(*curve.T, color=GHOST_COLOUR, linewidth=4.0, alpha=0.3, solid_capstyle='round', zorder=2, label=label)
    look = {'fontsize': 7, 'color': '0.35', 'xytext': (0, 5), 'textcoords': 'offset points', 'ha': 'center', 'zorder': 6}
    look['bbox'] = {'facecolor': 'white', 'alpha': 0.7, 'linewidth': 0.0, 'pad': 1.0}
    axes.annotate(reason, curve[int((0.5 + 0.15 * (number % 3)) * (len(curve) - 1))], annotation_clip=True, **look)


def _draw_ellipses(axes: Any, candidate: CandidateView, colour: str, is_total: bool) -> None:
    """Draw the ellipses along one path: filled for motor noise, dashed for the total uncertainty where it is asked for."""
    filled = {'facecolor': to_rgba(colour, 0.3), 'edgecolor': to_rgba(colour, 0.8), 'label': MOTOR_NOISE}
    dashed = {'fill': False, 'edgecolor': colour, 'linestyle': '--', 'label': TOTAL}
    looks: list[tuple[Array, dict[str, Any]]] = [(candidate.motor_covariance, filled)]
    if is_total and candidate.is_widened:
        looks.append((candidate.covariance, dashed))
    for row in np.unique(np.linspace(0, len(candidate.path) - 1, ELLIPSES_PER_CANDIDATE + 1).astype(int))[1:]:
        for covariance, look in looks:
            ellipse = make_stddev_ellipse(candidate.path[row], covariance[row])
            ellipse.set(linewidth=0.8, zorder=2, **look)
            axes.add_patch(ellipse)


def describe_in_legend(view: CandidateView | UnsolvedView, letter: str = ' ', reason: str = '') -> str:
    """Return the line of the legend that describes a candidate; reason: why it is a ghost."""
    # the words of a class with many obstacles would leave no room for the plot
    name = f'{view.label}  {view.description}' if len(view.description) <= LONGEST_WORDS else view.label
    if isinstance(view, UnsolvedView):
        return f'{letter}    - %  {name}; {view.reason}'
    words = f'; {"estimated" if view.is_estimated else "compromised"}: eta {view.eta:.3f}' if view.is_compromised else ''
    return f'{letter}  {100 * view.likelihood:3.0f} %  {name}{words}{f"; {reason}" if reason else ""}'


def draw_legend(axes: Any, title: str | None = None) -> None:
    """Write everything that is drawn on axes into a legend below them, in a part of their place, so that it covers nothing.

    The text is as small as the place needs. A second call replaces the legend of the first.
    """
    figure, name = axes.figure, f'legend {id(axes)}'
    for earlier in [each for each in figure.axes if each.get_gid() == name]:
        earlier.remove()
    slot, place = _PLACES.setdefault(axes, (axes.get_subplotspec(), axes.get_position(original=True)))
    named = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    candidates = [label for label in named if '%  ' in label]
    candidates.sort(key=lambda label: float(label.partition('%')[0][1:].strip().replace('-', '-1')), reverse=True)
    labels = candidates + [label for label in named if label not in candidates]
    width_in, height_in = figure.get_figwidth() * place.width, figure.get_figheight() * place.height
    columns = NARROW_COLUMNS if width_in < NARROW_IN else COLUMNS
    texts = [fill(label, columns, subsequent_indent=' ' * (10 if label in candidates else 0)) for label in labels]
    lines = sum(1 + text.count('\n') for text in texts) + (title is not None)
    size_pt = min(LEGEND_PT, 72.0 * width_in / (0.62 * (columns + 5)))
    wanted_in = min(lines * 1.35 * size_pt / 72.0 + 0.05, 0.5 * height_in)
    size_pt = min(size_pt, 72.0 * (wanted_in - 0.05) / (1.35 * max(lines, 1)))
    gap_in = 0.0 if figure.get_layout_engine() else LABELS_IN
    parts = [max(height_in - wanted_in - gap_in, 0.2 * height_in), gap_in, wanted_in]
    if slot is None:
        bottom = place.y0 + place.height * (gap_in + wanted_in) / sum(parts)
        axes.set_position((place.x0, bottom, place.width, place.y1 - bottom))
        below = figure.add_axes((place.x0, place.y0, place.width, place.height * wanted_in / sum(parts)))
    else:
        parts = [each for each in parts if each]
        rows = slot.subgridspec(len(parts), 1, height_ratios=parts, hspace=0.0)
        axes.set_subplotspec(rows[0])
        below = figure.add_subplot(rows[-1])
    below.set(gid=name)
    below.axis('off')
    handles = [named[label] for label in labels]
    look = {'borderaxespad': 0.0, 'borderpad': 0.0, 'labelspacing': 0.25, 'handlelength': 2.0, 'frameon': False}
    below.legend(handles, texts, title=title, loc='upper left', prop={'family': 'monospace', 'size': size_pt}, **look)


def draw_hand(axes: Any, hand: HandTrajectory, now_ns: int, span: Span) -> None:
    """Draw the measured hand within a span [ns]: black before now, pale after it, a dot at its position now."""
    past, future = hand.between(span[0], now_ns), hand.between(now_ns, span[1])
    axes.plot(*hand.positions[future].T, color='0.55', linewidth=1.4, zorder=4, label='hand later, not known to the prediction')
    axes.plot(*hand.positions[past].T, color='black', linewidth=2.0, zorder=4, label='hand before')
    draw_hand_now(axes, hand.positions[past][-1:])


def draw_hand_now(axes: Any, position: Array) -> None:
    """Draw positions of the hand (s, 2) [m]."""
    axes.plot(*position.T, marker='o', markersize=6, linestyle='', color='black', zorder=6, label='hand')


def draw_movement(axes: Any, positions: Array, number: int) -> None:
    """Draw a movement (m, 2) with an arrow and its number, counted from 1."""
    colour, dash = get_class_style(number)
    axes.plot(*positions.T, color=colour, linestyle=dash, linewidth=1.8)
    tail, head = positions[len(positions) * 2 // 3], positions[len(positions) * 3 // 4]
    axes.annotate('', head, tail, arrowprops={'arrowstyle': '-|>', 'color': colour, 'linewidth': 0.0, 'mutation_scale': 16})
    draw_tag(axes, positions[len(positions) * (2 + number % 2) // 6], str(number + 1), colour)


def draw_likelihoods(axes: Any, tracks: CandidateTracks, origin_ns: int) -> None:
    """Draw the likelihoods of the tracks that have a slot over time [s].

    A track has a gap where it has no candidate. The share that no candidate has is hatched.
    """
    times = (np.array([each.stamp_ns for each in tracks.snapshots]) - origin_ns) / NANOSECONDS
    drawn = {track: values for track, values in tracks.likelihoods().items() if track in tracks.slots}
    for rank, (track, (first, values)) in enumerate(drawn.items()):
        colour = CLASS_COLOURS[tracks.slots[track] % COLOURS]
        axes.plot(times[first : first + len(values)], values, color=colour, linewidth=1.8, marker='.', markersize=2.5)
        known = np.flatnonzero(np.isfinite(values))
        row = known[(2 * rank + 1) * len(known) // (2 * len(drawn))]
        draw_tag(axes, (times[first + row], values[row]), get_letter(tracks.slots[track]), colour)
    unknown = np.array([each.unknown_share + each.other_share for each in tracks.snapshots])
    if unknown.any():
        look = {'facecolor': 'none', 'edgecolor': '0.6', 'hatch': '////', 'linewidth': 0.0, 'step': 'mid'}
        axes.fill_between(times, 1.0 - unknown, 1.0, label='unknown, or another goal', **look)
        axes.legend(loc='lower left', fontsize=7)
    axes.set(ylim=(-0.03, 1.03), ylabel='likelihood')
    axes.tick_params(labelbottom=False)


def draw_speeds(
    axes: Any, hand: HandTrajectory, snapshot: Snapshot, slots: Mapping[str, int], span: Span, origin_ns: int
) -> None:
    """Draw predicted speeds and the measured speed within a span [ns], which is pale after the stamp of the snapshot."""
    now_s = (snapshot.stamp_ns - origin_ns) / NANOSECONDS
    for each in reversed(snapshot.candidates):
        look = get_candidate_style(slots.get(each.label), each.likelihood, each.is_compromised)
        axes.plot(now_s + each.times, each.speed, **look)
    times = hand.seconds_after(origin_ns)
    for rows, colour in ((hand.between(snapshot.stamp_ns, span[1]), '0.55'), (hand.between(span[0], snapshot.stamp_ns), 'black')):
        axes.plot(times[rows], hand.speed[rows], color=colour, linewidth=1.8)
    axes.set(ylabel='speed [m/s]', xlabel='time [s]')
    axes.set_ylim(bottom=0.0)


def draw_tag(axes: Any, position: Any, text: str, colour: str) -> None:
    """Write a letter or a number, unless it is empty, in a small circle at a position (2,)."""
    if text.strip():
        box = {'boxstyle': 'circle,pad=0.18', 'facecolor': 'white', 'edgecolor': colour, 'linewidth': 1.4}
        axes.text(*position, text, fontsize=7.5, ha='center', va='center', zorder=7, bbox=box, clip_on=True)


def draw_snapshot(axes: Any, snapshot: Snapshot, bounds: Bounds, slots: Mapping[str, int] | None = None) -> None:
    """Draw a scene with the candidates in it, the hand and a legend; slots: by label, in order of likelihood if not given."""
    if snapshot.hand is not None:
        snapshot = snapshot.begin_at(snapshot.hand)
    draw_scene(axes, snapshot.obstacles, snapshot.goals, bounds)
    draw_candidates(axes, snapshot, number_labels(snapshot.candidates) if slots is None else slots)
    if snapshot.hand is not None:
        draw_hand_now(axes, snapshot.hand[None])
    draw_legend(axes, None if snapshot.candidates else 'no candidate could be solved')


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
    bounds = _compute_scene_bounds(snapshot)
    with plt.rc_context(STYLE):
        if axes is None:
            axes = plt.figure(figsize=(WIDTH_IN, _get_height(bounds, snapshot)), layout='constrained').subplots()
        draw_snapshot(axes, snapshot, bounds)
    return axes


def plot_outcomes(
    file: Path | str, obstacles: Obstacles, goals: Array, outcomes: Sequence[PredictedCandidate], start: Array
) -> None:
    """Write a picture of candidates in their scene, in the format of the file's suffix.

    goals (g, 2), start (2,) [m]. Raises InputError if the suffix is not that of a picture format or the file cannot be written.
    """
    views = build_candidate_views(outcomes, len(goals)), None, build_unsolved_views(outcomes, len(goals))
    save_figure(make_scene_figure(Snapshot(0, obstacles, goals, *views, hand=start)), file)


def make_scene_figure(snapshot: Snapshot) -> Figure:
    """Return a figure of one snapshot: scene, candidates and legend."""
    bounds = _compute_scene_bounds(snapshot)
    with open_figure(WIDTH_IN, _get_height(bounds, snapshot)) as figure:
        draw_snapshot(figure.subplots(), snapshot, bounds)
    return figure


def make_recording_figure(
    hand: HandTrajectory, obstacles: Obstacles, goals: Array, spans: Sequence[Span], bounds: Bounds
) -> Figure:
    """Return a figure of all movements of a recording, numbered; spans: start and end [ns] of each movement."""
    with open_figure(WIDTH_IN, _get_height(bounds)) as figure:
        axes = figure.subplots()
        draw_scene(axes, obstacles, goals, bounds, named=False)
        axes.plot(*hand.positions.T, color='0.8', linewidth=0.8)
        for number, span in enumerate(spans):
            draw_movement(axes, hand.positions[hand.between(*span)], number)
    return figure


def make_snapshot_figure(hand: HandTrajectory, tracks: CandidateTracks, row: int, span: Span, bounds: Bounds) -> Figure:
    """Return a figure of one snapshot during a movement: the scene above, likelihoods and speeds of the whole movement below.

    row: of the snapshot in the tracks; span: start and end [ns] of the movement.
    """
    snapshot, slots = tracks.snapshots[row], tracks.slots_at(row)
    origin_ns = int(hand.stamps_ns[0])
    now_s, begin_s, end_s = ((stamp - origin_ns) / NANOSECONDS for stamp in (snapshot.stamp_ns, *span))
    heights = [_get_height(bounds, snapshot) + 0.4, 2.1, 1.9]
    with open_figure(WIDTH_IN, sum(heights)) as figure:
        scene, likelihoods, speeds = figure.subplots(3, 1, height_ratios=heights)
        draw_scene(scene, snapshot.obstacles, snapshot.goals, bounds)
        draw_candidates(scene, snapshot, slots)
        draw_hand(scene, hand, snapshot.stamp_ns, span)
        draw_legend(scene)
        draw_likelihoods(likelihoods, tracks.between(*span), origin_ns)
        draw_speeds(speeds, hand, snapshot, slots, span, origin_ns)
        for axes in (likelihoods, speeds):
            axes.axvline(now_s, color='0.4', linewidth=1.0)
            axes.set_xlim(begin_s, end_s)
        scene.set_title(f'at {now_s:.2f} s')
    return figure


def _compute_scene_bounds(snapshot: Snapshot) -> Bounds:
    hand = [] if snapshot.hand is None else [snapshot.hand[None]]
    return compute_bounds(snapshot.obstacles, snapshot.goals, (*snapshot.candidates, *snapshot.unsolved), *hand)


def _get_height(bounds: Bounds, snapshot: Snapshot | None = None) -> float:
    """Return the height [in] of a scene with equal axes, its axis labels and a legend of candidates."""
    height = float(np.clip(0.9 * WIDTH_IN * (bounds[3] - bounds[2]) / (bounds[1] - bounds[0]), 2.0, 7.0)) + 0.6
    if snapshot is None:
        return height
    texts = [describe_in_legend(each) for each in snapshot.candidates] + [describe_in_legend(each) for each in snapshot.unsolved]
    lines = sum(-(-len(text) // (COLUMNS - 10)) for text in texts) + 6
    return height + lines * 1.35 * LEGEND_PT / 72.0
