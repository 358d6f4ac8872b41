# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The Avoiding task has three rows and 24 homotopy classes, and the classes taken are those of its labels."""

from __future__ import annotations

from pathlib import Path

import pytest
from homotopy_scenes import AVOIDING

from foc_ros.analysis.evaluation.observations import observe
from foc_ros.analysis.evaluation.questions import GAP, GOAL, PATH_CLASS, ask, find_relevant_obstacles
from foc_ros.analysis.evaluation.report import find_gaps, find_label_mismatches
from foc_ros.analysis.recordings import find_recordings
from foc_ros.core.config import replace_values
from foc_ros.ros.parameters import load_parameter_file

PARAMETERS = Path(__file__).parents[1] / 'doc' / 'examples' / 'thumb_stick.yaml'


@pytest.mark.skipif(not AVOIDING.is_dir(), reason='optional data ../shared/data/d3il_avoiding is not there')
@pytest.mark.parametrize('name', ['000', '053'])
def test_the_classes_taken_are_as_labelled(name: str, tmp_path: Path) -> None:
    config = replace_values(load_parameter_file(PARAMETERS), {'rate_hz': 0.5})
    recording = observe(find_recordings(AVOIDING)[name], config)
    first, relevant = recording.observations[0], find_relevant_obstacles(recording)
    assert first.row.tolist() == [0, 1, 1, 2, 2, 2]
    assert ask(PATH_CLASS, first, relevant).possible == 24
    assert ask(GAP, first, relevant).possible == 2
    # a goal stands behind each gap of the last row
    assert ask(GOAL, first, relevant).truth == find_gaps(first)[2]
    label = next(line for line in (AVOIDING / 'labels.csv').read_text().splitlines() if line.startswith(f'{name},'))
    (tmp_path / 'labels.csv').write_text(f'recording,gap_row1,gap_row2,gap_row3\n{label}\n')
    assert find_label_mismatches(tmp_path, [recording]) == {}
