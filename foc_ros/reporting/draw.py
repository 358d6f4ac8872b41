# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pictures for print, by matplotlib: scenes with candidates, and the measured hand.

A path is a solid line that begins at the hand, and is the thicker the more likely it is; it is dotted if it is not known to avoid
the obstacles as surely as wanted. A path that is no proper prediction, because it could not be solved or leads through an
obstacle, is a ghost: pale, with the reason beside it. A letter stands beside each colour.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np

from foc_ros.core.errors import FocError, InputError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import find_holders, find_limits, trace_obstacle
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.types import Array
from foc_ros.io.outputs import MARK, write_whole
from foc_ros.ros.messages.ranking import MOST_LETTERS, MOST_NAME_LETTERS, cut, describe_candidate, find_drawn_curve

from .views import LIKELY, NOTED, SLOTS, HandTrajectory, describe_ghosts

try:
    import matplotlib as mpl
    from matplotlib.colors import to_rgba
    from matplotlib.figure import Figure as Figure
    from matplotlib.patches import Circle, Ellipse, Patch, Polygon
    from matplotlib.patheffects import withStroke
    from matplotlib.rcsetup import cycler
except ImportError as error:
    raise FocError("pictures need matplotlib: install python3-matplotlib, or pip install 'foc_ros[report]'") from error

CLASS_COLOURS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#7E57C2', '#8B5A2B', '#C2185B', '#8BC34A')
"""Those of Okabe and Ito, which differ without perception of hue, but yellow and black, and then further ones."""
GHOST_COLOUR = '#777777'
"""Colour of a ghost, and of a candidate without a letter."""
ELLIPSES_PER_CANDIDATE = 8
ROOM_PT = 11.0
"""Distance of the middle of a letter from other text, so that its circle touches none, nor the circle of a letter."""
NAMED_OBSTACLES = 30
"""The obstacles of larger scenes are drawn without their ids."""
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
Bounds = tuple[float, float, float, float]
"""Limits of x, then of y [m]."""
Span = tuple[int, int]
"""Start and end [ns]."""


@contextmanager
def open_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """Yield an empty figure of the given size [in]; what is drawn within the context has the common style."""
    with mpl.rc_context(STYLE):
        yield Figure(figsize=(width_in, height_in), layout='constrained')


def save_figure(figure: Figure, file: Path) -> None:
    """Write a figure as PNG, PDF or SVG, by the file's suffix; raises InputError if it cannot be written."""
    # without its date it is the same file each time
    metadata = {
        '.png': {'Software': MARK},
        '.pdf': {'Creator': MARK, 'CreationDate': None},
        '.svg': {'Creator': MARK, 'Date': None},
    }
    try:
        with write_whole(file) as unfinished:
            figure.savefig(unfinished, bbox_inches='tight', pad_inches=0.08, metadata=metadata[file.suffix.lower()])
    except OSError as error:
        raise InputError('picture file', 'a file that can be written', f'{file}: {error.strerror or error}') from error


