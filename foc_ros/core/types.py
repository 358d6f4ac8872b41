"""What flows through the house: frozen records with read-only arrays, SI units, in the task plane.

message -> HandSample -> HandState -> Candidates -> Solutions -> Prediction -> message.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

NANOSECONDS = 1_000_000_000
LEFT, RIGHT = 1, -1
"""Side on which a path passes an obstacle, seen in the direction of travel."""


def as_readonly(array: Array) -> Array:
    """Make an array that nobody else holds read-only, so that a record takes it as it is, without a copy."""
    array.setflags(write=False)
    return array


class Record:
    """Base of the records: freezes every array field after construction."""

    def __post_init__(self) -> None:
        held = vars(self)
        for name, value in held.items():
            if isinstance(value, np.ndarray) and ((flags := value.flags).writeable or not flags.c_contiguous):
                held[name] = as_readonly(value.copy())


@dataclass(frozen=True, eq=False)
class HandSample(Record):
    """One measured hand position.

    stamp_ns: message stamp [ns]; position (2,): in the task plane [m]; height: along the plane's normal [m];
    frame_id: the frame it was measured in.
    """

    stamp_ns: int
    position: Array
    height: float = 0.0
    frame_id: str = ''


@dataclass(frozen=True, eq=False)
class HandState(Record):
    """The estimator's answer at a stamp.

    mean (6,): x, y, vx, vy, ax, ay [m, m/s, m/s^2]; covariance (6, 6) in the same order;
    onset_ns: stamp at which the present movement began, None at rest; onset_position (2,): where it began [m];
    effort_spent: integral of squared jerk since onset [m^2/s^5].
    """

    stamp_ns: int
    mean: Array
    covariance: Array
    height: float = 0.0
    frame_id: str = ''
    onset_ns: int | None = None
    onset_position: Array | None = None
    effort_spent: float = 0.0


@dataclass(frozen=True, eq=False)
class Obstacles(Record):
    """Circles in the task plane, as a table of n rows.

    ids: identity of each, used in labels; centre (n, 2) [m]; radius (n,) mean [m]; radius_stddev (n,) [m];
    velocity (n, 2) [m/s]; centre_covariance (n, 2, 2) [m^2].
    """

    ids: tuple[str, ...]
    centre: Array
    radius: Array
    radius_stddev: Array
    velocity: Array
    centre_covariance: Array

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, rows: NDArray[np.intp] | list[int]) -> Obstacles:
        """Return the obstacles of the given rows, in that order."""
        index = np.asarray(rows, dtype=np.intp)
        return Obstacles(
            tuple(self.ids[i] for i in index),
            self.centre[index],
            self.radius[index],
            self.radius_stddev[index],
            self.velocity[index],
            self.centre_covariance[index],
        )

    def after(self, seconds: float) -> Obstacles:
        """Return the obstacles moved on at their velocity for `seconds` [s]."""
        if not self.velocity.any():
            return self
        return Obstacles(
            self.ids,
            self.centre + seconds * self.velocity,
            self.radius,
            self.radius_stddev,
            self.velocity,
            self.centre_covariance,
        )


def make_obstacles(
    centre: ArrayLike = (),
    radius: ArrayLike = (),
    radius_stddev: ArrayLike = 0.0,
    ids: tuple[str, ...] | None = None,
    velocity: ArrayLike = 0.0,
    centre_covariance: ArrayLike = 0.0,
) -> Obstacles:
    """Build :class:`Obstacles` from anything numpy can read; scalars hold for every row, ids default to positions."""
    centres = np.asarray(centre, dtype=float).reshape(-1, 2)
    n = len(centres)
    return Obstacles(
        tuple(str(i) for i in range(n)) if ids is None else tuple(ids),
        centres,
        np.full(n, radius, dtype=float),
        np.full(n, radius_stddev, dtype=float),
        np.full((n, 2), velocity, dtype=float),
        np.full((n, 2, 2), centre_covariance, dtype=float),
    )


@dataclass(frozen=True, eq=False)
class Candidate(Record):
    """One way round: a homotopy class towards one goal, with a timed guess inside it.

    label: stable name such as `goal0:+l1-l2` (+ passes on the left); goal: row of the goals; sides: (obstacle id, LEFT or
    RIGHT) of the obstacles in the name; guess (N + 1, 2): positions at steps 0..N [m]; length: of the path [m].
    """

    label: str
    goal: int
    sides: tuple[tuple[str, int], ...]
    guess: Array
    length: float


class Status(Enum):
    """How a candidate's forward optimal control ended. Only SOLVED takes part in the likelihood."""

    SOLVED = 'solved'
    ETA_UNREACHABLE = 'eta_unreachable'
    INFEASIBLE = 'infeasible'
    ITERATION_LIMIT = 'iteration_limit'
    DEADLINE = 'deadline'
    LEFT_CLASS = 'left_class'


