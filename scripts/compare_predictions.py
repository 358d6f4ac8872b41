"""Whether a change leaves predictions as they were: `record` the answers of replays before it, `compare` them after it.

    python scripts/compare_predictions.py record BEFORE BAG...
    python scripts/compare_predictions.py record AFTER BAG...
    python scripts/compare_predictions.py compare BEFORE AFTER [--tolerance 1e-9]

Each recording is replayed by `foc_ros replay BAG --json` in a process of its own; BAG may also be a folder of bags. Numbers are
compared relative to the largest one of their kind in a candidate, or to 1 if that is less. Labels, statuses and the most likely
class have to agree.
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
MOST_SHOWN = 20


def record(folder: Path, bags: list[Path], options: list[str]) -> None:
    """Replay every bag and keep its answer in the folder, compressed."""
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


def compare(before: Path, after: Path, tolerance: float) -> int:
    """Print how far the answers in two folders differ; return 1 if more than the tolerance, or in any word."""
    names = sorted({file.name for folder in (before, after) for file in folder.glob('*.json.gz')})
    counts, largest, differences = Counter[str](), dict.fromkeys(NUMBERS, 0.0), list[str]()
    for name in names:
        if not (before / name).exists() or not (after / name).exists():
            differences.append(f'{name}: in one folder only')
            continue
        one, other = (json.loads(gzip.decompress((folder / name).read_bytes()))['predictions'] for folder in (before, after))
        if [each['stamp_ns'] for each in one] != [each['stamp_ns'] for each in other]:
            differences.append(f'{name}: other stamps')
        for first, second in zip(one, other, strict=False):
            counts['predictions'] += 1
            where = f'{name} at {first["stamp_ns"]} ns'
            differences += [f'{where}: {words}' for words in _differences(first, second, tolerance, largest, counts)]
    print(f'{len(names)} recordings, {counts["predictions"]} predictions, {counts["candidates"]} candidates')
    print('largest relative differences: ' + ', '.join(f'{name} {value:.2g}' for name, value in largest.items()))
    print(f'{len(differences)} differences above {tolerance:g} or in words')
    for words in differences[:MOST_SHOWN]:
        print(f'  {words}')
    return 1 if differences else 0


def _differences(
    one: dict[str, Any], other: dict[str, Any], tolerance: float, largest: dict[str, float], counts: Counter[str]
) -> list[str]:
    """Return in words what differs between two predictions, and keep the largest differences of numbers."""
    candidates = [{each['label']: each for each in prediction['candidates']} for prediction in (one, other)]
    words = []
    if one['most_likely'] != other['most_likely']:
        words.append(f'most likely {one["most_likely"]} and {other["most_likely"]}')
    if candidates[0].keys() != candidates[1].keys():
        words.append(f'labels {sorted(candidates[0])} and {sorted(candidates[1])}')
    for label in candidates[0].keys() & candidates[1].keys():
        counts['candidates'] += 1
        first, second = candidates[0][label], candidates[1][label]
        if first['status'] != second['status']:
            words.append(f'{label}: {first["status"]} and {second["status"]}')
            continue
        for name in NUMBERS:
            a, b = np.array(first[name], dtype=float), np.array(second[name], dtype=float)
            difference = float(np.abs(a - b).max() / max(1.0, np.abs(a).max()))
            largest[name] = max(largest[name], difference)
            if not difference <= tolerance:
                words.append(f'{label}: {name} by {difference:.2g}')
    return words


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
