"""What goes on the axes of a picture: scenes, ways through them, the real hand, likelihoods, speeds.

Colours tell apart without hue: likelihood is viridis from pale to dark, classes are Okabe and Ito's colours with a letter each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from string import ascii_uppercase
from typing import Any

import numpy as np

from foc_ros.core.errors import FocError
from foc_ros.core.types import NANOSECONDS, Array, Obstacles

from .snapshots import CandidateView, Snapshot, Track

try:
    import matplotlib as mpl
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Ellipse
    from matplotlib.rcsetup import cycler
except ImportError as error:
    raise FocError("pictures need matplotlib: install python3-matplotlib, or pip install 'foc_ros[report]'") from error

CLASS_COLOURS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9')
"""Okabe and Ito's, without the yellow that vanishes on white and the black that is the real hand's."""
LIKELIHOOD_COLOURS = ListedColormap(mpl.colormaps['viridis'](np.linspace(0.88, 0.0, 256)), name='likelihood')
LIKELIHOOD_SCALE = Normalize(0.0, 1.0)
STDDEVS = 1.0
"""Standard deviations that ellipses and rings stand for."""
CLASSES = 2 * len(CLASS_COLOURS)
"""Classes told apart by colour and dash; there are no letters and colours for more."""
ELLIPSES_PER_WAY = 8
NAMED_OBSTACLES = 30
"""Above this many, the obstacles' names would hide the scene."""

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
def new_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """Yield an empty figure of a size [in], to be filled in our style."""
    with mpl.rc_context(STYLE):
        yield Figure(figsize=(width_in, height_in), layout='constrained')


def draw_scene(axes: Any, obstacles: Obstacles, goals: Array, bounds: Bounds, named: bool = True) -> None:
    """Draw obstacles (disc: mean radius; pale ring: a standard deviation of the radius more) and goals.

    named: whether goals are numbered, as labels of ways do.
    """
    rows = zip(obstacles.ids, obstacles.centre, obstacles.radius, obstacles.radius_stddev, strict=True)
    for name, centre, radius, stddev in rows:
        axes.add_patch(Circle(centre, radius + STDDEVS * stddev, facecolor='0.88', edgecolor='0.7', linewidth=0.6))
        axes.add_patch(Circle(centre, radius, facecolor='0.65', edgecolor='0.35', linewidth=0.8))
        if len(obstacles) <= NAMED_OBSTACLES:
            axes.text(*centre, name, ha='center', va='center', fontsize=8)
    for number, goal in enumerate(goals):
        axes.plot(*goal, marker='*', markersize=12, color='black', markerfacecolor='white', zorder=5)
        if named:
            axes.annotate(f'goal{number}', goal, xytext=(6, 6), textcoords='offset points', fontsize=8, zorder=6)
    axes.set(xlim=bounds[:2], ylim=bounds[2:], xlabel='x [m]', ylabel='y [m]')
    axes.set_aspect('equal')


