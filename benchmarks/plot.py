"""Draw doc/images/speed.png: the time of a warm tick against classes, obstacles and N.

python benchmarks/plot.py [FILE]
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.update(dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'), '1'))

import numpy as np
from matplotlib.axes import Axes
from rows.ticking import Ticking, alternating
from scenes import Reach, clusters, tick_4x8, with_far

from foc_ros.reporting.drawing import new_figure
from foc_ros.reporting.plots import save

SPEED = Path(__file__).resolve().parents[1] / 'doc' / 'images' / 'speed.png'
TICKS = 16
CLASSES, FAR, STEPS = (1, 2, 3, 4, 6, 8), (0, 8, 24, 56, 120, 248), (25, 50, 100, 200)


def main() -> None:
    """Measure, and draw into the file of the command line."""
    base = tick_4x8()
    six = Reach(base.config, clusters((2, 1, 2, 1, 2)), base.goals, base.hands)
    panels = {
        'classes wanted (8 obstacles)': {n: six.changed({'homotopy.max_candidates': n}) for n in CLASSES},
        'obstacles (8 near, the rest far; 4 classes)': {8 + n: _with(base, n) for n in FAR},
        'steps N (4 classes, 8 obstacles)': {n: base.changed({'foc.steps': n}) for n in STEPS},
    }
    with new_figure(11.0, 3.6) as figure:
        axes: list[Axes] = list(figure.subplots(1, 3, sharey=True))
        for panel, (label, reaches) in zip(axes, panels.items(), strict=True):
            _draw(panel, label, reaches)
        axes[0].set_ylabel('warm tick [ms]')
        axes[1].legend(frameon=False, loc='lower right')
    save(figure, sys.argv[1] if len(sys.argv) > 1 else SPEED)


def _with(reach: Reach, far: int) -> Reach:
    return Reach(reach.config, with_far(reach.obstacles, far, 5), reach.goals, reach.hands)


def _draw(panel: Axes, label: str, reaches: dict[int, Reach]) -> None:
    times = alternating({str(n): Ticking(reach) for n, reach in reaches.items()}, TICKS)
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
