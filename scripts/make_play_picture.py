#!/usr/bin/env python3
"""Make `doc/images/play.png`: the page of `foc_ros play` in a headless Chromium, with a hand on its way.

    python scripts/make_play_picture.py

Chromium, its driver and selenium are needed, as for the tests.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from browser_helpers import chromium, screenshot  # type: ignore[import-not-found]
from play_helpers import play, steer, visit, wait_for_answer  # type: ignore[import-not-found]

from foc_ros.core.config import Config
from foc_ros.ros.parameters import dump_parameter_file

PICTURE = Path(__file__).resolve().parents[1] / 'doc' / 'images' / 'play.png'


def main() -> None:
    """Steer for a moment and take the picture."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / 'foc.yaml'
        file.write_text(dump_parameter_file(Config(budget_s=0.0)), encoding='utf-8')
        with play(folder, '--params', str(file)) as started, chromium(folder / 'profile') as browser:
            visit(browser, started, 1100, 860)
            steer(browser, (0.0, 0.0))
            steer(browser, (0.06, -0.012), speed=0.15)
            wait_for_answer(browser)
            PICTURE.write_bytes(screenshot(browser))


if __name__ == '__main__':
    main()
