# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated reaches of doc/calibrate.md: `evaluate` reads them, and each ends near its own goal."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from foc_ros.analysis.recordings import find_recordings
from foc_ros.core.learning.movements import find_reached_goal

sys.path.append(str(Path(__file__).resolve().parents[1] / 'scripts'))

recordings_script = importlib.import_module('recordings')


@pytest.mark.parametrize(('kind', 'noise_m', 'largest_m'), [('grid', 5e-4, 0.03), ('star', 3e-4, 0.015)])
def test_every_reach_begins_at_rest_and_ends_near_its_goal(kind: str, noise_m: float, largest_m: float, tmp_path: Path) -> None:
    recordings_script.write_reaches(tmp_path, 2, kind)
    recordings = find_recordings(tmp_path)
    assert len(recordings) == recordings_script.COUNT
    for number, recording in enumerate(recordings.values()):
        path = recording.read_movement().positions[:, :2]
        assert find_reached_goal(path, recording.scene.goals[:, :2])[0] == number % len(recording.scene.goals)
        assert np.ptp(path[:4], axis=0).max() < 10.0 * noise_m
        distance = np.hypot(*(path[-20:].mean(axis=0) - recording.scene.goals[number % len(recording.scene.goals), :2]))
        assert noise_m / 10.0 < distance < largest_m
