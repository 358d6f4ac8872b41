# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The prediction: one hand state and one scene enter, one prediction and the classes that it follows leave."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from .candidates import estimate_unfollowed, estimate_unsolved, is_there, rank_candidates, solve_candidates, split_unknown
from .classes import Search, SearchOrder, search
from .classes.library import GuessTiming, recall_demonstrations
from .config import Config
from .deadline import NEVER, Deadline
from .goals import compare_goals, find_other_share
from .learning.dispersion import scale_covariances
from .learning.learnt import NOTHING, Knowledge
from .learning.recordings import Library, pool_recordings
from .obstacle_table import Obstacles
from .plant.models import TripleIntegratorModel, make_plant_model
from .prediction import PredictedCandidate, Prediction
from .situation import Situation, prepare_situation
from .solution import Candidate, Status
from .tracks import HOLD_S, Track, Tracks, take_remainder
from .types import NANOSECONDS, Array, HandState, Unassigned

SEARCH_SHARE, SOLVE_SHARE = 0.3, 0.8
"""Shares of the time left after which the search and the solver begin no step. The last step may end later."""


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
    situation = prepare_situation(config, hand, obstacles, goals, knowledge.objects, goal_heights, known)
    found, candidates = _find_candidates(situation, known, knowledge.library, deadline)
    matched = known.match(candidates, stamp_ns)
    absent = known.find_absent(candidates, matched, stamp_ns)
    solved = _solve(situation, candidates, matched, deadline.take_share(SOLVE_SHARE))
    answered = _answer(situation, solved, matched, absent)
    shared, unassigned = _share_likelihood(situation, answered, found.unfollowed, knowledge, hand)
    limited, unassigned = known.limit_changes(shared, unassigned, stamp_ns, absent)
    predicted, best = situation.heights.add_to(limited), known.choose_most_likely(limited)
    notes = {
        'merged': len(answered) - len(predicted),
        'culled': len(situation.blocking) - len(situation.near),
        'cleared_by_height': int(situation.cleared.sum()),
        'object_missing': sum(name is not None and name not in obstacles.ids for name in knowledge.objects),
        'recalled': len(candidates) - len(found.candidates),
        'kept': sum(each.age_s > 0.0 for each in predicted),
        'unfinished': sum(each.status is Status.DEADLINE for each in predicted),
        'estimated': sum(each.status is Status.ESTIMATED for each in predicted),
    }
    prediction = Prediction(
        stamp_ns,
        hand.frame_id,
        hand.height,
        scale_covariances(predicted, config.covariance),
        None if best is None else best.label,
        notes=dict(found.notes) | {name: count for name, count in notes.items() if count},
        solve_s=time.perf_counter() - began,
        obstacles=obstacles,
        goal_positions=goals,
        cleared=tuple(situation.cleared.tolist()),
        unknown=unassigned.unknown,
        other=unassigned.other,
    )
    following = Tracks(
        *known.follow(predicted, matched, solved, absent, stamp_ns),
        stamp_ns,
        goals,
        dict(enumerate(situation.durations_s)),
        unassigned,
        None if best is None else best.way,
        max([known.next_number, *(each.number + 1 for each in matched)]),
        found.next_goal,
    )
    return prediction, following


def _find_candidates(
    situation: Situation, known: Tracks, library: Library, deadline: Deadline
) -> tuple[Search, tuple[Candidate, ...]]:
    """Search for homotopy classes; return what was found, and the candidates with those that a library recalls."""
    hand, goals, near = situation.hand, situation.goals, situation.near
    timing = GuessTiming(situation.durations_s, situation.config.foc.steps)
    order = SearchOrder(deadline.take_share(SEARCH_SHARE), known.next_goal, situation.objects)
    found = search(hand.mean, goals, near, situation.config.homotopy, *timing, known.candidates, order)
    return found, recall_demonstrations(library.demonstrations, hand, goals, near, timing, found)


