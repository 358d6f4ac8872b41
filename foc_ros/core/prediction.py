# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A prediction: candidates with their likelihoods, goals, and the shares of what is unknown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Self, overload

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.solution import Candidate, Solution, Status, name_goal
from foc_ros.core.types import NANOSECONDS, Array, Record

from .errors import InputError
from .interpolation import interpolate_covariance, interpolate_position


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
    by id. cost: effort to go times the length of a step [m^2/s^5], with several goals times a factor of each that makes goals
    comparable (`goals`); likelihood in [0, 1]: 0 unless
    solved, compromised or estimated. age_s: 0, or how long ago the solution was found [s], of which this is the rest, if it was
    not solved now. way: a number that stays the same for as long as the class is followed, whatever its label and its rank are.
    height: the movement along the normal of the plane, None where it is not predicted: the hand then stays at its height.
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
        """Say the class in words, status and likelihood."""
        return f'<PredictedCandidate {self.description}, {self.status.value}, likelihood {self.likelihood:.2f}>'

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
        return self.solution.status.is_estimate

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
        times = self._check_times(t)
        return interpolate_position(self.mean, self.solution.dt, times.reshape(-1)).reshape(*times.shape, 2)

    def covariance_at(self, t: ArrayLike) -> Array:
        """Return the covariance of the position at times between the steps, too: the total uncertainty.

        Parameters
        ----------
        t : float or array_like of shape (q,)
            Seconds from now, in [0, `times[-1]`].

        Returns
        -------
        ndarray of shape (2, 2) or (q, 2, 2)
            Covariance [m^2]: within a step the quintic through the values and their first two derivatives at both ends; evenly
            between both values for a plant whose state has no acceleration.

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
        if not ((times >= 0.0) & (times <= end * (1.0 + 1e-9))).all():
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

    @overload
    def __getitem__(self, place: int) -> PredictedCandidate: ...

    @overload
    def __getitem__(self, place: slice) -> tuple[PredictedCandidate, ...]: ...

    def __getitem__(self, place: int | slice) -> PredictedCandidate | tuple[PredictedCandidate, ...]:
        """Return the candidate at a place, or those of a slice."""
        return self.candidates[place]

    def __iter__(self) -> Iterator[PredictedCandidate]:
        """Yield the candidates in their order."""
        return iter(self.candidates)

    def __bool__(self) -> bool:
        """Be true, also without candidates: a prediction is there."""
        return True

    def __repr__(self) -> str:
        """Say time, number of candidates and the most likely one."""
        found = [each for each in self.candidates if each.label == self.most_likely]
        best = f'most likely {found[0].description} ({found[0].likelihood:.2f})' if found else 'none solved'
        return f'<Prediction t={self.t:g} s, {len(self.candidates)} candidates, {best}>'

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
