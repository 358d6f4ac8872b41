"""One hand state and one scene in, one prediction out; what is remembered goes in and comes out."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from .config import REFERENCE_STEP_S, Config
from .duration import time_to_go
from .dynamics import triple_integrator_horizon
from .forward import forward
from .homotopy import path_sides, search
from .likelihood import likelihoods, most_likely
from .noise import noise_per_step
from .problem import Problem, rest_to_goal
from .replanning import triple_integrator_error_map
from .records import Array, Candidate, HandState, Obstacles, Outcome, Prediction, Solution, Status


@dataclass(frozen=True)
class Memory:
    """What one prediction hands to the next: the label that was the most likely."""

    most_likely: str | None = None


def predict(config: Config, hand: HandState, obstacles: Obstacles, goals: Array, memory: Memory) -> tuple[Prediction, Memory]:
    """Predict where a hand goes.

    obstacles: where they are at the hand's stamp; goals (g, 2) [m], g >= 1. The same arguments give the same answer, times apart.
    """
    began = time.perf_counter()
    durations = [time_to_go(hand, goal, config.duration) for goal in goals]
    found = search(hand.mean, goals, obstacles, config.homotopy, durations, config.foc.steps)
    solved = [_solve(config, hand, obstacles, goals, durations, candidate) for candidate in found.candidates]
    judged = [_outcome(hand, obstacles, *pair) for pair in zip(found.candidates, solved, strict=True)]
    outcomes = ranked(distinct(judged), config.likelihood.beta)
    answer = [outcome for outcome in outcomes if outcome.solved]
    labels, values = [outcome.candidate.label for outcome in answer], np.array([outcome.likelihood for outcome in answer])
    best = most_likely(labels, values, memory.most_likely, config.likelihood.margin)
    merged = len(judged) - len(outcomes)
    notes = dict(found.notes) | ({'merged': merged} if merged else {})
    seconds = time.perf_counter() - began
    prediction = Prediction(hand.stamp_ns, hand.frame_id, hand.height, tuple(outcomes), best, notes, seconds)
    return prediction, Memory(best)


def reaching_problem(config: Config, hand: HandState, obstacles: Obstacles, goal: Array, duration_s: float) -> Problem:
    """Build the problem of one goal (2,) [m], to be reached in duration_s [s]."""
    foc = config.foc
    dt = duration_s / foc.steps
    horizon = triple_integrator_horizon(dt, foc.steps)
    return rest_to_goal(
        horizon,
        hand.mean,
        goal,
        obstacles,
        noise_per_step(np.array([foc.noise_x, foc.noise_y]), REFERENCE_STEP_S, dt),
        foc.eta,
        initial_covariance=hand.covariance,
        error_map=triple_integrator_error_map(dt, foc.steps),
        goal_weight=foc.goal_weight,
        recovery_s=foc.recovery_s,
    )


def _solve(
    config: Config, hand: HandState, obstacles: Obstacles, goals: Array, durations: list[float], candidate: Candidate
) -> Solution:
    problem = reaching_problem(config, hand, obstacles, goals[candidate.goal], durations[candidate.goal])
    return forward(problem, candidate.guess, config.foc)


def _outcome(hand: HandState, obstacles: Obstacles, candidate: Candidate, solution: Solution) -> Outcome:
    """Judge which class the solution really is in, and what it costs: integral of squared jerk, spent and to go."""
    sides = path_sides(solution.path, obstacles)
    cost = hand.effort_spent + solution.effort * solution.dt
    if solution.status is Status.SOLVED and any(sides.get(identity, side) != side for identity, side in candidate.sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution slid into another class')
    return Outcome(candidate, solution, sides, cost, 0.0)


def distinct(outcomes: list[Outcome]) -> list[Outcome]:
    """Drop what slid into a class that another outcome solved: the same way round is never counted twice."""
    held = {(outcome.candidate.goal, frozenset(outcome.sides.items())) for outcome in outcomes if outcome.solved}
    return [
        outcome
        for outcome in outcomes
        if outcome.solution.status is not Status.LEFT_CLASS
        or (outcome.candidate.goal, frozenset(outcome.sides.items())) not in held
    ]


def ranked(outcomes: list[Outcome], beta: float) -> list[Outcome]:
    """Give the solved ones their likelihoods and put the most likely first; the others follow in their order, at 0."""
    solved = [outcome for outcome in outcomes if outcome.solved]
    shares = likelihoods(np.array([outcome.cost for outcome in solved]), beta)
    weighed = [replace(outcome, likelihood=float(share)) for outcome, share in zip(solved, shares, strict=True)]
    weighed.sort(key=lambda outcome: (-outcome.likelihood, outcome.candidate.label))
    return weighed + [outcome for outcome in outcomes if not outcome.solved]
