#!/usr/bin/env python3
"""Make the picture of the README: one real prediction of the packaged recording, early in a movement.

python scripts/make_readme_picture.py [FILE]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from matplotlib.figure import Figure

from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.io.bags import BagReader
from foc_ros.reporting.drawing import draw_colour_bar, draw_hand, draw_legend, draw_scene, draw_ways, new_figure
from foc_ros.reporting.plots import bounds_of, save
from foc_ros.reporting.snapshots import Snapshot, Track, movements, snapshot_of_prediction, track_of

ROOT = Path(__file__).resolve().parents[1]
RECORDING = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
PICTURE = ROOT / 'doc' / 'images' / 'scene.png'
MOVEMENT, AFTER_S = 5, 0.02
"""Which movement, counted from 1, and how long after its beginning [s]: when most is still open."""


def replayed() -> tuple[Track, list[Snapshot]]:
    """Return the hand's track and all predictions of the recording up to the wanted one and the end of its movement."""
    samples: list[HandSample] = []
    moments: list[Snapshot] = []
    with BagReader(RECORDING) as reader:
        for step in Replay(Config()).steps(reader):
            if step.sample is not None:
                samples.append(step.sample)
            if step.prediction is not None and step.scene.goals is not None:
                obstacles = step.scene.obstacles(step.prediction.stamp_ns)
                moments.append(snapshot_of_prediction(step.prediction, obstacles, step.scene.goals))
    return track_of(samples), moments


def picture(track: Track, moments: list[Snapshot]) -> Figure:
    """Return the picture of the wanted moment."""
    span = movements(track, Config().estimator.onset_speed)[MOVEMENT - 1]
    wanted_ns = span[0] + int(AFTER_S * NANOSECONDS)
    moment = min(moments, key=lambda each: abs(each.stamp_ns - wanted_ns))
    numbers = {way.label: number for number, way in enumerate(moment.ways)}
    positions = track.positions[track.between(*span)]
    bounds = bounds_of(moment.obstacles, moment.goals, moment.ways, positions)
    with new_figure(7.6, 6.6) as figure:
        scene, legend = figure.subplots(2, 1, height_ratios=[5.6, 0.8])
        draw_scene(scene, moment.obstacles, moment.goals, bounds)
        draw_ways(scene, moment.ways, numbers)
        draw_hand(scene, track, moment.stamp_ns, span)
        draw_colour_bar(figure, scene)
        draw_legend(legend, moment.ways, numbers)
    return figure


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Make the picture of the README.')
    parser.add_argument('file', nargs='?', type=Path, default=PICTURE)
    file = parser.parse_args().file
    file.parent.mkdir(parents=True, exist_ok=True)
    save(picture(*replayed()), file)
