# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked and answered for one homotopy class: goal, candidate, and the solution of its optimal control problem."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.types import Array, Record, as_readonly

from .errors import SceneError, explain_keywords

LEFT, RIGHT = 1, -1
"""Side on which a path passes an obstacle, seen in the direction of travel."""
Signature = frozenset[tuple[str, int]]
"""The obstacles in the name of a class, by id, each with LEFT or RIGHT."""


def agrees(one: Signature, other: Signature) -> bool:
    """Tell whether two classes pass the obstacles alike: the name of one is that of the other, with obstacles left out."""
    return one <= other or other <= one


@explain_keywords('goal')
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
        Name of an obstacle that is this goal, even if it does not hold the position, or moves away from it: it does not block
        the way to this goal.

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


def label_class(goal: int, sides: Sequence[tuple[str, int]]) -> str:
    """Return the label of a class to the goal of a row, such as `goal0:+l1-l2`; sides: LEFT or RIGHT by id."""
    return f'{name_goal(goal)}:' + ''.join([('+' if side == LEFT else '-') + identity for identity, side in sides])


def describe_class(sides: Iterable[tuple[str, int]], goal: str = '') -> str:
    """Return a homotopy class in words, such as `left of l1, l3, right of l2`; goal: its name, to come first, if any."""
    names: dict[int, list[str]] = {}
    for name, side in sides:
        names.setdefault(side, []).append(name)
    words = ', '.join(f'{"left" if side == LEFT else "right"} of {", ".join(each)}' for side, each in names.items()) or 'direct'
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
        """Say the class in words and the length."""
        return f'<Candidate {self.description}, {self.length:.3g} m>'

    @property
    def description(self) -> str:
        """The homotopy class in words, such as `goal0: left of l1, right of l2`."""
        return describe_class(self.sides, self.goal_name or name_goal(self.goal))

    def contains(self, sides: Mapping[str, int]) -> bool:
        """Tell whether a path is in this class that passes obstacles on these sides, LEFT or RIGHT by id."""
        return all(sides.get(identity, side) == side for identity, side in self.sides)


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
    def is_estimate(self) -> bool:
        """Whether effort and safety are estimated, because the solution was not found to its end."""
        return self in (Status.DEADLINE, Status.ESTIMATED)

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
    safety_factor: k that belongs to eta; safety_shortfall: by how much it is below the wanted one, 0 where solved, or estimated
    where it is a condition.
    motor_covariance (N + 1, n, n): what motor noise alone causes, which eta is about; None where `covariance` is that.
    violation: by how much the mean comes nearer to a centre than sqrt(E[R^2] + tau) [m], 0 where it does not; violation_at:
    (obstacle id, step) where.

    multipliers: (obstacle id, step, value) of the active constraints, with `lv`, `hc` and `optimal` at fractions of a step; the
    value is the growth of J_aug for each metre more of required distance [m/s^6]; equivalent_weights: tau [m^2] and lambda
    [1/s^6] of each active constraint.
    qp_solves: number of QPs solved; iterations: of `algorithm1`, None for the others; solve_s: wall time of the strategy [s].
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
    def path(self) -> Array:
        """Mean positions, (N + 1, 2) [m]."""
        return self.mean[:, :2]

    @property
    def times(self) -> Array:
        """Seconds from now, (N + 1,) [s]."""
        return self.dt * np.arange(len(self.mean), dtype=np.float64)
