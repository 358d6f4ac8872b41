"""Stops of a working node at random times, by SIGTERM and SIGINT: `python scripts/stops.py --count 100`.

Every node receives inputs and a signal at a time up to SPREAD_S after it installed its handlers. The exit code is 0 if all nodes
ended with exit code 0 and without a traceback.
"""

from __future__ import annotations

import argparse
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from soak import Player, isolated_graph

SPREAD_S = 2.0
LIMIT_S = 30.0


def has_handler(process: subprocess.Popen[str], number: int) -> bool:
    """Return whether a process has a handler for a signal; before that, the interpreter is still starting."""
    lines = Path(f'/proc/{process.pid}/status').read_text('ascii').splitlines()
    mask = next(int(line.split()[1], 16) for line in lines if line.startswith('SigCgt'))
    return bool(mask >> (number - 1) & 1)


def stop_one_node(player: Player, number: signal.Signals, after_s: float) -> str | None:
    """Start a node and stop it; return what went wrong, None if nothing did."""
    command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', '-p', 'foc.steps:=20', '-p', 'homotopy.max_candidates:=2']
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        start_s = time.monotonic()
        while not has_handler(process, signal.SIGTERM):
            time.sleep(0.005)
            if time.monotonic() - start_s > LIMIT_S:
                process.kill()
                return 'did not start'
        stop_s = time.monotonic() + after_s
        while time.monotonic() < stop_s:
            player.tick()
        process.send_signal(number)
        try:
            _, errors = process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            return f'{number.name} after {after_s:.2f} s: did not end'
    has_failed = process.returncode != 0 or 'Traceback' in errors
    return f'{number.name} after {after_s:.2f} s: exit code {process.returncode}, {errors.strip()[-400:]}' if has_failed else None


def main() -> int:
    """Stop `count` nodes by each signal and print how they ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument('--count', type=int, default=100, help='stops by each signal (default: %(default)s)')
    count, generator, failures = parser.parse_args().count, random.Random(0), 0
    with isolated_graph(), Player() as player:
        for turn in range(count):
            for number in (signal.SIGTERM, signal.SIGINT):
                error = stop_one_node(player, number, generator.uniform(0.0, SPREAD_S))
                failures += error is not None
                if error is not None or (turn + 1) % 10 == 0:
                    print(f'{number.name} {turn + 1} of {count}: {error or "no error"}', flush=True)
    print(f'{2 * count - failures} of {2 * count} stops with exit code 0 and no traceback')
    return min(failures, 1)


if __name__ == '__main__':
    sys.exit(main())
