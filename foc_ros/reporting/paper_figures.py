"""One figure for each study, in the common style of the pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from foc_ros.analysis.paper.reaching import PaperScene, compute_speed
from foc_ros.analysis.paper.studies import PAPER_ETA, PAPER_RATIOS, Studies, Study
from foc_ros.core.types import Solution

from .draw import (
    ELLIPSES_PER_CANDIDATE,
    Bounds,
    compute_bounds,
    draw_scene,
    get_class_style,
    make_stddev_ellipse,
    open_figure,
    save_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_IN = 9.0
STYLES = {'LV': 0, 'HC': 1, 'optimal': 2, 'H1': 3, 'H2': 4}
"""Colour of each strategy and homotopy class."""
RATIO_STYLES = (('black', '-', None), ('#009E73', '', 's'), ('#CC79A7', '', 'o'))
"""Colour, dash and marker: of the continuous curve, then of the paper's stepping, which gives points."""
PAPER_MARK = '#D55E00'
NARROW_DECADES = 1.0
"""Span below which an axis of a ratio has ticks at equal distances, not at powers of ten and their double and fivefold."""
LEAST_SPAN = 1.12
"""Least factor from 1 to either end of the axis of a ratio."""


def write_figures(studies: Studies, directory: Path, suffixes: Sequence[str]) -> None:
    """Write study1 to study7 in every format; raises InputError where a file cannot be written."""
    for number, study in studies.items():
        figure = draw_efforts(study) if study.efforts else draw_study(study)
        for suffix in suffixes:
            save_figure(figure, directory / f'study{number}.{suffix}')


def draw_study(study: Study) -> Figure:
    """Return the figure of a study: a row with scene and speeds for every eta of the solutions, then the ratios, if any."""
    bounds = _find_bounds(study)
    heights = [0.5 * WIDTH_IN * (bounds[3] - bounds[2]) / (bounds[1] - bounds[0]) + 0.7 for _ in study.solutions]
    heights += [3.4] if study.ratios else []
    with open_figure(WIDTH_IN, sum(heights) + 0.4) as figure:
        rows = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
        top = 1.08 * max(
            (float(compute_speed(each).max()) for solutions in study.solutions.values() for each in solutions.values()),
            default=1.0,
        )
        for row, (eta, solutions) in zip(rows, study.solutions.items(), strict=False):
            scene, speeds = row.subplots(1, 2, width_ratios=(1.7, 1.0))
            _draw_paths(scene, study.scene, solutions, bounds)
            _draw_speeds(speeds, solutions, top)
            scene.text(0.02, 0.97, f'η = {eta:g}', transform=scene.transAxes, va='top', fontsize=11)
        if study.ratios:
            alone, beside = rows[-1].subplots(1, 2)
            _draw_ratios(alone, beside, study)
        figure.suptitle(f'Study {study.number}: {study.title}')
    return figure


def draw_efforts(study: Study) -> Figure:
    """Return the figure of study 7: efforts over eta, and the share of roll-outs that stay clear."""
    with open_figure(WIDTH_IN, 3.9) as figure:
        efforts, clear = figure.subplots(1, 2)
        for curve in study.efforts:
            colour, dash = get_class_style(STYLES[curve.name])
            efforts.plot(curve.etas, curve.efforts, color=colour, linestyle=dash, linewidth=1.8, label=curve.name)
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
    solutions = [each for solutions in study.solutions.values() for each in solutions.values()]
    ends = [each.path[-1] + sign * np.sqrt(each.covariance[-1].diagonal()[:2]) for each in solutions for sign in (-1, 1)]
    points = [np.zeros((1, 2)), *(each.path for each in solutions), *(end[None] for end in ends)]
    return compute_bounds(study.scene.obstacles, study.scene.goal[None], (), *points)


def _draw_paths(axes: Any, scene: PaperScene, solutions: Mapping[str, Solution], bounds: Bounds) -> None:
    """Draw the scene, the mean paths through it, and ellipses of one standard deviation of the position."""
    draw_scene(axes, scene.obstacles, scene.goal[None], bounds, named=False)
    axes.plot(0.0, 0.0, marker='o', markersize=6, color='black', zorder=5)
    for name, solution in solutions.items():
        colour, dash = get_class_style(STYLES[name])
        axes.plot(*solution.path.T, color=colour, linestyle=dash, linewidth=2.0, zorder=4)
        for row in np.unique(np.linspace(0, len(solution.path) - 1, 2 * ELLIPSES_PER_CANDIDATE).astype(int)):
            ellipse = make_stddev_ellipse(solution.path[row], solution.covariance[row, :2, :2])
            ellipse.set(facecolor='none', edgecolor=colour, alpha=0.65, linewidth=0.7, zorder=3)
            axes.add_patch(ellipse)


def _draw_speeds(axes: Any, solutions: Mapping[str, Solution], top: float) -> None:
    for name, solution in solutions.items():
        colour, dash = get_class_style(STYLES[name])
        axes.plot(solution.times, compute_speed(solution), color=colour, linestyle=dash, linewidth=2.0, label=name)
    axes.set(xlabel='time [s]', ylabel='speed [m/s]', ylim=(0.0, top))
    axes.legend(frameon=False)


def _draw_ratios(alone: Any, beside: Any, study: Study) -> None:
    """Draw the ratio over eta on logarithmic scales: the continuous one alone, then beside those of the paper's stepping."""
    from matplotlib.ticker import LogLocator, MaxNLocator

    first = study.ratios[0]
    for axes, shown in ((alone, study.ratios[:1]), (beside, study.ratios)):
        axes.axhline(1.0, color='0.5', linewidth=1.0)
        for ratio, (colour, dash, marker) in zip(shown, RATIO_STYLES, strict=False):
            looks = {'color': colour, 'linestyle': dash, 'marker': marker, 'markersize': 4.0, 'linewidth': 1.8}
            axes.plot(ratio.etas, ratio.values, label=ratio.name, **looks)
        if study.number in PAPER_RATIOS:
            mark = {'color': PAPER_MARK, 'linestyle': '', 'marker': 'X', 'markersize': 9}
            axes.plot(PAPER_ETA, PAPER_RATIOS[study.number], label='the paper', **mark)
        axes.set(
            yscale='log',
            xlabel='wanted η',
            ylabel=' / '.join(f'$J_{{{each.name}}}$' for each in (first.numerator, first.denominator)),
        )
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, 1 / LEAST_SPAN), max(high, LEAST_SPAN))
        is_narrow = np.log10(np.divide(*axes.get_ylim()[::-1])) < NARROW_DECADES
        axes.yaxis.set_major_locator(MaxNLocator(6) if is_narrow else LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter('{x:g}')
        axes.minorticks_off()
        axes.legend(frameon=False, fontsize=8, loc='lower left', bbox_to_anchor=(0.0, 1.0), ncols=2)
