"""The Avoiding task: three rows, 24 ways, and the ways taken as its labels say."""

from __future__ import annotations

from pathlib import Path

import pytest
from homotopy_scenes import AVOIDING

from foc_ros.analysis.evaluation.labels import check_labels, gaps
from foc_ros.analysis.evaluation.observe import observe
from foc_ros.analysis.evaluation.questions import GAP, GOAL, WAY, question, relevant
from foc_ros.analysis.evaluation.recordings import find_recordings
from foc_ros.core.config import updated
from foc_ros.ros.parameters import load_parameter_file

PARAMETERS = Path(__file__).parents[1] / 'doc' / 'examples' / 'thumb_stick.yaml'


@pytest.mark.skipif(not AVOIDING.is_dir(), reason='optional data ../shared/data/d3il_avoiding is not there')
@pytest.mark.parametrize('name', ['000', '053'])
def test_the_ways_taken_are_as_labelled(name: str, tmp_path: Path) -> None:
    config = updated(load_parameter_file(PARAMETERS), {'rate_hz': 0.5})
    recording = observe(find_recordings(AVOIDING)[name], config)
    first, matters = recording.each[0], relevant(recording)
    assert first.row.tolist() == [0, 1, 1, 2, 2, 2]
    assert question(WAY, first, matters).open == 24
    assert question(GAP, first, matters).open == 2
    # a goal stands behind each gap of the last row
    assert question(GOAL, first, matters).truth == gaps(first)[2]
    label = next(line for line in (AVOIDING / 'labels.csv').read_text().splitlines() if line.startswith(f'{name},'))
    (tmp_path / 'labels.csv').write_text(f'recording,gap_row1,gap_row2,gap_row3\n{label}\n')
    assert check_labels(tmp_path, [recording]) == {}
