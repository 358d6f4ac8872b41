"""Draw doc/images/speed.png: the time of a warm tick over the number of classes, of obstacles and of steps.

python benchmarks/plot.py [FILE]
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path

os.environ.update(dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'), '1'))

import numpy as np
from matplotlib.axes import Axes
from rows.tick_sequence import TickSequence, time_ticks_in_turn
from scenes import Reach, add_far_obstacles, build_4x8, build_rows

from foc_ros.reporting.drawing import open_figure
from foc_ros.reporting.plots import save_figure

PICTURE = Path(__file__).resolve().parents[1] / 'doc' / 'images' / 'speed.png'
TICKS = 16
CLASSES, FAR, STEPS = (1, 2, 3, 4, 6, 8), (0, 8, 24, 56, 120, 248), (25, 50, 100, 200)


def main() -> None:
    """Measure, and draw into the file of the command line."""
    base = build_4x8()
    six_classes = replace(base, obstacles=build_rows((2, 1, 2, 1, 2)))
    panels = {
        'classes wanted (8 obstacles)': {n: six_classes.change_config({'homotopy.max_candidates': n}) for n in CLASSES},
        'obstacles (8 near, the rest far; 4 classes)': {8 + n: add_far_obstacles(base, n, 5) for n in FAR},
        'steps N (4 classes, 8 obstacles)': {n: base.change_config({'foc.steps': n}) for n in STEPS},
    }
    with open_figure(11.0, 3.6) as figure:
        axes: list[Axes] = list(figure.subplots(1, 3, sharey=True))
        for panel, (label, reaches) in zip(axes, panels.items(), strict=True):
            draw_panel(panel, label, reaches)
        axes[0].set_ylabel('warm tick [ms]')
        axes[1].legend(frameon=False, loc='lower right')
    save_figure(figure, sys.argv[1] if len(sys.argv) > 1 else PICTURE)


def draw_panel(panel: Axes, label: str, reaches: dict[int, Reach]) -> None:
    """Draw the time of a tick of each reach over its number."""
    times = time_ticks_in_turn({str(n): TickSequence(reach) for n, reach in reaches.items()}, TICKS)
    low, middle, high = (1e3 * np.percentile([times[str(n)] for n in reaches], share, axis=1) for share in (10, 50, 90))
    panel.fill_between(list(reaches), low, high, alpha=0.2, linewidth=0, label='10th to 90th percentile')
    panel.plot(list(reaches), middle, 'o-', label='median')
    panel.axhline(4.0, color='0.4', linestyle=':', label='4 ms')
    panel.set_xlabel(label)
    panel.set_yscale('log')
    panel.yaxis.set_major_formatter('{x:g}')
    panel.yaxis.set_minor_formatter('{x:g}')


if __name__ == '__main__':
    main()
