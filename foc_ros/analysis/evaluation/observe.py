"""One recording through the predictor, and what really came beside each prediction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.replay import Replay, Step
from foc_ros.core.config import Config, DurationConfig
from foc_ros.core.dynamics.predictive_covariance import duration_sensitivity
from foc_ros.core.errors import RecordingError
from foc_ros.core.estimation.duration import is_passing, time_price
from foc_ros.core.homotopy import compute_swept_angles
from foc_ros.core.homotopy.branch_times import compute_branch_times
from foc_ros.core.obstacles.chance_constraint import centre_trajectories
from foc_ros.core.types import LEFT, NANOSECONDS, RIGHT, Array, HandState, Obstacles, PredictedCandidate, Prediction

from .observations import TIMES_S, Observation, Observations, Truth, Ways
from .path import Path
from .recordings import Recording
from .rows import axis, lines, rows, to_pass


def observe(recording: Recording, config: Config) -> Observations:
    """Replay a recording; raises RecordingError where it cannot be read or nothing could be predicted in it."""
    replayed = Replay(config)
    stamps: list[int] = []
    path: list[Array] = []
    made: list[tuple[Step, HandState]] = []
    for step in replayed.steps(recording.items()):
        if step.sample is not None:
            stamps.append(step.sample.stamp_ns)
            path.append(step.sample.position)
        if step.prediction is not None and step.prediction.solved_candidates:
            assert replayed.pipeline.hand_state is not None
            made.append((step, replayed.pipeline.hand_state))
    if not made:
        reason = replayed.pipeline.blocked() or replayed.intake.last_refusal or 'no candidate could be solved'
        raise RecordingError(f'{recording.name}: nothing could be predicted: {reason}')
    goals = made[-1][0].scene.goals
    assert goals is not None
    past = Path(np.array(stamps), np.array(path), goals)
    each = [_observation(step, hand, past, config.duration) for step, hand in made if hand.stamp_ns <= past.end_ns]
    if not each:
        raise RecordingError(f'{recording.name}: nothing was predicted before its goal was reached')
    return Observations(recording.name, tuple(each), replayed.intake.counts)


def _observation(step: Step, hand: HandState, past: Path, duration: DurationConfig) -> Observation:
    prediction, goals = step.prediction, step.scene.goals
    assert prediction is not None and goals is not None
    obstacles = step.scene.obstacles(prediction.stamp_ns)
    along = axis(past.positions[0], goals)
    row = rows(obstacles.centre, obstacles.radius, along)
    since_s = 0.0 if hand.onset_ns is None else (hand.stamp_ns - hand.onset_ns) / NANOSECONDS
    return Observation(
        stamp_ns=prediction.stamp_ns,
        hand=hand.mean,
        since_s=since_s,
        ids=obstacles.ids,
        centre=obstacles.centre,
        row=row,
        along=along,
        goals=goals,
        ways=_ways(prediction, obstacles, hand.effort_spent, duration),
        most_likely=prediction.most_likely,
        truth=_truth(prediction.stamp_ns, past, obstacles, row, along, goals),
    )


def _ways(prediction: Prediction, obstacles: Obstacles, spent: float, duration: DurationConfig) -> Ways:
    outcomes, price, passing = prediction.candidates, time_price(duration), is_passing(duration)
    solutions = [outcome.solution for outcome in outcomes]
    steps = [np.minimum(np.rint(np.array(TIMES_S) / each.dt).astype(int), len(each.mean) - 1) for each in solutions]
    named = [[identity in dict(outcome.candidate.sides) for identity in obstacles.ids] for outcome in outcomes]
    return Ways(
        labels=tuple(outcome.candidate.label for outcome in outcomes),
        goal=np.array([outcome.candidate.goal for outcome in outcomes]),
        solved=np.array([outcome.is_solved for outcome in outcomes]),
        spent=spent,
        to_go=np.array([each.effort * each.dt + price * each.times[-1] for each in solutions]),
        likelihood=np.array([outcome.likelihood for outcome in outcomes]),
        length=np.array([outcome.candidate.length for outcome in outcomes]),
        price=price,
        time_s=np.array([each.times[-1] for each in solutions]),
        named=np.array(named, dtype=bool).reshape(len(outcomes), len(obstacles)),
        sides=np.array([_predicted_sides(outcome, obstacles) for outcome in outcomes]),
        mean=np.array([each.mean[at, :2] for each, at in zip(solutions, steps, strict=True)]),
        covariance=np.array([each.covariance[at, :2, :2] for each, at in zip(solutions, steps, strict=True)]),
        late=np.array([duration_sensitivity(each, passing)[at, :2] for each, at in zip(solutions, steps, strict=True)]),
        partings=compute_branch_times(outcomes, obstacles),
    )


def _predicted_sides(outcome: PredictedCandidate, obstacles: Obstacles) -> NDArray[np.int8]:
    """Return the sides (n,) on which a candidate runs: those in its name where it could not be solved, else its path's own."""
    solution = outcome.solution
    sides = _sides(solution.path, centre_trajectories(obstacles.centre, solution.dt * obstacles.velocity, len(solution.mean) - 1))
    named = {} if outcome.is_solved else dict(outcome.candidate.sides)
    return np.array([named.get(identity, side) for identity, side in zip(obstacles.ids, sides, strict=True)], dtype=np.int8)


def _sides(path: Array, where: Array) -> NDArray[np.int8]:
    """Return the sides (n,) of obstacles, where (m, n, 2) [m], on which a path (m, 2) [m] runs: by the angle that it sweeps."""
    return np.where(compute_swept_angles(path, where) < 0.0, LEFT, RIGHT).astype(np.int8)


def _truth(stamp_ns: int, past: Path, obstacles: Obstacles, row: NDArray[np.int64], along: Array, goals: Array) -> Truth:
    now = past.index(stamp_ns)
    rest = past.positions[now:]
    seconds = (past.stamps_ns[now:] - stamp_ns) / NANOSECONDS
    where = obstacles.centre + seconds[:, None, None] * obstacles.velocity
    line, place = lines(obstacles.centre @ along, row), past.positions @ along
    open_rows = to_pass(line, place[now:])
    return Truth(
        sides=_sides(rest, where),
        ahead=open_rows[row],
        # goals that were other ones then say nothing of those at the end
        goal=past.goal if np.array_equal(goals, past.goals) else None,
        positions=past.at(stamp_ns, np.array(TIMES_S)),
        progress=float(past.progress[now]),
        approach=_approach(line, past, place, now),
    )


def _approach(line: Array, past: Path, place: Array, now: int) -> float:
    """Return the share of the way from the last row, or the start, to the next one, that lies behind.

    line (r,) [m]: where the rows stand; place (m,) [m]: where the hand was, both along the way.
    """
    passed = [int(np.flatnonzero(place < each)[-1]) + 1 for each in line if to_pass(np.array([each]), place)[0]]
    following = min((each for each in passed if each > now), default=None)
    if following is None:
        return float('nan')
    last = max((each for each in passed if each <= now), default=0)
    way = past.travelled[following] - past.travelled[last]
    return float((past.travelled[now] - past.travelled[last]) / way) if way > 0.0 else 0.0
