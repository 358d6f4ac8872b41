# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`examples/paper`: the trends appear, the files hold the numbers, and an output that cannot be written is rejected."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from checks import check_trends
from paper import perform
from studies import PAPER_ETA, QUICK, RatioCurve

from foc_ros import Status

EXAMPLE = Path(__file__).resolve().parents[1] / 'examples' / 'paper'
FILES = {f'study{number}.{suffix}' for number in range(1, 8) for suffix in ('png', 'pdf')} | {'numbers.json', 'table.md'}


@pytest.fixture(scope='module')
def output(tmp_path_factory):
    return tmp_path_factory.mktemp('paper') / 'new' / 'output'


@pytest.fixture(scope='module')
def found(output):
    """Compute all studies on the coarse grid, from end to end."""
    return perform(output, QUICK)


def ratio(found, number):
    """Return the continuous ratio of a study, solved at every eta."""
    first = found[number].ratios[0]
    for curve in (first.numerator, first.denominator):
        assert {each.status for each in curve.solutions} == {Status.SOLVED}, curve.name
    return first


def test_every_trend_is_checked_and_holds(found):
    checked = check_trends(found)
    assert [each.study for each in checked] == [1, 2, 3, 4, 5, 6, 7]
    assert [each.study for each in checked if not each.holds] == []


def test_a_missing_trend_is_reported(found):
    """Where the numbers of H1 and H2, and of LV and HC, are exchanged, no statement about them holds."""
    changed = dict(found)
    for number in (3, 4, 5):
        first = found[number].ratios[0]
        swapped = RatioCurve(first.name, first.denominator, first.numerator)
        changed[number] = replace(found[number], ratios=(swapped, *found[number].ratios[1:]))
    checked = check_trends(changed)
    assert {3, 4, 5} <= {each.study for each in checked if not each.holds}


def test_files_hold_the_computed_numbers(found, output):
    assert {file.name for file in output.iterdir()} == FILES
    numbers = json.loads((output / 'numbers.json').read_text('utf-8'))
    for name, number, paper in (('LV', 5, 0.33), ('HC', 6, 0.67)):
        pair = numbers['ratio_at_eta_0.9615'][name]
        assert pair == {'paper': paper, 'ours': pytest.approx(ratio(found, number).at(PAPER_ETA), rel=1e-5)}
    assert numbers['studies'][2]['ratios'][0]['ratio'] == pytest.approx(list(ratio(found, 3).values), rel=1e-5)
    lines = (output / 'table.md').read_text('utf-8').splitlines()
    assert len(lines) == 2 + 7
    assert f'{ratio(found, 5).at(PAPER_ETA):.2f} at 0.9615' in lines[6] and '0.33 at 0.9615' in lines[6]


def test_output_that_cannot_be_written_exits_2_before_anything_is_computed(tmp_path):
    file = tmp_path / 'file'
    file.write_text('mine', encoding='utf-8')
    command = [sys.executable, str(EXAMPLE / 'paper.py'), '--output', str(file)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False, cwd=EXAMPLE.parents[1])
    assert (result.returncode, result.stdout) == (2, '')
    assert result.stderr == f'paper: --output: expected a folder that can be written, got {file}: File exists\n'
    assert file.read_text(encoding='utf-8') == 'mine'
