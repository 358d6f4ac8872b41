# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The study of the steadiness of predictions measures a recording of a reach."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))

flicker = importlib.import_module('flicker')


def write_reach(folder: Path, rate_hz: float = 100.0) -> Path:
    """Write a minimum-jerk reach of 0.4 m in 0.8 s past the left of a box, as tables like those of HLP."""
    times = np.arange(0.0, 1.0, 1.0 / rate_hz)
    s = np.minimum(times / 0.8, 1.0)
    y = 0.4 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    x = -0.08 * np.sin(np.pi * y / 0.4)
    rows = [f'a,{t:.4f},{px:.6f},{py:.6f},0.7' for t, px, py in zip(times, x, y, strict=True)]
    (folder / 'recordings.csv').write_text('\n'.join(['recording,t_s,x_m,y_m,z_m', *rows]))
    scene = ['a,Target,0,0.4,0.7,0.05,0.05,0.1', 'a,ObstacleLong,0.02,0.2,0.7,0.1,0.05,0.1', 'a,LeftBoundary,-0.4,0,0,1,1,1']
    (folder / 'scenes.csv').write_text('\n'.join(['recording,object,x_m,y_m,z_m,width_m,depth_m,height_m', *scene]))
    return folder


def test_steadiness_of_a_reach_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(write_reach(tmp_path))
    flicker.main([folder, '--strategy', 'lv', '--noise', '0', '--set', 'foc.steps=20', '--set', 'rate_hz=25'])
    cells = capsys.readouterr().out.splitlines()[-1].strip('|').split('|')
    assert cells[1:3] == ['`lv`', '0']
    assert int(cells[3]) == 24
