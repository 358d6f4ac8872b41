# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What commands print fits into a terminal of 80 columns."""

from __future__ import annotations

from pathlib import Path

import pytest
from bag_helpers import messages, write_bag
from fit_recordings import write_tables

from foc_ros.cli.main import main
from foc_ros.io import terminal
from foc_ros.io.terminal import COLUMNS, show_table

NAMES = ('front_left_post', 'front_right_post_of_the_shelf', 'a_name_that_is_longer_than_a_column_40')
POSTS = [
    f'{{x: {x}, y: {y}, radius: 0.02, id: {name}}}'
    for name, x, y in zip(NAMES, (0.15, 0.2, 0.25), (0.01, 0.05, -0.02), strict=True)
]
SCENE = f'start: [0, 0]\ngoals: [[0.3, 0.0], [0.3, 0.1]]\nobstacles: [{", ".join(POSTS)}]\n'


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
    Path('scene.yaml').write_text(SCENE)
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
