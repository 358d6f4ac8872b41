# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The path classes that tables of a data set state, beside those that the recorded paths really took."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from foc_ros.analysis.recordings import LABELS, TRIALS
from foc_ros.analysis.scenes import read_picked
from foc_ros.core.types import LEFT
from foc_ros.io.csv_tables import read_rows

from .observations import Observation, ObservedRecording


def find_label_mismatches(data: Path, recordings: Sequence[ObservedRecording]) -> dict[str, str]:
    """Return both texts for each recording whose label is not the path class that was taken; none where there are no labels.

    The columns of labels.csv after the first are the gaps taken, row by row, counted from low x. The column `sides` of trials.csv
    has the side of each box by the end of its name; where it says which object was picked up instead, that is the truth already.
    Raises RecordingError for a table that cannot be read.
    """
    trials, labels = data / TRIALS, data / LABELS
    compare: Callable[[Observation, Mapping[str, str]], str]
    if trials.exists() and not read_picked(trials):
        rows, compare = read_rows(trials, ('recording', 'sides')), _compare_sides
    elif labels.exists() and not trials.exists():
        rows, compare = read_rows(labels, ('recording',)), _compare_gaps
    else:
        return {}
    stated = {row.cells['recording']: row.cells for row in rows}
    differences = {
        each.name: compare(each.observations[0], stated[each.name]) if each.name in stated else 'no label' for each in recordings
    }
    return {name: words for name, words in differences.items() if words}


def _compare_gaps(first: Observation, cells: Mapping[str, str]) -> str:
    labelled = [text for column, text in cells.items() if column != 'recording']
    taken = [str(gap) for gap in find_gaps(first)]
    return '' if labelled == taken else f'label {" ".join(labelled)}, path {" ".join(taken)}'


def _compare_sides(first: Observation, cells: Mapping[str, str]) -> str:
    differences = []
    for label in cells['sides'].split():
        name, _, side = label.rpartition('=')
        for identity, taken, is_ahead in zip(first.ids, first.truth.sides, first.truth.is_ahead, strict=True):
            words = 'left' if taken == LEFT else 'right'
            if is_ahead and identity.rpartition('/')[0].endswith(name) and words != side:
                differences.append(f'{name} label {side}, path {words}')
    return '; '.join(differences)


def find_gaps(observation: Observation) -> list[int]:
    """Return the gap that the hand really took in each row still ahead, counted from low x."""
    truth, row = observation.truth, observation.row
    left_is_low = observation.left[0] < 0.0
    is_higher = (truth.sides == LEFT) != left_is_low
    return [int(is_higher[(row == each) & truth.is_ahead].sum()) for each in np.unique(row[truth.is_ahead])]
