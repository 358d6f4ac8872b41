# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One figure for each study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse
from matplotlib.ticker import LogLocator, MaxNLocator
from studies import PAPER_ETA, PAPER_RATIOS, RatioCurve, Scene, Studies, Study, compute_speed

import foc_ros

STYLE = {
    'font.size': 10,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'grid.color': '0.92',
    'axes.axisbelow': True,
    'savefig.dpi': 110,
}
METADATA = {'png': {'Software': 'foc_ros'}, 'pdf': {'Creator': 'foc_ros', 'CreationDate': None}}
"""What a picture says of itself; without its date it is the same file each time."""
WIDTH_IN = 9.0
COLOURS = {'LV': '#0072B2', 'HC': '#D55E00', 'optimal': '#009E73', 'H1': '#CC79A7', 'H2': '#E69F00'}
"""Colour of each strategy and homotopy class."""
RATIO_STYLES = (('black', '-', None), ('#009E73', '', 's'), ('#CC79A7', '', 'o'))
"""Colour, dash and marker: of the continuous curve, then of the paper's stepping, which gives points."""
PAPER_MARK = '#D55E00'
ELLIPSES = 16
"""Number of ellipses along a path."""
MARGIN = 0.04
"""Border around a scene, as a share of its greater side."""
NARROW_DECADES = 1.0
"""Span below which an axis of a ratio has ticks at equal distances, not at powers of ten and their double and fivefold."""
LEAST_SPAN = 1.12
"""Least factor from 1 to either end of the axis of a ratio."""
Bounds = tuple[float, float, float, float]
"""Limits of x, then of y [m]."""


def write_figures(studies: Studies, directory: Path, suffixes: Sequence[str] = ('png', 'pdf')) -> None:
    """Write study1 to study7 in every format."""
    with mpl.rc_context(STYLE):
        for number, study in studies.items():
            figure = draw_efforts(study) if study.efforts else draw_study(study)
            for suffix in suffixes:
                file = directory / f'study{number}.{suffix}'
                figure.savefig(file, bbox_inches='tight', pad_inches=0.08, metadata=METADATA[suffix])


def draw_study(study: Study) -> Figure:
    """Return the figure of a study: a row with scene and speeds for every eta of the solutions, then the ratios, if any."""
    bounds = _find_bounds(study)
    heights = [0.5 * WIDTH_IN * (bounds[3] - bounds[2]) / (bounds[1] - bounds[0]) + 0.7 for _ in study.solutions]
    heights += [3.4] if study.ratios else []
    figure = Figure(figsize=(WIDTH_IN, sum(heights) + 0.4), layout='constrained')
    rows = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    shown = [each for solutions in study.solutions.values() for each in solutions.values()]
    top = 1.08 * max((float(compute_speed(each).max()) for each in shown), default=1.0)
    for row, (eta, solutions) in zip(rows, study.solutions.items(), strict=False):
        scene, speeds = row.subplots(1, 2, width_ratios=(1.7, 1.0))
        _draw_paths(scene, study.scene, solutions, bounds)
        scene.text(0.02, 0.97, f'η = {eta:g}', transform=scene.transAxes, va='top', fontsize=11)
        for name, solution in solutions.items():
            speeds.plot(solution.times, compute_speed(solution), color=COLOURS[name], linewidth=2.0, label=name)
        speeds.set(xlabel='time [s]', ylabel='speed [m/s]', ylim=(0.0, top))
        speeds.legend(frameon=False)
    if study.ratios:
        alone, beside = rows[-1].subplots(1, 2)
        _draw_ratios(alone, study.ratios[:1], study.number)
        _draw_ratios(beside, study.ratios, study.number)
    figure.suptitle(f'Study {study.number}: {study.title}')
    return figure


def draw_efforts(study: Study) -> Figure:
    """Return the figure of study 7: efforts over eta, and the share of roll-outs that stay clear."""
    figure = Figure(figsize=(WIDTH_IN, 3.9), layout='constrained')
    efforts, clear = figure.subplots(1, 2)
    for curve in study.efforts:
        colour = COLOURS[curve.name]
        efforts.plot(curve.etas, curve.efforts, color=colour, linewidth=1.8, label=curve.name)
        rolled = study.rolled_out[curve.name]
        at_step, on_path = [each.step[0] for each in rolled.values()], [each.path[0] for each in rolled.values()]
        clear.plot(list(rolled), at_step, color=colour, linestyle='-', marker='o', markersize=4)
        clear.plot(list(rolled), on_path, color=colour, linestyle=':', marker='v', markersize=4)
    efforts.set(yscale='log', xlabel='wanted η', ylabel='effort [m²/s⁶]')
    efforts.legend(frameon=False)
    low, high = min(study.efforts[0].etas), 1.0
    clear.plot((low, high), (low, high), color='0.4', linestyle='--', linewidth=1.2)
    clear.annotate('the wanted η', (0.72, 0.72), xytext=(6, -10), textcoords='offset points', color='0.35', fontsize=8)
    clear.plot([], [], color='0.3', marker='o', markersize=4, label='at the worst step')
    clear.plot([], [], color='0.3', linestyle=':', marker='v', markersize=4, label='on the whole path')
    clear.set(xlabel='wanted η', ylabel='share of roll-outs that stay clear')
    clear.legend(frameon=False, loc='lower right')
    figure.suptitle(f'Study {study.number}: {study.title}')
    return figure