def get_class_style(number: int) -> tuple[str, str]:
    """Return colour and dash of a line in a chart of numbered things."""
    return CLASS_COLOURS[number % SLOTS], ('-', '--')[number // SLOTS % 2]


def get_letter(slot: int | None) -> str:
    """Return the letter of a slot, a blank if there is no slot."""
    return ' ' if slot is None else ascii_uppercase[slot]


def get_candidate_style(slot: int | None, likelihood: float, is_compromised: bool = False) -> dict[str, Any]:
    """Return the line style of a candidate: the colour of its slot, dotted if compromised, the thicker the more likely."""
    colour = GHOST_COLOUR if slot is None else CLASS_COLOURS[slot]
    return {'color': colour, 'linestyle': ':' if is_compromised else '-', 'linewidth': 1.2 + 3.0 * likelihood}


def describe_in_legend(candidate: PredictedCandidate, goals: int, letter: str = ' ', reason: str = '') -> str:
    """Return the line of a candidate; goals: number of goals; reason: why it is a ghost."""
    name = describe_candidate(candidate, goals, MOST_LETTERS)
    if not candidate.has_likelihood:
        return f'{letter}    - %  {name}; {candidate.reason}'
    found = 'estimated: eta about' if candidate.is_estimated else 'less sure than wanted: eta'
    words = f'; {reason}' if reason else '' if candidate.is_solved else f'; {found} {candidate.eta:.3f}'
    return f'{letter}  {100 * candidate.likelihood:3.0f} %  {name}{words}'


def compute_ellipse_axes(covariance: Array) -> tuple[Array, Array, Array]:
    """Return greater and smaller standard deviation and the angle of the greater [degrees]; covariance (..., 2, 2)."""
    variances, vectors = np.linalg.eigh(covariance)
    stddevs = np.sqrt(np.maximum(variances, 0.0))
    return stddevs[..., 1], stddevs[..., 0], np.degrees(np.arctan2(vectors[..., 1, 1], vectors[..., 0, 1]))


def find_apart(centres: Array, greater: Array) -> list[int]:
    """Return the rows of ellipses that do not lie upon each other, the last one among them; greater: standard deviation (n,)."""
    kept: list[int] = []
    for row in reversed(range(len(centres))):
        if not kept or np.hypot(*(centres[row] - centres[kept[-1]])) > 0.5 * greater[kept[-1]]:
            kept.append(row)
    return kept[::-1]


def make_stddev_ellipse(centre: Array, covariance: Array) -> Ellipse:
    """Return the ellipse of one standard deviation; centre (2,) [m], covariance (2, 2) [m^2]."""
    greater, smaller, angle = compute_ellipse_axes(covariance)
    return Ellipse(tuple(centre), 2.0 * float(greater), 2.0 * float(smaller), angle=float(angle))


def make_obstacle_patch(obstacles: Obstacles, row: int, growth: float, **look: Any) -> Patch:
    """Return the shape of one obstacle, larger by a growth [m]; look: of the patch."""
    if obstacles.corners[row] == 1:  # matplotlib's circle is smooth at any magnification
        return Circle(obstacles.centre[row], obstacles.radius[row] + growth, **look)
    return Polygon(trace_obstacle(obstacles, row, growth), **look)


def compute_bounds(
    obstacles: Obstacles, goals: Array, candidates: Sequence[PredictedCandidate], *points: Array, margin: float = 0.08
) -> Bounds:
    """Return limits of x and y [m] around obstacles, goals, paths and further points (m, 2), with a share of them as margin."""
    shapes = find_limits(obstacles, obstacles.radius_stddev)
    enclosed = np.concatenate([*shapes, *map(find_drawn_curve, candidates), np.reshape(goals, (-1, 2)), *points])
    low, high = (enclosed.min(axis=0), enclosed.max(axis=0)) if len(enclosed) else (np.zeros(2), np.ones(2))
    added = margin * max(*(high - low), 0.05)
    return float(low[0] - added), float(high[0] + added), float(low[1] - added), float(high[1] + added)


def draw_scene(axes: Any, obstacles: Obstacles, goals: Array, bounds: Bounds, names: Sequence[str] = ()) -> None:
    """Draw obstacles and goals (g, 2).

    An obstacle has its mean radius, in a pale ring as wide as the standard deviation of the radius. names: of the goals, by
    default the numbers in the labels of candidates; a name that is also that of the obstacle is written once.
    """
    holds_goal = np.any(find_holders(goals, obstacles), axis=0).tolist()
    for row, (name, centre) in enumerate(zip(obstacles.ids, obstacles.centre, strict=True)):
        ring = float(obstacles.radius_stddev[row])
        look = {'facecolor': '0.65', 'edgecolor': '0.35', 'linewidth': 0.8, 'zorder': 1.0, 'label': 'obstacle'}
        axes.add_patch(make_obstacle_patch(obstacles, row, 0.0, **look))
        if ring:
            look = {'facecolor': '0.88', 'edgecolor': '0.7', 'linewidth': 0.6, 'zorder': 0.9}
            look['label'] = 'standard deviation of its radius'
            axes.add_patch(make_obstacle_patch(obstacles, row, ring, **look))
        if len(obstacles) <= NAMED_OBSTACLES and not (holds_goal[row] and name in names):
            below = 12 if holds_goal[row] else 0  # where the sign of the goal does not cover it
            look = {'xytext': (0, -below), 'textcoords': 'offset points', 'ha': 'center', 'va': 'center'}
            axes.annotate(name, centre, fontsize=8, annotation_clip=True, **look)
    for number, goal in enumerate(goals):
        look = {'marker': '*', 'markersize': 12, 'color': 'black', 'markerfacecolor': 'white', 'linestyle': ''}
        axes.plot(*goal, zorder=5, label='goal', **look)
        name = cut(names[number], MOST_NAME_LETTERS) if names else f'goal{number}'
        side = -1 if len(name) > MOST_NAME_LETTERS / 2 and 2.0 * goal[0] > bounds[0] + bounds[1] else 1  # where it has room
        look = {'xytext': (6 * side, 6), 'textcoords': 'offset points', 'ha': 'left' if side > 0 else 'right'}
        axes.annotate(name, goal, fontsize=8, zorder=6, path_effects=[withStroke(linewidth=2.5, foreground='white')], **look)
    axes.set(xlim=bounds[:2], ylim=bounds[2:], xlabel='x [m]', ylabel='y [m]')
    axes.set_aspect('equal')


def draw_candidates(axes: Any, snapshot: Prediction, slots: Mapping[str, int]) -> None:
    """Draw the candidates of a snapshot, the most likely on top; slots: by label, a candidate without one has no letter.

    Motor noise is filled, and left out of candidates so unlikely that it would cover the others; only the most likely candidate
    has its total uncertainty, too. Moving obstacles are outlined where they are later. The legend has one line for all below
    NOTED, and the others in the order of their group identities.
    """
    _draw_later_obstacles(axes, snapshot)
    goals, entered = len(snapshot.goal_positions), set[str]()
    order = {each.label: f'candidate {row:04d}' for row, each in enumerate(snapshot.candidates)}
    views = [(each, *ghost) for each, ghost in zip(snapshot, describe_ghosts(snapshot), strict=True)]
    paths = [each for each, reason, _ in views if not reason]
    count = sum(each.likelihood < NOTED for each in paths)
    more = f'{count} more path{"s, each" if count > 1 else ""} below {100 * NOTED:.0f} %'
    for each in reversed(paths):
        is_noted, is_first = each.likelihood >= NOTED, each is snapshot.candidates[0]
        slot = slots.get(each.label) if is_noted else None
        style = get_candidate_style(slot, each.likelihood, not each.is_solved)
        if not is_noted:
            style |= {'linewidth': 0.7, 'alpha': 0.7}  # thinner than the hand later
        if is_first or each.likelihood >= LIKELY:
            total = f'all uncertainty of path {get_letter(slot)}' if is_first else ''
            _draw_ellipses(axes, each, style['color'], total)
        label = describe_in_legend(each, goals, get_letter(slot)) if is_noted else more
        axes.plot(*find_drawn_curve(each).T, zorder=3, label=label, gid=order[each.label] if is_noted else None, **style)
    elsewhere = f'{100.0 * (snapshot.unknown + snapshot.other):3.0f}'
    if paths and elsewhere != '  0':
        words = f'   {elsewhere} %  another class, or another goal'
        axes.plot([], [], linestyle='', label=words, gid='candidate ~')  # the last one
    for number, (each, reason, place) in enumerate(view for view in reversed(views) if view[1]):
        is_noted, curve = not each.has_likelihood or each.likelihood >= NOTED, find_drawn_curve(each)
        label = describe_in_legend(each, goals, get_letter(slots.get(each.label)), reason) if is_noted else f'below 1 %: {reason}'
        look = {'color': GHOST_COLOUR, 'linewidth': 4.0 if is_noted else 1.5, 'alpha': 0.3, 'solid_capstyle': 'round'}
        axes.plot(*curve.T, zorder=2, label=label, gid=order[each.label] if is_noted else None, **look)
        share = 0.5 + 0.15 * (number % 3) if place is None else place
        if reason not in entered:  # those of one obstacle would cover each other
            look = {'fontsize': 7, 'color': '0.35', 'xytext': (0, 5), 'textcoords': 'offset points', 'ha': 'center', 'zorder': 6}
            look['bbox'] = {'facecolor': 'white', 'alpha': 0.7, 'linewidth': 0.0, 'pad': 1.0}
            axes.annotate(reason, curve[round(share * (len(curve) - 1))], annotation_clip=True, **look)
        if place is not None:
            entered.add(reason)


def draw_letters(axes: Any, snapshot: Prediction, slots: Mapping[str, int]) -> None:
    """Write the letters of the paths, when all else is drawn: each where it covers no text or goal, or where there is most room.

    That of the most likely path may stand beside it: a hand at its goal leaves no room upon it.
    """
    axes.figure.draw_without_rendering()  # texts have places only then
    point, to_pixels = axes.figure.dpi / 72.0, axes.transData.transform
    goals = [(at - 5.0 * point, at + 5.0 * point) for at in to_pixels(snapshot.goal_positions.reshape(-1, 2))]
    for each, (ghost, _) in zip(snapshot, describe_ghosts(snapshot), strict=True):
        if not ghost and each.likelihood >= NOTED and each.label in slots:
            slot, path = slots[each.label], each.solution.path
            places = path[[round(share * (len(path) - 1)) for share in 0.3 + 0.05 * ((3 + 2 * slot + np.arange(10)) % 10)]]
            points = to_pixels(places)
            if each is snapshot.candidates[0]:
                points = np.concatenate([points + np.array([0.0, up * point]) for up in (0.0, 2.0 * ROOM_PT, -2.0 * ROOM_PT)])
            room = np.full(len(points), ROOM_PT * point)
            for low, high in (*goals, *(text.get_window_extent().get_points() for text in axes.texts)):
                room = np.minimum(room, np.linalg.norm(np.maximum(0.0, np.maximum(low - points, points - high)), axis=1))
            draw_tag(
                axes,
                axes.transData.inverted().transform(points[np.argmax(room)]),
                get_letter(slot),
                get_candidate_style(slot, each.likelihood)['color'],
            )


def _draw_later_obstacles(axes: Any, snapshot: Prediction) -> None:
    """Draw the outlines of moving obstacles at the thirds of the most likely path."""
    for time_s in snapshot.candidates[0].times[-1] * np.array([1.0, 2.0, 3.0]) / 3.0 if len(snapshot) else ():
        later = replace(snapshot.obstacles, centre=snapshot.obstacles.centre + time_s * snapshot.obstacles.velocity)
        for row in np.flatnonzero(later.velocity.any(axis=1)).tolist():
            look = {'fill': False, 'edgecolor': '0.35', 'linewidth': 1.0, 'linestyle': '--', 'zorder': 1.1}
            axes.add_patch(make_obstacle_patch(later, row, 0.0, **look, label='moving obstacle, until the hand arrives'))


def _draw_ellipses(axes: Any, candidate: PredictedCandidate, colour: str, total: str) -> None:
    """Draw the ellipses along one path: filled for motor noise, dashed for the total uncertainty; total: its words, if any.

    Of the total uncertainty, what is not within the axes is left out: it would be cut, or hide the picture.
    """
    look: dict[str, Any] = {'facecolor': to_rgba(colour, 0.3), 'edgecolor': to_rgba(colour, 0.8)}
    looks = [(candidate.motor_covariance, look | {'label': 'motor noise, one standard deviation'})]
    if total and candidate.solution.motor_covariance is not None:
        looks.append((candidate.covariance, {'fill': False, 'edgecolor': colour, 'linestyle': '--', 'label': total}))
    rows = np.unique(np.linspace(0, len(candidate.mean) - 1, ELLIPSES_PER_CANDIDATE + 1).astype(int))[1:]
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    for covariances, look in looks:
        path, covariance = candidate.solution.path[rows], covariances[rows, :2, :2]
        kept = find_apart(path, compute_ellipse_axes(covariance)[0])
        size = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        room = np.minimum(path - [left, bottom], [right, top] - path) if 'fill' in look else np.inf
        fits = np.all(size <= room, axis=1)[kept]
        look['label'] += '' if all(fits) else ', within the axes'
        for row in np.array(kept)[fits]:
            ellipse = make_stddev_ellipse(path[row], covariance[row])
            ellipse.set(linewidth=0.8, zorder=2, **look)
            axes.add_patch(ellipse)


def draw_hand(axes: Any, hand: HandTrajectory, now_ns: int, span: Span) -> None:
    """Draw the measured hand within a span [ns]: black before now, pale after it, a dot at its position now."""
    past, future = hand.between(span[0], now_ns), hand.between(now_ns, span[1])
    axes.plot(*hand.positions[future].T, color='0.55', linewidth=1.4, zorder=4, label='hand later, not known yet')
    if len(hand.positions[past]) > 1:
        axes.plot(*hand.positions[past].T, color='black', linewidth=2.0, zorder=4, label='hand before')
    draw_hand_now(axes, hand.positions[past][-1:])


def draw_hand_now(axes: Any, position: Array) -> None:
    """Draw positions of the hand (s, 2) [m]."""
    axes.plot(*position.T, marker='o', markersize=6, linestyle='', color='black', zorder=6, label='hand')


def draw_tag(axes: Any, position: Any, text: str, colour: str) -> None:
    """Write a letter or a number, unless it is empty, in a small circle at a position (2,)."""
    if text.strip():
        box = {'boxstyle': 'circle,pad=0.18', 'facecolor': 'white', 'edgecolor': colour, 'linewidth': 1.4}
        axes.text(*position, text, fontsize=7.5, ha='center', va='center', zorder=7, bbox=box, clip_on=True)
