"""The page of a fit: fitted values beside given ones, with escaped text."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from foc_ros.core.errors import InputError
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


def test_a_fit_without_parameters_has_tables_only(tmp_path: Path) -> None:
    write_report(tmp_path, 'x', ANSWER | {'parameters': {}})
    assert '<img' not in (tmp_path / 'fit.html').read_text(encoding='utf-8')


def test_a_folder_that_cannot_be_written_is_rejected(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('mine')
    with pytest.raises(InputError, match='--report'):
        write_report(tmp_path / 'file', 'x', ANSWER)
