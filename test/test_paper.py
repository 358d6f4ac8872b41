"""`examples/paper`: trends appear, files are reproducible, and an output that cannot be written is rejected."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

import figures
from checks import check_trends, find_crossings
from paper import perform
from studies import PAPER_ETA, QUICK, EffortCurve, RatioCurve, Studies, compute_speed, measure_solution

from foc_ros import Status

EXAMPLE = Path(__file__).resolve().parents[1] / 'examples' / 'paper'
FILES = {f'study{number}.{suffix}' for number in range(1, 8) for suffix in ('png', 'pdf')} | {'numbers.json', 'table.md'}


@pytest.fixture(scope='module')
def output(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp('paper') / 'new' / 'output'


@pytest.fixture(scope='module')
def found(output: Path) -> Studies:
    """Compute all studies on the coarse grid, from end to end."""
    return perform(output, QUICK)


def ratio(found: Studies, number: int) -> RatioCurve:
    """Return the continuous ratio of a study, solved at every eta."""
    first = found[number].ratios[0]
    for curve in (first.numerator, first.denominator):
        assert {each.status for each in curve.solutions} == {Status.SOLVED}, curve.name
    return first


def test_1_lv_is_slow_and_near_while_hc_keeps_away(found: Studies) -> None:
    study = found[1]
    lv, hc = study.solutions[0.94]['LV'], study.solutions[0.94]['HC']
    clearance = {name: measure_solution(study.scene, each)['clearance'] for name, each in study.solutions[0.94].items()}
    assert clearance['LV'] < 0.9 * clearance['HC']
    assert compute_speed(lv)[:25].mean() < 0.9 * compute_speed(hc)[:25].mean()
    assert compute_speed(lv).argmax() > compute_speed(hc).argmax()
    assert lv.tau < hc.tau and lv.lam > hc.lam


def test_2_more_eta_narrows_lv_and_lengthens_hc(found: Studies) -> None:
    low, high = found[2].solutions[0.86], found[2].solutions[0.95]
    narrowed = {name: np.trace(high[name].covariance[25, :2, :2]) / np.trace(low[name].covariance[25, :2, :2]) for name in low}
    assert narrowed['LV'] < narrowed['HC'] < 1.0
    for shown in (low, high):
        length = {name: measure_solution(found[2].scene, each)['path_length'] for name, each in shown.items()}
        assert length['LV'] < length['HC']


def test_3_ratio_of_strategies_rises_through_1(found: Studies) -> None:
    curve = ratio(found, 3)
    assert curve.values[0] < 1.0 < 1.5 < curve.at(0.95)
    assert len(find_crossings(curve)) == 1
    assert np.diff(curve.values[curve.etas >= 0.86]).min() > 0.0


def test_4_with_little_noise_it_stays_below_1(found: Studies) -> None:
    curve = ratio(found, 4)
    assert curve.values.max() < 1.001
    assert curve.values[-1] < 0.97


def test_5_and_6_classes_cost_the_same_up_to_a_knee_then_the_open_one_costs_less(found: Studies) -> None:
    lv, hc = ratio(found, 5), ratio(found, 6)
    for curve in (lv, hc):
        early = curve.values[curve.etas <= 0.9]
        assert early.min() > 0.75 and early.max() < 1.33
        assert curve.at(PAPER_ETA) < early.min()
    assert np.diff(lv.values[lv.etas >= 0.9])[:-1].max() < 0.0
    assert lv.at(PAPER_ETA) < 0.55 < hc.at(PAPER_ETA) < 0.8


def test_7_optimal_is_cheapest_and_all_keep_eta(found: Studies) -> None:
    efforts = {curve.name: curve.efforts for curve in found[7].efforts}
    assert np.isfinite(list(efforts.values())).all()
    for name in ('LV', 'HC'):
        assert (efforts['optimal'] < 1.001 * efforts[name]).all()
    for rolled in found[7].rolled_out.values():
        assert set(rolled) == set(QUICK.rolled_out)
        assert all(each.step[2] > eta for eta, each in rolled.items())


def test_stepping_overshoots(found: Studies) -> None:
    """With the printed growth the loop ends above the wanted eta, and LV costs many times what the smallest s costs."""
    _, printed, _ = found[3].ratios
    assert printed.name == 'algorithm 1, Δ = 10'
    for stepped in (printed.numerator, printed.denominator):
        for eta, each in zip(stepped.etas, stepped.solutions, strict=True):
            assert each.status is not Status.SOLVED or each.eta >= eta
    assert printed.at(0.94) > 2 * ratio(found, 3).at(0.93)


def test_every_trend_is_checked_and_holds(found: Studies) -> None:
    checked = check_trends(found)
    assert [each.study for each in checked] == [1, 2, 3, 4, 5, 6, 7]
    assert [each.study for each in checked if not each.holds] == []


def test_a_missing_trend_is_reported(found: Studies) -> None:
    """Where the numbers of H1 and H2, and of LV and HC, are exchanged, no statement about them holds."""
    changed = dict(found)
    for number in (3, 4, 5):
        first = found[number].ratios[0]
        swapped = RatioCurve(first.name, first.denominator, first.numerator)
        changed[number] = replace(found[number], ratios=(swapped, *found[number].ratios[1:]))
    checked = check_trends(changed)
    assert {3, 4, 5} <= {each.study for each in checked if not each.holds}


def test_crossings() -> None:
    def curve(*efforts: float) -> EffortCurve:
        solutions = tuple(type('Solved', (), {'effort': effort, 'status': Status.SOLVED})() for effort in efforts)
        return EffortCurve('', tuple(0.5 + 0.1 * row for row in range(len(efforts))), solutions)

    assert find_crossings(RatioCurve('', curve(0.5, 2.0, 8.0), curve(1.0, 1.0, 1.0))) == [pytest.approx(0.55)]
    assert find_crossings(RatioCurve('', curve(0.5, 0.9), curve(1.0, 1.0))) == []


def test_files_hold_the_computed_numbers(found: Studies, output: Path) -> None:
    assert {file.name for file in output.iterdir()} == FILES
    numbers = json.loads((output / 'numbers.json').read_text('utf-8'))
    for name, number, paper in (('LV', 5, 0.33), ('HC', 6, 0.67)):
        pair = numbers['ratio_at_eta_0.9615'][name]
        assert pair == {'paper': paper, 'ours': pytest.approx(ratio(found, number).at(PAPER_ETA), rel=1e-5)}
    assert numbers['studies'][2]['ratios'][0]['ratio'] == pytest.approx(list(ratio(found, 3).values), rel=1e-5)
    lines = (output / 'table.md').read_text('utf-8').splitlines()
    assert len(lines) == 2 + 7
    assert f'{ratio(found, 5).at(PAPER_ETA):.2f} at 0.9615' in lines[6] and '0.33 at 0.9615' in lines[6]


def test_same_files_each_time(found: Studies, output: Path, tmp_path: Path) -> None:
    """The pictures are equal to the byte, without dates and in the order of the studies; the drawings up to rounding."""
    figures.write_figures(found, tmp_path)
    for file in tmp_path.iterdir():
        assert list_contents(file) == list_contents(output / file.name), file.name


def list_contents(file: Path) -> list[bytes]:
    """Return the streams of a PDF with numbers of six decimals, of which Matplotlib writes ten, or all bytes of another file."""
    content = file.read_bytes()
    if file.suffix != '.pdf':
        return [content]
    streams = [
        zlib.decompress(each) for each in re.findall(rb'/FlateDecode[^>]*>>\nstream\n(.*?)\nendstream', content, re.DOTALL)
    ]
    assert streams
    return [re.sub(rb'\d+\.\d{7,}', lambda number: b'%.6f' % float(number[0]), each) for each in streams]


def test_output_that_cannot_be_written_exits_2_before_anything_is_computed(tmp_path: Path) -> None:
    file = tmp_path / 'file'
    file.write_text('mine', encoding='utf-8')
    command = [sys.executable, str(EXAMPLE / 'paper.py'), '--output', str(file)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False, cwd=EXAMPLE.parents[1])
    assert (result.returncode, result.stdout) == (2, '')
    assert result.stderr == f'paper: --output: expected a folder that can be written, got {file}: File exists\n'
    assert file.read_text(encoding='utf-8') == 'mine'


def test_the_search_for_scenes_scores_the_scene_that_it_found() -> None:
    import find_scenes

    make, faults, present = find_scenes.SEARCHES['strategies']
    assert len(make(np.random.default_rng(0)).path_classes) == len(present.path_classes) == 1
    assert find_scenes.sum_up(faults(present), find_scenes.HOPELESS) < 2.0