def draw_movement(axes: Any, positions: Array, number: int) -> None:
    """Draw a movement (m, 2) with an arrow on its way, and its number, counted from 1, near its beginning."""
    colour, dash = class_style(number)
    axes.plot(*positions.T, color=colour, linestyle=dash, linewidth=1.8)
    tail, head = positions[len(positions) * 2 // 3], positions[len(positions) * 3 // 4]
    axes.annotate('', head, tail, arrowprops={'arrowstyle': '-|>', 'color': colour, 'linewidth': 0.0, 'mutation_scale': 16})
    tag(axes, positions[len(positions) * (2 + number % 2) // 6], str(number + 1), colour)


def draw_ways(axes: Any, ways: Sequence[CandidateView], numbers: Mapping[str, int]) -> None:
    """Draw ways, the most likely on top, coloured by likelihood, with ellipses of one standard deviation of the position."""
    for rank, way in reversed(list(enumerate(ways))):
        colour = LIKELIHOOD_COLOURS(LIKELIHOOD_SCALE(way.likelihood))
        for row in np.unique(np.linspace(0, len(way.path) - 1, ELLIPSES_PER_WAY).astype(int)):
            ellipse = stddev_ellipse(way.path[row], way.covariance[row])
            ellipse.set(facecolor=(*colour[:3], 0.1), edgecolor=(*colour[:3], 0.5), linewidth=0.6, zorder=2)
            axes.add_patch(ellipse)
        axes.plot(*way.path.T, color=colour, linewidth=2.2, zorder=3)
        if way.label in numbers:
            place = way.path[int((0.45 + 0.12 * (rank % 3)) * (len(way.path) - 1))]
            tag(axes, place, ascii_uppercase[numbers[way.label]], class_style(numbers[way.label])[0])


def draw_hand(axes: Any, track: Track, now_ns: int, span: tuple[int, int]) -> None:
    """Draw where the hand came from (solid), where it is, and where it really went (dotted)."""
    before, after = track.between(span[0], now_ns), track.between(now_ns, span[1])
    axes.plot(*track.positions[before].T, color='black', linewidth=2.0, zorder=4)
    axes.plot(*track.positions[after].T, color='black', linewidth=1.4, linestyle=':', zorder=4)
    axes.plot(*track.positions[before][-1:].T, marker='o', markersize=6, color='black', zorder=6)


def draw_likelihoods(
    axes: Any, moments: Sequence[Snapshot], lines: Sequence[Mapping[str, int]], letters: Mapping[int, int], origin_ns: int
) -> None:
    """Draw the likelihood of ways over time; one that is no candidate for a while leaves a gap.

    lines: for every moment, the line of each way by label; letters: number of the letter and colour by line, for those drawn.
    """
    times = [(moment.stamp_ns - origin_ns) / NANOSECONDS for moment in moments]
    tables = [{numbers[way.label]: way.likelihood for way in moment.ways} for moment, numbers in zip(moments, lines, strict=True)]
    shown = sorted({line for table in tables for line in table} & set(letters))
    for rank, line in enumerate(shown):
        values = np.array([table.get(line, np.nan) for table in tables])
        colour, dash = class_style(letters[line])
        axes.plot(times, values, color=colour, linestyle=dash, linewidth=1.8, marker='.', markersize=2.5, label=f'line {line}')
        known = np.flatnonzero(np.isfinite(values))
        place = known[(2 * rank + 1) * len(known) // (2 * len(shown))]
        tag(axes, (times[place], values[place]), ascii_uppercase[letters[line]], colour)
    axes.set(ylim=(-0.03, 1.03), ylabel='likelihood')
    axes.tick_params(labelbottom=False)


def draw_speeds(axes: Any, track: Track, moment: Snapshot, span: tuple[int, int], origin_ns: int) -> None:
    """Draw the measured speed over a movement and, from the moment on, the predicted ones, coloured by likelihood."""
    rows = track.between(*span)
    times = (track.stamps_ns[rows] - origin_ns) / NANOSECONDS
    now = (moment.stamp_ns - origin_ns) / NANOSECONDS
    for way in reversed(moment.ways):
        axes.plot(now + way.times, way.speed, color=LIKELIHOOD_COLOURS(LIKELIHOOD_SCALE(way.likelihood)), linewidth=1.6)
    axes.plot(times, np.linalg.norm(track.velocity[rows], axis=1), color='black', linewidth=1.6, linestyle=':')
    past = times <= now
    axes.plot(times[past], np.linalg.norm(track.velocity[rows][past], axis=1), color='black', linewidth=2.0)
    axes.set(ylabel='speed [m/s]', xlabel='time [s]')
    axes.set_ylim(bottom=0.0)


def draw_legend(axes: Any, ways: Sequence[CandidateView], numbers: Mapping[str, int]) -> None:
    """Write the letter, likelihood and label of every way."""
    axes.axis('off')
    if not ways:
        axes.text(0.0, 0.5, 'no candidate could be solved', transform=axes.transAxes, va='center')
    for row, way in enumerate(ways):
        height = 1.0 - (row + 0.5) / len(ways)
        letter = ascii_uppercase[numbers[way.label]] if way.label in numbers else ' '
        text = f'{letter}  {100 * way.likelihood:3.0f} %  {way.label}'
        axes.text(0.0, height, text, transform=axes.transAxes, va='center', family='monospace', fontsize=8)


def stddev_ellipse(centre: Array, covariance: Array, stddevs: float = STDDEVS) -> Ellipse:
    """Return the ellipse of so many standard deviations; covariance (2, 2) [m^2]."""
    variances, vectors = np.linalg.eigh(covariance)
    minor, major = 2.0 * stddevs * np.sqrt(np.maximum(variances, 0.0))
    return Ellipse(tuple(centre), major, minor, angle=float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))))


def class_style(number: int) -> tuple[str, str]:
    """Return the colour and dash of a class, or of a numbered movement."""
    return CLASS_COLOURS[number % len(CLASS_COLOURS)], ('-', '--')[number // len(CLASS_COLOURS) % 2]


def tag(axes: Any, place: Any, text: str, colour: str) -> None:
    """Write a letter or number in a small circle at a place (2,)."""
    box = {'boxstyle': 'circle,pad=0.18', 'facecolor': 'white', 'edgecolor': colour, 'linewidth': 1.4}
    axes.text(*place, text, fontsize=7.5, ha='center', va='center', zorder=7, bbox=box, clip_on=True)


def draw_colour_bar(figure: Figure, axes: Any) -> None:
    """Draw the scale of the likelihood beside a scene."""
    figure.colorbar(ScalarMappable(LIKELIHOOD_SCALE, LIKELIHOOD_COLOURS), ax=axes, label='likelihood', shrink=0.8, pad=0.02)
