#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measure how steady predictions are from tick to tick, on recordings at 100 Hz, with measurement noise.

    python scripts/flicker.py [DATA ...] [--strategy NAME ...] [--noise M ...] [--set NAME=VALUE ...] [--most N]

DATA: bags, or folders as `foc_ros evaluate` reads them; by default the packaged recording, and D3IL and HLP where they are beside
the checkout. Of a folder with more than N recordings, N are used. Positions come at 100 Hz by cubic interpolation, and
predictions at 50 Hz. Ticks across a change of the scene are left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
import yaml
from page import ROOT, SHARED, format_table
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from foc_ros.analysis.recordings import Recording, find_recordings
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import TYPESTORE, Item
from foc_ros.io.topics import HAND
from foc_ros.ros.messages.decode_poses import decode_stamp
from foc_ros.ros.messages.encode_inputs import encode_hand_pose
from foc_ros.ros.messages.types import RosbagsTypes

DEMO = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'
RATE_HZ = 100.0
STRATEGIES, NOISE_M = ('lv', 'hc', 'optimal'), (0.0, 0.0005, 0.001)
TYPES = RosbagsTypes(TYPESTORE)
CHANGE = 0.15
"""Change of a likelihood from one tick to the next that counts."""
SHORT_TICKS, LONGEST_S = 5, 0.05
"""Absences of fewer ticks count. Ticks farther apart than LONGEST_S are not compared."""
FINE = 100
"""Points for each step of a path, less than 0.2 mm apart, from which distances are measured."""


@dataclass
class Steadiness:
    """What happened over the ticks of several recordings.

    ticks: pairs of predictions that were compared; changed: those in which a likelihood changed by more than CHANGE; absences: of
    a class, shorter than SHORT_TICKS; sideways: move of each mean path [m].
    """

    ticks: int = 0
    changed: int = 0
    absences: int = 0
    sideways: list[float] = field(default_factory=list)

    def summarise(self) -> list[str]:
        """Return the cells under HEAD."""
        percentile, largest = (1e3 * float(np.percentile(self.sideways or [0.0], each)) for each in (95.0, 100.0))
        changed = f'{1e3 * self.changed / max(self.ticks, 1):.2f}'
        return [str(self.ticks), changed, str(self.absences), f'{percentile:.1f}', f'{largest:.1f}']


HEAD = (
    'ticks',
    f'changes above {CHANGE:g} [1 in 1,000]',
    f'absences under {SHORT_TICKS} ticks',
    'sideways 95 % [mm]',
    'largest [mm]',
)


def measure_steadiness(predictions: Iterable[Prediction], total: Steadiness) -> None:
    """Add the ticks of one recording to a total, with classes by their numbers. A change of goals or obstacles begins anew."""
    before: Prediction | None = None
    last: dict[int, PredictedCandidate] = {}
    seen: dict[int, int] = {}  # the last tick of each class
    for tick, now in enumerate(predictions):
        found = {each.way: each for each in now.candidates_with_likelihood}
        if before is None or not _is_same_scene(before, now):
            seen = {}
        else:
            total.ticks += 1
            total.absences += sum(1 < tick - seen.get(way, -SHORT_TICKS) <= SHORT_TICKS for way in found)
            shares = [{way: each.likelihood for way, each in table.items()} for table in (last, found)]
            total.changed += any(abs(shares[0].get(way, 0.0) - shares[1].get(way, 0.0)) > CHANGE for way in last | found)
            total.sideways += [compute_sideways_move(last[each], found[each]) for each in last.keys() & found.keys()]
        before, last = now, found
        seen |= dict.fromkeys(found, tick)


def _is_same_scene(before: Prediction, now: Prediction) -> bool:
    return (
        now.t - before.t <= LONGEST_S
        and np.array_equal(before.goal_positions, now.goal_positions)
        and before.obstacles.ids == now.obstacles.ids
        and np.array_equal(before.obstacles.centre, now.obstacles.centre)
    )


def compute_sideways_move(before: PredictedCandidate, now: PredictedCandidate) -> float:
    """Return the largest distance [m] of a mean path from that of the tick before, perpendicular to the latter."""
    line = before.position_at(np.linspace(0.0, before.times[-1], FINE * (len(before.times) - 1) + 1))
    return float(KDTree(line).query(now.solution.path)[0].max())


def resample(recording: Recording, stddev: float, seed: int) -> list[Item]:
    """Return the messages of a recording with the hand at RATE_HZ, by cubic interpolation, with Gaussian noise [m] in x and y."""
    items = list(recording.items())
    poses = {decode_stamp(each.message.header): each for each in items if each.role == HAND}
    known, first = np.array(sorted(poses)), poses[min(poses)]
    points = [poses[stamp_ns].message.pose.position for stamp_ns in known.tolist()]
    stamps = np.arange(known[0], known[-1] + 1, round(NANOSECONDS / RATE_HZ))
    positions = CubicSpline(known - known[0], [(each.x, each.y, each.z) for each in points])(stamps - known[0])
    positions[:, :2] += np.random.default_rng(seed).normal(0.0, stddev, (len(stamps), 2))
    frame_id, late_ns = first.message.header.frame_id, first.log_ns - int(known[0])
    hand = [
        Item(HAND, first.topic, stamp_ns + late_ns, encode_hand_pose(TYPES, stamp_ns, frame_id, position), b'')
        for stamp_ns, position in zip(stamps.tolist(), positions.tolist(), strict=True)
    ]
    return sorted([*(each for each in items if each.role != HAND), *hand], key=lambda each: each.log_ns)


def measure(recordings: Sequence[Recording], strategy: str, noise: float, config: Config) -> Steadiness:
    """Predict recordings with noise [m] on the measured positions; each has its own seed."""
    total, config = Steadiness(), config.with_values({'foc.strategy': strategy})
    for seed, recording in enumerate(recordings):
        steps = Replay(config).steps(resample(recording, noise, seed))
        measure_steadiness((each.prediction for each in steps if each.prediction is not None), total)
    return total


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the data sets of the command line, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data', nargs='*', type=Path, help='bags or folders')
    parser.add_argument('--set', action='append', default=[], metavar='NAME=VALUE', help='a parameter')
    parser.add_argument('--strategy', nargs='+', default=STRATEGIES, metavar='NAME')
    parser.add_argument('--most', type=int, default=16, metavar='N', help='recordings of a folder, evenly chosen (default: 16)')
    parser.add_argument('--noise', nargs='+', type=float, default=NOISE_M, metavar='M', help='standard deviations [m]')
    chosen = parser.parse_args(arguments)
    config = Config().with_values({name: yaml.safe_load(text) for name, _, text in (each.partition('=') for each in chosen.set)})
    print(config)
    print(format_table(('data', 'strategy', 'noise [mm]', *HEAD), ()), flush=True)
    paths = chosen.data or [DEMO, *(SHARED / name for name in ('d3il_avoiding', 'hlp_reaching') if (SHARED / name).exists())]
    for path, strategy, noise in product(paths, chosen.strategy, chosen.noise):
        found = list(find_recordings(path).values())
        every = max(len(found) // chosen.most, 1)
        measured = measure(found[::every][: chosen.most], strategy, noise, config)
        row = path.stem, f'`{strategy}`', f'{1e3 * noise:g}', *measured.summarise()
        print(format_table(row, ()).partition('\n')[0], flush=True)


if __name__ == '__main__':
    main()
