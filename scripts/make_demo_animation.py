#!/usr/bin/env python3
"""Make the moving picture of the README: the packaged recording as the predictor sees it, movement by movement.

python scripts/make_demo_animation.py [FILE]
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from make_readme_picture import replayed
from matplotlib.figure import Figure
from PIL import Image

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS
from foc_ros.reporting.drawing import CLASS_COLOURS, CLASSES, draw_hand, draw_likelihoods, draw_scene, draw_ways, new_figure
from foc_ros.reporting.plots import bounds_of
from foc_ros.reporting.snapshots import Snapshot, Track, movements
from foc_ros.reporting.track_association import associate_tracks, slots

ANIMATION = Path(__file__).resolve().parents[1] / 'doc' / 'images' / 'demo.gif'
MOVEMENTS = (0, 4, 6)
"""Which movements of the recording, counted from 0."""
PICTURES, LAST_S, STEP_MS = 22, 0.9, 110
"""Pictures of a movement, how long the last one stays [s], and how long each [ms]: about a third of the real pace."""
COLOURS = 128


def main() -> None:
    """Draw the pictures, and write them into the file of the command line."""
    parser = argparse.ArgumentParser(description='Make the moving picture of the README.')
    parser.add_argument('file', nargs='?', type=Path, default=ANIMATION)
    file = parser.parse_args().file
    save(list(pictures(*replayed())), file)


def pictures(track: Track, moments: list[Snapshot], chosen: tuple[int, ...] = MOVEMENTS) -> Iterator[tuple[Figure, int]]:
    """Yield the pictures, each with the time it stays [ms]."""
    spans = movements(track, Config().estimator.onset_speed)
    goals = np.unique(np.concatenate([moment.goals for moment in moments]), axis=0)
    bounds = bounds_of(moments[0].obstacles, goals, (), track.positions)
    for start_ns, end_ns in (spans[number] for number in chosen):
        inside = [moment for moment in moments if start_ns <= moment.stamp_ns <= end_ns and moment.ways]
        lines = associate_tracks(inside)
        letters = slots(inside, lines, CLASSES, len(CLASS_COLOURS))
        rows = np.unique(np.linspace(0, len(inside) - 1, PICTURES).round().astype(int))
        for row in rows:
            moment, seconds = inside[row], [(stamp - start_ns) / NANOSECONDS for stamp in (start_ns, end_ns)]
            with new_figure(8.4, 4.2) as figure:
                scene, shares = figure.subplots(1, 2, width_ratios=(1.55, 1.0))
                draw_scene(scene, moment.obstacles, moment.goals, bounds)
                draw_ways(scene, moment.ways, {label: letters[line] for label, line in lines[row].items() if line in letters})
                draw_hand(scene, track, moment.stamp_ns, (start_ns, end_ns))
                draw_likelihoods(shares, inside[: row + 1], lines[: row + 1], letters, start_ns)
                shares.set(xlim=seconds, xlabel='time [s]', title='likelihood of each way', ylabel='')
                shares.tick_params(labelbottom=True)
            yield figure, STEP_MS if row != rows[-1] else int(1000 * LAST_S)


def save(drawn: list[tuple[Figure, int]], file: Path) -> None:
    """Write an animated GIF."""
    images = []
    for figure, _ in drawn:
        buffer = io.BytesIO()
        figure.savefig(buffer, format='png', dpi=80)
        images.append(Image.open(buffer).convert('RGB').quantize(COLOURS, dither=Image.Dither.NONE))
    file.parent.mkdir(parents=True, exist_ok=True)
    images[0].save(file, save_all=True, append_images=images[1:], duration=[stays for _, stays in drawn], loop=0, optimize=True)


if __name__ == '__main__':
    main()
