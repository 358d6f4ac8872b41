# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the hand really did, by its recorded path, and through which gaps it could have gone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay, keep_last_run
from foc_ros.analysis.scenes import NO_GOAL
from foc_ros.core.classes import compute_swept_angles
from foc_ros.core.classes.rows import WALL, Rows, locate_rows
from foc_ros.core.config import Config, EstimatorConfig
from foc_ros.core.errors import RecordingError
from foc_ros.core.hand.kalman import Update, update
from foc_ros.core.learning.movements import AT_GOAL_M, find_goal_at_end, find_movements, find_reached_goal
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.solution import LEFT, RIGHT
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Record

TIMES_S: Array = np.arange(1.0, 9.0) * 0.125
"""Times ahead at which predicted positions are compared with the true ones [s]."""
HORIZONS_S = (0.25, 0.5, 1.0)
"""Those of them that are reported."""
HORIZONS = np.searchsorted(TIMES_S, HORIZONS_S)
MIN_SAMPLES = 10

Bools = NDArray[np.bool_]
Sides = NDArray[np.int8]


class RecordedPath:
    """A recorded path, whose movement ends where it is nearest to the goal that it reached.

    Attributes: stamps_ns (m,), positions (m, 2) [m], goals (g, 2) [m]; goal: row of the goal reached, None where none was;
    end_ns: when the movement ends; travelled (m,) [m]: so far; progress (m,): its share of the movement. The argument goal is
    None to find it.
    """

    def __init__(self, stamps_ns: NDArray[np.int64], positions: Array, goals: Array, goal: int | None = None) -> None:
        self.stamps_ns, self.positions, self.goals = stamps_ns, positions, goals
        if goal == NO_GOAL:
            self.goal, end = None, len(positions) - 1
        else:
            reached, end = find_reached_goal(positions, goals if goal is None else goals[[goal]])
            self.goal = reached if goal is None else goal
        self.end_ns = int(stamps_ns[end])
        # travel is counted in steps of a share of the extent of the path, so that noise at rest adds none
        step, last, moved = 0.02 * float(np.hypot(*np.ptp(positions, axis=0))), positions[0], np.zeros(len(positions))
        for sample, position in enumerate(positions[1:], 1):
            distance = float(np.hypot(*(position - last)))
            if distance >= step:
                moved[sample], last = distance, position
        self.travelled = np.cumsum(moved)
        whole = self.travelled[end]
        self.progress = np.minimum(self.travelled / whole, 1.0) if whole > 0.0 else np.zeros(len(positions))

    @classmethod
    def from_samples(cls, samples: Sequence[HandSample], goals: Array, goal: int | None = None) -> RecordedPath:
        """Return the path of samples of the hand."""
        return cls(np.array([each.stamp_ns for each in samples]), np.array([each.position for each in samples]), goals, goal)

    def count_arrivals(self) -> int:
        """Return how many movements of the hand end at a goal."""
        arrived = [self.positions[self.stamps_ns <= end_ns] for _, end_ns in find_movements(self.stamps_ns, self.positions)]
        return sum(find_goal_at_end(each, self.goals)[1] <= AT_GOAL_M for each in arrived)

    def interpolate(self, stamp_ns: int, seconds: Array) -> Array:
        """Return the positions (h, 2) [m] some seconds (h,) after a stamp, nan beyond the end."""
        times = (self.stamps_ns - stamp_ns) / NANOSECONDS
        return np.column_stack([np.interp(seconds, times, axis, right=np.nan) for axis in self.positions.T])


def warn_of_several_movements(recordings: Iterable[tuple[str, RecordedPath]]) -> list[str]:
    """Return a warning of the recordings, each a name and its path, in which the hand moves from one goal to the next."""
    names = [name for name, path in recordings if path.count_arrivals() > 1]
    words = 'the hand comes to rest at goals more than once; one recording per movement is expected, so the results mean little'
    return [f'{", ".join(names)}: {words}'] if names else []


@dataclass(frozen=True, eq=False)
class RecordedHand:
    """The hand in a recording, as the estimator receives it: its path, the obstacles at the first stamp, and the frame."""

    name: str
    path: RecordedPath
    obstacles: Obstacles
    frame_id: str = ''

    @property
    def times(self) -> Array:
        """Seconds since the first sample, (m,)."""
        return np.asarray((self.path.stamps_ns - self.path.stamps_ns[0]) / NANOSECONDS)

    def filter(self, config: EstimatorConfig) -> list[Update]:
        """Return what an estimator makes of each sample: the state, and whether it continues or starts anew."""
        updates, state = list[Update](), None
        for stamp_ns, position in zip(self.path.stamps_ns.tolist(), self.path.positions, strict=True):
            updates.append(update(state, HandSample(stamp_ns, position, frame_id=self.frame_id), config))
            state = updates[-1].state
        return updates


def check_samples(name: str, samples: Sequence[HandSample]) -> None:
    """Raise RecordingError where a recording has too few samples to show a movement."""
    if len(samples) < MIN_SAMPLES:
        raise RecordingError(f'{name}: expected at least {MIN_SAMPLES} hand poses, got {len(samples)}')


