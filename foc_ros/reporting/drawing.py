"""Elements of the pictures, drawn on matplotlib axes: scenes, candidates, the measured hand, likelihoods, speeds.

Colours, dashes, letters and ellipses are defined here once: the report page receives them with its data. The colours of Okabe and
Ito can be told apart without perception of hue, and a letter stands beside each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from string import ascii_uppercase
from textwrap import fill
from typing import Any

import numpy as np

from foc_ros.core.errors import FocError
from foc_ros.core.obstacles.geometry import trace_obstacle
from foc_ros.core.types import NANOSECONDS, Array, Obstacles

from .snapshots import CandidateView, HandTrajectory, Snapshot, UnsolvedView

try:
    import matplotlib as mpl
    from matplotlib.colors import to_rgba
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Ellipse, Patch, Polygon
    from matplotlib.rcsetup import cycler
except ImportError as error:
    raise FocError("pictures need matplotlib: install python3-matplotlib, or pip install 'foc_ros[report]'") from error

CLASS_COLOURS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9')
"""Colours of Okabe and Ito, without yellow (invisible on white) and black (used for the measured hand)."""
NO_CLASS_COLOUR = '#777777'
"""Colour of a candidate without a slot or without a likelihood."""
HATCH = '////'
"""Pattern of the share of the candidates of which no likelihood is known."""
CLASSES = 2 * len(CLASS_COLOURS)
"""Number of slots: pairs of a colour and a dash, each with its letter."""
STDDEVS = 1.0
"""Size of ellipses and rings in standard deviations."""
ELLIPSES_PER_CANDIDATE = 8
LEGEND_COLUMNS = 56
"""Width of a line of the legend [characters]."""
LONGEST_WORDS = 60
"""Number of characters in the words of a class beyond which the legend has its label only."""
NAMED_OBSTACLES = 30
"""The obstacles of larger scenes are drawn without their ids."""

ELLIPSE_HANDLES = [
    Patch(
        facecolor='0.85',
        edgecolor='0.4',
        linewidth=0.6,
        label='ellipse: motor noise, which eta is about\n(one standard deviation)',
    ),
    Patch(
        fill=False,
        edgecolor='0.4',
        linewidth=0.6,
        linestyle='--',
        label='dashed ellipse: total uncertainty\n(one standard deviation)',
    ),
]
"""The two ellipses in the legend."""

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


@contextmanager
def open_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """Yield an empty figure of the given size [in]; what is drawn within the context has the common style."""
    with mpl.rc_context(STYLE):
        yield Figure(figsize=(width_in, height_in), layout='constrained')


def get_class_style(number: int) -> tuple[str, str]:
    """Return colour and dash of a slot, or of anything else that is numbered."""
    return CLASS_COLOURS[number % len(CLASS_COLOURS)], ('-', '--')[number // len(CLASS_COLOURS) % 2]


def get_letter(slot: int | None) -> str:
    """Return the letter of a slot, a blank if there is no slot."""
    return ' ' if slot is None else ascii_uppercase[slot]


def get_candidate_style(slot: int | None, likelihood: float, is_compromised: bool = False) -> dict[str, Any]:
    """Return the line style of a candidate: colour and dash of its slot, dotted if compromised, the thicker the more likely."""
    colour, dash = (NO_CLASS_COLOUR, '-') if slot is None else get_class_style(slot)
    return {'color': colour, 'linestyle': ':' if is_compromised else dash, 'linewidth': 1.2 + 3.0 * likelihood}


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


def draw_scene(axes: Any, obstacles: Obstacles, goals: Array, bounds: Bounds, named: bool = True) -> None:
    """Draw obstacles and goals.

    An obstacle has its mean radius, in a pale ring as wide as the standard deviation of the radius. named: whether the
    goals (g, 2) are numbered, as in the labels of candidates.
    """
    for row, (name, centre) in enumerate(zip(obstacles.ids, obstacles.centre, strict=True)):
        ring = STDDEVS * float(obstacles.radius_stddev[row])
        axes.add_patch(make_obstacle_patch(obstacles, row, ring, facecolor='0.88', edgecolor='0.7', linewidth=0.6))
        axes.add_patch(make_obstacle_patch(obstacles, row, 0.0, facecolor='0.65', edgecolor='0.35', linewidth=0.8))
        if len(obstacles) <= NAMED_OBSTACLES:
            axes.text(*centre, name, ha='center', va='center', fontsize=8)
    for number, goal in enumerate(goals):
        axes.plot(*goal, marker='*', markersize=12, color='black', markerfacecolor='white', zorder=5)
        if named:
            axes.annotate(f'goal{number}', goal, xytext=(6, 6), textcoords='offset points', fontsize=8, zorder=6)
    axes.set(xlim=bounds[:2], ylim=bounds[2:], xlabel='x [m]', ylabel='y [m]')
    axes.set_aspect('equal')


def draw_candidates(
    axes: Any, candidates: Sequence[CandidateView], slots: Mapping[str, int], unsolved: Sequence[UnsolvedView] = ()
) -> None:
    """Draw candidates, the most likely on top, with ellipses of the position's standard deviation, and a legend below the axes.

    slots: by label; a candidate without a slot has no letter. unsolved: those without a likelihood, which are grey.
    """
    for lost in unsolved:
        axes.plot(*lost.path.T, color=NO_CLASS_COLOUR, linewidth=1.0, alpha=0.6, zorder=2, label=describe_in_legend(lost))
    for rank, each in reversed(list(enumerate(candidates))):
        letter = get_letter(slots.get(each.label))
        style = get_candidate_style(slots.get(each.label), each.likelihood, each.is_compromised)
        _draw_ellipses(axes, each, style['color'])
        axes.plot(*each.curve.T, zorder=3, label=describe_in_legend(each, letter), **style)
        row = int((0.45 + 0.12 * (rank % 3)) * (len(each.path) - 1))
        draw_tag(axes, each.path[row], letter, style['color'])
    look = {'loc': 'upper left', 'frameon': False, 'borderaxespad': 4.5, 'prop': {'family': 'monospace', 'size': 8}}
    title = None if candidates else 'no candidate could be solved'
    handles = [each for each in axes.lines if not each.get_label().startswith('_')][::-1]
    kinds = len(candidates) and 1 + any(each.is_widened for each in candidates)
    axes.legend(handles=handles + ELLIPSE_HANDLES[:kinds], title=title, bbox_to_anchor=(0.0, 0.0), **look)


def _draw_ellipses(axes: Any, candidate: CandidateView, colour: str) -> None:
    """Draw the ellipses along one path: filled for motor noise, dashed for the total uncertainty."""
    filled = {'facecolor': to_rgba(colour, 0.15), 'edgecolor': to_rgba(colour, 0.6)}
    dashed = {'fill': False, 'edgecolor': to_rgba(colour, 0.5), 'linestyle': '--'}
    for row in np.unique(np.linspace(0, len(candidate.path) - 1, ELLIPSES_PER_CANDIDATE).astype(int)):
        for covariance, look in ((candidate.motor_covariance, filled), (candidate.covariance, dashed))[
            : 1 + candidate.is_widened
        ]:
            ellipse = make_stddev_ellipse(candidate.path[row], covariance[row])
            ellipse.set(linewidth=0.6, zorder=2, **look)
            axes.add_patch(ellipse)


def describe_in_legend(view: CandidateView | UnsolvedView, letter: str = ' ') -> str:
    """Return the lines of the legend that describe a candidate."""
    # the words of a class with many obstacles would leave no room for the plot
    name = f'{view.label}  {view.description}' if len(view.description) <= LONGEST_WORDS else view.label
    if isinstance(view, UnsolvedView):
        return fill(f'{letter}    - %  {name}; {view.reason}', LEGEND_COLUMNS, subsequent_indent='          ')
    words = f'; compromised: eta {view.eta:.3f}' if view.is_compromised else ''
    return fill(f'{letter}  {100 * view.likelihood:3.0f} %  {name}{words}', LEGEND_COLUMNS, subsequent_indent='          ')


def draw_hand(axes: Any, hand: HandTrajectory, now_ns: int, span: tuple[int, int]) -> None:
    """Draw the measured hand within a span [ns]: solid before now, dotted after it, a dot at its position now."""
    past, future = hand.between(span[0], now_ns), hand.between(now_ns, span[1])
    axes.plot(*hand.positions[past].T, color='black', linewidth=2.0, zorder=4)
    axes.plot(*hand.positions[future].T, color='black', linewidth=1.4, linestyle=':', zorder=4)
    axes.plot(*hand.positions[past][-1:].T, marker='o', markersize=6, color='black', zorder=6)


def draw_movement(axes: Any, positions: Array, number: int) -> None:
    """Draw a movement (m, 2) with an arrow and its number, counted from 1."""
    colour, dash = get_class_style(number)
    axes.plot(*positions.T, color=colour, linestyle=dash, linewidth=1.8)
    tail, head = positions[len(positions) * 2 // 3], positions[len(positions) * 3 // 4]
    axes.annotate('', head, tail, arrowprops={'arrowstyle': '-|>', 'color': colour, 'linewidth': 0.0, 'mutation_scale': 16})
    draw_tag(axes, positions[len(positions) * (2 + number % 2) // 6], str(number + 1), colour)


def draw_speeds(
    axes: Any, hand: HandTrajectory, snapshot: Snapshot, slots: Mapping[str, int], span: tuple[int, int], origin_ns: int
) -> None:
    """Draw predicted speeds and the measured speed within a span [ns], which is dotted after the stamp of the snapshot."""
    now_s = (snapshot.stamp_ns - origin_ns) / NANOSECONDS
    for each in reversed(snapshot.candidates):
        axes.plot(
            now_s + each.times, each.speed, **get_candidate_style(slots.get(each.label), each.likelihood, each.is_compromised)
        )
    times = hand.seconds_after(origin_ns)
    for rows, dash, width in ((hand.between(*span), ':', 1.6), (hand.between(span[0], snapshot.stamp_ns), '-', 2.0)):
        axes.plot(times[rows], hand.speed[rows], color='black', linewidth=width, linestyle=dash)
    axes.set(ylabel='speed [m/s]', xlabel='time [s]')
    axes.set_ylim(bottom=0.0)


def draw_tag(axes: Any, position: Any, text: str, colour: str) -> None:
    """Write a letter or a number, unless it is empty, in a small circle at a position (2,)."""
    if not text.strip():
        return
    box = {'boxstyle': 'circle,pad=0.18', 'facecolor': 'white', 'edgecolor': colour, 'linewidth': 1.4}
    axes.text(*position, text, fontsize=7.5, ha='center', va='center', zorder=7, bbox=box, clip_on=True)
