# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Observations: what was predicted in a recording, beside what really came, and the questions that are put to a prediction.

A recording is replayed once. How costs become likelihoods can then be tried on the observations without a predictor. Scores and
fits need nothing else.

In a row of m obstacles (`rows`) a path that does not turn back takes one of m + 1 gaps, so that rows of m_1, m_2, ... obstacles
leave (m_1 + 1)(m_2 + 1)... homotopy classes. A gap that is too narrow for the hand is none. The questions are:

- `way`: in which homotopy class will the hand pass the obstacles still ahead?
- `gap`: the same for the next row of obstacles only.
- `goal`: which goal will it reach?

A question is put only where at least two answers are possible. Candidates may also weave through a row; such an answer can be
given, but a uniform guess does not count it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from foc_ros.analysis.csv_recordings import NO_GOAL
from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording, group_by_operator
from foc_ros.analysis.replay import Replay, Step
from foc_ros.core.classes import compute_swept_angles
from foc_ros.core.classes.rows import WALL, Decisions, Rows, find_decisions, find_direction, find_rows, locate_rows
from foc_ros.core.classes.sides import BranchTimes, compute_branch_times
from foc_ros.core.config import Config
from foc_ros.core.errors import FocError, RecordingError, warn
from foc_ros.core.hand.duration import is_passing
from foc_ros.core.learning.movements import find_reached_goal
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.plant.covariance import compute_duration_sensitivity
from foc_ros.core.types import (
    LEFT,
    NANOSECONDS,
    RIGHT,
    Array,
    HandState,
    Obstacles,
    PredictedCandidate,
    Prediction,
    Record,
    Solution,
)

TIMES_S = tuple(0.125 * step for step in range(1, 9))
"""Times ahead at which predicted positions are compared with the true ones [s]."""
HORIZONS_S = (0.25, 0.5, 1.0)
"""Those of them that are reported."""
RESOLUTION = 0.02
"""Travel is counted in steps of this share of the extent of the path, so that noise at rest adds none."""

Bools = NDArray[np.bool_]
Sides = NDArray[np.int8]
PATH_CLASS, GAP, GOAL = 'way', 'gap', 'goal'
Answer = tuple[int, ...]
"""Sides of the obstacles in question, LEFT or RIGHT, in their order; or the row of a goal."""


class RecordedPath:
    """A recorded path, whose movement ends where it is nearest to the goal that it reached.

    goal: row of the one that was reached, or `NO_GOAL`; None to find it. Attributes: stamps_ns (m,), positions (m, 2) [m], goals
    (g, 2) [m]; goal: row of the goal reached, None where none was; end_ns: when the movement ends; travelled (m,): distance
    travelled so far [m]; progress (m,): its share of the movement.
    """

    def __init__(self, stamps_ns: NDArray[np.int64], positions: Array, goals: Array, goal: int | None = None) -> None:
        self.stamps_ns, self.positions, self.goals = stamps_ns, positions, goals
        if goal == NO_GOAL:
            self.goal, end = None, len(positions) - 1
        else:
            reached, end = find_reached_goal(positions, goals if goal is None else goals[[goal]])
            self.goal = reached if goal is None else goal
        self.end_ns = int(stamps_ns[end])
        self.travelled = _compute_travelled(positions)
        whole = self.travelled[end]
        self.progress = np.minimum(self.travelled / whole, 1.0) if whole > 0.0 else np.zeros(len(positions))

    def interpolate(self, stamp_ns: int, seconds: Array) -> Array:
        """Return the positions (h, 2) [m] some seconds (h,) after a stamp, nan beyond the end."""
        times = (self.stamps_ns - stamp_ns) / NANOSECONDS
        return np.column_stack([np.interp(seconds, times, axis, right=np.nan) for axis in self.positions.T])


