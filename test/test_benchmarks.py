# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program of the benchmark, with a row that compares the package with itself, and the study of steady predictions."""

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path += [str(ROOT / 'benchmarks'), str(ROOT / 'scripts')]

flicker = importlib.import_module('flicker')


def run(*options, **environment):
    command = [sys.executable, str(ROOT / 'benchmarks' / 'run.py'), '--quick', *options]
    return subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)


def test_a_row_reports_times_ratio_and_agreement_or_the_error_of_what_cannot_be_measured(tmp_path):
    (tmp_path / 'casadi.py').write_text("raise ImportError('the peer is missing')\n")
    done = run('--json', '--only', 'far_obstacles', 'cold_circles_ipopt', PYTHONPATH=f'{tmp_path}{os.pathsep}{ROOT}')
    assert done.returncode == 1, done.stderr
    rows = {row['name']: row for row in json.loads(done.stdout)}
    assert list(rows) == ['far_obstacles', 'cold_circles_ipopt']
    row, failed = rows.values()
    assert row['ratio'] == row['peer_ms'] / row['ours_ms'] > 0
    assert row['agree'] is True, row['agreement']
    assert row['repetitions'] > 0
    assert row['details']['solved'] == '4 of 4'
    assert (failed['error'], failed['agree'], failed['ratio']) == ('ImportError: the peer is missing', False, None)


def write_reach(folder, rate_hz=100.0):
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


def test_steadiness_of_a_reach_is_measured(tmp_path, capsys):
    folder = str(write_reach(tmp_path))
    flicker.main([folder, '--strategy', 'lv', '--noise', '0', '--set', 'foc.steps=20', '--set', 'rate_hz=25'])
    cells = capsys.readouterr().out.splitlines()[-1].strip('|').split('|')
    assert cells[1:3] == ['`lv`', '0']
    assert int(cells[3]) == 24
