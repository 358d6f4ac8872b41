# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions and the measured hand for display, and candidates over time.

A track has the candidates of one class, and a slot, which gives its letter and colour.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from foc_ros.core.learning.movements import find_movements, measure_speed
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.clearance import GRAZE_M
from foc_ros.core.obstacles.geometry import find_holders, find_offset
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import LEFT, RIGHT, Candidate, Solution, Status
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Record
from foc_ros.ros.messages.decode_poses import decode_frame, decode_stamp
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, LIKELIHOOD_COLUMNS, OTHER, STATUSES, UNKNOWN
from foc_ros.ros.messages.ranking import find_drawn_curves, order_candidates

SLOTS = 10
"""Number of the letters, each with a colour, that tell candidates apart."""
NOTED, LIKELY = 0.01, 0.05
"""Likelihoods from which a candidate is worth mentioning, and from which its ellipses are drawn."""


def build_snapshot(prediction: Prediction) -> Prediction:
    """Return a prediction as pictures and reports show it, most likely first; FocError if a number is not finite."""
    kept = []
    for each in (*order_candidates(prediction), *list_unsolved(prediction)):
        solution, motor = each.solution, each.solution.motor_covariance
        solution = replace(
            solution,
            mean=solution.mean[:, :4],
            covariance=solution.covariance[:, :2, :2],
            motor_covariance=None if motor is None else motor[:, :2, :2],
            control=solution.control[:0],
        )
        kept.append(replace(each, solution=solution, height=None))
    return replace(prediction, candidates=tuple(kept))


def read_snapshot(cloud: Any, likelihoods: Any, plane: str, obstacles: Obstacles, goals: Array) -> Prediction:
    """Return the snapshot in a pair of messages of `~/prediction` and `~/likelihoods`: inverse of `messages.encode_prediction`.

    obstacles and goals (g, 2) [m] are those at the stamp of the messages. Costs are relative to the least one.
    """
    rows = np.frombuffer(cloud.data, dtype=CLOUD_ROW) if len(cloud.data) else np.zeros(0, dtype=CLOUD_ROW)
    columns = np.asarray(likelihoods.data, dtype=float).reshape(-1, len(LIKELIHOOD_COLUMNS))
    labels = likelihoods.layout.dim[0].label.split(';') if len(columns) else []
    shares = {UNKNOWN: 0.0 if labels else 1.0, OTHER: 0.0}
    while labels and labels[-1] in shares:
        shares[labels[-1]], labels, columns = float(columns[-1, 0]), labels[:-1], columns[:-1]
    parts = (rows[rows['candidate'] == number] for number in range(len(labels)))
    read = zip(labels, columns, parts, strict=True)
    candidates = tuple(_read_candidate(label, obstacles.ids, values, part, plane) for label, values, part in read)
    cleared = np.zeros(len(obstacles), dtype=bool)
    if len(rows):
        height = rows[next(axis for axis in 'xyz' if axis not in plane)]
        cleared = (height.min() > obstacles.heights[:, 1]) | (height.max() < obstacles.heights[:, 0])
    return Prediction(
        decode_stamp(cloud.header),
        decode_frame(cloud.header),
        0.0,
        candidates,
        candidates[0].label if candidates else None,
        obstacles=obstacles,
        goal_positions=goals,
        cleared=tuple(cleared.tolist()),
        unknown=shares[UNKNOWN],
        other=shares[OTHER],
    )


def _read_candidate(label: str, ids: Collection[str], values: Array, rows: Any, plane: str) -> PredictedCandidate:
    x, y = plane[0], plane[1]
    mean = _stack(rows, (x, y, f'v{x}', f'v{y}'))
    pairs = x + x, plane, plane, y + y
    total, motor = (_stack(rows, [prefix + pair for pair in pairs]).reshape(-1, 2, 2) for prefix in ('', 'motor_'))
    likelihood, effort, cost_ratio, eta = values.tolist()
    status, dt = STATUSES[int(rows['status'][0])], float(rows['t'][-1]) / max(len(rows) - 1, 1)
    only_motor = None if np.array_equal(total, motor) else motor
    solution = Solution(status, '', dt, mean, total, np.zeros((0, 2)), effort, {}, 0.0, 0.0, eta, motor_covariance=only_motor)
    sides = parse_sides(label, ids)
    candidate = Candidate(label, int(rows['goal'][0]), tuple(sides.items()), mean[:, :2], 0.0)
    return PredictedCandidate(candidate, solution, sides, cost_ratio, likelihood, way=int(rows['way'][0]))


def _stack(rows: Any, names: Sequence[str]) -> Array:
    return np.stack([rows[name].astype(float) for name in names], axis=-1)


def list_unsolved(prediction: Prediction) -> tuple[PredictedCandidate, ...]:
    """Return the candidates without a likelihood."""
    return tuple(each for each in prediction.candidates if not each.has_likelihood)


