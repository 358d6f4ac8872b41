# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pages of evaluations and fits: pictures with their intervals, fitted values beside given ones, with escaped text."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from foc_ros.analysis.evaluation.baselines import BOLTZMANN, PUBLISHED, REFITTED
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, RecordingError
from foc_ros.io.bags import BagReader, Item
from foc_ros.reporting import evaluation_report, simulation_report
from foc_ros.reporting import page as pages
from foc_ros.reporting.draw import open_figure
from foc_ros.reporting.evaluation_report import _draw_reliability
from foc_ros.reporting.example import FEW, draw_example, warn_of_few
from foc_ros.reporting.fit_report import write_report
from foc_ros.reporting.page import Section, explain_tables, make_chart, write_page

RECORDING = Path(__file__).resolve().parents[1] / 'foc_ros' / 'recordings' / 'reaching.mcap'
ANSWER = {
    'recordings': 2,
    'parameters': {
        'likelihood.beta': {'value': 0.5, 'interval': [0.4, 0.7], 'how': 'classes taken', 'given': 1.0},
        'foc.noise_x': {'value': 0.08, 'interval': [None, None], 'how': 'spread', 'given': 0.05},
        'duration.intercept_s': {'value': 0.0, 'interval': [0.0, 0.1], 'how': 'durations', 'given': 0.0},
    },
    'scores': {'ways': {'given': -1.0, 'fitted': -0.75, 'held out': None}},
    'comparison': {'error_m 0.5': {'before': 0.063, 'after': 0.096}, 'inside_90': {'before': 0.5, 'after': 0.8}},
    'warnings': ['<b>few</b> recordings'],
    'failed': {'x.mcap': 'no hand'},
    'output': 'mine.yaml',
    'node': ['here', 'there'],
}


def test_the_page_holds_values_intervals_scores_and_warnings(tmp_path: Path) -> None:
    write_report(tmp_path / 'new', 'hers & his', ANSWER)
    page = (tmp_path / 'new' / 'fit.html').read_text(encoding='utf-8')
    assert '<title>Fit: hers &amp; his</title>' in page
    assert '<tr><th>likelihood.beta</th><td>1</td><td>0.5</td><td>0.4 to 0.7</td><td>classes taken</td></tr>' in page
    assert '<td>- to -</td>' in page
    assert '<tr><th>log-likelihood of the class taken [nat]</th><td>fitted</td><td>-0.750</td></tr>' in page
    row = '<th>error of positions 0.5 s ahead [mm]</th><td>63.0</td><td>96.0</td><td>worse</td>'
    assert row in page and 'Better with the fitted parameters: positions in the region of 90 %' in page
    assert '&lt;b&gt;few&lt;/b&gt; recordings' in page and 'x.mcap: no hand' in page
    assert page.count('<img') == 1


def test_a_fit_without_parameters_has_tables_only_and_a_folder_that_cannot_be_written_is_rejected(tmp_path: Path) -> None:
    write_report(tmp_path, 'x', ANSWER | {'parameters': {}})
    assert '<img' not in (tmp_path / 'fit.html').read_text(encoding='utf-8')
    (tmp_path / 'file').write_text('mine')
    with pytest.raises(InputError, match='--report'):
        write_report(tmp_path / 'file', 'x', ANSWER)


BINS = [
    {'count': 3, 'confidence': 0.45, 'right': 0.5, 'interval': [0.2, 0.7]},
    {'count': 0, 'confidence': None, 'right': None, 'interval': None},
    {'count': 40, 'confidence': 0.85, 'right': 0.9, 'interval': [0.8, 0.95]},
]


def test_a_reliability_plot_has_error_bars_and_counts() -> None:
    names = PUBLISHED, REFITTED, BOLTZMANN
    with open_figure(3.0, 3.0) as figure:
        axes = figure.subplots()
        _draw_reliability(axes, 'way', {name: {'reliability': BINS} for name in names})
    assert len(axes.containers) == len(names)
    for container in axes.containers:
        _, _, (bars,) = container.lines
        ends = [segment[:, 1].tolist() for segment in bars.get_segments()]
        assert ends == [pytest.approx([0.2, 0.7]), pytest.approx([0.8, 0.95])]
    assert [text.get_text() for text in axes.texts] == ['3', '40']


class Recorded:
    """The packaged recording, as one of a folder of recordings, or one that cannot be read."""

    def __init__(self, is_broken: bool = False) -> None:
        self.is_broken = is_broken

    def items(self) -> Iterator[Item]:
        if self.is_broken:
            raise RecordingError('broken')
        with BagReader(RECORDING) as reader:
            yield from islice(reader, 250)