def _find_bounds(study: Study) -> Bounds:
    circles = np.array(study.scene.circles)
    reach = (circles[:, 2] + circles[:, 3])[:, None]
    points = [circles[:, :2] - reach, circles[:, :2] + reach, np.zeros((1, 2)), np.array([[study.scene.goal_x, 0.0]])]
    for solution in (each for solutions in study.solutions.values() for each in solutions.values()):
        spread = np.sqrt(np.diagonal(solution.covariance[:, :2, :2], axis1=1, axis2=2))
        points += [solution.path, solution.path[-1:] - spread[-1:], solution.path[-1:] + spread[-1:]]
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    (left, bottom), (right, top) = low - MARGIN * max(high - low), high + MARGIN * max(high - low)
    return float(left), float(right), float(bottom), float(top)


def _draw_paths(axes: Any, scene: Scene, solutions: Mapping[str, foc_ros.Solution], bounds: Bounds) -> None:
    """Draw the scene, the mean paths through it, and ellipses of one standard deviation of the position."""
    for number, (x, y, radius, stddev) in enumerate(scene.circles):
        axes.add_patch(Circle((x, y), radius + stddev, facecolor='0.88', edgecolor='0.7', linewidth=0.6))
        axes.add_patch(Circle((x, y), radius, facecolor='0.65', edgecolor='0.35', linewidth=0.8))
        axes.text(x, y, str(number), ha='center', va='center', fontsize=8)
    axes.plot(scene.goal_x, 0.0, marker='*', markersize=12, color='black', markerfacecolor='white', zorder=5)
    axes.plot(0.0, 0.0, marker='o', markersize=6, color='black', zorder=5)
    axes.set(xlim=bounds[:2], ylim=bounds[2:], xlabel='x [m]', ylabel='y [m]', aspect='equal')
    for name, solution in solutions.items():
        axes.plot(*solution.path.T, color=COLOURS[name], linewidth=2.0, zorder=4)
        for row in np.unique(np.linspace(0, len(solution.path) - 1, ELLIPSES).astype(int)):
            variance, directions = np.linalg.eigh(solution.covariance[row, :2, :2])
            smaller, greater = 2.0 * np.sqrt(np.maximum(variance, 0.0))
            angle = float(np.degrees(np.arctan2(directions[1, 1], directions[0, 1])))
            look = {'facecolor': 'none', 'edgecolor': COLOURS[name], 'alpha': 0.65, 'linewidth': 0.7, 'zorder': 3}
            axes.add_patch(Ellipse(solution.path[row], greater, smaller, angle=angle, **look))


def _draw_ratios(axes: Any, ratios: Sequence[RatioCurve], number: int) -> None:
    """Draw ratios over eta on a logarithmic scale, and what the paper says."""
    axes.axhline(1.0, color='0.5', linewidth=1.0)
    for ratio, (colour, dash, marker) in zip(ratios, RATIO_STYLES, strict=False):
        looks = {'color': colour, 'linestyle': dash, 'marker': marker, 'markersize': 4.0, 'linewidth': 1.8}
        axes.plot(ratio.etas, ratio.values, label=ratio.name, **looks)
    if number in PAPER_RATIOS:
        mark = {'color': PAPER_MARK, 'linestyle': '', 'marker': 'X', 'markersize': 9}
        axes.plot(PAPER_ETA, PAPER_RATIOS[number], label='the paper', **mark)
    label = ' / '.join(f'$J_{{{each.name}}}$' for each in (ratios[0].numerator, ratios[0].denominator))
    axes.set(yscale='log', xlabel='wanted η', ylabel=label)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 1 / LEAST_SPAN), max(high, LEAST_SPAN))
    is_narrow = np.log10(np.divide(*axes.get_ylim()[::-1])) < NARROW_DECADES
    axes.yaxis.set_major_locator(MaxNLocator(6) if is_narrow else LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter('{x:g}')
    axes.minorticks_off()
    axes.legend(frameon=False, fontsize=8, loc='lower left', bbox_to_anchor=(0.0, 1.0), ncols=2)
