# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions and the measured hand for display, as plain arrays."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.plant.response import compute_curve
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import LEFT, RIGHT, Status
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Record
from foc_ros.ros.messages.ranking import compute_cost_ratios, describe_candidate, find_drawn_curve, order_candidates

COLOURS, SLOTS = 6, 12
"""Numbers of colours, and of the letters that tell candidates apart: the letters beyond F have the same colours again."""
NOTED, LIKELY = 0.01, 0.05
"""Likelihoods from which a candidate is worth mentioning, and from which its ellipses are drawn."""
GRAZE_M = 1e-3
"""Depth [m] up to which a path within an obstacle counts as one along its boundary."""
Sides = dict[str, int]
"""Side (LEFT or RIGHT) of each obstacle by its id."""


@dataclass(frozen=True, eq=False)
class CandidateView(Record):
    """One candidate with a likelihood.

    description: its class in words, with the goal where there are several; times (m,): seconds after the stamp of the snapshot;
    path (m, 2) [m]; velocity (m, 2) [m/s]; covariance and motor_covariance (m, 2, 2) of the position [m^2]: the total, and the
    part that motor noise causes, which eta is about; effort [m^2/s^6]; cost_ratio: cost over the least cost; eta: achieved
    probability of avoidance; way: number of the class while it is followed.
    """

    label: str
    description: str
    status: Status
    likelihood: float
    effort: float
    cost_ratio: float
    eta: float
    times: Array
    path: Array
    velocity: Array
    covariance: Array
    motor_covariance: Array
    way: int = 0

    @property
    def is_compromised(self) -> bool:
        """Whether eta is below the wanted one, or may be: it is an estimate."""
        return self.status is not Status.SOLVED

    @property
    def is_estimated(self) -> bool:
        """Whether effort and eta are estimates."""
        return self.status in (Status.ESTIMATED, Status.DEADLINE)

    @property
    def speed(self) -> Array:
        """Speed (m,) [m/s]."""
        speed: Array = np.linalg.norm(self.velocity, axis=1)
        return speed

    @property
    def is_widened(self) -> bool:
        """Whether the covariance holds more than the motor noise."""
        return not np.array_equal(self.covariance, self.motor_covariance)

    @property
    def curve(self) -> Array:
        """The path as a smooth curve (l, 2) [m], l >= m."""
        return compute_curve(self.path, self.velocity, float(self.times[1] - self.times[0]) if len(self.times) > 1 else 0.0)


@dataclass(frozen=True, eq=False)
class UnsolvedView(Record):
    """One candidate without a likelihood.

    status: in one word; reason: status, message and remedy in words; path (m, 2) [m]: where the attempt ended, or the guess.
    """

    label: str
    description: str
    status: str
    reason: str
    path: Array


