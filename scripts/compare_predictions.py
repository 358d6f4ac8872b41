"""Check that a change leaves the predictions as they were: `record` replays before and after the change, and `compare` them.

    python scripts/compare_predictions.py record BEFORE BAG... [OPTIONS]
    python scripts/compare_predictions.py record AFTER BAG... [OPTIONS]
    python scripts/compare_predictions.py compare BEFORE AFTER [--tolerance 1e-9]

Each recording is replayed by `foc_ros replay BAG --json OPTIONS` in a process of its own. BAG may also be a folder of bags.
The difference of two numbers is relative to the largest number of their kind in a candidate, or to 1 if that is larger. Labels,
statuses and the most likely class have to be equal.
"""

from __future__ import annotations

import argparse
import gzip
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

NUMBERS = ('mean', 'stddev', 'effort', 'cost', 'eta', 'likelihood')
MAX_PRINTED = 20


def record(folder: Path, bags: list[Path], options: list[str]) -> None:
    """Replay every bag and write the compressed answer into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    found = [bag for path in bags for bag in ([path] if _is_bag(path) else sorted(filter(_is_bag, path.iterdir())))]
    for bag in found:
        command = [sys.executable, '-m', 'foc_ros', 'replay', str(bag), '--json', *options]
        result = subprocess.run(command, capture_output=True, check=False)
        if result.returncode not in (0, 3):
            raise SystemExit(f'{bag}: {result.stderr.decode()}')
        (folder / f'{bag.stem}.json.gz').write_bytes(gzip.compress(result.stdout))
        print(bag, file=sys.stderr)


def _is_bag(path: Path) -> bool:
    return path.suffix in ('.mcap', '.db3') or (path / 'metadata.yaml').exists()


class Comparison:
    """Differences between recorded predictions: counts, the largest relative difference of each number, and texts."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.counts = Counter[str]()
        self.largest = dict.fromkeys(NUMBERS, 0.0)
        self.differences: list[str] = []

    def compare_recordings(self, name: str, before: list[dict[str, Any]], after: list[dict[str, Any]]) -> None:
        """Compare the predictions of one recording."""
        if [each['stamp_ns'] for each in before] != [each['stamp_ns'] for each in after]:
            self.differences.append(f'{name}: other stamps')
        for one, other in zip(before, after, strict=False):
            self.counts['predictions'] += 1
            where = f'{name} at {one["stamp_ns"]} ns'
            self.differences += [f'{where}: {text}' for text in self._compare_predictions(one, other)]

    def _compare_predictions(self, one: dict[str, Any], other: dict[str, Any]) -> list[str]:
        """Return the differences between two predictions."""
        texts = []
        if one['most_likely'] != other['most_likely']:
            texts.append(f'most likely {one["most_likely"]} and {other["most_likely"]}')
        first, second = ({each['label']: each for each in prediction['candidates']} for prediction in (one, other))
        if first.keys() != second.keys():
            texts.append(f'labels {sorted(first)} and {sorted(second)}')
        for label in first.keys() & second.keys():
            self.counts['candidates'] += 1
            texts += [f'{label}: {text}' for text in self._compare_candidates(first[label], second[label])]
        return texts

    def _compare_candidates(self, one: dict[str, Any], other: dict[str, Any]) -> list[str]:
        """Return the differences between two candidates."""
        if one['status'] != other['status']:
            return [f'{one["status"]} and {other["status"]}']
        texts = []
        for name in NUMBERS:
            a, b = np.array(one[name], dtype=float), np.array(other[name], dtype=float)
            difference = float(np.abs(a - b).max() / max(1.0, np.abs(a).max()))
            self.largest[name] = max(self.largest[name], difference)
            if not difference <= self.tolerance:
                texts.append(f'{name} by {difference:.2g}')
        return texts


def compare(before: Path, after: Path, tolerance: float) -> int:
    """Print the differences between the answers in two folders; return 1 if there are any above the tolerance."""
    comparison = Comparison(tolerance)
    names = sorted({file.name for folder in (before, after) for file in folder.glob('*.json.gz')})
    for name in names:
        if not (before / name).exists() or not (after / name).exists():
            comparison.differences.append(f'{name}: in one folder only')
            continue
        one, other = (json.loads(gzip.decompress((folder / name).read_bytes()))['predictions'] for folder in (before, after))
        comparison.compare_recordings(name, one, other)
    counts, differences = comparison.counts, comparison.differences
    print(f'{len(names)} recordings, {counts["predictions"]} predictions, {counts["candidates"]} candidates')
    print('largest relative differences: ' + ', '.join(f'{name} {value:.2g}' for name, value in comparison.largest.items()))
    print(f'{len(differences)} differences above {tolerance:g} or in words')
    for text in differences[:MAX_PRINTED]:
        print(f'  {text}')
    return 1 if differences else 0


def main() -> int:
    """Record or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest='command', required=True)
    recording = commands.add_parser('record')
    recording.add_argument('folder', type=Path)
    recording.add_argument('bags', type=Path, nargs='+')
    comparing = commands.add_parser('compare')
    comparing.add_argument('before', type=Path)
    comparing.add_argument('after', type=Path)
    comparing.add_argument('--tolerance', type=float, default=1e-9)
    arguments, options = parser.parse_known_args()
    if arguments.command == 'compare':
        return compare(arguments.before, arguments.after, arguments.tolerance)
    record(arguments.folder, arguments.bags, options)
    return 0


if __name__ == '__main__':
    sys.exit(main())
