"""The simulated reaches of doc/calibration.md: read by `evaluate`, each ends beside its own goal."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np

from foc_ros.evaluation.path import reached
from foc_ros.evaluation.recordings import find_recordings

SCRIPT = Path(__file__).parents[1] / 'scripts' / 'make_reaches.py'


def test_every_reach_waits_and_ends_beside_its_goal(tmp_path: Path) -> None:
    found = importlib.util.spec_from_file_location('make_reaches', SCRIPT)
    assert found is not None and found.loader is not None
    script = importlib.util.module_from_spec(found)
    found.loader.exec_module(script)
    script.main(tmp_path, 2)
    recordings = find_recordings(tmp_path)
    assert len(recordings) == script.COUNT
    for number, recording in enumerate(recordings.values()):
        path = np.array([[row.number('x_m'), row.number('y_m')] for row in recording.rows])
        assert reached(path, recording.goals[:, :2])[0] == number % len(recording.goals)
        assert np.ptp(path[: int(0.04 * script.RATE_HZ)], axis=0).max() < 10.0 * script.NOISE_M