@dataclass(frozen=True, eq=False)
class GroundTruth(Record):
    """What the hand really did after one prediction.

    sides (n,): LEFT or RIGHT, the side of each obstacle on which the rest of the path runs; is_ahead (n,): whether the row of the
    obstacle is still to be passed; goal: row of the goal that was reached, None where none was, or where the goals were other
    ones; positions (h, 2) [m]: at `TIMES_S`, nan beyond the end; progress in [0, 1]: share of the movement so far; approach in
    [0, 1]: share of the distance from the last row, or the start, to the next one, nan where no row is to come.
    """

    sides: Sides
    is_ahead: Bools
    goal: int | None
    positions: Array
    progress: float
    approach: float


def find_ground_truth(
    stamp_ns: int, path: RecordedPath, obstacles: Obstacles, row: Rows, direction: Array, goals: Array
) -> GroundTruth:
    """Return what the hand did after a stamp [ns].

    obstacles, goals (g, 2) [m]: as they were at the stamp; row (n,) and direction (2,): of `find_rows` and `find_direction`.
    """
    now = int(np.searchsorted(path.stamps_ns, stamp_ns))
    seconds = (path.stamps_ns[now:] - stamp_ns) / NANOSECONDS
    centres = obstacles.centre + seconds[:, None, None] * obstacles.velocity
    row_position, position = locate_rows(obstacles.centre @ direction, row), path.positions @ direction
    return GroundTruth(
        sides=find_sides(path.positions[now:], centres),
        is_ahead=np.append(find_rows_ahead(row_position, position[now:]), False)[row],
        goal=path.goal if np.array_equal(goals, path.goals) else None,
        positions=path.interpolate(stamp_ns, np.array(TIMES_S)),
        progress=float(path.progress[now]),
        approach=_compute_approach(row_position, path, position, now),
    )


def find_open_gaps(obstacles: Obstacles, row: Rows, direction: Array, hand_radius: float) -> tuple[Sides, ...]:
    """Return for each row the sides (k, n) on which a path through one of its k open gaps passes its obstacles, 0 for all others.

    A gap is open if it is wider than the hand, hand_radius [m]; the outer gaps of a row are those between it and the walls.
    """
    left = np.array([-direction[1], direction[0]])
    distance = _measure_distances(obstacles)
    walls = np.flatnonzero(row == WALL)
    found = []
    for number in range(int(row.max(initial=WALL)) + 1):
        members = np.flatnonzero(row == number)
        members = members[np.argsort(obstacles.centre[members] @ left, kind='stable')]
        inner = distance[members[:-1], members[1:]]
        ends = [
            _find_walls_beside(obstacles, walls, member, side * left) for member, side in ((members[0], -1), (members[-1], 1))
        ]
        outer = [distance[member, beside].min(initial=np.inf) for member, beside in zip(members[[0, -1]], ends, strict=True)]
        is_open = np.array([outer[0], *inner, outer[1]]) > 2.0 * hand_radius
        sides = np.zeros((len(members) + 1, len(obstacles)), dtype=np.int8)
        sides[:, members] = np.where(np.arange(len(members)) < np.arange(len(members) + 1)[:, None], LEFT, RIGHT)
        found.append(sides[is_open])
    return tuple(found)


def _find_walls_beside(obstacles: Obstacles, walls: NDArray[np.intp], member: int, outwards: Array) -> NDArray[np.intp]:
    """Return those walls whose nearest point is beside an obstacle, where a unit vector (2,) points, rather than ahead of it."""
    towards = -measure_offsets(obstacles.centre[member], obstacles.take(walls))[0][0]
    is_beside: Bools = towards @ outwards >= np.abs(towards @ [outwards[1], -outwards[0]])
    return walls[is_beside]


def _measure_distances(obstacles: Obstacles) -> Array:
    """Return the distances (n, n) [m] between obstacles; two convex polygons that are apart are nearest at a vertex of one."""
    corners = obstacles.centre[:, None] + obstacles.vertices
    nearest = measure_offsets(corners, obstacles)[1].reshape(*corners.shape[:2], len(obstacles)).min(axis=1)
    distance: Array = np.minimum(nearest, nearest.T) - obstacles.radius[:, None] - obstacles.radius
    return distance


