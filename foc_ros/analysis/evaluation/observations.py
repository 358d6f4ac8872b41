# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Observations: what was predicted in a recording, beside what really came, and the questions that are put to them.

A recording is replayed once. How costs become likelihoods can then be tried on the observations without a predictor.

- `way`: in which homotopy class will the hand pass the obstacles still ahead?
- `gap`: the same for the next row of obstacles only.
- `goal`: which goal will it reach?

Through a row of m obstacles (`rows`) a path that does not turn back takes one of m + 1 gaps, of which those too narrow for the
hand are none. A question is put only where at least two answers are possible. A candidate may also weave through a row: such an
answer can be given, but a uniform guess does not count it. The true answer always counts as possible.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, make_interp_spline

from foc_ros.analysis.parallel import collect, count_prediction
from foc_ros.analysis.recordings import Recording, group_by_operator
from foc_ros.analysis.replay import Replay, Step, keep_last_run
from foc_ros.core.classes.rows import Decisions, Rows, find_decisions, find_direction, find_rows, tabulate_sides
from foc_ros.core.classes.sides import BranchTimes, compute_branch_times, measure_passages
from foc_ros.core.config import Config, replace_values
from foc_ros.core.errors import FocError, RecordingError, warn
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.plant.covariance import SharedCovariances, widen_covariance
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.situation import simplify_start
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState, Record

from .truth import HORIZONS_S, TIMES_S, Bools, GroundTruth, RecordedPath, Sides, check_samples, find_ground_truth, find_open_gaps

EXACT = 1e-18
"""Variance that is added to that of a position, which may be known [m^2]: that of a nanometre."""

PATH_CLASS, GAP, GOAL = 'way', 'gap', 'goal'
WIDENINGS = 'foc.process_noise', 'foc.endpoint_stddev', 'duration.spread'
"""Standard deviations that no plan depends on. The covariances are linear in their squares."""
Answer = tuple[int, ...]
"""Sides of the obstacles in question, LEFT or RIGHT, in their order; or the row of a goal."""
Questions = list[tuple['Observation', 'Question']]


