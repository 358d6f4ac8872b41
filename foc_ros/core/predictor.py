"""One hand state and one scene in, one prediction out; what is remembered goes in and comes out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .candidates import rank_candidates, solve_candidates
from .config import REFERENCE_STEP_S, Config, DurationConfig
from .deadline import Deadline
from .dynamics.noise import scale_noise
from .dynamics.plants import triple_integrator_horizon
from .dynamics.predictive_covariance import predictive_covariance, timing_covariances
from .estimation.duration import candidate_durations, estimate_times_to_go, is_passing, time_price
from .homotopy import search
from .homotopy.demonstrations import Demonstration, GuessTiming, recall_demonstrations
from .likelihood import select_most_likely
from .memory import Memory
from .obstacles.culling import cull_obstacles
from .ocp.problem import Problem, rest_to_goal
from .types import Array, Candidate, HandState, Obstacles, PredictedCandidate, Prediction, make_obstacles


def predict(
    config: Config, hand: HandState, obstacles: Obstacles, goals: Array, memory: Memory, library: Sequence[Demonstration] = ()
) -> tuple[Prediction, Memory]:
    """Predict where a hand goes.

    obstacles: where they are at the hand's stamp; goals (g, 2) [m], g >= 1; library: ways to recall where they
    fit. The same arguments give the same answer, times apart.
    """
    began = time.perf_counter()
    hand = _start(hand, config.estimator.acceleration_time_s)
    durations = estimate_times_to_go(hand, goals, config.duration)
    given, obstacles = obstacles, cull_obstacles(obstacles, hand.mean[:2], goals, max(durations), config.scene.max_obstacles)
    found = search(hand.mean, goals, obstacles, config.homotopy, durations, config.foc.steps, memory.candidates)
    seen = hand, goals, obstacles, config.homotopy, GuessTiming(durations, config.foc.steps)
    candidates = recall_demonstrations(library, *seen, found.candidates, memory.candidates)
    problems = build_problems(config, hand, obstacles, goals, candidates, durations)
    deadline = Deadline(config.budget_s or None, began)
    tried = solve_candidates(
        candidates, list(problems.values()), config.foc, config.likelihood, hand.effort_spent, memory.known(candidates), deadline
    )
    tried = [_priced(memory.aged(outcome, hand.stamp_ns), time_price(config.duration)) for outcome in tried]
    outcomes = rank_candidates(tried, config.likelihood, obstacles)
    unsure = {
        one: predictive_covariance(hand, one.horizon.dt, config.foc.steps, config) for one in dict.fromkeys(problems.values())
    }
    outcomes = [_seen(outcome, hand, unsure[problems[outcome.candidate.label]], config.duration) for outcome in outcomes]
    shares = {outcome.candidate.label: outcome.likelihood for outcome in outcomes if outcome.is_solved}
    best = select_most_likely(shares, memory.most_likely, config.likelihood.margin)
    counted = {'merged': len(candidates) - len(outcomes), 'culled': len(given) - len(obstacles)}
    counted['recalled'] = len(candidates) - len(found.candidates)
    notes = dict(found.notes) | {name: count for name, count in counted.items() if count}
    seconds = time.perf_counter() - began
    prediction = Prediction(hand.stamp_ns, hand.frame_id, hand.height, tuple(outcomes), best, notes, seconds)
    return prediction, memory.after(prediction, candidates, tried)


def _priced(outcome: PredictedCandidate, price: float) -> PredictedCandidate:
    """Add what the time to go costs."""
    return replace(outcome, cost=outcome.cost + price * float(outcome.solution.times[-1])) if price else outcome


def warm_up(config: Config) -> None:
    """Predict once for a made-up scene, so that the first real prediction finds what is computed once and kept."""
    obstacles, goals = make_obstacles([[0.15, 0.0]], 0.02, 0.001), np.array([[0.3, 0.0]])
    predict(config, HandState(0, np.zeros(6), np.zeros((6, 6))), obstacles, goals, Memory())


def build_problems(
    config: Config,
    hand: HandState,
    obstacles: Obstacles,
    goals: Array,
    candidates: Sequence[Candidate],
    goal_times: Sequence[float],
) -> dict[str, Problem]:
    """Return the problem of each candidate by its label; candidates of one goal and duration share theirs."""
    times = candidate_durations(hand, candidates, goal_times, config.duration)
    kinds = [(candidate.goal, duration_s) for candidate, duration_s in zip(candidates, times, strict=True)]
    made = {kind: build_problem(config, hand, obstacles, goals[kind[0]], kind[1]) for kind in dict.fromkeys(kinds)}
    return {candidate.label: made[kind] for candidate, kind in zip(candidates, kinds, strict=True)}


def build_problem(config: Config, hand: HandState, obstacles: Obstacles, goal: Array, duration_s: float) -> Problem:
    """Build the problem of one goal (2,) [m], to be reached in duration_s [s], by a hand whose state is known."""
    foc = config.foc
    dt = duration_s / foc.steps
    horizon = triple_integrator_horizon(dt, foc.steps)
    return rest_to_goal(
        horizon,
        hand.mean,
        goal,
        obstacles,
        scale_noise(np.array([foc.noise_x, foc.noise_y]), REFERENCE_STEP_S, dt),
        foc.eta,
        goal_weight=foc.goal_weight,
        recovery_s=foc.recovery_s,
        passing=is_passing(config.duration),
    )


def _start(hand: HandState, acceleration_time_s: float) -> HandState:
    """Return the state that a prediction starts from.

    Speed and acceleration of a hand that has not begun to move are taken as nothing. They are noise: with 1 mm of it at 100 Hz,
    the efforts of a hand at rest would differ by a factor of three from one sample to the next, and the ways round a symmetric
    obstacle would swap their ranks 24 times a second.

    An acceleration a that fades as exp(-t / tau) leads from the speed v to v + tau a. Where the operator commands speed, as with
    a thumb stick, that is soon, and a plan that starts from v + tau a without acceleration is nearer to what comes.
    """
    if hand.onset_ns is None:
        return replace(hand, mean=np.concatenate([hand.mean[:2], np.zeros(4)]))
    if not acceleration_time_s:
        return hand
    settled = hand.mean[2:4] + acceleration_time_s * hand.mean[4:]
    return replace(hand, mean=np.concatenate([hand.mean[:2], settled, np.zeros(2)]))


def _seen(outcome: PredictedCandidate, hand: HandState, unsure: Array, duration: DurationConfig) -> PredictedCandidate:
    """Add a doubt (N + 1, 6, 6), and that of the times, to what the hand's own noise will do."""
    solution = outcome.solution
    covariance = solution.covariance + unsure
    for added in timing_covariances(solution, hand.onset_ns is None, duration):
        covariance += added
    seen = solution.with_covariance(covariance)
    return PredictedCandidate(outcome.candidate, seen, outcome.sides, outcome.cost, outcome.likelihood)
