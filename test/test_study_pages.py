"""The pages of evaluations and fits: pictures with their intervals, fitted values beside given ones, with escaped text."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from foc_ros.analysis.evaluation.baselines import BOLTZMANN, PUBLISHED, REFITTED
from foc_ros.core.errors import InputError
from foc_ros.reporting.draw import open_figure
from foc_ros.reporting.evaluation_report import _draw_reliability
from foc_ros.reporting.fit_report import write_report

ANSWER = {
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
