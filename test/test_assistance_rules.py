# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The assistance rules of others: cases with known answers, limits of force and slew, and the study that compares them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from assistance_rules import (
    ASSISTANCE_N,
    FULL_FORCE_M,
    INFLUENCE_M,
    RIVALS,
    compute_field_force,
)
from test_simulation import QUICK

from foc_ros.analysis.simulation import NOISY
from foc_ros.analysis.simulation.operators import DT, draw_task
from foc_ros.analysis.simulation.study import run_trial
from foc_ros.core.obstacle_table import make_obstacles

STUDY = Path(__file__).parents[1] / 'benchmarks' / 'assistance.py'
POST = make_obstacles([(0.0, 0.0)], [0.02])


def test_the_potential_field_pushes_outward_within_its_influence_only() -> None:
    at = lambda rho: compute_field_force(np.array([0.02 + rho, 0.0]), POST, 100.0)  # noqa: E731
    assert at(FULL_FORCE_M) == pytest.approx([ASSISTANCE_N, 0.0])
    assert at(INFLUENCE_M + 1e-6).tolist() == [0.0, 0.0]
    assert compute_field_force(np.array([0.0, -0.0201]), POST, 3.0) == pytest.approx([0.0, -3.0])
    # the force is minus the gradient of the potential, eta / 2 (1 / rho - 1 / rho_0)^2
    rho, step = 0.012, 1e-7
    eta = ASSISTANCE_N * FULL_FORCE_M**2 / (1 / FULL_FORCE_M - 1 / INFLUENCE_M)
    potential = lambda rho: 0.5 * eta * (1 / rho - 1 / INFLUENCE_M) ** 2  # noqa: E731
    assert at(rho)[0] == pytest.approx(-(potential(rho + step) - potential(rho - step)) / (2 * step), rel=1e-5)


@pytest.mark.parametrize('rule', RIVALS)
def test_every_rule_keeps_force_and_slew_within_the_limits(rule: str) -> None:
    task = draw_task(NOISY, np.random.default_rng(2))
    noise = np.random.default_rng(3).normal(size=(900, 2, 2))
    trial = run_trial(task, RIVALS[rule], QUICK, noise)
    sizes = np.hypot(*trial.assistance.T)
    assert 0.0 < sizes.max() <= QUICK.guidance.f_max + 1e-9
    assert np.hypot(*np.diff(trial.assistance, axis=0).T).max() <= QUICK.guidance.slew * DT + 1e-9


def run_study(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(STUDY), '--trials', '1', '--workers', '1', *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)


def test_the_study_prints_the_cells_of_simulate() -> None:
    done = run_study('--operators', 'noisy', '--assistance', 'blend,potential_field', '--json')
    assert done.returncode == 0, done.stderr
    cells = json.loads(done.stdout)['cells']
    assert [(cell['operator'], cell['assistance']) for cell in cells] == [
        ('noisy', rule) for rule in ('none', 'blend', 'potential_field')
    ]
    assert all(low <= cell['effort'] <= high for cell in cells for low, high in [cell['effort_interval']])


def test_the_study_refuses_an_unknown_rule() -> None:
    done = run_study('--assistance', 'magic')
    assert done.returncode == 2
    assert '--assistance: expected names of none, foc, hindsight, blend, potential_field, got magic' in done.stderr