def is_late(snapshot: Prediction) -> bool:
    """Return whether time ran out before a path that is worth mentioning was found to its end."""
    return any(each.status is Status.DEADLINE and each.likelihood >= NOTED for each in snapshot.candidates)


def count_likely_paths(snapshot: Prediction) -> float:
    """Return the number of likely paths, without estimates and ghosts: exp of the entropy of likelihoods of at least LIKELY."""
    seen = [each for each, (ghost, _) in zip(snapshot, describe_ghosts(snapshot), strict=True) if not ghost]
    shares = np.array([each.likelihood for each in seen if each.likelihood >= LIKELY and not each.is_estimated])
    shares /= max(shares.sum(), LIKELY)
    return float(np.exp(-(shares * np.log(shares)).sum())) if len(shares) else 0.0


def choose_moment(snapshots: Sequence[Prediction], start_ns: int, end_ns: int) -> int | None:
    """Return the row of the snapshot of a movement with the most likely paths on the way, None where the movement has none."""
    during = {row: each for row, each in enumerate(snapshots) if start_ns <= each.stamp_ns <= end_ns and each.most_likely}
    if not during:
        return None
    begin, end = (start_ns + share * (end_ns - start_ns) for share in (0.15, 0.6))
    # ellipses at rest are small, so those on the way are compared only with each other
    shown = {row: each for row, each in during.items() if begin <= each.stamp_ns <= end} or during
    sizes = {row: np.linalg.eigvalsh(each.candidates[0].covariance[:, :2, :2]).max() for row, each in shown.items()}
    settled = [row for row, size in sizes.items() if size <= 3.0**2 * np.median(list(sizes.values()))]
    return max(settled, key=lambda row: count_likely_paths(shown[row]))


def find_entered(snapshot: Prediction) -> list[str]:
    """Return the names of the obstacles that the hand of a snapshot with a path is inside."""
    (is_entered,) = find_holders(snapshot.candidates[0].mean[:1, :2], snapshot.blocking_obstacles)
    return [snapshot.blocking_obstacles.ids[row] for row in np.flatnonzero(is_entered)]


def describe_ghosts(snapshot: Prediction) -> list[tuple[str, float | None]]:
    """Return why the path of each candidate is no proper prediction, and at which share of it, None if nowhere in particular.

    It could not be solved, or leads through an obstacle; otherwise the reason is ''. The beginning of a path within an obstacle
    that the hand is in does not count, nor its end within one that is its goal, nor do depths of less than GRAZE_M.
    """
    reasons = ['' if each.has_likelihood else each.status.value.replace('_', ' ') for each in snapshot]
    places: list[float | None] = [None] * len(reasons)
    shown, blocking = snapshot.candidates_with_likelihood, snapshot.blocking_obstacles  # these candidates are the first ones
    if not shown or not len(blocking):
        return list(zip(reasons, places, strict=True))
    curves = find_drawn_curves(shown)
    times = np.linspace(0.0, [each.times[-1] for each in shown], len(curves))
    offsets = curves[..., None, :] - (blocking.centre + times[..., None, None] * blocking.velocity)
    x, y = offsets[..., 0], offsets[..., 1]
    near, depths = np.nonzero(np.hypot(x, y) < blocking.extent), np.full(x.shape, -np.inf)
    depths[near] = blocking.radius[near[2]] - find_offset(x[near], y[near], blocking.edges.take(near[2])).distance
    is_inside = depths > GRAZE_M
    between = np.maximum.accumulate(~is_inside, axis=0) & np.maximum.accumulate(~is_inside[::-1], axis=0)[::-1]
    is_entered = is_inside & between
    for row in np.flatnonzero(is_entered.any(axis=(0, 2))).tolist():
        first = int(np.argwhere(is_entered[:, row])[0, 1])
        deepest = np.argmax(np.where(between[:, row, first], depths[:, row, first], -np.inf))
        reasons[row], places[row] = f'leads through obstacle {blocking.ids[first]}', float(deepest / (len(curves) - 1))
    return list(zip(reasons, places, strict=True))


