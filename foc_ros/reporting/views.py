"""Predictions for display: plain arrays, from the predictor's records or the node's messages; and their tracks over time."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.plant.response import compute_curve, fall_as_minimum_jerk
from foc_ros.core.types import (
    LEFT,
    NANOSECONDS,
    RIGHT,
    Array,
    HandSample,
    Obstacles,
    PredictedCandidate,
    Prediction,
    Record,
    describe_class,
)
from foc_ros.ros.messages.decode_poses import decode_stamp
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, LIKELIHOOD_COLUMNS, OTHER, STAMP, UNKNOWN
from foc_ros.ros.messages.plane import project
from foc_ros.ros.messages.ranking import compute_cost_ratios, describe_candidate, find_drawn_curve, order_candidates

COLOURS, SLOTS = 6, 12
"""Numbers of colours, and of the letters that tell candidates apart: the letters beyond F have the same colours again."""
GRAZE_M = 1e-3
"""Depth [m] up to which a path within an obstacle counts as one along its boundary."""
Sides = dict[str, int]
"""Side (LEFT or RIGHT) of each obstacle by its id."""


@dataclass(frozen=True, eq=False)
class CandidateView(Record):
    """One candidate with a likelihood.

    description: its class in words, with the goal where there are several; is_compromised: whether eta is below the wanted one,
    or may be, where is_estimated; is_estimated: whether effort and eta are estimates, which is unknown of a message;
    times (m,): seconds after the stamp of the snapshot; path (m, 2) [m]; velocity (m, 2) [m/s]; covariance and motor_covariance
    (m, 2, 2) of the position [m^2]: the total, and the part that motor noise causes, which eta is about; effort [m^2/s^6];
    cost_ratio: cost over the least cost; eta: achieved probability of avoidance; way: number of the class while it is followed.
    """

    label: str
    description: str
    is_compromised: bool
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
    is_estimated: bool = False

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

    def begin_at(self, hand: Array) -> CandidateView:
        """Return the view with a path from a position (2,) [m], which merges into the old one as by a minimum-jerk movement."""
        if len(self.path) < 2:
            return self
        s, rate = np.linspace(0.0, 1.0, len(self.path)), 1.0 / float(self.times[-1])
        fall, slope, _ = fall_as_minimum_jerk(s)
        apart = hand - self.path[0]
        return replace(self, path=self.path + np.outer(fall, apart), velocity=self.velocity + np.outer(rate * slope, apart))


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
    likelihood, which no candidate has.
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

    def begin_at(self, hand: Array) -> Snapshot:
        """Return the snapshot with paths that begin at the hand (2,) [m].

        An answer that is kept for a moment after the last one, because the computer was too busy for a new one, begins where the
        hand was expected then. The filtered hand, where all others begin, is about a millimetre beside the measured one.
        """
        candidates = tuple(each.begin_at(hand) for each in self.candidates)
        unsolved = tuple(replace(each, path=np.concatenate([hand[None], each.path[1:]])) for each in self.unsolved)
        return replace(self, candidates=candidates, unsolved=unsolved, hand=hand)

    def find_entered(self, view: CandidateView) -> str:
        """Return the name of the first obstacle that a path leads through, empty if it leads through none.

        The obstacles have their mean sizes and move on at their velocities. The beginning of a path within an obstacle that the
        hand is in does not count, nor do depths of less than GRAZE_M.
        """
        rows = [row for row, name in enumerate(self.obstacles.ids) if name not in self.cleared]
        curve, blocking = view.curve, self.obstacles.take(rows)
        if not rows or not len(curve):
            return ''
        times = np.linspace(view.times[0], view.times[-1], len(curve))
        centres = blocking.centre + times[:, None, None] * blocking.velocity
        depths = blocking.radius - measure_offsets(curve, blocking, centres)[1]
        is_inside = depths > GRAZE_M
        has_left = np.maximum.accumulate(~is_inside, axis=0)
        entered = np.argwhere(is_inside & has_left)
        return blocking.ids[int(entered[0, 1])] if len(entered) else ''

    def describe_ghost(self, view: CandidateView | UnsolvedView) -> str:
        """Return why a path is no proper prediction: it could not be solved, or leads through an obstacle; otherwise ''."""
        if isinstance(view, UnsolvedView):
            return view.status.replace('_', ' ')
        name = self.find_entered(view)
        return f'leads through obstacle {name}' if name else ''


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

    def position_at(self, stamp_ns: int) -> Array:
        """Return the position (2,) [m] at a stamp: the last one until then, the first one before all."""
        row = int(np.searchsorted(self.stamps_ns, stamp_ns, side='right')) - 1
        position: Array = self.positions[max(row, 0)]
        return position

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
        not candidate.is_solved,
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
        candidate.is_estimated,
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


def _describe_label(label: str, ids: Collection[str], goals: int) -> str:
    """Return the class of a label in words, with its goal if there are several goals; empty if it names an unknown obstacle."""
    goal, sides = parse_label(label, ids)
    is_read = len(label) == len(goal) + 1 + sum(1 + len(name) for name in sides)
    return describe_class(sides.items(), goal if goals > 1 else '') if is_read else ''


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
    )


def is_same_prediction(cloud: Any, likelihoods: Any) -> bool:
    """Whether messages of `~/prediction` and `~/likelihoods` hold the same prediction."""
    return bool(likelihoods.layout.dim[2].label == f'{STAMP}{decode_stamp(cloud.header)}')


def read_snapshot(cloud: Any, likelihoods: Any, plane: str, obstacles: Obstacles, goals: Array) -> Snapshot:
    """Return the snapshot in a pair of messages of `~/prediction` and `~/likelihoods`: inverse of `messages.encode_prediction`.

    obstacles and goals (g, 2) [m] are those at the stamp of the messages. Raises MessageError if the two messages hold different
    predictions.
    """
    if not is_same_prediction(cloud, likelihoods):
        raise MessageError('likelihoods', 'those of the prediction', 'those of another prediction')
    rows, columns = _read_cloud(cloud), np.asarray(likelihoods.data, dtype=float).reshape(-1, len(LIKELIHOOD_COLUMNS))
    labels = likelihoods.layout.dim[0].label.split(';') if len(columns) else []
    shares = {UNKNOWN: 0.0 if labels else 1.0, OTHER: 0.0}
    while labels and labels[-1] in shares:
        shares[labels[-1]], labels, columns = float(columns[-1, 0]), labels[:-1], columns[:-1]
    candidates = []
    for number, (label, values) in enumerate(zip(labels, columns, strict=True)):
        name = label, _describe_label(label, obstacles.ids, len(goals))
        candidates.append(_read_candidate(name, values, rows[rows['candidate'] == number], plane))
    cleared = []
    if len(rows) and len(obstacles):
        height = project(np.stack([rows[axis].astype(float) for axis in 'xyz'], axis=-1), plane)[1]
        is_cleared = (height.min() > obstacles.heights[:, 1]) | (height.max() < obstacles.heights[:, 0])
        cleared = [name for name, is_out in zip(obstacles.ids, is_cleared, strict=True) if is_out]
    most_likely = candidates[0].label if candidates else None
    return Snapshot(
        decode_stamp(cloud.header),
        obstacles,
        goals,
        tuple(candidates),
        most_likely,
        cleared=cleared,
        unknown_share=shares[UNKNOWN],
        other_share=shares[OTHER],
    )


def _read_candidate(name: tuple[str, str], values: Array, rows: Any, plane: str) -> CandidateView:
    def stack(names: Sequence[str]) -> Array:
        return np.stack([rows[name].astype(float) for name in names], axis=-1)

    path, _ = project(stack('xyz'), plane)
    velocity, _ = project(stack(('vx', 'vy', 'vz')), plane)
    covariances = []
    for prefix in ('', 'motor_'):
        pairs = [prefix + pair for pair in ('xx', 'xy', 'xz', 'xy', 'yy', 'yz', 'xz', 'yz', 'zz')]
        half, _ = project(stack(pairs).reshape(-1, 3, 3), plane)
        covariances.append(project(half.swapaxes(1, 2), plane)[0])
    likelihood, effort, cost_ratio, eta = values.tolist()
    head = *name, bool(rows['compromised'].any()), likelihood, effort, cost_ratio, eta
    return CandidateView(*head, rows['t'].astype(float), path, velocity, covariances[0], covariances[1], int(rows['way'][0]))


def _read_cloud(cloud: Any) -> Any:
    if cloud.point_step != CLOUD_ROW.itemsize:
        raise MessageError('point_step', str(CLOUD_ROW.itemsize), cloud.point_step)
    return np.frombuffer(cloud.data, dtype=CLOUD_ROW) if len(cloud.data) else np.zeros(0, dtype=CLOUD_ROW)


@dataclass(frozen=True)
class CandidateTracks:
    """Snapshots with their candidates associated over time: a track has the candidates whose class has the same number.

    tracks: for each snapshot, the number of the track of each candidate, by label; slots: of each track, the slot that gives its
    letter and colour. Tracks without a slot are missing there.
    """

    snapshots: Sequence[Snapshot]
    tracks: Sequence[Mapping[str, int]]
    slots: Mapping[int, int]

    def between(self, start_ns: int, end_ns: int) -> CandidateTracks:
        """Return the part with start_ns <= stamp <= end_ns."""
        rows = [row for row, each in enumerate(self.snapshots) if start_ns <= each.stamp_ns <= end_ns]
        return CandidateTracks([self.snapshots[row] for row in rows], [self.tracks[row] for row in rows], self.slots)

    def slots_at(self, row: int) -> dict[str, int]:
        """Return the slots of the candidates of one snapshot, by label."""
        return {label: self.slots[track] for label, track in self.tracks[row].items() if track in self.slots}

    def likelihoods(self) -> dict[int, tuple[int, Array]]:
        """Return, for each track, its first row and its likelihoods from there on, NaN where it has no candidate."""
        known: dict[int, dict[int, float]] = {}
        for row, (snapshot, tracks) in enumerate(zip(self.snapshots, self.tracks, strict=True)):
            for each in snapshot.candidates:
                known.setdefault(tracks[each.label], {})[row] = each.likelihood
        return {
            track: (min(rows), np.array([rows.get(row, np.nan) for row in range(min(rows), max(rows) + 1)]))
            for track, rows in sorted(known.items())
        }


def build_candidate_tracks(snapshots: Sequence[Snapshot]) -> CandidateTracks:
    """Return the candidates of successive snapshots by track, and give the tracks their letters and colours.

    A track has the candidates of one class. Tracks are numbered from 0 in order of their appearance, whatever the classes were
    numbered before the first snapshot.
    """
    numbers: dict[int, int] = {}
    tracks = [{each.label: numbers.setdefault(each.way, len(numbers)) for each in snapshot.candidates} for snapshot in snapshots]
    return CandidateTracks(snapshots, tracks, assign_slots(snapshots, tracks))


def assign_slots(
    snapshots: Sequence[Snapshot], tracks: Sequence[Mapping[str, int]], count: int = SLOTS, colours: int = COLOURS
) -> dict[int, int]:
    """Return the slot in [0, count) of each track; simultaneous tracks have different slots.

    Tracks that begin together receive their slots in order of likelihood. A slot whose colour (slot modulo colours) is unused at
    that time is preferred, then the one that has been free for longest. A track that finds no free slot has none.
    """
    last_row = {track: row for row, numbers in enumerate(tracks) for track in numbers.values()}
    slots: dict[int, int] = {}
    begun: set[int] = set()
    taken_until = dict.fromkeys(range(count), -1)
    for row, (snapshot, numbers) in enumerate(zip(snapshots, tracks, strict=True)):
        for track in (numbers[each.label] for each in snapshot.candidates):
            free = [slot for slot, until in taken_until.items() if until < row]
            if track not in begun and free:
                used = {slot % colours for slot, until in taken_until.items() if until >= row}
                slots[track] = min(free, key=lambda slot: (slot % colours in used, taken_until[slot], slot))
                taken_until[slots[track]] = last_row[track]
            begun.add(track)
    return slots
