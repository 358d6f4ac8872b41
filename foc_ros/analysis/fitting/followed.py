"""How many ways are followed: as many as the recordings leave open, for a way that is no candidate is never foretold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from foc_ros.analysis.evaluation.rows import axis, lines, rows
from foc_ros.core.config import Config

from .demonstrations import Demonstration
from .estimates import Estimate, bounded

NAME = 'homotopy.max_candidates'
MOST = 24
"""Ways beyond which they are no longer followed for their own sake, but goals are: a prediction takes a few ms for each."""


def fit_followed(demonstrations: Sequence[Demonstration], config: Config) -> tuple[Mapping[str, Estimate], list[str]]:
    """Return the number of candidates that has room for every goal and for the ways open, never less than what is given."""
    open_ways = max(ways(each) for each in demonstrations)
    goals = max(len(each.goals) for each in demonstrations)
    followed = int(bounded(NAME, max(config.homotopy.max_candidates, min(open_ways, MOST), goals)))
    words = [f'{NAME}: {open_ways} ways are open in a recording, {followed} are followed'] if open_ways > followed else []
    if followed == config.homotopy.max_candidates:
        return {}, words
    return {NAME: Estimate(NAME, followed, followed, followed, 'ways and goals open in the recordings')}, words


def ways(demonstration: Demonstration) -> int:
    """Return how many ways lead through the rows of obstacles between where a movement begins and the farthest goal."""
    start, goals, obstacles = demonstration.positions[0], demonstration.goals, demonstration.obstacles
    along = axis(start, goals)
    row = rows(obstacles.centre, obstacles.radius, along)
    line = lines(obstacles.centre @ along, row)
    between = (line > start @ along) & (line < (goals @ along).max())
    return int(np.prod(np.bincount(row, minlength=len(line))[between] + 1.0))
