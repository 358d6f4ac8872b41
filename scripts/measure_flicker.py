#!/usr/bin/env python3
"""Measure how steady predictions are, on recordings at 100 Hz, with measurement noise.

    python scripts/measure_flicker.py [DATA ...] [--strategy NAME ...] [--noise M ...] [--set NAME=VALUE ...] [--every N]

DATA: bags, or folders as `foc_ros evaluate` reads them; by default the packaged recording, and D3IL and HLP where they are beside
the checkout. Positions come at 100 Hz by cubic interpolation, and predictions at 50 Hz. Ticks across a change of the scene are
left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from accuracy.data_sets import DataSet, find_data_sets, load_data_set
from accuracy.page import parse_setting, print_table
from accuracy.steadiness import HEAD, Steadiness, measure_steadiness
from accuracy.tracks import predict_track, read_track

from foc_ros.core.config import Config

RATE_HZ = 100.0
STRATEGIES, NOISE_M = ('lv', 'hc', 'optimal'), (0.0, 0.0005, 0.001)


def measure(data: DataSet, strategy: str, noise: float, config: Config) -> Steadiness:
    """Predict all recordings of a data set with noise [m] on the measured positions; each has its own seed."""
    total, config = Steadiness(), config.with_values({'foc.strategy': strategy})
    for seed, recording in enumerate(data.recordings.values()):
        track = read_track(recording).resample(RATE_HZ).add_noise(noise, seed)
        measure_steadiness(predict_track(track, config), total)
    return total


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the data sets of the command line, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data', nargs='*', type=Path, help='bags or folders')
    parser.add_argument('--set', action='append', default=[], type=parse_setting, metavar='NAME=VALUE', help='a parameter')
    parser.add_argument('--strategy', nargs='+', default=STRATEGIES, metavar='NAME')
    parser.add_argument('--noise', nargs='+', type=float, default=NOISE_M, metavar='M', help='standard deviations [m]')
    parser.add_argument('--every', type=int, default=1, metavar='N', help='every n-th recording only')
    chosen = parser.parse_args(arguments)
    config = Config().with_values(dict(chosen.set))
    print(config)
    sets = [load_data_set(path).thin(chosen.every) for path in chosen.data or find_data_sets()]
    rows = (
        [data.name, f'`{strategy}`', f'{1e3 * noise:g}', *measure(data, strategy, noise, config).summarise()]
        for data, strategy, noise in product(sets, chosen.strategy, chosen.noise)
    )
    print_table(('data', 'strategy', 'noise [mm]', *HEAD), rows)


if __name__ == '__main__':
    main()
