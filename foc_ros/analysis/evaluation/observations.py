"""What was predicted in a recording, beside what really came: all that scores and fits need, without a predictor.

A recording is replayed once; how its costs become likelihoods can then be tried out in no time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.homotopy.branch_times import BranchTimes
from foc_ros.core.types import Array, Record

TIMES_S = tuple(0.125 * step for step in range(1, 9))
"""Times ahead at which predicted positions are compared with the true ones [s]."""
HORIZONS_S = (0.25, 0.5, 1.0)
"""Those of them that are reported."""

Bools = NDArray[np.bool_]
Sides = NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Ways(Record):
    """The k candidates of one prediction.

    labels; goal (k,): row of the goals; solved (k,); spent [m^2/s^5]: effort since onset, the same for all; to_go (k,)
    [m^2/s^5]: effort through each and what its time costs; likelihood (k,): as published, 0 unless solved; length (k,) [m]: of
    the shortest path in its class; price [m^2/s^6]: of time; time_s (k,): to its goal; named (k, n): whether the obstacle is in
    the candidate's name; sides (k, n): LEFT or RIGHT, on which it passes each of the n obstacles; mean (k, h, 2) [m] and
    covariance (k, h, 2, 2) [m^2]: of the position at `TIMES_S`; late (k, h, 2) [m]: by how much it lags behind for each share of
    the time to the goal that the plan takes longer; partings: when they part.
    """

    labels: tuple[str, ...]
    goal: NDArray[np.int64]
    solved: Bools
    spent: float
    to_go: Array
    likelihood: Array
    length: Array
    price: float
    time_s: Array
    named: Bools
    sides: Sides
    mean: Array
    covariance: Array
    late: Array
    partings: BranchTimes

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True, eq=False)
class Truth(Record):
    """What the hand really did after one prediction.

    sides (n,): LEFT or RIGHT, the side of each obstacle on which the rest of the path runs; ahead (n,): whether the row of the
    obstacle is still to be passed; goal: row of the goal where the recording ends, None where it ends at none, or at one that was
    not there yet; positions (h, 2) [m]: at `TIMES_S`, nan beyond the end; progress in [0, 1]: share of the way that lies behind;
    approach in [0, 1]: share of the way from the last row, or the start, to the next one, nan where none is to come.
    """

    sides: Sides
    ahead: Bools
    goal: int | None
    positions: Array
    progress: float
    approach: float


@dataclass(frozen=True, eq=False)
class Observation(Record):
    """One prediction: at stamp_ns, from a hand whose mean is hand (6,), its movement since_s old (0 at rest) [s].

    ids, centre (n, 2) [m]: of the obstacles at that stamp; row (n,): the row of obstacles that each is in, 0 first; along (2,):
    the unit vector on which rows are ordered; goals (g, 2) [m]; most_likely: the label that leads after hysteresis.
    """

    stamp_ns: int
    hand: Array
    since_s: float
    ids: tuple[str, ...]
    centre: Array
    row: NDArray[np.int64]
    along: Array
    goals: Array
    ways: Ways
    most_likely: str | None
    truth: Truth


@dataclass(frozen=True, eq=False)
class Observations:
    """One recording: its name, its predictions in order, and counts by kind of what was refused or failed."""

    name: str
    each: tuple[Observation, ...]
    counts: dict[str, int]
