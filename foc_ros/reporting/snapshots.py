"""Snapshots of predictions for display: plain arrays, built from the predictor's records or from the node's messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Obstacles, PredictedCandidate, Prediction, Record
from foc_ros.ros.messages.decode_poses import decode_stamp
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, LIKELIHOOD_COLUMNS
from foc_ros.ros.messages.plane import project
from foc_ros.ros.messages.ranking import compute_cost_ratios, order_candidates


@dataclass(frozen=True, eq=False)
class CandidateView(Record):
    """One solved candidate.

    times (m,): seconds after the stamp of the snapshot; path (m, 2) [m]; speed (m,) [m/s]; covariance (m, 2, 2) of the
    position [m^2]; effort [m^2/s^6]; cost_ratio: cost over the least cost; eta: achieved probability of avoidance.
    """

    label: str
    likelihood: float
    effort: float
    cost_ratio: float
    eta: float
    times: Array
    path: Array
    speed: Array
    covariance: Array


@dataclass(frozen=True, eq=False)
class Snapshot(Record):
    """One prediction and its scene.

    candidates: the solved ones, most likely first; most_likely: label, None if no candidate was solved; unsolved: (label, status)
    of the other candidates; solve_s: wall time [s], None if it is unknown.
    """

    stamp_ns: int
    obstacles: Obstacles
    goals: Array
    candidates: tuple[CandidateView, ...]
    most_likely: str | None
    unsolved: tuple[tuple[str, str], ...] = ()
    solve_s: float | None = None


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


def build_candidate_views(candidates: Sequence[PredictedCandidate]) -> tuple[CandidateView, ...]:
    """Return views of the solved candidates, in their order."""
    solved = tuple(each for each in candidates if each.is_solved)
    return tuple(_build_candidate_view(each, ratio) for each, ratio in zip(solved, compute_cost_ratios(solved), strict=True))


def _build_candidate_view(candidate: PredictedCandidate, cost_ratio: float) -> CandidateView:
    label, likelihood, solution = candidate.candidate.label, candidate.likelihood, candidate.solution
    speed, covariance = np.linalg.norm(solution.mean[:, 2:4], axis=1), solution.covariance[:, :2, :2]
    values = label, likelihood, solution.effort, cost_ratio, solution.eta
    return CandidateView(*values, solution.times, solution.path, speed, covariance)


def build_snapshot(prediction: Prediction) -> Snapshot:
    """Return the snapshot of a prediction; raises FocError if the prediction holds a number that is not finite."""
    unsolved = tuple((each.candidate.label, each.solution.status.value) for each in prediction.candidates if not each.is_solved)
    candidates = build_candidate_views(order_candidates(prediction))
    scene = prediction.obstacles, prediction.goals
    return Snapshot(prediction.stamp_ns, *scene, candidates, prediction.most_likely, unsolved, prediction.solve_s)


def is_same_prediction(cloud: Any, likelihoods: Any) -> bool:
    """Whether messages of `~/prediction` and `~/likelihoods` hold the same prediction; the latter carries no stamp."""
    rows = _read_cloud(cloud)
    _, first = np.unique(rows['candidate'], return_index=True)
    return np.array_equal(rows['likelihood'][first], _read_likelihoods(likelihoods)[:, 0].astype(np.float32))


def read_snapshot(cloud: Any, likelihoods: Any, plane: str, obstacles: Obstacles, goals: Array) -> Snapshot:
    """Return the snapshot in a pair of messages of `~/prediction` and `~/likelihoods`: inverse of `messages.encode_prediction`.

    obstacles and goals (g, 2) [m] are those at the stamp of the messages. Raises MessageError if the two messages hold different
    predictions.
    """
    if not is_same_prediction(cloud, likelihoods):
        raise MessageError('likelihoods', 'those of the prediction', 'those of another prediction')
    rows, columns = _read_cloud(cloud), _read_likelihoods(likelihoods)
    labels = likelihoods.layout.dim[0].label.split(';') if len(columns) else []
    candidates = tuple(
        _read_candidate(label, values, rows[rows['candidate'] == number], plane)
        for number, (label, values) in enumerate(zip(labels, columns, strict=True))
    )
    return Snapshot(decode_stamp(cloud.header), obstacles, goals, candidates, candidates[0].label if candidates else None)


def _read_candidate(label: str, values: Array, rows: Any, plane: str) -> CandidateView:
    def stack(names: str) -> Array:
        return np.stack([rows[name].astype(float) for name in names.split()], axis=-1)

    path, _ = project(stack('x y z'), plane)
    velocity, _ = project(stack('vx vy vz'), plane)
    half, _ = project(stack('xx xy xz xy yy yz xz yz zz').reshape(-1, 3, 3), plane)
    covariance, _ = project(half.swapaxes(1, 2), plane)
    likelihood, effort, cost_ratio, eta = values.tolist()
    speed = np.linalg.norm(velocity, axis=1)
    return CandidateView(label, likelihood, effort, cost_ratio, eta, rows['t'].astype(float), path, speed, covariance)


def _read_cloud(cloud: Any) -> Any:
    if cloud.point_step != CLOUD_ROW.itemsize:
        raise MessageError('point_step', str(CLOUD_ROW.itemsize), cloud.point_step)
    return np.frombuffer(cloud.data, dtype=CLOUD_ROW) if len(cloud.data) else np.zeros(0, dtype=CLOUD_ROW)


def _read_likelihoods(likelihoods: Any) -> Array:
    return np.asarray(likelihoods.data, dtype=float).reshape(-1, len(LIKELIHOOD_COLUMNS))
