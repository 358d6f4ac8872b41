"""A live node in scenes that are hard to predict in: `python scripts/hostile.py --seconds 6`.

For each scene and strategy a node in its own process receives poses at 100 Hz. The exit code is 0 if in each of them

- the longest gap between two diagnostics is below GAP_S, and the longest answer of `~/engage` below ANSWER_S,
- no prediction is published later than `estimator.hand_timeout_s` after the stamp of its pose,
- PUNCTUAL of the predictions are computed within `budget_s` and 2 ms,
- the memory does not grow after the first third, and the node has no internal error and stops without one.

Other programs of the machine lengthen all times: run it alone.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from soak import GROWTH, Player, isolated_graph, measure_process

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS, Array

STRATEGIES = ('lv', 'hc', 'optimal')
GAP_S, ANSWER_S, PUNCTUAL = 1.3, 0.05, 0.999
ASK_EVERY = 10
"""Number of periods between two calls of the service."""
START_S = 120.0
"""Time within which a node has to start [s]."""


def scatter(count: int, radius: float, low: tuple[float, float], high: tuple[float, float]) -> list[tuple[float, ...]]:
    """Return circles whose centres are uniformly distributed in a rectangle, always the same."""
    centres = np.random.default_rng(0).uniform(low, high, (count, 2)).tolist()
    return [(x, y, 0.0, radius, 0.001, number) for number, (x, y) in enumerate(centres)]


@dataclass(frozen=True)
class Case:
    """A scene, the hand moving from (0, 0) to (0.3, 0) m and back, and parameters of the node besides the strategy."""

    rows: list[tuple[float, ...]]
    goals: Array = field(default_factory=lambda: np.array([[0.3, 0.0, 0.0]]))
    parameters: Mapping[str, object] = field(default_factory=dict)


MANY_GOALS = np.array([[0.3 + 0.02 * (i // 8), 0.03 * (i % 8 - 3.5), 0.0] for i in range(64)])
CASES = {
    '32 on the hand': Case(scatter(32, 0.03, (-0.02, -0.02), (0.02, 0.02))),
    '64 on the hand': Case(scatter(64, 0.03, (-0.02, -0.02), (0.02, 0.02))),
    'crowd of 60 %': Case(scatter(66, 0.02, (0.0, -0.15), (0.3, 0.15))),
    '256 near': Case(scatter(256, 0.004, (0.02, -0.1), (0.28, 0.1)), parameters={'scene.max_obstacles': 256}),
    'K = 64': Case(scatter(12, 0.012, (0.05, -0.08), (0.25, 0.08)), parameters={'homotopy.max_candidates': 64}),
    'N = 400': Case(scatter(6, 0.015, (0.05, -0.06), (0.25, 0.06)), parameters={'foc.steps': 400}),
    '64 goals x 64': Case(scatter(64, 0.006, (0.03, -0.1), (0.27, 0.1)), MANY_GOALS, {'homotopy.max_candidates': 64}),
}


class Watcher(Player):
    """A player that measures. Attributes: gap_s, answer_s, age_s: the longest gap, answer and age of a prediction, so far."""

    def __init__(self, case: Case) -> None:
        super().__init__(case.rows, case.goals)
        self.gap_s = self.answer_s = self.age_s = 0.0
        self._heard_s: float | None = None
        self._asked_s: float | None = None

    def forget(self) -> None:
        """Forget the times that were measured while the node started."""
        self.gap_s = self.answer_s = self.age_s = 0.0

    def tick(self, *, faulty: bool = False) -> None:
        """Publish the messages of one period, and ask the service if it has answered."""
        from std_srvs.srv import SetBool

        if self._asked_s is None and self._turn % ASK_EVERY == 0 and self._engage.service_is_ready():
            self._asked_s = time.monotonic()
            self._engage.call_async(SetBool.Request(data=True)).add_done_callback(self._note_answer)
        super().tick(faulty=faulty)

    def end(self) -> None:
        """Count the waiting times that have not ended."""
        now_s = time.monotonic()
        self.gap_s = max(self.gap_s, now_s - (self._heard_s or now_s))
        self.answer_s = max(self.answer_s, now_s - (self._asked_s or now_s))

    def _note_answer(self, _: object) -> None:
        assert self._asked_s is not None
        self.answer_s, self._asked_s = max(self.answer_s, time.monotonic() - self._asked_s), None

    def _receive_prediction(self, cloud: Any, information: Mapping[str, int]) -> None:  # type: ignore[override]
        super()._receive_prediction(cloud)
        stamp_ns = cloud.header.stamp.sec * NANOSECONDS + cloud.header.stamp.nanosec
        self.age_s = max(self.age_s, (information['source_timestamp'] - stamp_ns) / NANOSECONDS)

    def _receive_health(self, array: Any) -> None:
        super()._receive_health(array)
        now_s = time.monotonic()
        self.gap_s, self._heard_s = max(self.gap_s, now_s - (self._heard_s or now_s)), now_s


def count(health: Mapping[str, str], name: str) -> int:
    """Return a count of the diagnostics."""
    return int(health.get(f'count {name}', 0))


def measure(case: Case, strategy: str, seconds: float) -> dict[str, float]:
    """Run a node in a scene for some seconds and return what was measured."""
    parameters = {'foc.strategy': strategy, **case.parameters}
    options = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', *options]
    with Watcher(case) as watcher, subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        began = time.monotonic()
        while count(watcher.health, 'predictions') == 0 and time.monotonic() - began < START_S and process.poll() is None:
            watcher.tick()
        watcher.forget()
        before, began, memory = dict(watcher.health), time.monotonic(), 0.0
        while time.monotonic() - began < seconds:
            watcher.tick()
            if memory == 0.0 and time.monotonic() - began > seconds / 3.0:
                memory = measure_process(process.pid)['memory']
        watcher.end()
        grown = measure_process(process.pid)['memory'] / memory
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=30)
    made = count(watcher.health, 'predictions') + count(watcher.health, 'predict_too_late')
    over = count(watcher.health, 'predict_over_budget') - count(before, 'predict_over_budget')
    made -= count(before, 'predictions') + count(before, 'predict_too_late')
    p50, _, p99 = watcher.health['solve time p50, p99 [ms]'].partition(', ')
    return {
        'made': made,
        'p50 [ms]': float(p50 if p99 else 'nan'),
        'p99 [ms]': float(p99 or 'nan'),
        'over': over,
        'gap [s]': watcher.gap_s,
        'answer [s]': watcher.answer_s,
        'age [s]': watcher.age_s,
        'memory': grown,
        'errors': count(watcher.health, 'internal_errors') + (process.returncode != 0 or 'Traceback' in errors),
    }


def find_failures(row: Mapping[str, float]) -> list[str]:
    """Return the names of the values of a row that are beyond their limits."""
    limits = {
        'gap [s]': GAP_S,
        'answer [s]': ANSWER_S,
        'age [s]': Config().estimator.hand_timeout_s,
        'over': (1.0 - PUNCTUAL) * row['made'],
        'memory': GROWTH,
        'errors': 0,
    }
    return [name for name, limit in limits.items() if not row[name] <= limit] + ['made'] * (row['made'] == 0)


def main() -> int:
    """Run a node in every scene with every strategy and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument('--seconds', type=float, default=6.0, help='duration of each run (default: %(default)s)')
    parser.add_argument('--only', choices=CASES, action='append', help='one scene; may be repeated')
    parser.add_argument('--strategy', choices=STRATEGIES, action='append', help='one strategy; may be repeated')
    arguments, failed = parser.parse_args(), 0
    with isolated_graph():
        for name in arguments.only or CASES:
            for strategy in arguments.strategy or STRATEGIES:
                row = measure(CASES[name], strategy, arguments.seconds)
                failures = find_failures(row)
                failed += bool(failures)
                values = '  '.join(f'{key} {value:.4g}' for key, value in row.items())
                print(f'{name:15} {strategy:8} {values}  {"FAILS: " + ", ".join(failures) if failures else "holds"}', flush=True)
    return min(failed, 1)


if __name__ == '__main__':
    sys.exit(main())