def find_rows_ahead(row_position: Array, position: Array) -> Bools:
    """Tell which rows (r,), at row_position (r,) [m], the rest of a path, (m,) [m], still has to pass."""
    is_before = position[:, None] < row_position
    return np.asarray((is_before[:-1] & ~is_before[1:]).any(axis=0))


def find_sides(path: Array, centres: Array) -> Sides:
    """Return the sides (n,) of obstacles, at centres (m, n, 2) [m], on which a path (m, 2) [m] runs, by its swept angle."""
    return np.where(compute_swept_angles(path, centres) < 0.0, LEFT, RIGHT).astype(np.int8)


def _compute_approach(row_position: Array, path: RecordedPath, position: Array, now: int) -> float:
    """Return the share of the distance from the last row, or the start, to the next one, that sample `now` has travelled."""
    is_passed = find_rows_ahead(row_position, position)
    passed = [int(np.flatnonzero(position < each)[-1]) + 1 for each in row_position[is_passed]]
    following = min((each for each in passed if each > now), default=None)
    if following is None:
        return float('nan')
    last = max((each for each in passed if each <= now), default=0)
    distance = path.travelled[following] - path.travelled[last]
    return float((path.travelled[now] - path.travelled[last]) / distance) if distance > 0.0 else 0.0


def _compute_travelled(positions: Array) -> Array:
    """Return the distance [m] travelled up to each position (m, 2) [m], counted in steps of RESOLUTION."""
    step = RESOLUTION * float(np.hypot(*np.ptp(positions, axis=0)))
    travelled, last = np.zeros(len(positions)), positions[0]
    for sample in range(1, len(positions)):
        moved = float(np.hypot(*(positions[sample] - last)))
        travelled[sample] = travelled[sample - 1]
        if moved >= step:
            travelled[sample] += moved
            last = positions[sample]
    return travelled


@dataclass(frozen=True, eq=False)
class CandidateTable(Record):
    """The k candidates of one prediction, about n obstacles.

    labels; goal (k,): row of the goals; has_likelihood (k,): whether each takes part; cost_to_go (k,) [m^2/s^5]: integral of the
    squared control, comparable between goals; safety_shortfall (k,): by how much the safety factor is below the wanted one;
    likelihood (k,): as published; length (k,) [m]: of the shortest path in its class; time_s (k,): time to the goal; is_named
    (k, n): whether the obstacle is in the label; sides (k, n): LEFT or RIGHT, on which the candidate passes each obstacle; mean
    (k, h, 2) [m] and covariance (k, h, 2, 2) [m^2]: of the position at `TIMES_S`; duration_sensitivity (k, h, 2) [m]: by how much
    the position lags behind for each share of the time to go that the movement takes longer; branch_times: when the candidates
    part; decisions: of those that take part.
    """

    labels: tuple[str, ...]
    goal: NDArray[np.int64]
    has_likelihood: Bools
    cost_to_go: Array
    safety_shortfall: Array
    likelihood: Array
    length: Array
    time_s: Array
    is_named: Bools
    sides: Sides
    mean: Array
    covariance: Array
    duration_sensitivity: Array
    branch_times: BranchTimes
    decisions: Decisions

    def __len__(self) -> int:
        return len(self.labels)

    @property
    def mixture(self) -> Array:
        """Weights (k,) of the candidates in the density of positions: what is unknown has none."""
        total = float(self.likelihood.sum())
        return self.likelihood / total if total > 0.0 else self.likelihood


@dataclass(frozen=True, eq=False)
class Observation(Record):
    """One prediction at stamp_ns, from a hand with mean hand (6,), movement_age_s after the onset of its movement (0 at rest).

    ids, centre (n, 2) [m]: of the obstacles at that stamp; row (n,): the row of each obstacle, 0 first, -1 for a wall; gaps: for
    each row the sides (k, n) on which paths through its open gaps pass its obstacles; direction (2,): the unit vector along which
    rows are ordered; goals (g, 2) [m]; candidates; most_likely: the leading label after hysteresis; truth;
    other: share of a goal that nobody announced.
    """

    stamp_ns: int
    hand: Array
    movement_age_s: float
    ids: tuple[str, ...]
    centre: Array
    row: Rows
    gaps: tuple[Sides, ...]
    direction: Array
    goals: Array
    candidates: CandidateTable
    most_likely: str | None
    truth: GroundTruth
    other: float = 0.0

    @property
    def left(self) -> Array:
        """The unit vector (2,) to the left of the direction."""
        return np.array([-self.direction[1], self.direction[0]])