@dataclass(frozen=True, eq=False)
class Snapshot(Record):
    """One prediction and its scene.

    candidates: those with a likelihood, most likely first; most_likely: label, None if no candidate has one; unsolved: the other
    candidates; solve_s: wall time [s], None if it is unknown; hand (2,): position of the hand [m], None if it is unknown;
    cleared: names of the obstacles that the hand passes above or below; unknown_share, other_share: of the
    likelihood, which no candidate has; goal_names: what pictures call the goals, none for `goal0` and so on.
    """

    stamp_ns: int
    obstacles: Obstacles
    goals: Array
    candidates: tuple[CandidateView, ...]
    most_likely: str | None
    unsolved: tuple[UnsolvedView, ...] = ()
    solve_s: float | None = None
    hand: Array | None = None
    cleared: Collection[str] = ()
    unknown_share: float = 0.0
    other_share: float = 0.0
    goal_names: tuple[str, ...] = ()

    @property
    def is_late(self) -> bool:
        """Whether time ran out before a path that is worth mentioning was found to its end."""
        return any(each.status is Status.DEADLINE and each.likelihood >= NOTED for each in self.candidates)

    @property
    def likely_paths(self) -> float:
        """Number of likely paths: exp of the entropy of the likelihoods that are at least LIKELY."""
        shares = np.array([each.likelihood for each in self.candidates if each.likelihood >= LIKELY])
        shares = shares / max(shares.sum(), LIKELY)
        return float(np.exp(-(shares * np.log(shares)).sum())) if len(shares) else 0.0

    def find_entered(self, view: CandidateView) -> tuple[str, float]:
        """Return the name of the first obstacle that a path leads through, and the share of the path at the deepest point.

        The name is empty if the path leads through no obstacle.

        The obstacles have their mean sizes and move on at their velocities. The beginning of a path within an obstacle that the
        hand is in does not count, nor its end within one that is its goal, nor do depths of less than GRAZE_M.
        """
        rows = [row for row, name in enumerate(self.obstacles.ids) if name not in self.cleared]
        curve, blocking = view.curve, self.obstacles.take(rows)
        if not rows or not len(curve):
            return '', 0.0
        times = np.linspace(view.times[0], view.times[-1], len(curve))
        centres = blocking.centre + times[:, None, None] * blocking.velocity
        depths = blocking.radius - measure_offsets(curve, blocking, centres)[1]
        is_inside = depths > GRAZE_M
        between = np.maximum.accumulate(~is_inside, axis=0) & np.maximum.accumulate(~is_inside[::-1], axis=0)[::-1]
        entered = np.argwhere(is_inside & between)
        if not len(entered):
            return '', 0.0
        first = int(entered[0, 1])
        deepest = np.argmax(np.where(between[:, first], depths[:, first], -np.inf))
        return blocking.ids[first], float(deepest / (len(curve) - 1))

    def describe_ghost(self, view: CandidateView | UnsolvedView) -> tuple[str, float | None]:
        """Return why a path is no proper prediction, and at which share of the path that is, None if nowhere in particular.

        It could not be solved, or leads through an obstacle; otherwise the reason is ''.
        """
        if isinstance(view, UnsolvedView):
            return view.status.replace('_', ' '), None
        name, share = self.find_entered(view)
        return (f'leads through obstacle {name}', share) if name else ('', None)


@dataclass(frozen=True, eq=False)
class HandTrajectory(Record):
    """The measured movement of the hand: stamps_ns (n,) increasing, positions (n, 2) [m], velocity (n, 2) [m/s]."""

    stamps_ns: np.ndarray[tuple[int], np.dtype[np.int64]]
    positions: Array
    velocity: Array = field(init=False)

    HALF_WIDTH_S = 0.05
    """Half of the interval of the central difference: wide enough to suppress sensor noise, short compared with a reach."""

    def __post_init__(self) -> None:
        times = self.seconds_after(int(self.stamps_ns[0]) if len(self.stamps_ns) else 0)
        begins, ends = (np.clip(times + shift, times[:1], times[-1:]) for shift in (-self.HALF_WIDTH_S, self.HALF_WIDTH_S))
        axes = self.positions.T if len(times) else ()
        displacement = [np.interp(ends, times, axis) - np.interp(begins, times, axis) for axis in axes]
        elapsed = np.where(ends > begins, ends - begins, np.inf)
        object.__setattr__(self, 'velocity', (np.array(displacement) / elapsed).T.reshape(-1, 2))
        super().__post_init__()

    @property
    def speed(self) -> Array:
        """Speed (n,) [m/s]."""
        speed: Array = np.linalg.norm(self.velocity, axis=1)
        return speed

    def seconds_after(self, origin_ns: int) -> Array:
        """Return the times (n,) [s] of the samples after an origin."""
        return (self.stamps_ns - origin_ns) / NANOSECONDS

    def between(self, start_ns: int, end_ns: int) -> slice:
        """Return the rows with start_ns <= stamp <= end_ns."""
        return slice(int(np.searchsorted(self.stamps_ns, start_ns)), int(np.searchsorted(self.stamps_ns, end_ns, side='right')))

    def find_movements(self, onset_speed: float, gap_s: float = 0.15, least_m: float = 0.03) -> list[tuple[int, int]]:
        """Return start and end [ns] of every movement.

        During a movement the hand is faster than onset_speed [m/s], pauses shorter than gap_s [s] apart; it extends over more
        than least_m [m].
        """
        rows = np.flatnonzero(self.speed > onset_speed)
        if not len(rows):
            return []
        breaks = np.flatnonzero(np.diff(self.stamps_ns[rows]) > gap_s * NANOSECONDS)
        spans = zip(np.concatenate([rows[:1], rows[breaks + 1]]), np.concatenate([rows[breaks], rows[-1:]]), strict=True)
        return [
            (int(self.stamps_ns[first]), int(self.stamps_ns[last]))
            for first, last in spans
            if np.ptp(self.positions[first : last + 1], axis=0).max() > least_m
        ]


