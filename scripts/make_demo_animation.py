#!/usr/bin/env python3
"""Make the animation of the README: predictions of the packaged recording during three movements.

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
from foc_ros.reporting.draw import compute_bounds, draw_candidates, draw_hand, draw_likelihoods, draw_scene, open_figure
from foc_ros.reporting.views import HandTrajectory, Snapshot, build_candidate_tracks

ANIMATION = Path(__file__).resolve().parents[1] / 'doc' / 'images' / 'demo.gif'
MOVEMENTS = (0, 4, 6)
"""Rows of the movements of the recording that are shown."""
PICTURES, LAST_S, STEP_MS = 22, 0.9, 110
"""Pictures of a movement, duration of the last [s] and of each other picture [ms]: about a third of the real speed."""
COLOURS = 128


def main() -> None:
    """Write the animation into the file given on the command line."""
    parser = argparse.ArgumentParser(description='Make the animation of the README.')
    parser.add_argument('file', nargs='?', type=Path, default=ANIMATION)
    file = parser.parse_args().file
    save(list(pictures(*replayed())), file)


def pictures(
    hand: HandTrajectory, snapshots: list[Snapshot], chosen: tuple[int, ...] = MOVEMENTS
) -> Iterator[tuple[Figure, int]]:
    """Yield the pictures, each with its duration [ms]."""
    spans = hand.find_movements(Config().estimator.onset_speed)
    goals = np.unique(np.concatenate([each.goals for each in snapshots]), axis=0)
    bounds = compute_bounds(snapshots[0].obstacles, goals, (), hand.positions)
    for start_ns, end_ns in (spans[number] for number in chosen):
        tracks = build_candidate_tracks([each for each in snapshots if start_ns <= each.stamp_ns <= end_ns and each.candidates])
        rows = np.unique(np.linspace(0, len(tracks.snapshots) - 1, PICTURES).round().astype(int))
        for row in rows:
            snapshot = tracks.snapshots[row]
            snapshot = snapshot.begin_at(hand.position_at(snapshot.stamp_ns))
            with open_figure(8.4, 4.2) as figure:
                scene, shares = figure.subplots(1, 2, width_ratios=(1.55, 1.0))
                draw_scene(scene, snapshot.obstacles, snapshot.goals, bounds)
                draw_candidates(scene, snapshot, tracks.slots_at(row))
                draw_hand(scene, hand, snapshot.stamp_ns, (start_ns, end_ns))
                draw_likelihoods(shares, tracks.between(start_ns, snapshot.stamp_ns), start_ns)
                limits = (0.0, (end_ns - start_ns) / NANOSECONDS)
                shares.set(xlim=limits, xlabel='time [s]', title='likelihood of each candidate', ylabel='')
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
    images[0].save(
        file, save_all=True, append_images=images[1:], duration=[duration_ms for _, duration_ms in drawn], loop=0, optimize=True
    )


if __name__ == '__main__':
    main()
