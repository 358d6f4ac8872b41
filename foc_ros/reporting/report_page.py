"""The page of a report: the recording on a time slider, with all that was predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from foc_ros.core.errors import FocError

from .page import data_script, own_part, own_scripts, page_of, plotly_script, table

if find_spec('plotly') is None:
    raise FocError("reports need plotly: pip install plotly, or pip install 'foc_ros[report]'")


def report_page(title: str, data: Mapping[str, Any], facts: Mapping[str, str], warnings: Sequence[str]) -> str:
    """Return the page; data: as of `report_data.page_data`."""
    told = '<h2>The recording</h2>' + table((), facts.items())
    if not data['frames']:
        return page_of(title, told, warnings)
    scripts = data_script('report-data', data) + plotly_script() + own_scripts('charts.js', 'player.js')
    return page_of(title, own_part('player.html') + told + scripts, warnings)
