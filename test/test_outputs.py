# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A command replaces what an earlier run has made, and no other file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

import pytest
from bag_helpers import messages, write_bag
from fit_recordings import write_tables
from matplotlib.figure import Figure
from report_samples import START_NS, prediction, predictions, samples

from foc_ros.cli.main import main
from foc_ros.core.errors import InputError
from foc_ros.io import terminal
from foc_ros.io.outputs import check_replaceable, check_report
from foc_ros.io.terminal import COLUMNS, show_table
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
    write_page(tmp_path, 'index.html', 'made by foc_ros')


@pytest.mark.parametrize('name', ['index.html', 'predictions.json', 'overview.png'])
def test_a_report_overwrites_no_other_file(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text('mine', 'utf-8')
    with pytest.raises(InputError, match='--report: expected a new file, or one that foc_ros has made'):
        check_report('--report', tmp_path)
    (tmp_path / name).rename(tmp_path / 'other.html')
    check_report('--report', tmp_path)


NAMES = ('front_left_post', 'front_right_post_of_the_shelf', 'a_name_that_is_longer_than_a_column_40')
POSTS = [
    f'{{x: {x}, y: {y}, radius: 0.02, id: {name}}}'
    for name, x, y in zip(NAMES, (0.15, 0.2, 0.25), (0.01, 0.05, -0.02), strict=True)
]
LONG_NAMES_SCENE = f'start: [0, 0]\ngoals: [[0.3, 0.0], [0.3, 0.1]]\nobstacles: [{", ".join(POSTS)}]\n'


def find_widest(printed: str) -> int:
    return max(map(len, printed.splitlines()))


@pytest.mark.parametrize(
    'arguments',
    [
        ['solve', 'scene.yaml', '--monte-carlo', '100'],
        ['replay', 'bag', '--params', 'slow.yaml'],
        ['simulate', '--operators', 'unannounced_goal', '--trials', '1', '--workers', '1', '--params', 'quick.yaml'],
        ['evaluate', 'data', '--workers', '1', '--params', 'quick.yaml'],
    ],
    ids=lambda arguments: arguments[0],
)
def test_the_output_of_a_command_fits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path('scene.yaml').write_text(LONG_NAMES_SCENE)
    Path('slow.yaml').write_text('/**: {ros__parameters: {rate_hz: 1.0, foc.steps: 10}}')
    Path('quick.yaml').write_text('/**: {ros__parameters: {rate_hz: 5.0, foc.steps: 10}}')
    write_bag(Path('bag'), messages(0.1))
    if 'data' in arguments:
        write_tables(Path('data'), count=2)
    assert main(arguments) == 0
    assert 0 < find_widest(capsys.readouterr().out) <= COLUMNS


def test_a_wide_table_is_divided_and_loses_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    columns = ['rule', *(f'column {number} of a wide table' for number in range(7)), 'last']
    rows = [[f'rule {row}', *(f'{row}.{number} (1 to 2)' for number in range(7)), f'end {row}'] for row in range(3)]
    show_table(columns, rows, 'title')
    printed = capsys.readouterr().out
    assert find_widest(printed) <= COLUMNS
    assert all(printed.count(text) == 1 for text in ('title', *columns[1:], *(cell for row in rows for cell in row[1:])))
    assert printed.count('rule 2') == 4


def test_progress_is_printed_at_times_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for quiet_s, lines in ((60.0, []), (0.0, ['replay: 1 of 2', 'replay: 2 of 2'])):
        monkeypatch.setattr(terminal, 'QUIET_S', quiet_s)
        assert list(terminal.show_progress('ab', 'replay', 2)) == ['a', 'b']
        assert capsys.readouterr().err.splitlines() == lines