@dataclass(frozen=True, eq=False)
class ObservedRecording:
    """One recording: its name, its observations in order, and the whole path of the hand."""

    name: str
    observations: tuple[Observation, ...]
    path: RecordedPath


def observe(recording: Recording, config: Config, replayed: Replay | None = None) -> ObservedRecording:
    """Replay a recording; raises RecordingError where it cannot be read or nothing could be predicted in it.

    replayed: a replay with the same config that goes on, with what it has learnt but not with its scene; a new one if not given.
    """
    if replayed is None:
        replayed = Replay(config)
    else:
        replayed.forget_scene()
    stamps: list[int] = []
    positions: list[Array] = []
    made: list[tuple[Step, HandState, Config]] = []
    for step in replayed.steps(recording.items()):
        if step.sample is not None:
            stamps.append(step.sample.stamp_ns)
            positions.append(step.sample.position)
        if step.prediction is not None and step.prediction.candidates_with_likelihood:
            assert replayed.pipeline.hand_state is not None
            made.append((step, replayed.pipeline.hand_state, replayed.pipeline.adapted_config))
    losses = replayed.describe_losses()
    if not made:
        reason = losses or replayed.pipeline.not_ready_reason() or 'no candidate could be solved'
        raise RecordingError(f'{recording.name}: nothing could be predicted: {reason}')
    if losses:
        warn(losses)
    goals = made[-1][0].scene.goals
    assert goals is not None
    path = RecordedPath(np.array(stamps), np.array(positions), goals, recording.goal)
    found = [make_observation(step, hand, path, adapted) for step, hand, adapted in made if hand.stamp_ns <= path.end_ns]
    if not found:
        raise RecordingError(f'{recording.name}: nothing was predicted before its goal was reached')
    return ObservedRecording(recording.name, tuple(found), path)


def observe_in_order(recordings: Sequence[Recording], config: Config) -> tuple[list[ObservedRecording], dict[str, str]]:
    """Replay the recordings of an operator in their order, each with what was learnt of the operator in those before.

    Return what was observed, and the reason by name for each recording that cannot be used.
    """
    replayed, observed, failed = Replay(config), list[ObservedRecording](), dict[str, str]()
    for recording in recordings:
        try:
            observed.append(observe(recording, config, replayed))
        except FocError as error:
            failed[recording.name] = ' '.join(str(error).split())
    return observed, failed


def observe_all(
    recordings: Mapping[str, Recording], config: Config, in_order: bool = False
) -> tuple[list[ObservedRecording], dict[str, str]]:
    """Observe recordings in parallel, with a progress bar; return the failures by name as well.

    in_order: the recordings of an operator follow one another, with what is learnt from one to the next.
    """
    if not in_order:
        return collect(partial(observe, config=config), list(recordings.items()), 'replay')
    operators = list(group_by_operator(recordings).items())
    parts, failed = collect(partial(observe_in_order, config=config), operators, 'replay')
    failed |= {name: reason for _, reasons in parts for name, reason in reasons.items()}
    return [each for observed, _ in parts for each in observed], failed


