# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The records that pass between the parts of the package: frozen, with read-only arrays, SI units, in the task plane.

message -> HandSample -> HandState -> Candidates -> Solutions -> Prediction -> message.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, StrEnum
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError, SceneError
from .interpolation import interpolate_covariance, interpolate_position

Array = NDArray[np.float64]

NANOSECONDS = 1_000_000_000
LEFT, RIGHT = 1, -1
"""Side on which a path passes an obstacle, seen in the direction of travel."""
ROUNDING = 1e-9
"""Relative error of a time that may be that of rounding."""
SHOWN_NAMES = 5
"""Number of obstacles that the repr of a table names."""


def as_readonly(array: Array) -> Array:
    """Make a new array read-only, so that a record takes it without a copy; no other code may hold a reference to it."""
    array.setflags(write=False)
    return array


UNKNOWN_HEIGHTS = as_readonly(np.array([-np.inf, np.inf]))
"""Lowest and highest point of an obstacle whose height is not known [m]: it blocks at every height."""


class Record:
    """Base of the records: after construction every array field is read-only and C-contiguous."""

    def __post_init__(self) -> None:
        values = vars(self)
        for name, value in values.items():
            if isinstance(value, np.ndarray) and ((flags := value.flags).writeable or not flags.c_contiguous):
                values[name] = as_readonly(value.copy())

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a record from another process, where its arrays have become writeable."""
        vars(self).update(state)
        Record.__post_init__(self)


@dataclass(frozen=True, eq=False)
class HandSample(Record):
    """One measured hand position.

    stamp_ns: message stamp [ns]; position (2,): in the task plane [m]; height: along the plane's normal [m];
    frame_id: frame of the measurement.
    """

    stamp_ns: int
    position: Array
    height: float = 0.0
    frame_id: str = ''


class Rest(NamedTuple):
    """Shares of the likelihood that no candidate has: of classes that are unknown, and of a goal that nobody announced."""

    unknown: float = 0.0
    other: float = 0.0


class SampleStatus(StrEnum):
    """What became of a message that was given to the predictor.

    ACCEPTED: used. RESTARTED_BACKWARD, RESTARTED_GAP, RESTARTED_JUMP: used, and the movement restarts from it. DISENGAGED: the
    hand was followed, but nothing is predicted from it. JUMPED: refused, and kept until the next one decides whether it is an
    outlier. SKIPPED: not used, because it is too near to the last one. DUPLICATE, LATE, WRONG_FRAME: refused. The last four
    change nothing.
    """

    ACCEPTED = 'accepted'
    DUPLICATE = 'duplicate'
    LATE = 'late'
    RESTARTED_BACKWARD = 'restarted_backward'
    RESTARTED_GAP = 'restarted_gap'
    RESTARTED_JUMP = 'restarted_jump'
    JUMPED = 'jumped'
    WRONG_FRAME = 'wrong_frame'
    SKIPPED = 'skipped'
    DISENGAGED = 'disengaged'

    @property
    def is_refused(self) -> bool:
        """Whether the message was rejected."""
        return self in (SampleStatus.JUMPED, SampleStatus.DUPLICATE, SampleStatus.LATE, SampleStatus.WRONG_FRAME)

    @property
    def is_taken(self) -> bool:
        """Whether the message was used."""
        return not self.is_refused and self is not SampleStatus.SKIPPED

    @property
    def is_restart(self) -> bool:
        """Whether the movement restarts from this message."""
        return self in (SampleStatus.RESTARTED_BACKWARD, SampleStatus.RESTARTED_GAP, SampleStatus.RESTARTED_JUMP)


@dataclass(frozen=True, eq=False)
class HandState(Record):
    """The estimated state of the hand at a stamp.

    mean (6,): x, y, vx, vy, ax, ay [m, m/s, m/s^2]; covariance (6, 6) in the same order;
    height: as measured, along the plane's normal [m]; onset_ns: stamp at which the present movement began, None at rest;
    onset_position (2,): where it began [m]; height_mean (3,): height, its velocity and its acceleration, with the covariance that
    x, vx and ax have.
    """

    stamp_ns: int
    mean: Array
    covariance: Array
    height: float = 0.0
    frame_id: str = ''
    onset_ns: int | None = None
    onset_position: Array | None = None
    height_mean: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, eq=False, repr=False)
class Obstacles(Record):
    """Rounded convex polygons in the task plane, as a table of n rows; a circle is a polygon with one vertex, at its centre.

    ids: name of each, used in labels; centre (n, 2): a point inside [m]; radius (n,): mean distance of the boundary from the
    polygon [m]; radius_stddev (n,) [m]; velocity (n, 2) [m/s]; centre_covariance (n, 2, 2) [m^2]; vertices (n, V, 2): of the
    polygons, anticlockwise, relative to the centre [m]; corners (n,): number of vertices of each, rows beyond are not used;
    heights (n, 2): lowest and highest point of each along the plane's normal [m], UNKNOWN_HEIGHTS where they are not known.
    """

    ids: tuple[str, ...]
    centre: Array
    radius: Array
    radius_stddev: Array
    velocity: Array
    centre_covariance: Array
    vertices: Array
    corners: NDArray[np.intp]
    heights: Array

    def __len__(self) -> int:
        return len(self.ids)

    def __repr__(self) -> str:
        """Count the obstacles and name the first few."""
        names = ', '.join(self.ids[:SHOWN_NAMES]) + (', ...' if len(self) > SHOWN_NAMES else '')
        return f'<Obstacles: {len(self)}{names and f" ({names})"}>'

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
            self.vertices[index],
            self.corners[index],
            self.heights[index],
        )

    @property
    def extent(self) -> Array:
        """Largest distance of the boundary of each obstacle from its centre, (n,) [m]."""
        farthest: Array = np.hypot(self.vertices[..., 0], self.vertices[..., 1]).max(axis=1, initial=0.0) + self.radius
        return farthest

    def grow(self, radius: float) -> Obstacles:
        """Return the obstacles with a radius [m] added to those of all, such as that of the hand."""
        return replace(self, radius=self.radius + radius) if radius else self

    def after(self, seconds: float) -> Obstacles:
        """Return the obstacles at a time `seconds` [s] later, each moved on at its velocity."""
        if not self.velocity.any():
            return self
        return replace(self, centre=self.centre + seconds * self.velocity)


def make_obstacles(
    centre: ArrayLike = (),
    radius: ArrayLike = (),
    radius_stddev: ArrayLike = 0.0,
    ids: tuple[str, ...] | None = None,
    velocity: ArrayLike = 0.0,
    centre_covariance: ArrayLike = 0.0,
    polygons: Sequence[Array] | None = None,
    heights: ArrayLike = UNKNOWN_HEIGHTS,
) -> Obstacles:
    """Build `Obstacles` from array-likes; scalars hold for every row, and ids default to the numbers of the rows.

    polygons: vertices of each (v, 2), anticlockwise, relative to the centre [m]; circles if not given. heights: (n, 2) or (2,).
    """
    centres = np.asarray(centre, dtype=float).reshape(-1, 2)
    n = len(centres)
    corners = np.ones(n, dtype=np.intp) if polygons is None else np.array([len(each) for each in polygons], dtype=np.intp)
    vertices = np.zeros((n, corners.max(initial=1), 2))
    for row, each in enumerate(polygons or ()):
        vertices[row, : len(each)] = each
    return Obstacles(
        tuple(str(i) for i in range(n)) if ids is None else tuple(ids),
        centres,
        np.full(n, radius, dtype=float),
        np.full(n, radius_stddev, dtype=float),
        np.full((n, 2), velocity, dtype=float),
        np.full((n, 2, 2), centre_covariance, dtype=float),
        vertices,
        corners,
        np.full((n, 2), heights, dtype=float),
    )


@dataclass(frozen=True, eq=False, repr=False)
class Goal(Record):
    """A position to which the hand may be going.

    Parameters
    ----------
    position : array_like of shape (2,) or (3,)
        In the task plane [m]; a third number is the height over it.
    name : str, optional
        What `Prediction.goals`, descriptions and pictures call the goal; by default ``goal0`` and so on, by its place in the list
        of goals. Labels keep this number.
    object : str, optional
        Name of an obstacle that is this goal, even if it does not hold the position: it does not block the way to this goal.

    Raises
    ------
    SceneError
        For a wrong shape, a number that is not finite, or a name that is no text or empty.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.Goal((0.3, 0.0), name='bowl')
    <Goal bowl at (0.3, 0) m>
    """

    position: ArrayLike
    name: str | None = None
    object: str | None = None

    def __post_init__(self) -> None:
        from .support import check_position  # it needs this module

        object.__setattr__(self, 'position', check_position('goal.position', self.position))
        texts: dict[str, Any] = {'name': self.name, 'object': self.object}
        for field_name, text in texts.items():
            if text is not None and (not isinstance(text, str) or not text.strip()):
                raise SceneError(f'goal.{field_name}', 'a text that is not empty', repr(text))
        super().__post_init__()

    def __repr__(self) -> str:
        """Say name and position."""
        numbers = ', '.join(f'{each:g}' for each in np.asarray(self.position).tolist())
        return f'<Goal {self.name + " " if self.name else ""}at ({numbers}) m>'


def name_goal(row: int) -> str:
    """Return the name of the goal of a row that was given none, as labels begin with it."""
    return f'goal{row}'


def describe_class(sides: Iterable[tuple[str, int]], goal: str = '') -> str:
    """Return a homotopy class in words, such as `left of l1, right of l2`; goal: its name, which comes first if it is given."""
    words = ', '.join(f'{"left" if side == LEFT else "right"} of {name}' for name, side in sides) or 'direct'
    return f'{goal}: {words}' if goal else words


@dataclass(frozen=True, eq=False, repr=False)
class Candidate(Record):
    """A homotopy class towards one goal that is followed, with a timed guess of a path inside it.

    label: stable name such as `goal0:+l1-l2` (+ passes on the left); goal: row of the goals; sides: (obstacle id, LEFT or
    RIGHT) of the obstacles in the name; guess (N + 1, 2): positions at steps 0..N [m]; length: of the path [m]; goal_name: what
    the goal is called, `goal0` and so on if not given.
    """

    label: str
    goal: int
    sides: tuple[tuple[str, int], ...]
    guess: Array
    length: float
    goal_name: str = ''

    def __repr__(self) -> str:
        """Say label and length."""
        return f'<Candidate {self.label}, {self.length:.3g} m>'

    @property
    def description(self) -> str:
        """The homotopy class in words, such as `goal0: left of l1, right of l2`."""
        return describe_class(self.sides, self.goal_name or name_goal(self.goal))


class Status(Enum):
    """Result of the forward optimal control of a candidate. All that are solved or estimated have a likelihood.

    SOLVED: the solution meets the wanted eta. COMPROMISED: it meets a smaller eta only, which makes it less likely.
    ETA_UNREACHABLE: the same, where less than the wanted eta is not allowed. INFEASIBLE: no path of the class meets the goal and
    the constraints. ITERATION_LIMIT: the result does not meet what it promises. DEADLINE: time ran out before it was settled:
    effort and safety are estimated from its last iterate. ESTIMATED: the same where it was not settled after the most QPs, or is
    so unlikely that it goes on in the next prediction; or the solver failed where the search has found a path: path, effort and
    safety are estimated from its length. LEFT_CLASS: the solution lies in another homotopy class.
    """

    SOLVED = 'solved'
    COMPROMISED = 'compromised'
    ETA_UNREACHABLE = 'eta_unreachable'
    INFEASIBLE = 'infeasible'
    ITERATION_LIMIT = 'iteration_limit'
    DEADLINE = 'deadline'
    ESTIMATED = 'estimated'
    LEFT_CLASS = 'left_class'

    @property
    def has_likelihood(self) -> bool:
        """Whether a candidate that ended so takes part in the likelihood."""
        return self in (Status.SOLVED, Status.COMPROMISED, Status.DEADLINE, Status.ESTIMATED)

    @property
    def remedy(self) -> str:
        """What helps against this result, in words; empty for a solved candidate."""
        return _REMEDIES[self.value]


_REMEDIES = {
    'solved': '',
    'compromised': 'allow more time or a smaller eta',
    'eta_unreachable': 'allow more time, a smaller eta, or a finite likelihood.shortfall',
    'infeasible': 'none for this class, whose gap is closed; check the radii of its obstacles if people pass here',
    'iteration_limit': 'choose another foc.strategy',
    'deadline': 'allow a longer budget_s or fewer homotopy.max_candidates',
    'estimated': 'none where the class is unlikely; otherwise choose another foc.strategy',
    'left_class': 'choose another foc.strategy',
}


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Record):
    """The forward optimal control of one candidate.

    Units are those of the triple integrator, whose control is jerk [m/s^3]; with another plant m/s^3 becomes the unit of its
    control.

    status, message: result in words and numbers. dt [s]; mean (N + 1, n) and covariance (N + 1, n, n) of the state at
    steps 0..N (positions first, then velocities); control (N, 2) [m/s^3]. effort: J_U = sum |U|^2 [m^2/s^6]; costs: every term of
    J_aug by name [m^2/s^6]; tau [m^2] and lam (lambda [1/s^6]): the parameters of the final QP; both are 0 for `optimal`, which
    has a pair for each constraint.

    eta: achieved, the smallest over obstacles and steps, and with `lv`, `hc` and `optimal` also between the steps; eta_at:
    (obstacle id, step) where, with fractions of a step. eta_reachable: the largest eta found if the wanted one is unreachable.
    safety_factor: k that belongs to eta; safety_shortfall: by how much it is below the wanted one, 0 where solved, and what is
    expected of it where time ran out.
    motor_covariance (N + 1, n, n): what motor noise alone causes, which eta is about; None where `covariance` is that.
    violation: by how much the mean comes nearer to a centre than sqrt(E[R^2] + tau) [m], 0 where it does not; violation_at:
    (obstacle id, step) where.

    multipliers: (obstacle id, step, value) of the active constraints, with `lv`, `hc` and `optimal` at fractions of a step; the
    value is the growth of J_aug for each metre more of required distance [m/s^6]; equivalent_weights: tau [m^2] and lambda
    [1/s^6] of each active constraint. expected: the effort that is expected where time ran out, None elsewhere.
    qp_solves: number of QPs solved; iterations: of `algorithm1`, None for the others; solve_s: wall time [s].
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
    safety_factor: float = 0.0
    safety_shortfall: float = 0.0
    violation: float = 0.0
    violation_at: tuple[str, float] | None = None
    multipliers: tuple[tuple[str, float, float], ...] = ()
    equivalent_weights: tuple[tuple[float, float], ...] = ()
    expected: float | None = None
    qp_solves: int = 0
    iterations: int | None = None
    solve_s: float = 0.0
    motor_covariance: Array | None = None

    def __repr__(self) -> str:
        """Say the status, the effort and the eta achieved."""
        return f'<Solution {self.status.value}, effort {self.effort:.4g}, eta {self.eta:.4g}>'

    def with_covariance(self, covariance: Array) -> Solution:
        """Return the solution with another total covariance (N + 1, n, n), a new array; faster than `dataclasses.replace`."""
        other = object.__new__(type(self))
        motor = self.covariance if self.motor_covariance is None else self.motor_covariance
        vars(other).update(vars(self), covariance=as_readonly(covariance), motor_covariance=motor)
        return other

    @property
    def expected_effort(self) -> float:
        """The effort with which the class is compared [m^2/s^6]."""
        return self.effort if self.expected is None else self.expected

    @property
    def path(self) -> Array:
        """Mean positions, (N + 1, 2) [m]."""
        return self.mean[:, :2]

    @property
    def times(self) -> Array:
        """Seconds from now, (N + 1,) [s]."""
        return self.dt * np.arange(len(self.mean), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class HeightTrajectory(Record):
    """The predicted movement along the normal of the task plane, at steps 0..N of a candidate.

    mean (N + 1, m): height [m], its velocity [m/s] and what else one axis of the plant has; covariance, motor_covariance
    (N + 1, m, m): of these, in total and the part that motor noise causes. Height and position in the plane are independent.
    """

    mean: Array
    covariance: Array
    motor_covariance: Array

    @property
    def stddev(self) -> Array:
        """Standard deviation of the height, (N + 1,) [m]."""
        stddev: Array = np.sqrt(np.maximum(self.covariance[:, 0, 0], 0.0))
        return stddev


@dataclass(frozen=True, eq=False, repr=False)
class PredictedCandidate:
    """One candidate with its solution and likelihood.

    candidate: the homotopy class; solution: its forward optimal control; sides: side on which the mean path passes each obstacle,
    by id. cost: effort to go times the length of a step [m^2/s^5], comparable between goals; likelihood in [0, 1]: 0 unless
    solved, compromised or estimated. age_s: 0, or how long ago the solution was found, of which this is the rest, if it failed
    [s]. way: a number that stays the same for as long as the class is followed, whatever its label and its rank are. height: the
    movement along the normal of the plane, None where it is not predicted: the hand then stays at its height.
    """

    candidate: Candidate
    solution: Solution
    sides: dict[str, int]
    cost: float
    likelihood: float
    age_s: float = 0.0
    way: int = 0
    height: HeightTrajectory | None = None

    def __repr__(self) -> str:
        """Say label, status and likelihood."""
        return f'<PredictedCandidate {self.label}, {self.status.value}, likelihood {self.likelihood:.2f}>'

    def with_goal_name(self, name: str) -> PredictedCandidate:
        """Return the candidate with a name for its goal, for its description."""
        return replace(self, candidate=replace(self.candidate, goal_name=name))

    @property
    def is_solved(self) -> bool:
        """Whether the solution meets the wanted eta."""
        return self.solution.status is Status.SOLVED

    @property
    def is_estimated(self) -> bool:
        """Whether the solution was not found to its end, so that its effort and its safety are estimated."""
        return self.solution.status in (Status.DEADLINE, Status.ESTIMATED)

    @property
    def has_likelihood(self) -> bool:
        """Whether this candidate takes part in the likelihood: it is solved, compromised or estimated."""
        return self.status.has_likelihood

    @property
    def label(self) -> str:
        """Name of the homotopy class, such as `goal0:+l1-l2`."""
        return self.candidate.label

    @property
    def description(self) -> str:
        """The homotopy class in words, such as `goal0: left of l1, right of l2`."""
        return self.candidate.description

    @property
    def status(self) -> Status:
        """Result of the forward optimal control."""
        return self.solution.status

    @property
    def reason(self) -> str:
        """Status, message, and what helps, in words; only the status if the candidate is solved."""
        parts = (self.status.value.replace('_', ' '), self.solution.message, self.status.remedy)
        return parts[0] if self.is_solved else ': '.join(parts[:2]) + f'; remedy: {parts[2]}'

    @property
    def mean(self) -> Array:
        """Mean state at steps 0..N, (N + 1, n): position [m], velocity [m/s], and what else the plant has."""
        return self.solution.mean

    @property
    def covariance(self) -> Array:
        """Covariance of the state at steps 0..N, (N + 1, n, n): the total uncertainty."""
        return self.solution.covariance

    @property
    def motor_covariance(self) -> Array:
        """The part of the covariance that motor noise causes, (N + 1, n, n): eta is about this one."""
        motor = self.solution.motor_covariance
        return self.solution.covariance if motor is None else motor

    @property
    def times(self) -> Array:
        """Seconds from now, (N + 1,) [s]."""
        return self.solution.times

    def position_at(self, t: ArrayLike) -> Array:
        """Return the mean position at times between the steps, too.

        Parameters
        ----------
        t : float or array_like of shape (q,)
            Seconds from now, in [0, `times[-1]`].

        Returns
        -------
        ndarray of shape (2,) or (q, 2)
            Position [m]: within a step the cubic through the positions and velocities at both ends.

        Raises
        ------
        InputError
            For a time beyond the prediction, or a candidate without a path.
        """
        return interpolate_position(self.mean, self.solution.dt, self._check_times(t))

    def covariance_at(self, t: ArrayLike) -> Array:
        """Return the covariance of the position at times between the steps, too: the total uncertainty.

        Parameters
        ----------
        t : float or array_like of shape (q,)
            Seconds from now, in [0, `times[-1]`].

        Returns
        -------
        ndarray of shape (2, 2) or (q, 2, 2)
            Covariance [m^2]: within a step the quintic through the values and their first two derivatives at both ends.

        Raises
        ------
        InputError
            For a time beyond the prediction, or a candidate without a path.
        """
        return interpolate_covariance(self.covariance, self.solution.dt, self._check_times(t))

    def _check_times(self, t: ArrayLike) -> Array:
        if len(self.mean) < 2:
            raise InputError('t', 'a candidate with a path', f'{self.label}, {self.status.value}')
        end = float(self.times[-1])
        try:
            times = np.asarray(t, dtype=float)
        except (TypeError, ValueError):
            times = np.array(np.nan)
        if not ((times >= 0.0) & (times <= end * (1.0 + ROUNDING))).all():
            raise InputError('t', f'seconds from now in [0, {end:.6g}], the end of the prediction', repr(t))
        checked: Array = np.minimum(times, end)
        return checked

    @property
    def eta(self) -> float:
        """Probability of avoidance that the solution achieves."""
        return self.solution.eta

    @property
    def effort(self) -> float:
        """Control effort sum |U|^2 [m^2/s^6]."""
        return self.solution.effort


@dataclass(frozen=True, eq=False, repr=False)
class PredictedGoal(Record):
    """One goal of a prediction.

    name: as given, `goal0` and so on by its row otherwise; position (2,) [m]. likelihood in [0, 1]: of its candidates together;
    None where none of them has one, which says nothing about the goal. What is `unknown` in a prediction may belong to any goal.
    """

    name: str
    position: Array
    likelihood: float | None

    def __repr__(self) -> str:
        """Say name, position and likelihood."""
        x, y = self.position.tolist()
        shown = 'unknown' if self.likelihood is None else f'{self.likelihood:.2f}'
        return f'<PredictedGoal {self.name} at ({x:g}, {y:g}) m, likelihood {shown}>'


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Record):
    """The prediction that belongs to one hand sample.

    candidates: solved, compromised and estimated ones, most likely first; then those without a likelihood, with their status.
    most_likely: label after hysteresis, None where no candidate has a likelihood. notes: facts for diagnostics (relaxed margins,
    merged classes, culled obstacles), as counts by name. solve_s: wall time of the whole prediction [s]. obstacles: all that were
    given, at the stamp of the hand; goal_positions (g, 2) [m]; goal_names (g,): empty if none was given. cleared (n,): whether
    the predicted height clears each obstacle, which therefore does not block. unknown: share of the likelihood that belongs to
    classes that are not among the candidates; other: that of a goal that nobody announced.
    """

    stamp_ns: int
    frame_id: str
    height: float
    candidates: tuple[PredictedCandidate, ...]
    most_likely: str | None
    notes: dict[str, int] = field(default_factory=dict)
    solve_s: float = 0.0
    obstacles: Obstacles = field(default_factory=make_obstacles)
    goal_positions: Array = field(default_factory=lambda: np.zeros((0, 2)))
    cleared: tuple[bool, ...] = ()
    unknown: float = 0.0
    other: float = 0.0
    goal_names: tuple[str, ...] = ()

    def __len__(self) -> int:
        """Count the candidates."""
        return len(self.candidates)

    def __iter__(self) -> Iterator[PredictedCandidate]:
        """Yield the candidates in their order."""
        return iter(self.candidates)

    def __bool__(self) -> bool:
        """Be true, also without candidates: a prediction is there."""
        return True

    def __repr__(self) -> str:
        """Say time, number of candidates and the most likely one."""
        likelihoods = {each.label: each.likelihood for each in self.candidates}
        best = 'none solved' if self.most_likely is None else f'most likely {self.most_likely}'
        share = f' ({likelihoods[self.most_likely]:.2f})' if self.most_likely in likelihoods else ''
        return f'<Prediction t={self.t:g} s, {len(self.candidates)} candidates, {best}{share}>'

    @property
    def t(self) -> float:
        """Time of the hand sample [s]."""
        return self.stamp_ns / NANOSECONDS

    def with_goal_names(self, names: tuple[str, ...]) -> Self:
        """Return the prediction with names (g,) for its goals, which then stand in the descriptions of its candidates, too."""
        candidates = tuple(each.with_goal_name(names[each.candidate.goal]) for each in self.candidates)
        return replace(self, candidates=candidates, goal_names=names)

    @property
    def goals(self) -> tuple[PredictedGoal, ...]:
        """The goals in their order, each with its name, its position and its likelihood."""
        likelihoods: dict[int, float] = {}
        for each in self.candidates_with_likelihood:
            row = each.candidate.goal
            likelihoods[row] = likelihoods.get(row, 0.0) + each.likelihood
        names = self.goal_names or tuple(map(name_goal, range(len(self.goal_positions))))
        rows = zip(names, self.goal_positions, strict=True)
        return tuple(PredictedGoal(*each, likelihoods.get(row)) for row, each in enumerate(rows))

    @property
    def blocking_obstacles(self) -> Obstacles:
        """The obstacles that the predicted height does not clear."""
        if not any(self.cleared):
            return self.obstacles
        return self.obstacles.take([row for row, is_cleared in enumerate(self.cleared) if not is_cleared])

    @property
    def solved_candidates(self) -> tuple[PredictedCandidate, ...]:
        """The candidates that meet the wanted eta, most likely first."""
        return tuple(each for each in self.candidates if each.is_solved)

    @property
    def candidates_with_likelihood(self) -> tuple[PredictedCandidate, ...]:
        """The candidates that take part in the likelihood, most likely first."""
        return tuple(each for each in self.candidates if each.has_likelihood)
