# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The prediction: one hand state and one scene enter, one prediction and the classes that it follows leave."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .candidates import estimate_unfollowed, estimate_unsolved, is_there, rank_candidates, solve_candidates, split_unknown
from .classes import Search, Turn, search
from .classes.library import GuessTiming, recall_demonstrations
from .config import REFERENCE_STEP_S, Config, EstimatorConfig
from .deadline import NEVER, Deadline
from .goals import compare_goals, find_other_share
from .hand.duration import estimate_times_to_go, is_passing, limit_change
from .height import HeightPredictor
from .learning.dispersion import scale_covariance
from .learning.learnt import NOTHING, Knowledge
from .learning.recordings import Library, pool_recordings
from .obstacle_table import Obstacles, make_obstacles
from .obstacles.clearance import cull_obstacles
from .obstacles.geometry import find_holders
from .obstacles.risk import RiskBound, count_events
from .ocp.problem import Problem, rest_to_goal
from .plant.covariance import SharedCovariances, scale_noise, widen_covariance
from .plant.models import TripleIntegratorModel, make_plant_model
from .prediction import PredictedCandidate, Prediction
from .safety_preference import SafetyPreference
from .solution import Candidate, Status
from .tracks import HOLD_S, NO_TRACKS, Track, Tracks, take_rest
from .types import NANOSECONDS, Array, HandState, Record, Rest

SEARCH_SHARE, SOLVE_SHARE = 0.3, 0.8
"""Shares of the time left after which the search and the solver begin no step. The last step may end later."""
RESERVE_S, POOLING_S = 5e-5, 2e-4
"""Time besides that for each candidate [s]: to rank it, and to pool its path with recordings where there are some."""


