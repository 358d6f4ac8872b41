# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A command replaces what an earlier run has made, and no other file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from matplotlib.figure import Figure
from report_samples import START_NS, prediction, predictions, samples

from foc_ros.cli.main import main
from foc_ros.core.errors import InputError
from foc_ros.io.outputs import REPORT_FILES, check_page, check_replaceable
from foc_ros.reporting.figures import write_picture
from foc_ros.reporting.page import write_page
from foc_ros.reporting.report import write_report
from foc_ros.reporting.views import build_hand_trajectory, build_snapshot

SCENE = '{"start": [0, 0], "goal": [0.3, 0], "duration_s": 1, "steps": 10, "noise": [0.05, 0.05], "eta": 0.9, "obstacles": []}'


@pytest.mark.parametrize('suffix', ['png', 'pdf', 'svg'])
def test_a_picture_is_replaced_by_the_next_one(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f'scene.{suffix}'
    write_picture(file, prediction(START_NS, np.zeros(2)))
    check_replaceable('--plot', file)


def test_a_picture_that_something_else_has_made_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'scene.json').write_text(SCENE, 'utf-8')
    picture = tmp_path / 'holiday.png'
    Figure().savefig(picture)
    before = picture.read_bytes()
    assert main(['solve', str(tmp_path / 'scene.json'), '--plot', str(picture)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count('\n')) == ('', 1)
    assert '--plot: expected a new file, or one that foc_ros has made' in err
    assert picture.read_bytes() == before


def test_a_report_is_replaced_by_the_next_one(tmp_path: Path) -> None:
    made = samples()
    for _ in range(2):
        write_report(tmp_path, 'x', build_hand_trajectory(made), [build_snapshot(each) for each in predictions(made)], {})
    write_page(tmp_path, 'index.html', 'x', (), (), None)


@pytest.mark.parametrize('name', ['index.html', 'predictions.json', 'overview.png'])
def test_a_report_overwrites_no_other_file(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text('mine', 'utf-8')
    with pytest.raises(InputError, match='--report: expected a new file, or one that foc_ros has made'):
        check_page('--report', tmp_path, *REPORT_FILES)
    (tmp_path / name).rename(tmp_path / 'other.html')
    check_page('--report', tmp_path, *REPORT_FILES)