@dataclass(frozen=True, eq=False)
class CandidateTable(Record):
    """The k candidates of one prediction, about n obstacles.

    has_likelihood: whether each takes part; cost_to_go [m^2/s^5]: integral of the squared control, comparable between goals;
    safety_shortfall: by how much the safety factor is below the wanted one; likelihood: as published; length [m]: of the shortest
    path in its class; time_s: to the goal; named: obstacles in any label; sides (k, n): LEFT or RIGHT; mean (k, h, 2) [m]: the
    positions at `TIMES_S`; covariance (k, 3, 2, 2) [m^2], positive definite: of those at `HORIZONS_S`; plans (4, k, 3, 2, 2)
    [m^2]: that of the plan without `WIDENINGS`, and with each of them at 1, none if not asked for; decisions: of those that take
    part.
    """

    labels: tuple[str, ...]
    goal: NDArray[np.int64]
    has_likelihood: Bools
    cost_to_go: Array
    safety_shortfall: Array
    likelihood: Array
    length: Array
    time_s: Array
    named: frozenset[str]
    sides: Sides
    mean: Array
    covariance: Array
    plans: Array
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
    """One prediction, from a hand with mean hand (6,), movement_age_s after the onset of its movement (0 at rest).

    ids, centre (n, 2) [m]: of the obstacles at that stamp; row (n,): 0 first, -1 for a wall; gaps: for each row the sides (k, n)
    on which paths through its open gaps pass its obstacles; direction (2,): the unit vector along which rows are ordered;
    most_likely: the leading label after hysteresis; other: share of a goal that nobody announced.
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


def observe(
    recording: Recording, config: Config, replayed: Replay | None = None, *, with_plans: bool = False
) -> ObservedRecording:
    """Replay a recording; raises RecordingError where it cannot be read or nothing could be predicted in it.

    replayed: a replay with the same config that goes on, with what it has learnt but not with its scene; a new one if not given.
    with_plans: whether the covariances are tabulated that other `WIDENINGS` would give.
    """
    if replayed is None:
        replayed = Replay(config)
    else:
        replayed.forget_scene()
    samples: list[HandSample] = []
    made: list[tuple[Step, HandState, Config]] = []
    for step in replayed.steps(recording.items()):
        if step.sample is not None:
            keep_last_run(samples, step.sample, made)
        if step.prediction is not None:
            count_prediction()
        if step.prediction is not None and step.prediction.candidates_with_likelihood:
            assert replayed.pipeline.hand_state is not None
            made.append((step, replayed.pipeline.hand_state, replayed.pipeline.adapted_config))
    losses = replayed.describe_losses()
    if not made:
        reason = losses or replayed.pipeline.not_ready_reason() or 'no candidate could be solved'
        raise RecordingError(f'{recording.name}: nothing could be predicted: {reason}')
    check_samples(recording.name, samples)
    if losses:
        warn(f'{recording.name}: {losses}')
    goals = made[-1][0].scene.goals
    assert goals is not None
    path = RecordedPath.from_samples(samples, goals, recording.goal)
    found = [make_observation(*each, path, with_plans=with_plans) for each in made if each[1].stamp_ns <= path.end_ns]
    if not found:
        raise RecordingError(f'{recording.name}: nothing was predicted before its goal was reached')
    return ObservedRecording(recording.name, tuple(found), path)


def observe_in_order(recordings: Sequence[Recording], config: Config) -> tuple[list[ObservedRecording], dict[str, str]]:
    """Replay the recordings of an operator in their order, each with what was learnt before; return the failures by name, too."""
    replayed, observed, failed = Replay(config), list[ObservedRecording](), dict[str, str]()
    for recording in recordings:
        try:
            observed.append(observe(recording, config, replayed))
        except FocError as error:
            failed[recording.name] = ' '.join(str(error).split()).removeprefix(f'{recording.name}: ')
    return observed, failed


def observe_all(
    recordings: Mapping[str, Recording], config: Config, in_order: bool = False, stage: str = 'replay'
) -> tuple[list[ObservedRecording], dict[str, str]]:
    """Observe recordings in parallel with a progress bar, or as `observe_in_order`; return the failures by name as well.

    stage: words of the progress bar.
    """
    groups = group_by_operator(recordings) if in_order else {name: [each] for name, each in recordings.items()}
    parts, failed = collect(partial(observe_in_order, config=config), list(groups.items()), stage)
    failed |= {name: reason for _, reasons in parts for name, reason in reasons.items()}
    return [each for observed, _ in parts for each in observed], failed


def make_observation(step: Step, hand: HandState, config: Config, path: RecordedPath, *, with_plans: bool) -> Observation:
    """Return one prediction, with the hand that it was made from, beside what came; config: adapted to the operator."""
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
        candidates=_tabulate_candidates(prediction, obstacles, hand, goals, config, with_plans=with_plans),
        most_likely=prediction.most_likely,
        truth=find_ground_truth(prediction.stamp_ns, path, obstacles, row, direction, goals),
        other=prediction.other,
    )


def _tabulate_candidates(
    prediction: Prediction, obstacles: Obstacles, hand: HandState, goals: Array, config: Config, *, with_plans: bool
) -> CandidateTable:
    predicted, narrow = prediction.candidates, replace_values(config, dict.fromkeys(WIDENINGS, 0.0))
    solutions = [each.solution for each in predicted]
    widened = [narrow, *(replace_values(narrow, {each: 1.0}) for each in WIDENINGS)] if with_plans else []
    has_likelihood = np.array([each.has_likelihood for each in predicted])
    passages = measure_passages(solutions, obstacles)
    sides = tabulate_sides(passages)
    for row, each in zip(sides, predicted, strict=True):  # those of the label where a candidate could not be solved
        known = {} if each.has_likelihood else dict(each.candidate.sides)
        row[:] = [known.get(identity, side) for identity, side in zip(obstacles.ids, row, strict=True)]
    goal, grown = np.array([each.candidate.goal for each in predicted], dtype=np.intp), obstacles.grow(config.scene.hand_radius)
    return CandidateTable(
        labels=tuple(each.candidate.label for each in predicted),
        goal=goal,
        has_likelihood=has_likelihood,
        cost_to_go=np.array([each.cost for each in predicted]),
        safety_shortfall=np.array([each.safety_shortfall for each in solutions]),
        likelihood=np.array([each.likelihood for each in predicted]),
        length=np.array([each.candidate.length for each in predicted]),
        time_s=np.array([each.times[-1] for each in solutions]),
        named=frozenset(identity for each in predicted for identity, _ in each.candidate.sides),
        sides=sides,
        mean=np.array(
            [
                # the cubic through positions and velocities
                CubicHermiteSpline(each.times, each.path, each.mean[:, 2:4])(np.minimum(TIMES_S, each.times[-1]))
                for each in solutions
            ]
        ),
        covariance=np.array([interpolate_steps(each.covariance[:, :2, :2], each.dt) for each in solutions]) + EXACT * np.eye(2),
        plans=np.array([_tabulate_plans(predicted, hand, each) + EXACT * np.eye(2) for each in widened]),
        branch_times=compute_branch_times(passages),
        decisions=find_decisions(sides[has_likelihood], goal[has_likelihood], grown, hand, goals),
    )


def _tabulate_plans(predicted: Sequence[PredictedCandidate], hand: HandState, config: Config) -> Array:
    """Return the covariance (k, 3, 2, 2) [m^2] of the positions at `HORIZONS_S` that the plans of k candidates have."""
    shared, found = SharedCovariances(simplify_start(hand, config.estimator), config), []
    for each in predicted:
        planned = each.solution.with_covariance(each.motor_covariance)
        covariance = widen_covariance(planned, shared[planned.dt], hand.onset_ns is None, config)
        found.append(interpolate_steps(covariance[:, :2, :2], planned.dt))
    return np.array(found)


def interpolate_steps(values: Array, dt: float) -> Array:
    """Return values (N + 1, ...) at steps of dt [s] at `HORIZONS_S` (3, ...), linear between; the last one afterwards."""
    times = dt * np.arange(len(values))
    return np.asarray(make_interp_spline(times, values, k=1)(np.minimum(HORIZONS_S, times[-1])))


@dataclass(frozen=True, eq=False)
class Question(Record):
    """One question to one prediction.

    obstacles (a,): rows of those in question; possible: number of possible answers; answers: those that a candidate gives, and
    the true one; given (k,): index of the answer of each candidate; is_possible: whether each answer is one of the possible ones;
    truth: index of the true answer.
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
    return frozenset[str]().union(*(each.candidates.named for each in recording.observations))