@dataclass(frozen=True, eq=False)
class HandTrajectory(Record):
    """The measured movement of the hand: stamps_ns (n,) increasing, positions (n, 2) [m]."""

    stamps_ns: np.ndarray[tuple[int], np.dtype[np.int64]]
    positions: Array

    @cached_property
    def speed(self) -> Array:
        """Speed (n,) [m/s]."""
        return measure_speed(self.stamps_ns, self.positions)

    def seconds_after(self, origin_ns: int) -> Array:
        """Return the times (n,) [s] of the samples after an origin."""
        return (self.stamps_ns - origin_ns) / NANOSECONDS

    def between(self, start_ns: int, end_ns: int) -> slice:
        """Return the rows with start_ns <= stamp <= end_ns."""
        return slice(int(np.searchsorted(self.stamps_ns, start_ns)), int(np.searchsorted(self.stamps_ns, end_ns, side='right')))

    def approaches_goal(self, start_ns: int, end_ns: int, snapshots: Sequence[Prediction]) -> bool:
        """Return whether a movement ends nearer to a goal than it begins: it is no way back."""
        goals = next((each.goal_positions for each in snapshots if start_ns <= each.stamp_ns <= end_ns), None)
        ends = self.positions[self.between(start_ns, end_ns)][[0, -1]]
        if goals is None or not len(goals):
            return False
        begin, end = np.linalg.norm(ends[:, None] - goals, axis=2).min(axis=1).tolist()
        return bool(end < begin)

    def find_movements(self) -> list[tuple[int, int]]:
        """Return start and end [ns] of every movement."""
        return find_movements(self.stamps_ns, self.positions)


def build_hand_trajectory(samples: Sequence[HandSample]) -> HandTrajectory:
    """Return the trajectory of hand samples; samples that are not newer than all before them are left out."""
    stamps = np.array([sample.stamp_ns for sample in samples], dtype=np.int64)
    is_newest = np.diff(np.maximum.accumulate(stamps), prepend=stamps[:1] - 1) > 0
    positions = np.array([sample.position for sample in samples]).reshape(-1, 2)
    return HandTrajectory(stamps[is_newest], positions[is_newest])


def parse_sides(label: str, ids: Collection[str]) -> dict[str, int]:
    """Return the sides that a label names; ids: of the obstacles of the scene, which may contain signs."""
    names = '|'.join([*(re.escape(name) for name in sorted(ids, key=len, reverse=True)), '[^+-]+'])
    found = re.findall(rf'([+-])({names})(?=[+-]|$)', label.partition(':')[2])
    return {name: LEFT if sign == '+' else RIGHT for sign, name in found}


@dataclass(frozen=True)
class CandidateTracks:
    """Snapshots, for each of them the track of each candidate by label, and the slots of the tracks with a letter and colour."""

    snapshots: Sequence[Prediction]
    tracks: Sequence[Mapping[str, int]]
    slots: Mapping[int, int]

    def likelihoods(self) -> dict[int, tuple[int, Array]]:
        """Return, for each track, its first row and its likelihoods from there on, NaN where it has no candidate."""
        known: dict[int, dict[int, float]] = {}
        for row, (snapshot, tracks) in enumerate(zip(self.snapshots, self.tracks, strict=True)):
            for each in snapshot.candidates_with_likelihood:
                known.setdefault(tracks[each.label], {})[row] = each.likelihood
        return {
            track: (min(rows), np.array([rows.get(row, np.nan) for row in range(min(rows), max(rows) + 1)]))
            for track, rows in sorted(known.items())
        }


class Slots:
    """Gives each class a slot of letter and colour, kept over an absence unless a present class has it."""

    def __init__(self) -> None:
        self._owners: dict[int, int] = {}
        self._used = [0] * SLOTS
        self._turn = 0

    def assign(self, ways: Sequence[int]) -> list[int | None]:
        """Return the slots of classes, by their numbers, most likely first; None where all are taken."""
        self._turn += 1
        slots = {way: slot for slot, way in self._owners.items() if way in ways and self._used[slot] == self._turn - 1}
        for way in ways:
            free = [slot for slot in range(SLOTS) if slot not in slots.values()]
            if way not in slots and free:
                own = self._owners.get
                slots[way] = min(free, key=lambda slot: (own(slot) != way, self._used[slot], slot))
                self._owners = {slot: owner for slot, owner in self._owners.items() if owner != way} | {slots[way]: way}
        for slot in slots.values():
            self._used[slot] = self._turn
        return [slots.get(way) for way in ways]


def build_candidate_tracks(snapshots: Sequence[Prediction]) -> CandidateTracks:
    """Return the candidates of successive snapshots by track, which lasts until its class has another letter."""
    given, last, numbers, tracks = Slots(), dict[int, int | None](), dict[tuple[int, int | None], int](), list[dict[str, int]]()
    for snapshot in snapshots:
        shown = snapshot.candidates_with_likelihood
        ways = [each.way for each in shown if each.likelihood >= NOTED]  # unlikely ones would take the colours of others
        last |= zip(ways, given.assign(ways), strict=True)
        keys = [(each.way, last.get(each.way)) for each in shown]
        found = [numbers.setdefault(key, len(numbers)) for key in keys]
        tracks.append({each.label: track for each, track in zip(shown, found, strict=True)})
    return CandidateTracks(snapshots, tracks, {track: slot for (_, slot), track in numbers.items() if slot is not None})