def make_observation(step: Step, hand: HandState, path: RecordedPath, config: Config) -> Observation:
    """Return one prediction, with the hand that it was made from, beside what came.

    path: the whole path of the hand; config: adapted to the operator, as for the prediction.
    """
    prediction, goals = step.prediction, step.scene.goals
    assert prediction is not None and goals is not None
    obstacles = step.scene.obstacles(prediction.stamp_ns)
    direction = find_direction(path.positions[0], goals)
    row = find_rows(obstacles, direction, path.positions[0], goals)
    return Observation(
        stamp_ns=prediction.stamp_ns,
        hand=hand.mean,
        movement_age_s=0.0 if hand.onset_ns is None else (hand.stamp_ns - hand.onset_ns) / NANOSECONDS,
        ids=obstacles.ids,
        centre=obstacles.centre,
        row=row,
        gaps=find_open_gaps(obstacles, row, direction, config.scene.hand_radius),
        direction=direction,
        goals=goals,
        candidates=_tabulate_candidates(prediction, obstacles, hand, goals, config),
        most_likely=prediction.most_likely,
        truth=find_ground_truth(prediction.stamp_ns, path, obstacles, row, direction, goals),
        other=prediction.other,
    )


def _tabulate_candidates(
    prediction: Prediction, obstacles: Obstacles, hand: HandState, goals: Array, config: Config
) -> CandidateTable:
    predicted, passing = prediction.candidates, is_passing(config.duration)
    solutions = [each.solution for each in predicted]
    has_likelihood = np.array([each.has_likelihood for each in predicted])
    sides = np.array([_find_predicted_sides(each, obstacles) for each in predicted])
    goal, grown = np.array([each.candidate.goal for each in predicted], dtype=np.intp), obstacles.grow(config.scene.hand_radius)
    named = [[identity in dict(each.candidate.sides) for identity in obstacles.ids] for each in predicted]
    return CandidateTable(
        labels=tuple(each.candidate.label for each in predicted),
        goal=goal,
        has_likelihood=has_likelihood,
        cost_to_go=np.array([each.cost for each in predicted]),
        safety_shortfall=np.array([each.safety_shortfall for each in solutions]),
        likelihood=np.array([each.likelihood for each in predicted]),
        length=np.array([each.candidate.length for each in predicted]),
        time_s=np.array([each.times[-1] for each in solutions]),
        is_named=np.array(named, dtype=bool).reshape(len(predicted), len(obstacles)),
        sides=sides,
        mean=np.array([interpolate_path(each) for each in solutions]),
        covariance=np.array([interpolate_steps(each.covariance[:, :2, :2], each.dt) for each in solutions]),
        duration_sensitivity=np.array(
            [interpolate_steps(compute_duration_sensitivity(each, passing)[:, :2], each.dt) for each in solutions]
        ),
        branch_times=compute_branch_times(predicted, obstacles),
        decisions=find_decisions(sides[has_likelihood], goal[has_likelihood], grown, hand, goals),
    )


def interpolate_path(solution: Solution) -> Array:
    """Return the mean positions (h, 2) [m] at `TIMES_S`, by the cubic through positions and velocities; at the end afterwards."""
    path = CubicHermiteSpline(solution.times, solution.mean[:, :2], solution.mean[:, 2:4])
    return np.asarray(path(np.minimum(TIMES_S, solution.times[-1])))


def interpolate_steps(values: Array, dt: float) -> Array:
    """Return values (N + 1, ...) at steps of dt [s] at `TIMES_S` (h, ...), linear between steps; the last one afterwards."""
    at = np.minimum(np.array(TIMES_S) / dt, len(values) - 1)
    before = np.minimum(at.astype(int), len(values) - 2)
    share = (at - before).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[before] + share * values[before + 1])


def _find_predicted_sides(predicted: PredictedCandidate, obstacles: Obstacles) -> Sides:
    """Return the sides (n,) of a candidate: those of its solved path, or those in its label where it could not be solved."""
    solution = predicted.solution
    centres = centre_trajectories(obstacles.centre, solution.dt * obstacles.velocity, len(solution.mean) - 1)
    named = {} if predicted.has_likelihood else dict(predicted.candidate.sides)
    sides = find_sides(solution.path, centres)
    return np.array([named.get(identity, side) for identity, side in zip(obstacles.ids, sides, strict=True)], dtype=np.int8)


Questions = list[tuple[Observation, 'Question']]