def predict(
    config: Config,
    hand: HandState,
    obstacles: Obstacles,
    goals: Array,
    tracks: Tracks,
    knowledge: Knowledge = NOTHING,
    deadline: Deadline = NEVER,
    goal_heights: Array | None = None,
) -> tuple[Prediction, Tracks]:
    """Predict where a hand goes.

    Parameters
    ----------
    config
        All parameters.
    hand
        Estimated state of the hand.
    obstacles
        Obstacles at the stamp of the hand. The hand keeps `scene.hand_radius` away from them; the prediction holds them as given.
    goals
        Goals (g, 2) [m], g >= 1.
    tracks
        What the previous prediction returned, or `NO_TRACKS`.
    knowledge
        Demonstrated paths, which become candidates where they fit the scene, recordings, which are evidence (`recordings`), the
        planning of the operator (`likelihood`), the obstacles that are goals by name, and the goals of the past.
    deadline
        When the prediction has to be ready. All classes are solved together; what is not settled then is compared by an estimate.
    goal_heights
        Heights of the goals (g,) [m]; None where they are not known, and the height of the hand is not predicted.

    Returns
    -------
    Prediction, Tracks
        The prediction, and the classes that it follows, for the next one. Without a deadline, equal arguments give equal results,
        wall times apart.
    """
    began, stamp_ns, known = time.perf_counter(), hand.stamp_ns, tracks.keep_goals(goals)
    library, planning_spread, objects, habits = knowledge
    scene = _prepare_scene(config, hand, obstacles, goals, objects, goal_heights, known)
    found, candidates = _find_candidates(scene, config, known, library, deadline)
    matched = known.match(candidates, stamp_ns)
    reserve_s = (RESERVE_S + POOLING_S * bool(library.recordings)) * len(candidates)
    resting = known.find_resting(matched, obstacles, stamp_ns)
    solved = _solve(scene, config, candidates, matched, resting, deadline.take_share(SOLVE_SHARE, reserve_s))
    held = [_hold_answer(*each, scene) for each in zip(solved, matched, strict=True)]
    absent = known.find_absent(candidates, matched, stamp_ns)
    held += [each for track in absent if (each := _hold_absent(track, scene)) is not None]
    answered = estimate_unsolved(held, scene.in_the_way)
    others = estimate_unfollowed(found.unfollowed, answered, scene.durations_s)
    compared, ends = [*answered, *others], habits.find_ends(goals)
    if isinstance(make_plant_model(config.foc), TripleIntegratorModel):
        compared = compare_goals(compared, scene.hand, ends, scene.durations_s)
    weights = habits.weigh(goals, obstacles, objects, config.likelihood.past_goals)
    all_ranked = rank_candidates(compared, config.likelihood, scene.near, scene.hand, goals, planning_spread, weights)
    ranked, unknown = split_unknown(all_ranked, {each.label for each in others})
    pooled = pool_recordings(ranked, library, hand, scene.blocking, goals)
    rest = Rest(unknown)
    if unknown < 1.0:
        spread_m, prior = config.foc.endpoint_stddev, config.likelihood.other_goal
        led_to = sorted({each.candidate.goal for each in compared if each.has_likelihood})
        times_s = [scene.durations_s[goal] for goal in led_to]
        other = find_other_share(scene.hand, ends[led_to], times_s, prior, spread_m)
        rest = Rest((1.0 - other) * unknown, other)
    known_share = 1.0 - sum(rest)
    shared = [replace(each, likelihood=known_share * each.likelihood) for each in pooled]
    limited, rest = known.limit_changes(shared, rest, stamp_ns, absent)
    predicted, best = scene.heights.add_to(limited), known.choose_most_likely(limited)
    counts = {
        'merged': len(answered) - len(ranked),
        'culled': len(scene.blocking) - len(scene.near),
        'cleared_by_height': int(scene.cleared.sum()),
        'object_missing': sum(name is not None and name not in obstacles.ids for name in objects),
        'recalled': len(candidates) - len(found.candidates),
        'kept': sum(each.age_s > 0.0 for each in predicted),
        'unfinished': sum(each.status is Status.DEADLINE for each in predicted),
        'estimated': sum(each.status is Status.ESTIMATED for each in predicted),
    }
    prediction = Prediction(
        stamp_ns,
        hand.frame_id,
        hand.height,
        tuple(scale_covariance(each, config.covariance, at_rest=hand.onset_ns is None) for each in predicted),
        None if best is None else best.label,
        notes=dict(found.notes) | {name: count for name, count in counts.items() if count},
        solve_s=time.perf_counter() - began,
        obstacles=obstacles,
        goal_positions=goals,
        cleared=tuple(scene.cleared.tolist()),
        unknown=rest.unknown,
        other=rest.other,
    )
    following = Tracks(
        *known.follow(predicted, matched, solved, absent, stamp_ns),
        stamp_ns,
        goals,
        obstacles,
        dict(enumerate(scene.durations_s)),
        rest,
        None if best is None else best.way,
        max([known.next_number, *(each.number + 1 for each in matched)]),
        found.next_goal,
    )
    return prediction, following


@dataclass(frozen=True, eq=False)
class _PredictionScene(Record):
    """What the candidates of one prediction are found and solved in.

    hand: the state that they start from; goals (g, 2) [m]; durations_s: time to go to each; blocking: obstacles that the hand
    does not clear by its height, grown by its radius; near: those that are not culled; in_the_way: those of them that do not hold
    the goal, for each goal; cleared (n,): whether the hand clears each of all obstacles; heights: the prediction of the height;
    covariances: what all candidates share of theirs; objects: the id of the obstacle that each goal is.
    """

    hand: HandState
    goals: Array
    durations_s: list[float]
    blocking: Obstacles
    near: Obstacles
    in_the_way: list[Obstacles]
    cleared: NDArray[np.bool_]
    heights: HeightPredictor
    covariances: SharedCovariances
    objects: Sequence[str | None]


def _prepare_scene(
    config: Config,
    estimated: HandState,
    obstacles: Obstacles,
    goals: Array,
    objects: Sequence[str | None],
    goal_heights: Array | None,
    known: Tracks,
) -> _PredictionScene:
    """Return the scene of a prediction: a start without noise, times to go, and the obstacles that are in the way."""
    hand = _simplify_start(estimated, config.estimator)
    durations_s = _find_durations(hand, goals, known, config)
    grown = obstacles.grow(config.scene.hand_radius)
    covariances = SharedCovariances(hand, config)
    heights = HeightPredictor(config, hand, goal_heights, covariances)
    cleared = heights.find_cleared(grown, goals, durations_s)
    blocking = grown.take(np.flatnonzero(~cleared)) if cleared.any() else grown
    near = cull_obstacles(blocking, hand.mean[:2], goals, max(durations_s), config.scene.max_obstacles)
    in_the_way = take_in_the_way(near, goals, durations_s, objects)
    return _PredictionScene(hand, goals, durations_s, blocking, near, in_the_way, cleared, heights, covariances, objects)