def test_a_recording_is_pictured_with_its_prediction_and_one_that_cannot_be_read_is_passed_over() -> None:
    config = Config().with_values({'rate_hz': 10.0, 'foc.steps': 20})
    (section,) = draw_example({'broken': Recorded(is_broken=True), 'whole': Recorded()}, config)
    ((_, caption),) = section.pictures
    assert caption.startswith('whole, 0.') and caption.endswith('after the hand began to move.')
    assert draw_example({'broken': Recorded(is_broken=True)}, config) == []


def test_a_page_names_what_made_it_and_no_path(tmp_path: Path) -> None:
    config = Config().with_values({'foc.eta': 0.8, 'homotopy.library': '/elsewhere/mine.json'})
    write_page(tmp_path, 'x.html', 'x', [Section('In short', ['a < b'])], (), config)
    page = (tmp_path / 'x.html').read_text(encoding='utf-8')
    assert '<li>a &lt; b</li>' in page
    footer = page.partition('<footer')[2].partition('</footer>')[0]
    assert f'Made by foc_ros {version("foc_ros")} on {datetime.now().astimezone():%Y-%m-%d}; ' in footer
    assert 'processors' in footer and 'foc.eta = 0.8' in footer and 'homotopy.library = mine.json' in footer
    assert 'someone' not in page and str(Path.cwd()) not in page
    write_page(tmp_path, 'x.html', 'x', [], (), Config())
    assert 'All parameters have their defaults.' in (tmp_path / 'x.html').read_text(encoding='utf-8')


def test_words_are_explained_once_where_they_stand_first() -> None:
    tables = (('First', ('', 'gain [nat]'), [('foc', '1')]), ('Second', ('', 'gain [nat]', 'ECE'), [('foc', '1', '0')]))
    sections = explain_tables(tables, {'nat': 'a unit', 'ECE': 'an error', 'Brier': 'not here'})
    assert [(each.heading, each.notes) for each in sections] == [('First', ['nat: a unit']), ('Second', ['ECE: an error'])]


def test_few_recordings_are_warned_of(tmp_path: Path) -> None:
    assert warn_of_few(FEW, 'recordings') == [] and warn_of_few(FEW - 1, 'recordings')[0].startswith(
        f'Few recordings ({FEW - 1})'
    )
    write_report(tmp_path, 'x', ANSWER)
    page = (tmp_path / 'fit.html').read_text(encoding='utf-8')
    assert '<p class="warning">Few recordings (2)' in page and 'held out: scored on' in page
    assert page.index('3 parameters were fitted to 2 recordings.') < page.index('<table')


def test_legends_are_below_the_axes_and_cover_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def draw(axes: Any) -> None:
        for number in range(6):
            axes.plot([0, 1], [0, number], label=f'baseline number {number}')
        axes.plot([0, 1], [1, 0], label='baseline number 0')

    monkeypatch.setattr(pages, 'make_picture', lambda figure, _: figure)
    figure: Any = make_chart((6.4, 4.6), '', draw)
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert len(legend.get_texts()) == 6
    assert not legend.get_window_extent().overlaps(figure.axes[0].get_tightbbox())


def test_results_are_told_in_plain_words_first() -> None:
    scores = {'right': 0.8, 'log_likelihood': float(np.log(0.5))}
    answer = {
        'recordings': 3,
        'predictions': 40,
        'questions': {'way': {'foc': scores, 'uniform': {'right': 0.5, 'log_likelihood': float(np.log(0.25))}}},
        'positions': {
            'displacement_m': {'likelihood-weighted': {'final': {'0.5': 0.0314}}},
            'inside_all': {'0.9': {'0.5': 0.87}},
        },
    }
    told = ' '.join(evaluation_report.summarise(answer))
    for words in ('3 recordings', '40 moments', 'in 80 % of them', 'probability of 50 %', 'gives it 25 %', '31 mm', 'held 87 %'):
        assert words in told
    cell = {'operator': 'changes_way', 'collision_rate': 0.1, 'completion_s': 1.234}
    cells = [cell | {'assistance': 'none'}, cell | {'assistance': 'foc', 'collision_rate': 0.05, 'completion_s': None}]
    assert simulation_report.summarise(cells)[1:] == [
        'Changes way: collisions in 5 % of the trials with guidance; '
        'collisions in 10 % of the trials and 1.23 s for a movement without guidance.'
    ]