@dataclass(frozen=True, eq=False)
class Solution(Record):
    """The forward optimal control's answer for one candidate.

    status, message: how it ended, in words and numbers. dt [s]; mean (N + 1, n) and covariance (N + 1, n, n) of the state at
    steps 0..N (positions first); control (N, 2): jerk [m/s^3]. effort: J_U = sum |U|^2 [m^2/s^6]; costs: every term of J_aug
    by name [m^2/s^6]; tau [m^2] and lam (lambda [1/s^6]): where on the curve, or as given; 0 in `optimal`, which has one of each
    for every row.

    eta: achieved, the smallest over obstacles and steps, for `lv` and `hc` between the steps too; eta_at: (obstacle id, step)
    where, with fractions of a step. eta_reachable: the largest that was found, where the wanted one is out of reach, else None.
    violation: by how much the mean comes nearer to a centre than sqrt(E[R^2] + tau) [m], 0 where it never does; violation_at:
    (obstacle id, step) where.

    multipliers: (obstacle id, step, value) of the contacts that hold the mean off, in `lv` and `hc` with fractions of a step: by
    how much J_aug would grow for each metre more of distance asked for [m/s^6]; held: what each of them asks for, tau [m^2] and
    lambda [1/s^6]. slope: dk/ds on the curve of `lv` and `hc`, 0 where not known. qp_solves: QPs solved; iterations: of the loop
    of `algorithm1`, None in the others; solve_s: wall time [s].
    """

    status: Status
    message: str
    dt: float
    mean: Array
    covariance: Array
    control: Array
    effort: float
    costs: dict[str, float]
    tau: float
    lam: float
    eta: float
    eta_at: tuple[str, float] | None = None
    eta_reachable: float | None = None
    violation: float = 0.0
    violation_at: tuple[str, float] | None = None
    multipliers: tuple[tuple[str, float, float], ...] = ()
    held: tuple[tuple[float, float], ...] = ()
    slope: float = 0.0
    qp_solves: int = 0
    iterations: int | None = None
    solve_s: float = 0.0

    def with_covariance(self, covariance: Array) -> Solution:
        """Return the solution with another covariance (N + 1, n, n), fresh: `dataclasses.replace` at a tenth of the time."""
        other = object.__new__(Solution)
        vars(other).update(vars(self), covariance=as_readonly(covariance))
        return other

    @property
    def path(self) -> Array:
        """Mean positions, (N + 1, 2) [m]."""
        return self.mean[:, :2]

    @property
    def times(self) -> Array:
        """Seconds from now, (N + 1,) [s]."""
        return self.dt * np.arange(len(self.mean), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class PredictedCandidate:
    """One candidate with its solution; sides: side of every obstacle its path really passes, by id.

    cost: effort to go, what its time costs, and what all classes share, as effort spent since onset [m^2/s^5]; likelihood in
    [0, 1]: 0 unless solved.
    """

    candidate: Candidate
    solution: Solution
    sides: dict[str, int]
    cost: float
    likelihood: float

    @property
    def is_solved(self) -> bool:
        """Whether this outcome takes part in the likelihood."""
        return self.solution.status is Status.SOLVED


@dataclass(frozen=True, eq=False)
class Prediction:
    """The whole answer to one hand sample.

    outcomes: solved ones first, most likely first; then those that could not be solved, with their status.
    most_likely: label after hysteresis, None where nothing was solved. notes: facts for diagnostics (relaxed margins, merged
    classes, culled obstacles), as counts by name. solve_s: wall time of the whole prediction [s].
    """

    stamp_ns: int
    frame_id: str
    height: float
    candidates: tuple[PredictedCandidate, ...]
    most_likely: str | None
    notes: dict[str, int] = field(default_factory=dict)
    solve_s: float = 0.0

    @property
    def solved_candidates(self) -> tuple[PredictedCandidate, ...]:
        """The outcomes that meet the wanted eta, most likely first."""
        return tuple(outcome for outcome in self.candidates if outcome.is_solved)
