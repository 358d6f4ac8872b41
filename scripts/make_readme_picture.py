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
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import BagReader
from foc_ros.reporting.draw import (
    compute_bounds,
    draw_candidates,
    draw_hand,
    draw_legend,
    draw_scene,
    number_labels,
    open_figure,
    save_figure,
)
from foc_ros.reporting.report import ReportCollector
from foc_ros.reporting.views import HandTrajectory, Snapshot, build_hand_trajectory

ROOT = Path(__file__).resolve().parents[1]
RECORDING = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
PICTURE = ROOT / 'doc' / 'images' / 'scene.png'
MOVEMENT, AFTER_S = 5, 0.02
"""The movement, counted from 1, and the time after its beginning [s] of the prediction shown: early, with several candidates."""


def replayed() -> tuple[HandTrajectory, list[Snapshot]]:
    """Return the hand's trajectory and all predictions of the recording."""
    collected = ReportCollector()
    with BagReader(RECORDING) as reader:
        for step in Replay(Config()).steps(reader):
            collected.add(step)
    return build_hand_trajectory(collected.samples), collected.snapshots


def picture(hand: HandTrajectory, snapshots: list[Snapshot]) -> Figure:
    """Return the picture of the chosen prediction."""
    span = hand.find_movements(Config().estimator.onset_speed)[MOVEMENT - 1]
    wanted_ns = span[0] + int(AFTER_S * NANOSECONDS)
    snapshot = min(snapshots, key=lambda each: abs(each.stamp_ns - wanted_ns))
    snapshot = snapshot.begin_at(hand.position_at(snapshot.stamp_ns))
    bounds = compute_bounds(snapshot.obstacles, snapshot.goals, snapshot.candidates, hand.positions[hand.between(*span)])
    with open_figure(7.6, 6.6) as figure:
        scene = figure.subplots()
        draw_scene(scene, snapshot.obstacles, snapshot.goals, bounds)
        draw_candidates(scene, snapshot, number_labels(snapshot.candidates))
        draw_hand(scene, hand, snapshot.stamp_ns, span)
        draw_legend(scene)
    return figure


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Make the picture of the README.')
    parser.add_argument('file', nargs='?', type=Path, default=PICTURE)
    file = parser.parse_args().file
    file.parent.mkdir(parents=True, exist_ok=True)
    save_figure(picture(*replayed()), file)