def build_hand_trajectory(samples: Sequence[HandSample]) -> HandTrajectory:
    """Return the trajectory of hand samples; samples that are not newer than all before them are left out."""
    stamps = np.array([sample.stamp_ns for sample in samples], dtype=np.int64)
    is_newest = np.diff(np.maximum.accumulate(stamps), prepend=stamps[:1] - 1) > 0
    positions = np.array([sample.position for sample in samples]).reshape(-1, 2)
    return HandTrajectory(stamps[is_newest], positions[is_newest])


def build_candidate_views(candidates: Sequence[PredictedCandidate], goals: int = 1) -> tuple[CandidateView, ...]:
    """Return views of the candidates with a likelihood, in their order; goals: number of goals in the scene."""
    shown = tuple(each for each in candidates if each.has_likelihood)
    return tuple(_build_candidate_view(each, ratio, goals) for each, ratio in zip(shown, compute_cost_ratios(shown), strict=True))


def _build_candidate_view(candidate: PredictedCandidate, cost_ratio: float, goals: int) -> CandidateView:
    solution = candidate.solution
    return CandidateView(
        candidate.label,
        describe_candidate(candidate, goals),
        candidate.status,
        candidate.likelihood,
        solution.effort,
        cost_ratio,
        solution.eta,
        solution.times,
        solution.path,
        solution.mean[:, 2:4],
        solution.covariance[:, :2, :2],
        candidate.motor_covariance[:, :2, :2],
        candidate.way,
    )


def build_unsolved_views(candidates: Sequence[PredictedCandidate], goals: int = 1) -> tuple[UnsolvedView, ...]:
    """Return views of the candidates without a likelihood, in their order; goals: number of goals in the scene."""
    return tuple(
        UnsolvedView(each.label, describe_candidate(each, goals), each.status.value, each.reason, find_drawn_curve(each))
        for each in candidates
        if not each.has_likelihood
    )


def parse_label(label: str, ids: Collection[str]) -> tuple[str, Sides]:
    """Split a label into its goal and the sides it names; ids: of the obstacles of the scene, which may contain signs."""
    goal, _, rest = label.partition(':')
    names = '|'.join(re.escape(name) for name in sorted(ids, key=len, reverse=True))
    found = re.findall(rf'([+-])({names})(?=[+-]|$)', rest) if names else []
    return goal, {name: LEFT if sign == '+' else RIGHT for sign, name in found}


def build_snapshot(prediction: Prediction) -> Snapshot:
    """Return the snapshot of a prediction; raises FocError if the prediction holds a number that is not finite.

    The hand is where the guesses of the search begin.
    """
    return Snapshot(
        prediction.stamp_ns,
        prediction.obstacles,
        prediction.goal_positions,
        build_candidate_views(order_candidates(prediction), len(prediction.goal_positions)),
        prediction.most_likely,
        build_unsolved_views(prediction.candidates, len(prediction.goal_positions)),
        prediction.solve_s,
        next((each.candidate.guess[0] for each in sorted(prediction.candidates, key=lambda each: each.age_s)), None),
        tuple(name for name, is_cleared in zip(prediction.obstacles.ids, prediction.cleared, strict=False) if is_cleared),
        prediction.unknown,
        prediction.other,
        prediction.goal_names,
    )