def _find_candidates(
    scene: _PredictionScene, config: Config, known: Tracks, library: Library, deadline: Deadline
) -> tuple[Search, tuple[Candidate, ...]]:
    """Search for homotopy classes; return what was found, and the candidates with those that a library recalls."""
    timing = GuessTiming(scene.durations_s, config.foc.steps)
    turn = Turn(deadline.take_share(SEARCH_SHARE), known.next_goal, scene.objects)
    found = search(scene.hand.mean, scene.goals, scene.near, config.homotopy, *timing, known.candidates, turn)
    return found, recall_demonstrations(library.demonstrations, scene.hand, scene.goals, scene.near, timing, found)


def _solve(
    scene: _PredictionScene,
    config: Config,
    candidates: Sequence[Candidate],
    matched: Sequence[Track],
    resting: Collection[int],
    deadline: Deadline,
) -> list[PredictedCandidate]:
    """Solve the candidates that do not rest, each from the solution of its track; return all with their numbers, in their order.

    The solutions have predictive covariances. resting: numbers of tracks of which the rest of their last solution is taken.
    """
    found = [
        _hold_track(track, candidate, scene, 'unlikely, and solved again soon') if track.number in resting else None
        for candidate, track in zip(candidates, matched, strict=True)
    ]
    open_rows = [row for row, each in enumerate(found) if each is None]
    by_goal = {
        row: build_problem(config, scene.hand, scene.in_the_way[row], scene.goals[row], scene.durations_s[row])
        for row in {candidates[row].goal for row in open_rows}
    }
    earlier = [None if matched[row].has_failed else matched[row].solution for row in open_rows]
    tried = [candidates[row] for row in open_rows]
    until = Deadline(whole=deadline, goes_on=True)
    solved = solve_candidates(tried, [by_goal[each.goal] for each in tried], config.foc, earlier, until)
    for row, each in zip(open_rows, solved, strict=True):
        numbered = replace(each, way=matched[row].number)
        found[row] = _widen_covariance(numbered, scene.covariances, scene.hand, config)
    return [each for each in found if each is not None]


def _hold_answer(solved: PredictedCandidate, track: Track, scene: _PredictionScene) -> PredictedCandidate:
    """Return the rest of the last answer of a class that could not be solved, if it still holds."""
    if solved.has_likelihood:
        return solved
    return _hold_track(track, solved.candidate, scene, solved.solution.message) or solved


def _hold_absent(track: Track, scene: _PredictionScene) -> PredictedCandidate | None:
    """Return the rest of the last answer of a class that is no candidate any more, if it still holds."""
    return _hold_track(track, track.candidate, scene, 'the class is not followed any more')


def _hold_track(track: Track, candidate: Candidate, scene: _PredictionScene, reason: str) -> PredictedCandidate | None:
    """Return what remains of the solution of a track, under the name of a candidate.

    None if it is too old, if nothing remains, or if it is no path of its class any more.
    """
    hand, obstacles = scene.hand, scene.in_the_way[candidate.goal]
    if track.solution is None or not track.is_solved_within(hand.stamp_ns, HOLD_S):
        return None
    age_s = (hand.stamp_ns - track.solved_ns) / NANOSECONDS
    rest = take_rest(track.solution, age_s, hand.mean[:2], reason)
    if rest is None or not is_there(candidate, rest, obstacles):
        return None
    return PredictedCandidate(candidate, rest, track.sides, rest.expected_effort * rest.dt, 0.0, age_s, track.number)


def warm_up(config: Config) -> None:
    """Predict twice in a made-up scene, so that the first real predictions find the modules loaded and the matrices computed."""
    obstacles, goals = make_obstacles([[0.15, 0.0]], 0.02, 0.001), np.array([[0.3, 0.0]])
    hand, tracks = HandState(0, np.zeros(6), np.zeros((6, 6))), NO_TRACKS
    for _ in range(2):  # the second one begins at a solution
        _, tracks = predict(config, hand, obstacles, goals, tracks)