def ask(name: str, observation: Observation, relevant: frozenset[str]) -> Question | None:
    """Return a question about the relevant obstacles, None where fewer than two answers are possible or the truth is unknown."""
    truth, candidates = observation.truth, observation.candidates
    if name == GOAL:
        count = len(observation.goals)
        if truth.goal is None or count < 2:
            return None
        answers, given = tuple((goal,) for goal in range(count)), candidates.goal.astype(np.intp)
        return Question(GOAL, np.zeros(0, dtype=np.intp), count, answers, given, np.ones(count, dtype=bool), truth.goal)
    is_relevant = np.array([identity in relevant for identity in observation.ids], dtype=bool)
    ahead = np.flatnonzero(truth.is_ahead & is_relevant)
    if name == GAP and len(ahead):
        ahead = ahead[observation.row[ahead] == observation.row[ahead].min()]
    indices: dict[Answer, int] = {}
    rows = [indices.setdefault(tuple(sides), len(indices)) for sides in candidates.sides[:, ahead].tolist()]
    true = indices.setdefault(tuple(truth.sides[ahead].tolist()), len(indices))
    listed, row = np.array([*indices]), observation.row[ahead]
    possible, is_possible = 1, np.ones(len(listed), dtype=bool)
    for number in np.unique(row):
        gaps = np.unique(observation.gaps[number][:, ahead[row == number]], axis=0)
        possible *= len(gaps)
        is_possible &= (listed[:, None, row == number] == gaps).all(axis=2).any(axis=1)
    if possible < 2:
        return None
    if not is_possible[true]:
        is_possible[true], possible = True, possible + 1
    return Question(name, ahead, possible, tuple(indices), np.array(rows, dtype=np.intp), is_possible, true)
