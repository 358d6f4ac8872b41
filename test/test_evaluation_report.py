"""The pictures of the page of `evaluate`."""

from __future__ import annotations

import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from foc_ros.analysis.evaluation.baselines import BOLTZMANN, PUBLISHED, REFITTED
from foc_ros.reporting.draw import open_figure
from foc_ros.reporting.evaluation_report import _draw_reliability

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
