#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Make recordings of simulated hands.

    python scripts/recordings.py packaged
    python scripts/recordings.py tables

packaged: the recording of the package. An operator carries objects to and fro among obstacles, on a different path each time. The
movements are independent of the predictor. Each reach is the minimum-jerk movement through hand-picked via points: a quintic
spline, continuous up to the fourth derivative, with the passing times that minimise its squared jerk (Flash and Hogan 1985). Its
jerk with proportional noise drives a triple integrator, and a weak feedback brings the hand to the target. The recorded positions
have the noise of a tracker in addition. All random numbers come from one seed.

tables: doc/examples/*.csv, two movements of the packaged recording as motion-capture tables, for `convert`.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from page import ROOT
from scipy.interpolate import BSpline, make_interp_spline
from scipy.optimize import minimize

from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter
from foc_ros.io.topics import HAND
from foc_ros.reporting.views import build_hand_trajectory
from foc_ros.ros.messages.decode_poses import decode_hand_sample
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RosbagsTypes

MOVEMENTS = (4, 6)
"""Rows of the movements of the recording that the tables have."""
LEAD_NS, EVERY = 200_000_000, 2
"""Time by which a table begins before its movement, and the number of samples of which one is kept: 50 per second."""
PACKAGED = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
SEED, FRAME = 20, 'world'
HEIGHT, STEP_S = 0.12, 0.01
START_NS = 1_767_225_600_000_000_000
"""Stamp of the first message: the first second of 2026, UTC."""
MOTOR_NOISE = 0.25
"""Standard deviation of the jerk's noise per unit of jerk, drawn once per step."""
SENSOR_NOISE_M = 0.0007
FEEDBACK_RATE = 3.5
"""The three poles of the feedback [1/s]: slow compared with a reach, so that the noise is visible, but faster than a rest."""

NEAR = np.array([[0.0, -0.06], [0.0, 0.07]])
FAR = np.array([[0.36, -0.065], [0.35, 0.08]])
OBSTACLES = [  # x, y, z, radius, radius_stddev, id, size_x, size_y, yaw: a box, three circles, and a wall beside the workspace
    (0.170, 0.003, HEIGHT, 0.004, 0.003, 1, 0.064, 0.036, 0.6),
    (0.135, 0.125, HEIGHT, 0.030, 0.002, 2, 0.0, 0.0, 0.0),
    (0.200, -0.125, HEIGHT, 0.030, 0.002, 3, 0.0, 0.0, 0.0),
    (0.255, 0.075, HEIGHT, 0.020, 0.002, 4, 0.0, 0.0, 0.0),
    (0.180, 0.240, HEIGHT, 0.003, 0.002, 5, 0.360, 0.010, 0.0),
]


REACHES: list[tuple[bool, int, list[list[float]], float, float]] = [
    # outward or back, number of the site, via points [m], duration [s], rest before it [s]
    (True, 0, [[0.180, -0.065]], 1.05, 1.2),
    (False, 1, [[0.165, 0.072]], 1.20, 1.3),
    (True, 1, [[0.150, 0.068], [0.245, 0.125]], 1.10, 1.2),
    (False, 1, [[0.145, 0.185]], 1.25, 1.3),
    (True, 0, [[0.100, -0.010], [0.190, -0.064]], 1.20, 1.2),
    (False, 0, [[0.190, -0.185]], 1.30, 1.4),
    (True, 1, [[0.190, -0.060]], 1.10, 1.2),
    (False, 0, [[0.225, 0.042], [0.150, 0.062]], 1.25, 1.3),
]
REST_AT_END_S, SWITCH_S = 1.0, 0.4
"""Rest at the end, and time after an arrival at which the goals change: the object is put down [s]."""


def minimum_jerk(points: Array, duration_s: float) -> BSpline:
    """Return the movement through `points` (m, 2), at rest at both ends, with the smallest integral of squared jerk."""

    def through(inner: Array) -> BSpline:
        times = np.concatenate([[0.0], inner, [duration_s]])
        rest = [(1, np.zeros(2)), (2, np.zeros(2))]
        return make_interp_spline(times, points, k=5, bc_type=(rest, rest))

    grid = np.linspace(0.0, duration_s, 501)

    def cost(inner: Array) -> float:
        if np.any(np.diff([0.0, *inner, duration_s]) < 0.05):
            return np.inf
        return float(np.mean(through(inner)(grid, nu=3) ** 2))

    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    first = duration_s * length[1:-1] / length[-1]
    return through(minimize(cost, first, method='Nelder-Mead', options={'xatol': 1e-7, 'fatol': 1e-10}).x)


def reference() -> tuple[Array, list[tuple[float, bool]]]:
    """Return the intended movement (n, 3, 2): position, velocity, acceleration at every step; and the changes of the goals.

    A change is the time [s] from which on the goals are the far sites (True) or the near ones (False).
    """
    parts: list[Array] = []
    goals = [(0.0, True)]
    at, elapsed = NEAR[0], 0.0
    for is_outward, site, via, duration_s, rest_s in REACHES:
        target = (FAR if is_outward else NEAR)[site]
        parts.append(_resting(at, rest_s))
        movement = minimum_jerk(np.vstack([at, *via, target]), duration_s)
        times = STEP_S * np.arange(round(duration_s / STEP_S))
        parts.append(np.stack([movement(times, nu=order) for order in range(3)], axis=1))
        elapsed += rest_s + duration_s
        goals.append((elapsed + SWITCH_S, not is_outward))
        at = target
    parts.append(_resting(at, REST_AT_END_S))
    return np.concatenate(parts), goals


def _resting(at: Array, seconds: float) -> Array:
    return np.stack([np.array([at, np.zeros(2), np.zeros(2)])] * round(seconds / STEP_S))


def moved(intended: Array, random: np.random.Generator) -> Array:
    """Return the positions of the hand (n, 2): the triple integrator driven by intended jerk, feedback and noise."""
    dt, rate = STEP_S, FEEDBACK_RATE
    a = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    b = np.array([dt**3 / 6, dt**2 / 2, dt])
    gain = np.array([rate**3, 3 * rate**2, 3 * rate])
    state = intended[0].copy()
    positions = [state[0].copy()]
    for now, following in pairwise(intended):
        jerk = (following[2] - now[2]) / dt + gain @ (now - state)
        jerk = jerk + MOTOR_NOISE * np.abs(jerk) * random.standard_normal(2)
        state = a @ state + np.outer(b, jerk)
        positions.append(state[0].copy())
    return np.array(positions)


def messages() -> list[tuple[int, str, Any]]:
    """Return all messages of the recording in order: stamp [ns], topic, message."""
    types, random = RosbagsTypes(TYPESTORE), np.random.default_rng(SEED)
    intended, switches = reference()
    truth = moved(intended, random)
    measured = np.column_stack([truth, np.full(len(truth), HEIGHT)]) + SENSOR_NOISE_M * random.standard_normal((len(truth), 3))
    end_s = STEP_S * len(truth)
    out: list[tuple[int, str, Any]] = []
    for seconds in sorted({*np.arange(0.0, end_s, 1.0), *(time for time, _ in switches)}):
        far = [outward for time, outward in switches if time <= seconds][-1]
        sites = np.column_stack([FAR if far else NEAR, np.full(2, HEIGHT)])
        out.append((_stamp(seconds), '/goals', encode_goals(types, _stamp(seconds), FRAME, sites)))
    stamps = [_stamp(seconds) for seconds in np.arange(0.0, end_s, 0.2)]
    out += [(stamp_ns, '/obstacles', encode_obstacles(types, stamp_ns, FRAME, OBSTACLES)) for stamp_ns in stamps]
    for step, at in enumerate(measured):
        stamp_ns = _stamp(STEP_S * step)
        out.append((stamp_ns, '/hand_pose', encode_hand_pose(types, stamp_ns, FRAME, at)))
    return sorted(out, key=lambda item: item[0])


def _stamp(seconds: float) -> int:
    return START_NS + round(seconds * 1e3) * 1_000_000


def write_recording(file: Path) -> None:
    """Write the recording as one MCAP file, replacing an existing file."""
    with tempfile.TemporaryDirectory() as directory:
        bag = Path(directory) / 'reaching'
        with BagWriter(bag) as writer:
            for stamp_ns, topic, message in messages():
                writer.write(topic, message, stamp_ns)
        (made,) = bag.glob('*.mcap')
        file.write_bytes(made.read_bytes())


def write_tables(directory: Path) -> None:
    """Write recordings.csv, obstacles.csv and goals.csv of two movements of the packaged recording."""
    with BagReader(PACKAGED) as reader:
        hand = build_hand_trajectory([decode_hand_sample(item.message, 'xy') for item in reader if item.role == HAND])
    spans = hand.find_movements()
    samples = []
    for name, number in zip('ab', MOVEMENTS, strict=True):
        begin_ns, end_ns = spans[number][0] - LEAD_NS, spans[number][1]
        rows = hand.between(begin_ns, end_ns)
        for stamp, (x, y) in list(zip(hand.stamps_ns[rows], hand.positions[rows], strict=True))[::EVERY]:
            samples.append((name, f'{(stamp - begin_ns) / NANOSECONDS:.3f}', f'{x:.4f}', f'{y:.4f}'))
    obstacles = [
        (str(name), *(f'{value:.4f}' for value in (x, y, radius, stddev, *box)))
        for x, y, _, radius, stddev, name, *box in OBSTACLES
    ]
    columns = 'id', 'x_m', 'y_m', 'radius_m', 'radius_stddev_m', 'size_x_m', 'size_y_m', 'yaw_rad'
    tables: dict[str, Sequence[Sequence[str]]] = {
        'recordings': [('recording', 't_s', 'x_m', 'y_m'), *samples],
        'obstacles': [columns, *obstacles],
        'goals': [('x_m', 'y_m'), *([f'{value:.4f}' for value in goal] for goal in FAR)],
    }
    for name, table in tables.items():
        with (directory / f'{name}.csv').open('w', newline='', encoding='utf-8') as stream:
            csv.writer(stream, lineterminator='\n').writerows(table)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Make recordings of simulated hands.')
    parser.add_argument('what', choices=('packaged', 'tables'))
    if parser.parse_args().what == 'packaged':
        write_recording(PACKAGED)
    else:
        write_tables(ROOT / 'doc' / 'examples')