def read_hand(recording: Recording, config: Config) -> RecordedHand:
    """Read a recording as a replay does, without predicting; raises RecordingError for one without goals or with few samples."""
    replayed, samples = Replay(config), list[HandSample]()
    for _, sample in replayed.take(recording.items()):
        if sample is not None:
            keep_last_run(samples, sample)
    scene = replayed.pipeline.scene
    if scene.goals is None or not len(scene.goals):
        raise RecordingError(f'{recording.name}: {replayed.pipeline.not_ready_reason() or "no goal received"}')
    check_samples(recording.name, samples)
    path = RecordedPath.from_samples(samples, scene.goals)
    return RecordedHand(recording.name, path, scene.obstacles(samples[0].stamp_ns), samples[0].frame_id)


@dataclass(frozen=True, eq=False)
class GroundTruth(Record):
    """What the hand really did after one prediction.

    sides (n,): LEFT or RIGHT, on which the rest of the path passes each obstacle; is_ahead (n,): whether its row is still to be
    passed; goal: row of the goal that was reached, None where none was, or where the goals were other ones; positions (h, 2) [m]:
    at `TIMES_S`, nan beyond the end; progress: share of the movement so far; approach: share of the distance from the last row,
    or the start, to the next one, nan where no row is to come; left_s: time to the end of the movement [s].
    """

    sides: Sides
    is_ahead: Bools
    goal: int | None
    positions: Array
    progress: float
    approach: float
    left_s: float


def find_ground_truth(
    stamp_ns: int, path: RecordedPath, obstacles: Obstacles, row: Rows, direction: Array, goals: Array
) -> GroundTruth:
    """Return what the hand did after a stamp [ns].

    obstacles, goals (g, 2) [m]: as they were at the stamp; row (n,) and direction (2,): of `find_rows` and `find_direction`.
    """
    now = int(np.searchsorted(path.stamps_ns, stamp_ns))
    seconds = (path.stamps_ns[now:] - stamp_ns) / NANOSECONDS
    centres = obstacles.centre + seconds[:, None, None] * obstacles.velocity
    is_before = (path.positions @ direction)[:, None] < locate_rows(obstacles.centre @ direction, row)
    crosses = is_before[:-1] & ~is_before[1:]  # whether each row is crossed after each sample, (m - 1, r)
    crossed = [int(np.flatnonzero(each)[-1]) + 1 for each in crosses.T if each.any()]
    last = max((each for each in crossed if each <= now), default=0)
    following = min((each for each in crossed if each > now), default=0)
    whole = path.travelled[following] - path.travelled[last] if following else np.nan  # nan: no row is to come
    return GroundTruth(
        sides=np.where(compute_swept_angles(path.positions[now:], centres) < 0.0, LEFT, RIGHT).astype(np.int8),
        is_ahead=np.append(crosses[now:].any(axis=0), False)[row],
        goal=path.goal if np.array_equal(goals, path.goals) else None,
        positions=path.interpolate(stamp_ns, TIMES_S),
        progress=float(path.progress[now]),
        approach=float((path.travelled[now] - path.travelled[last]) / whole) if whole != 0.0 else 0.0,
        left_s=(path.end_ns - stamp_ns) / NANOSECONDS,
    )


def find_open_gaps(obstacles: Obstacles, row: Rows, direction: Array, hand_radius: float) -> tuple[Sides, ...]:
    """Return for each row the sides (k, n) on which a path through one of its k open gaps passes its obstacles, 0 for all others.

    A gap is open if it is wider than the hand; the outer gaps of a row are those between it and the walls.
    """
    left = np.array([-direction[1], direction[0]])
    corners = obstacles.centre[:, None] + obstacles.vertices  # two convex polygons that are apart are nearest at a vertex of one
    nearest = measure_offsets(corners, obstacles)[1].reshape(*corners.shape[:2], len(obstacles)).min(axis=1)
    distance = np.minimum(nearest, nearest.T) - obstacles.radius[:, None] - obstacles.radius
    found, walls = [], np.flatnonzero(row == WALL)
    for number in range(int(row.max(initial=WALL)) + 1):
        members = np.flatnonzero(row == number)
        members = members[np.argsort(obstacles.centre[members] @ left, kind='stable')]
        ends = []
        for member, outwards in ((members[0], -left), (members[-1], left)):
            # the walls whose nearest point is beside the obstacle, where the vector points, rather than ahead of it
            towards = -measure_offsets(obstacles.centre[member], obstacles.take(walls))[0][0]
            is_beside = towards @ outwards >= np.abs(towards @ [outwards[1], -outwards[0]])
            ends.append(distance[member, walls[is_beside]].min(initial=np.inf))
        is_open = np.array([ends[0], *distance[members[:-1], members[1:]], ends[1]]) > 2.0 * hand_radius
        sides = np.zeros((len(members) + 1, len(obstacles)), dtype=np.int8)
        sides[:, members] = np.where(np.tri(len(members) + 1, len(members), -1), LEFT, RIGHT)
        found.append(sides[is_open])
    return tuple(found)
