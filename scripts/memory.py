"""Memory of a process that makes many predictions: `python scripts/memory.py --ticks 100000`.

A hand moves to and fro among obstacles, so that homotopy classes and durations keep changing. The exit code is 0 if the resident
memory never grows by more than a twentieth after the first tenth of the ticks.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from rich.progress import track

from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import HandSample, make_obstacles

WARM_UP, GROWTH = 0.1, 1.05
CONFIG = replace_values(Config(), {'foc.steps': 30, 'rate_hz': 100.0, 'scene.timeout_s': 0.0})
OBSTACLES = make_obstacles([[0.12, 0.01], [0.2, -0.03], [0.15, 0.06]], [0.02, 0.015, 0.02], 0.001)
GOALS = np.array([[0.3, 0.0], [0.28, 0.1]])


def resident_mb() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


def main() -> int:
    """Predict, and measure the memory."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--ticks', type=int, default=100_000, metavar='N', help='predictions (default: 100000)')
    ticks = parser.parse_args().ticks
    pipeline = Pipeline(CONFIG)
    pipeline.set_obstacles('cloud', OBSTACLES, None, 'world')
    pipeline.set_goals(GOALS, 'world')
    generator, measured_mb, predictions = np.random.default_rng(1), [], 0
    for tick in track(range(ticks), description='ticks'):
        phase = 2 * np.pi * tick / 700
        position = np.array([0.14 - 0.14 * np.cos(phase), 0.02 * np.sin(3.1 * phase)]) + generator.normal(0, 2e-4, 2)
        pipeline.add_hand_sample(HandSample(1_000_000_000 + 10_000_000 * tick, position, 0.0, 'world'))
        predictions += pipeline.is_due and pipeline.predict() is not None
        if tick >= WARM_UP * ticks and tick % max(ticks // 50, 1) == 0:
            measured_mb.append(resident_mb())
    growth = max(measured_mb) / measured_mb[0]
    print(f'{predictions} predictions of {ticks} ticks')
    print(f'{measured_mb[0]:.0f} MB after the first tenth, {max(measured_mb):.0f} MB at most: x {growth:.3f}')
    return int(growth > GROWTH or predictions < 0.9 * ticks)


if __name__ == '__main__':
    sys.exit(main())
