#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Draw what config/foc.rviz shows: python scripts/viewers.py [--to FILE].

RViz is not needed: the messages are those of the node for the packaged recording, and displays, colours and view are those of the
configuration. It is a drawing in the view from above, and not a screenshot.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from matplotlib.colors import hsv_to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Polygon
from page import IMAGES, ROOT

from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import TYPESTORE, BagReader
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes

RECORDING, SHOWN_S = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap', 6.24
"""The recording, and the time of it that is drawn [s]: early in a movement, with several likely paths."""
CYLINDER, LINE_STRIP, TEXT, TRIANGLES = 3, 4, 9, 11
VIOLET_HUE = 0.8
"""Hue of the least intensity; that of the largest one is 0, red."""
POINTS_PER_INCH, PIXELS_PER_INCH = 72, 100


def find_messages() -> dict[str, Any]:
    """Return the newest message of each topic at the time that is drawn, those of the node included."""
    config, sent, first_ns = Config(), {}, None
    with BagReader(RECORDING) as reader:
        for step in Replay(config).steps(reader):
            sent[step.item.topic] = step.item.message
            if step.sample is not None and first_ns is None:
                first_ns = step.sample.stamp_ns
            if step.prediction is None or first_ns is None or step.prediction.stamp_ns < first_ns + SHOWN_S * NANOSECONDS:
                continue
            outputs = encode_outputs(step.prediction, config.plane, RosbagsTypes(TYPESTORE))
            return sent | {f'/foc/{name}': message for name, message in outputs.items()}
    raise SystemExit(f'{RECORDING.name} has no prediction after {SHOWN_S} s')


def draw_markers(axes: Any, array: Any, points_per_m: float) -> None:
    """Draw markers; seen from above, one that is drawn later may cover one that is not higher."""
    for marker in array.markers:
        colour = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
        centre, points = marker.pose.position, np.array([[point.x, point.y] for point in marker.points])
        if marker.type == CYLINDER:
            angle = math.degrees(2.0 * math.atan2(marker.pose.orientation.z, marker.pose.orientation.w))
            axes.add_patch(Ellipse((centre.x, centre.y), marker.scale.x, marker.scale.y, angle=angle, color=colour, linewidth=0))
        elif marker.type == LINE_STRIP:
            axes.plot(*points.T, color=colour, linewidth=marker.scale.x * points_per_m, solid_capstyle='butt')
        elif marker.type == TRIANGLES:
            for corners in points.reshape(-1, 3, 2):
                axes.add_patch(Polygon(corners, color=colour, linewidth=0))
        elif marker.type == TEXT:
            size = marker.scale.z * points_per_m
            axes.text(centre.x, centre.y, marker.text, color=colour, size=size, ha='center', va='center', clip_on=True, zorder=5)


def draw_cloud(axes: Any, display: dict[str, Any], cloud: Any, points_per_m: float) -> None:
    """Draw the rows of a table as dots in the colours of a rainbow."""
    rows, low, high = np.frombuffer(cloud.data, CLOUD_ROW), display['Min Intensity'], display['Max Intensity']
    hues = VIOLET_HUE * (1.0 - np.clip((rows[display['Channel Name']] - low) / (high - low), 0.0, 1.0))
    colours = hsv_to_rgb(np.column_stack([hues, np.ones(len(rows)), np.ones(len(rows))]))
    axes.scatter(rows['x'], rows['y'], s=(display['Size (m)'] * points_per_m) ** 2, c=colours, linewidths=0, zorder=3)


def draw_poses(axes: Any, display: dict[str, Any], poses: list[Any]) -> None:
    """Draw poses as arrows along their first axis, or as their first two axes in red and green."""
    for pose in poses:
        angle = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        length = float(display.get('Axes Length') or display['Arrow Length'])
        arms = ((0.0, 'red'), (math.pi / 2, 'lime')) if display['Shape'] == 'Axes' else ((0.0, '#ff1900'),)
        for turn, colour in arms:
            end = (pose.position.x + length * math.cos(angle + turn), pose.position.y + length * math.sin(angle + turn))
            style = {'arrowstyle': '-' if display['Shape'] == 'Axes' else '->', 'color': colour, 'linewidth': 2}
            axes.annotate('', end, (pose.position.x, pose.position.y), arrowprops=style, zorder=4)


def draw(configuration: dict[str, Any], messages: dict[str, Any]) -> Figure:
    """Return the drawing of all displays that are enabled, in their order."""
    manager, window = configuration['Visualization Manager'], configuration['Window Geometry']
    view = manager['Views']['Current']
    figure = Figure((window['Width'] / PIXELS_PER_INCH, window['Height'] / PIXELS_PER_INCH), dpi=PIXELS_PER_INCH)
    axes = figure.add_axes((0, 0, 1, 1))
    background = [int(part) / 255 for part in manager['Global Options']['Background Color'].split(';')]
    figure.set_facecolor(background)
    axes.set_axis_off()
    points_per_m = view['Scale'] / PIXELS_PER_INCH * POINTS_PER_INCH
    drawers: dict[str, Callable[[dict[str, Any], Any], None]] = {
        'MarkerArray': lambda _, message: draw_markers(axes, message, points_per_m),
        'PointCloud2': lambda display, message: draw_cloud(axes, display, message, points_per_m),
        'Path': lambda display, message: _draw_path(axes, display, message),
        'Pose': lambda display, message: draw_poses(axes, display, [message.pose]),
        'PoseArray': lambda display, message: draw_poses(axes, display, message.poses),
    }
    for display in manager['Displays']:
        kind = display['Class'].partition('/')[2]
        if display['Enabled'] and kind == 'Grid':
            for at in (np.arange(display['Plane Cell Count'] + 1) - display['Plane Cell Count'] / 2) * display['Cell Size']:
                axes.axvline(at, color='#a0a0a4', alpha=0.5, linewidth=0.6)
                axes.axhline(at, color='#a0a0a4', alpha=0.5, linewidth=0.6)
        elif display['Enabled']:
            drawers[kind](display, messages[display['Topic']['Value']])
    half_width, half_height = window['Width'] / view['Scale'] / 2, window['Height'] / view['Scale'] / 2
    axes.set(xlim=(view['X'] - half_width, view['X'] + half_width), ylim=(view['Y'] - half_height, view['Y'] + half_height))
    return figure


def _draw_path(axes: Any, display: dict[str, Any], path: Any) -> None:
    """Draw a path as a thin line."""
    points = [(pose.pose.position.x, pose.pose.position.y) for pose in path.poses]
    colour = [int(part) / 255 for part in display['Color'].split(';')]
    axes.plot(*np.array(points).reshape(-1, 2).T, color=colour, linewidth=1, zorder=3)


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--to', type=Path, default=IMAGES / 'rviz.png', metavar='FILE')
    configuration = yaml.safe_load((ROOT / 'config' / 'foc.rviz').read_text('utf-8'))
    draw(configuration, find_messages()).savefig(parser.parse_args().to)


if __name__ == '__main__':
    main()
