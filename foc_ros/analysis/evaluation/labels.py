"""Labels that came with recordings, checked against the ways really taken."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from foc_ros.core.types import LEFT
from foc_ros.io.csv_tables import rows

from .observations import Observation, Observations
from .recordings import LABELS


def check_labels(data: Path, recordings: Sequence[Observations]) -> dict[str, str]:
    """Return, for each recording whose label is not the way that it took, what both say; none where there are no labels.

    The label's columns after the first are the gaps taken, row by row, counted from low x. Raises RecordingError for a
    table that cannot be read.
    """
    if not (data / LABELS).exists():
        return {}
    labels = {row.cells['recording']: row.cells for row in rows(data / LABELS, ('recording',))}
    found = {}
    for recording in recordings:
        cells = labels.get(recording.name)
        if cells is None:
            found[recording.name] = 'no label'
            continue
        told = [text for column, text in cells.items() if column != 'recording']
        taken = [str(gap) for gap in gaps(recording.each[0])]
        if told != taken:
            found[recording.name] = f'label {" ".join(told)}, path {" ".join(taken)}'
    return found


def gaps(seen: Observation) -> list[int]:
    """Return the gap that the hand really took in each row still ahead, counted from low x."""
    left_is_low = -seen.along[1] < 0.0
    higher = (seen.truth.sides == LEFT) != left_is_low
    return [int(higher[(seen.row == row) & seen.truth.ahead].sum()) for row in np.unique(seen.row[seen.truth.ahead])]
