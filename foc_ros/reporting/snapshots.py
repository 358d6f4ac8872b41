"""What a reader is shown of one prediction: plain arrays, whether it comes from the predictor or from messages of the node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.types import NANOSECONDS, Array, HandSample, Obstacles, PredictedCandidate, Prediction, Record
from foc_ros.ros.messages.ranking import cost_ratios, ranked


@dataclass(frozen=True, eq=False)
class CandidateView(Record):
    """One candidate that was solved.

    times (m,): seconds from the moment; path (m, 2) [m]; speed (m,) [m/s]; covariance (m, 2, 2) of the position [m^2];
    effort [m^2/s^6]; cost_ratio: to the best; eta: achieved.
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
    """One prediction and the scene it was made in.

    ways: most likely first; unsolved: (label, status) of the candidates that could not be solved; most_likely: label, None where
    nothing was solved; solve_s: wall time [s], None where it is not known.
    """

    stamp_ns: int
    obstacles: Obstacles
    goals: Array
    ways: tuple[CandidateView, ...]
    most_likely: str | None
    unsolved: tuple[tuple[str, str], ...] = ()
    solve_s: float | None = None


@dataclass(frozen=True, eq=False)
class Track(Record):
    """Where the hand really went: stamps_ns (n,) rising, positions (n, 2) [m]."""

    stamps_ns: np.ndarray[tuple[int], np.dtype[np.int64]]
    positions: Array
    velocity: Array = field(init=False)

    HALF_WIDTH_S = 0.05
    """Half of the central difference that gives the velocity: averages sensor noise out and leaves a reach its shape."""

    def __post_init__(self) -> None:
        times = (self.stamps_ns - self.stamps_ns[:1]) / NANOSECONDS
        before, after = (np.clip(times + shift, times[:1], times[-1:]) for shift in (-self.HALF_WIDTH_S, self.HALF_WIDTH_S))
        moved = (
            [np.interp(after, times, axis) - np.interp(before, times, axis) for axis in self.positions.T] if len(times) else []
        )
        elapsed = np.where(after > before, after - before, np.inf)
        object.__setattr__(self, 'velocity', (np.array(moved) / elapsed).T.reshape(-1, 2))
        super().__post_init__()

    def between(self, start_ns: int, end_ns: int) -> slice:
        """Return the rows of start_ns <= stamp <= end_ns."""
        return slice(int(np.searchsorted(self.stamps_ns, start_ns)), int(np.searchsorted(self.stamps_ns, end_ns, side='right')))


def track_of(samples: Sequence[HandSample]) -> Track:
    """Return the track of hand samples; those that do not come after all before them are left out."""
    stamps = np.array([sample.stamp_ns for sample in samples], dtype=np.int64)
    newest = np.maximum.accumulate(stamps)
    fresh = np.concatenate([[True], stamps[1:] > newest[:-1]]) if len(stamps) else np.zeros(0, dtype=bool)
    positions = np.array([sample.position for sample in samples]).reshape(-1, 2)
    return Track(stamps[fresh], positions[fresh])


def candidate_views(outcomes: Sequence[PredictedCandidate]) -> tuple[CandidateView, ...]:
    """Return the solved ones of the outcomes, in their order."""
    solved = tuple(outcome for outcome in outcomes if outcome.is_solved)
    return tuple(_way(outcome, ratio) for outcome, ratio in zip(solved, cost_ratios(solved), strict=True))


def _way(outcome: PredictedCandidate, cost_ratio: float) -> CandidateView:
    solution = outcome.solution
    return CandidateView(
        outcome.candidate.label,
        outcome.likelihood,
        solution.effort,
        cost_ratio,
        solution.eta,
        solution.times,
        solution.path,
        np.linalg.norm(solution.mean[:, 2:4], axis=1),
        solution.covariance[:, :2, :2],
    )


def snapshot_of_prediction(prediction: Prediction, obstacles: Obstacles, goals: Array) -> Snapshot:
    """Return a prediction with the scene it was made in. Raises FocError where it holds a number that is not finite."""
    return Snapshot(
        prediction.stamp_ns,
        obstacles,
        goals,
        candidate_views(ranked(prediction)),
        prediction.most_likely,
        tuple((each.candidate.label, each.solution.status.value) for each in prediction.candidates if not each.is_solved),
        prediction.solve_s,
    )


def movements(track: Track, onset_speed: float, gap_s: float = 0.15, least_m: float = 0.03) -> list[tuple[int, int]]:
    """Return start and end [ns] of every movement.

    A movement is faster than onset_speed [m/s] and goes farther than least_m [m]; pauses shorter than gap_s [s] belong to it.
    """
    fast = np.linalg.norm(track.velocity, axis=1) > onset_speed
    rows = np.flatnonzero(fast)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(track.stamps_ns[rows]) > gap_s * NANOSECONDS)
    spans = zip(np.concatenate([rows[:1], rows[breaks + 1]]), np.concatenate([rows[breaks], rows[-1:]]), strict=True)
    return [
        (int(track.stamps_ns[first]), int(track.stamps_ns[last]))
        for first, last in spans
        if np.ptp(track.positions[first : last + 1], axis=0).max() > least_m
    ]