def _find_durations(hand: HandState, goals: Array, known: Tracks, config: Config) -> list[float]:
    """Return the time to go [s] to each goal, which for a goal that was there before changes only gradually."""
    durations, elapsed_s = estimate_times_to_go(hand, goals, config.duration), known.measure_time(hand.stamp_ns)
    return [limit_change(each, known.durations_s.get(goal, each), elapsed_s) for goal, each in enumerate(durations)]


def take_in_the_way(
    obstacles: Obstacles, goals: Array, times_s: Sequence[float], objects: Sequence[str | None] = ()
) -> list[Obstacles]:
    """Return for each of the goals (g, 2) [m] the obstacles on the way to it: all but those that hold it, or are its object.

    times_s: the time to go to each goal [s].
    """
    holds = find_holders(goals, obstacles, objects, times_s)
    return [obstacles.take(np.flatnonzero(~each)) if each.any() else obstacles for each in holds]


def build_problem(config: Config, hand: HandState, obstacles: Obstacles, goal: Array, duration_s: float) -> Problem:
    """Return the problem of reaching a goal (2,) [m] in duration_s [s] with the plant of the config, from a known hand state."""
    foc = config.foc
    dt, plant = duration_s / foc.steps, make_plant_model(foc)
    return rest_to_goal(
        plant.build_horizon(dt, foc.steps),
        plant.project_mean(hand.mean),
        goal,
        obstacles,
        scale_noise(np.array([foc.noise_x, foc.noise_y]), REFERENCE_STEP_S, dt),
        foc.eta,
        goal_weight=foc.goal_weight,
        recovery_s=foc.recovery_s,
        passing=is_passing(config.duration),
        risk=RiskBound(foc.bound, count_events(foc.risk, len(obstacles), foc.steps)),
        preference=SafetyPreference(config.likelihood.beta, config.likelihood.shortfall, dt=dt),
    )


def _simplify_start(hand: HandState, config: EstimatorConfig) -> HandState:
    """Return the state that a prediction starts from.

    Speed and acceleration of a hand that has not begun to move, those of its height too, are set to zero, because they are noise:
    with 1 mm of it at 100 Hz, the efforts of a hand at rest would differ by a factor of three from one sample to the next, and
    the classes of a symmetric obstacle would swap their ranks 24 times a second. The covariance is that of a hand that moves with
    about `estimator.onset_speed` at most.

    An acceleration a that decays as exp(-t / tau) leads from the speed v to v + tau a. Where the operator commands speed, as with
    a thumb stick, tau is short, and a plan that starts from v + tau a without acceleration is nearer to what follows.
    """
    if hand.onset_ns is None:
        height_at_rest, mean = np.array([hand.height_mean[0], 0.0, 0.0]), np.concatenate([hand.mean[:2], np.zeros(4)])
        return replace(hand, mean=mean, covariance=_slow_down(hand.covariance, config.onset_speed), height_mean=height_at_rest)
    if not config.acceleration_time_s:
        return hand
    final_velocity = hand.mean[2:4] + config.acceleration_time_s * hand.mean[4:]
    height, velocity, acceleration = hand.height_mean.tolist()
    height_then = np.array([height, velocity + config.acceleration_time_s * acceleration, 0.0])
    return replace(hand, mean=np.concatenate([hand.mean[:2], final_velocity, np.zeros(2)]), height_mean=height_then)


def _slow_down(covariance: Array, onset_speed: float) -> Array:
    """Return the covariance (6, 6) of a state given that its velocity is zero with a standard deviation of onset_speed [m/s]."""
    gain = covariance[:, 2:4] @ np.linalg.inv(covariance[2:4, 2:4] + onset_speed**2 * np.eye(2))
    slowed: Array = covariance - gain @ covariance[2:4]
    return slowed


def _widen_covariance(
    candidate: PredictedCandidate, shared: SharedCovariances, hand: HandState, config: Config
) -> PredictedCandidate:
    """Add the predictive covariance, and that of the timing, to the covariance that motor noise causes."""
    solution = candidate.solution
    covariance = widen_covariance(solution, shared[solution.dt], hand.onset_ns is None, config)
    return replace(candidate, solution=solution.with_covariance(covariance))