@dataclass(frozen=True, eq=False)
class Question(Record):
    """One question to one prediction.

    name; obstacles (a,): rows of those in question; possible: number of possible answers; answers: those that a candidate gives,
    and the true one; given (k,): index of the answer of each candidate; is_possible: whether each answer is one of the possible
    ones; truth: index of the true answer.
    """

    name: str
    obstacles: NDArray[np.intp]
    possible: int
    answers: tuple[Answer, ...]
    given: NDArray[np.intp]
    is_possible: NDArray[np.bool_]
    truth: int

    @property
    def unlisted(self) -> int:
        """Number of possible answers that no candidate gives and that are not the true one."""
        return max(self.possible - int(self.is_possible.sum()), 0)


def ask_all(recording: ObservedRecording, name: str) -> Questions:
    """Return a question with every observation of a recording to which it can be put."""
    relevant = find_relevant_obstacles(recording)
    pairs = ((observation, ask(name, observation, relevant)) for observation in recording.observations)
    return [(observation, question) for observation, question in pairs if question is not None]


def ask_main(recording: ObservedRecording) -> Questions:
    """Return the questions that one set of parameters is fitted to: path classes, or goals where no path class is in question."""
    return ask_all(recording, PATH_CLASS) or ask_all(recording, GOAL)


def find_relevant_obstacles(recording: ObservedRecording) -> frozenset[str]:
    """Return the obstacles that are in the label of any candidate of a recording."""
    found: set[str] = set()
    for each in recording.observations:
        found.update(each.ids[row] for row in np.flatnonzero(each.candidates.is_named.any(axis=0)))
    return frozenset(found)


def ask(name: str, observation: Observation, relevant: frozenset[str]) -> Question | None:
    """Return a question about the relevant obstacles, None where fewer than two answers are possible or the truth is unknown."""
    if name == GOAL:
        return _ask_goal(observation)
    is_relevant = np.array([identity in relevant for identity in observation.ids], dtype=bool)
    ahead = np.flatnonzero(observation.truth.is_ahead & is_relevant)
    if name == GAP and len(ahead):
        ahead = ahead[observation.row[ahead] == observation.row[ahead].min()]
    if not len(ahead):
        return None
    through = [np.unique(gaps[:, members], axis=0) for gaps, members in _split_by_row(observation, ahead)]
    possible = int(np.prod([len(each) for each in through]))
    if possible < 2:
        return None
    given = [tuple(each) for each in observation.candidates.sides[:, ahead].tolist()]
    answers, indices = _index_answers([*given, tuple(observation.truth.sides[ahead].tolist())])
    is_possible = np.array([_leads_through_one_gap_each(answer, observation, ahead) for answer in answers])
    return Question(name, ahead, possible, answers, indices[:-1], is_possible, int(indices[-1]))


def _ask_goal(observation: Observation) -> Question | None:
    count = len(observation.goals)
    if observation.truth.goal is None or count < 2:
        return None
    answers, given = tuple((goal,) for goal in range(count)), observation.candidates.goal.astype(np.intp)
    return Question(GOAL, np.zeros(0, dtype=np.intp), count, answers, given, np.ones(count, dtype=bool), observation.truth.goal)


def _index_answers(given: Iterable[Answer]) -> tuple[tuple[Answer, ...], NDArray[np.intp]]:
    indices: dict[Answer, int] = {}
    order = [indices.setdefault(answer, len(indices)) for answer in given]
    return tuple(indices), np.array(order, dtype=np.intp)


def _split_by_row(observation: Observation, ahead: NDArray[np.intp]) -> Iterator[tuple[Sides, NDArray[np.intp]]]:
    """Yield for each row ahead the sides of its open gaps, and its obstacles among those ahead."""
    for number in np.unique(observation.row[ahead]):
        yield observation.gaps[number], ahead[observation.row[ahead] == number]


def _leads_through_one_gap_each(answer: Answer, observation: Observation, ahead: NDArray[np.intp]) -> bool:
    """Tell whether sides lead through one open gap of each row."""
    sides = np.zeros(len(observation.ids), dtype=np.int8)
    sides[ahead] = answer
    return all((gaps[:, members] == sides[members]).all(axis=1).any() for gaps, members in _split_by_row(observation, ahead))