def _solve(
    situation: Situation, candidates: Sequence[Candidate], matched: Sequence[Track], deadline: Deadline
) -> list[PredictedCandidate]:
    """Solve the candidates, each from the solution of its track; return them with their numbers and predictive covariances."""
    by_goal = {goal: situation.pose_problem(goal) for goal in {each.goal for each in candidates}}
    problems = [by_goal[each.goal] for each in candidates]
    earlier = [None if each.has_failed else each.solution for each in matched]
    until = Deadline(whole=deadline, goes_on=True)
    solved = solve_candidates(candidates, problems, situation.config.foc, earlier, until)
    return [situation.add_uncertainty(replace(each, way=track.number)) for each, track in zip(solved, matched, strict=True)]


def _answer(
    situation: Situation, solved: Sequence[PredictedCandidate], matched: Sequence[Track], absent: Sequence[Track]
) -> list[PredictedCandidate]:
    """Return the candidates with an answer wherever there is one: of the solver, the rest of an earlier one, or an estimate.

    The rest of an earlier answer stands for a class that the solver or the search has missed, as long as it still holds.
    """
    answered = [
        each if each.has_likelihood else _hold_track(track, each.candidate, situation, each.solution.message) or each
        for each, track in zip(solved, matched, strict=True)
    ]
    for track in absent:
        held = _hold_track(track, track.candidate, situation, 'the class is not followed any more')
        if held is not None:
            answered.append(held)
    late = [(each, track) for each, track in zip(solved, matched, strict=True) if each.status is Status.DEADLINE]
    begun = {each.way for each, track in late if track.solution is None and each.solution.qp_solves == 1}
    return estimate_unsolved(answered, situation.in_the_way, begun)


def _hold_track(track: Track, candidate: Candidate, situation: Situation, reason: str) -> PredictedCandidate | None:
    """Return what remains of the solution of a track, under the name of a candidate.

    None if it is too old, if nothing remains, or if it is no path of its class any more.
    """
    hand, obstacles = situation.hand, situation.in_the_way[candidate.goal]
    age_s = (hand.stamp_ns - track.solved_ns) / NANOSECONDS
    if track.solution is None or not 0.0 <= age_s <= HOLD_S:
        return None
    rest = take_remainder(track.solution, age_s, hand.mean[:2], reason)
    if rest is None or not is_there(candidate, rest, obstacles):
        return None
    return PredictedCandidate(candidate, rest, track.sides, rest.effort * rest.dt, 0.0, age_s, track.number)


def _share_likelihood(
    situation: Situation,
    answered: Sequence[PredictedCandidate],
    unfollowed: Sequence[Candidate],
    knowledge: Knowledge,
    estimated: HandState,
) -> tuple[list[PredictedCandidate], Unassigned]:
    """Return the distinct candidates with their likelihoods, the most likely first, and the shares that no candidate has.

    First, candidates and unfollowed classes are compared by their costs, and by the goals of the past. What the classes that are
    not followed get is unknown. Recordings change what the candidates get. Then comes the share of another goal.
    estimated: the state of the hand as it was estimated, which tells the recordings that count.
    """
    config, hand, goals, habits = situation.config, situation.hand, situation.goals, knowledge.habits
    others = estimate_unfollowed(unfollowed, answered, situation.durations_s)
    compared, ends = [*answered, *others], habits.find_ends(goals)
    if isinstance(make_plant_model(config.foc), TripleIntegratorModel):
        compared = compare_goals(compared, hand, ends, situation.durations_s)
    weights = habits.weigh(goals, situation.obstacles, situation.objects, config.likelihood.past_goals)
    ranked = rank_candidates(compared, config.likelihood, situation.near, hand, goals, knowledge.planning_spread, weights)
    followed, unknown = split_unknown(ranked, {each.label for each in others})
    pooled = pool_recordings(followed, knowledge.library, estimated, situation.blocking, goals)
    unassigned = Unassigned(unknown)
    if unknown < 1.0:
        led_to = sorted({each.candidate.goal for each in compared if each.has_likelihood})
        times_s = [situation.durations_s[goal] for goal in led_to]
        other = find_other_share(hand, ends[led_to], times_s, config.likelihood.other_goal, config.foc.endpoint_stddev)
        unassigned = Unassigned((1.0 - other) * unknown, other)
    known_share = 1.0 - sum(unassigned)
    return [replace(each, likelihood=known_share * each.likelihood) for each in pooled], unassigned
