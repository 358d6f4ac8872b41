#!/usr/bin/env python3
"""Measure `foc_ros play` in a headless Chromium: frames per second, and the time from a pointer event to the drawn prediction.

    python scripts/measure_play.py [--scene rows|grid] [--seconds 20] [--budget 0.01]

The scene has 16 obstacles. Up to 8 ways are followed, and those that were followed before; their mean number is printed.
Synthetic pointer events move the hand to and fro. The page measures both numbers: frames by the times of the browser, and the
delay from the time stamp of an event until the prediction for the hand that it moved has been drawn, of the last 200 predictions.
Chromium, its driver and selenium are needed, as for the tests.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from browser_helpers import chromium  # type: ignore[import-not-found]
from play_helpers import play, steer, visit, wait_for  # type: ignore[import-not-found]

from foc_ros.core.config import Config
from foc_ros.ros.parameters import dump_parameter_file

WAYS, OBSTACLES = 8, 16
SCENES = {
    'grid': """
for (let row = 0; row < 16; row += 1) {
  const [x, y] = [0.1 + 0.05 * (row % 4), 0.066 * Math.floor(row / 4) - 0.1 + 0.016 * (row % 2)];
  obstacles.push({ kind: row % 4 ? 'circle' : 'box', x, y,
    ...(row % 4 ? { radius: 0.01 } : { size_x: 0.02, size_y: 0.014, yaw: 0.3 }) });
}
""",
    'rows': """
for (let row = 0; row < 16; row += 1) {
  const [x, y] = [0.15 + 0.1 * (row % 2), 0.05 * (Math.floor(row / 2) - 3.5) + 0.025 * (row % 2)];
  obstacles.push({ kind: 'circle', x, y, radius: 0.01 });
}
""",
}
"""Obstacles: four rows of boxes and posts close together, or two rows of posts."""
TURNS = ((0.05, 0.03), (0.0, -0.03))
"""Points between which the hand moves, before the obstacles [m]."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition('\n')[0])
    parser.add_argument('--seconds', type=float, default=20.0, help='time to measure (default: %(default)s)')
    words = 'budget_s of the predictions [s] (default: %(default)s)'
    parser.add_argument('--budget', type=float, default=Config().budget_s, help=words)
    parser.add_argument('--scene', choices=SCENES, default='rows', help='arrangement of the obstacles (default: %(default)s)')
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / 'foc.yaml'
        file.write_text(
            dump_parameter_file(Config(budget_s=given.budget).with_values({'homotopy.max_candidates': WAYS})), encoding='utf-8'
        )
        with play(folder, '--params', str(file)) as started, chromium(folder / 'profile') as browser:
            visit(browser, started)
            scene = f'const obstacles = []; {SCENES[given.scene]} play.setScene({{ obstacles, goals: play.view.scene.goals }});'
            browser.execute_script(scene)
            wait_for(browser, f'play.view.scene.obstacles.length === {OBSTACLES} && play.view.candidates.length > 1', 'ways')
            start = 'play.measured.delays.length = 0; return [performance.now(), play.measured.predictions]'
            begun = browser.execute_script(start)
            frames, ways = [], []
            while (now := browser.execute_script('return performance.now()')) < begun[0] + 1e3 * given.seconds:
                seen = steer(browser, *TURNS)
                ways += [len(candidates) for _, candidates in seen]
                frames.append(browser.execute_script('return play.measured.fps'))
            measured = browser.execute_script('return play.measured')
        delays = np.percentile(measured['delays'], [50, 90, 99])
        rate = (measured['predictions'] - begun[1]) / (now - begun[0]) * 1e3
        print(f'frames per second: {np.median(frames):.1f} (median), {min(frames):.1f} (least), over 2 s each')
        print('from pointer event to drawn prediction: {:.0f} ms (median), {:.0f} ms (90 %), {:.0f} ms (99 %)'.format(*delays))
        print(f'{rate:.0f} predictions per second, {np.mean(ways):.1f} ways on average, {OBSTACLES} obstacles')


if __name__ == '__main__':
    main()
