"""The study of the steadiness of predictions: what counts as unsteady, on small and made-up input."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foc_ros.analysis.recordings import find_recordings
from foc_ros.core.types import Candidate, PredictedCandidate, Prediction, Solution, Status, make_obstacles

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))

flicker = importlib.import_module('flicker')

STEPS = 20


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


def make_prediction(tick: int, shares: dict[str, float], bows: dict[str, float] | None = None) -> Prediction:
    """Return a prediction 20 ms after the last one, with straight paths of 0.3 m that bow sideways [m]."""
    s, times = np.linspace(0.0, 1.0, STEPS + 1), np.linspace(0.0, 1.0, STEPS + 1)
    candidates = []
    for label, share in shares.items():
        bow = (bows or {}).get(label, 0.0)
        columns = 0.3 * s, bow * np.sin(np.pi * s), np.full_like(times, 0.3), bow * np.pi * np.cos(np.pi * s)
        mean = np.stack((*columns, 0.0 * s, 0.0 * s), axis=1)
        zeros = np.zeros((STEPS + 1, 6, 6)), np.zeros((STEPS, 2))
        solution = Solution(Status.SOLVED, '', 1.0 / STEPS, mean, *zeros, 1.0, {}, 0.0, 0.0, 0.9)
        sides = tuple((each[1:], 1 if each[0] == '+' else -1) for each in label.split(',') if each)
        candidates.append(PredictedCandidate(Candidate(label, 0, sides, mean[:, :2], 0.3), solution, {}, 1.0, share))
    obstacles, goals = make_obstacles([[0.15, 0.0]], 0.03), np.array([[0.3, 0.0]])
    best = max(shares, key=lambda label: shares[label]) if shares else None
    return Prediction(tick * 20_000_000, '', 0.0, tuple(candidates), best, obstacles=obstacles, goal_positions=goals)


def measure(*shares: dict[str, float]) -> flicker.Steadiness:
    total = flicker.Steadiness()
    flicker.measure_steadiness((make_prediction(tick, each) for tick, each in enumerate(shares)), total)
    return total


def test_a_track_is_resampled_and_gets_the_noise_that_was_asked_for(tmp_path: Path) -> None:
    (recording,) = find_recordings(write_reach(tmp_path, 20.0)).values()
    (tmp_path / 'fine').mkdir()
    (fine,) = find_recordings(write_reach(tmp_path / 'fine', 100.0)).values()
    track, true = flicker.read_track(recording).resample(100.0), flicker.read_track(fine)
    assert track.stamps_ns.tolist() == true.stamps_ns[: len(track.stamps_ns)].tolist()
    assert np.abs(track.positions - true.positions[: len(track.positions)]).max() < 1e-3
    noisy = true.add_noise(0.001, 1)
    assert (noisy.positions - true.positions).std() == pytest.approx(0.001, rel=0.1)
    assert np.array_equal(noisy.positions, true.add_noise(0.001, 1).positions)


def test_steadiness_of_a_reach_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(write_reach(tmp_path))
    flicker.main([folder, '--strategy', 'lv', '--noise', '0', '--set', 'foc.steps=20', '--set', 'rate_hz=25'])
    cells = capsys.readouterr().out.splitlines()[-1].strip('| ').split(' | ')
    assert cells[1:3] == ['`lv`', '0']
    assert int(cells[3]) == 24


def test_a_steady_class_counts_nothing() -> None:
    total = measure(*[{'+a': 0.6, '-a': 0.4}] * 20)
    assert (total.ticks, total.changed, total.returns, total.absences) == (19, 0, 0, 0)
    assert max(total.sideways) < 1e-12
    assert total.seconds == pytest.approx(19 * 0.02)


def test_a_change_of_a_likelihood_counts_once_a_tick_and_a_new_name_is_no_change() -> None:
    assert measure({'+a': 0.6, '-a': 0.4}, {'+a': 0.45, '-a': 0.55}, {'+a': 0.45, '-a': 0.55}).changed == 1
    assert measure({'+a': 0.6, '-a': 0.4}, {'+a,-b': 0.6, '-a': 0.4}).changed == 0
    assert measure({'+a': 0.6, '-a': 0.4}, {'+b': 0.6, '-a': 0.4}).changed == 1
    # of two classes that become one, the more likely lives on
    assert measure({'-a': 0.05, '+a': 0.95}, {'': 1.0}).changed == 0


def test_a_lead_that_comes_back_soon_counts_and_a_late_one_does_not() -> None:
    a, b = {'+a': 0.6, '-a': 0.4}, {'+a': 0.4, '-a': 0.6}
    assert measure(a, a, b, b, a, a).returns == 1
    assert measure(a, b, a, b).returns == 2
    assert measure(a, *[b] * 10, a).returns == 0
    assert measure(a, a, b, b).returns == 0


def test_an_absence_of_fewer_than_ten_ticks_counts() -> None:
    both, one = {'+a': 0.9, '-a': 0.1}, {'+a': 1.0}
    assert measure(both, *[one] * 9, both).absences == 1
    assert measure(both, *[one] * 10, both).absences == 0
    assert measure(both, both, one, one).absences == 0


def test_a_path_that_moves_sideways_is_measured() -> None:
    total = flicker.Steadiness()
    bows = [0.0, 0.02, 0.09]
    made = [make_prediction(tick, {'+a': 1.0}, {'+a': bow}) for tick, bow in enumerate(bows)]
    flicker.measure_steadiness(made, total)
    assert total.sideways == pytest.approx([0.02, 0.07], rel=0.02)


def test_a_change_of_the_goals_begins_anew() -> None:
    first, second = make_prediction(0, {'+a': 1.0}), make_prediction(1, {'-a': 1.0})
    total = flicker.Steadiness()
    flicker.measure_steadiness([first, replace(second, goal_positions=np.array([[0.0, 0.3]]))], total)
    assert (total.ticks, total.changed) == (0, 0)
