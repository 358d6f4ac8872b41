"""The prediction: one hand state and one scene enter, one prediction and the memory for the next one leave."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .candidates import rank_candidates, solve_candidates
from .config import REFERENCE_STEP_S, Config
from .deadline import Deadline
from .dynamics.noise import scale_noise
from .dynamics.plant_models import make_plant_model
from .dynamics.predictive_covariance import compute_predictive_covariance, timing_covariances
from .estimation.duration import choose_candidate_durations, estimate_times_to_go, is_passing
from .homotopy import search
from .homotopy.demonstrations import Demonstration, GuessTiming, recall_demonstrations
from .likelihood import make_cost_model, select_most_likely
from .memory import Memory
from .obstacles.culling import cull_obstacles
from .ocp.problem import Problem, rest_to_goal
from .types import Array, Candidate, HandState, Obstacles, PredictedCandidate, Prediction, make_obstacles


def predict(
    config: Config, hand: HandState, obstacles: Obstacles, goals: Array, memory: Memory, library: Sequence[Demonstration] = ()
) -> tuple[Prediction, Memory]:
    """Predict where a hand goes.

    Parameters
    ----------
    config
        All parameters.
    hand
        Estimated state of the hand.
    obstacles
        Obstacles at the stamp of the hand.
    goals
        Goals (g, 2) [m], g >= 1.
    memory
        What the previous prediction returned, or an empty `Memory`.
    library
        Demonstrated paths, which become candidates where they fit the scene.

    Returns
    -------
    Prediction, Memory
        The prediction, and the memory for the next one. Equal arguments give equal results, wall times apart.
    """
    began = time.perf_counter()
    hand = _simplify_start(hand, config.estimator.acceleration_time_s)
    durations = estimate_times_to_go(hand, goals, config.duration)
    given, obstacles = obstacles, cull_obstacles(obstacles, hand.mean[:2], goals, max(durations), config.scene.max_obstacles)
    found = search(hand.mean, goals, obstacles, config.homotopy, durations, config.foc.steps, memory.candidates)
    scene = hand, goals, obstacles, config.homotopy, GuessTiming(durations, config.foc.steps)
    candidates = recall_demonstrations(library, *scene, found.candidates, memory.candidates)
    problems = build_problems(config, hand, obstacles, goals, candidates, durations)
    costs, earlier = make_cost_model(hand.effort_spent, config), memory.find_earlier(candidates)
    deadline = Deadline(config.budget_s or None, began)
    solved = solve_candidates(candidates, list(problems.values()), config.foc, costs, earlier, deadline)
    ranked = rank_candidates([memory.add_age(each, hand.stamp_ns) for each in solved], config.likelihood, obstacles)
    predicted = _widen_covariances(ranked, problems, hand, config)
    likelihoods = {each.label: each.likelihood for each in predicted if each.is_solved}
    best = select_most_likely(likelihoods, memory.most_likely, config.likelihood.margin)
    counts = {'merged': len(candidates) - len(ranked), 'culled': len(given) - len(obstacles)}
    counts['recalled'] = len(candidates) - len(found.candidates)
    notes = dict(found.notes) | {name: count for name, count in counts.items() if count}
    prediction = Prediction(
        hand.stamp_ns,
        hand.frame_id,
        hand.height,
        tuple(predicted),
        best,
        notes,
        time.perf_counter() - began,
        given,
        goals,
    )
    return prediction, memory.after(prediction, candidates, solved)


def warm_up(config: Config) -> None:
    """Predict once for a made-up scene, so that the first real prediction finds the cached matrices and the loaded kernels."""
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
    """Return the problem of each candidate by its label; candidates with the same goal and duration share a problem."""
    times = choose_candidate_durations(hand, candidates, goal_times, config.duration)
    kinds = [(candidate.goal, duration_s) for candidate, duration_s in zip(candidates, times, strict=True)]
    built = {kind: build_problem(config, hand, obstacles, goals[kind[0]], kind[1]) for kind in dict.fromkeys(kinds)}
    return {candidate.label: built[kind] for candidate, kind in zip(candidates, kinds, strict=True)}


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
    )


def _simplify_start(hand: HandState, acceleration_time_s: float) -> HandState:
    """Return the state that a prediction starts from.

    Speed and acceleration of a hand that has not begun to move are set to zero, because they are noise: with 1 mm of it at 100
    Hz, the efforts of a hand at rest would differ by a factor of three from one sample to the next, and the classes of a
    symmetric obstacle would swap their ranks 24 times a second.

    An acceleration a that decays as exp(-t / tau) leads from the speed v to v + tau a. Where the operator commands speed, as with
    a thumb stick, tau is short, and a plan that starts from v + tau a without acceleration is nearer to what follows.
    """
    if hand.onset_ns is None:
        return replace(hand, mean=np.concatenate([hand.mean[:2], np.zeros(4)]))
    if not acceleration_time_s:
        return hand
    final_velocity = hand.mean[2:4] + acceleration_time_s * hand.mean[4:]
    return replace(hand, mean=np.concatenate([hand.mean[:2], final_velocity, np.zeros(2)]))


def _widen_covariances(
    candidates: Sequence[PredictedCandidate], problems: dict[str, Problem], hand: HandState, config: Config
) -> list[PredictedCandidate]:
    """Add the predictive covariance, and that of the timing, to the covariance that motor noise causes."""
    plant = make_plant_model(config.foc)
    shared = {
        problem: compute_predictive_covariance(hand, problem.horizon.dt, config.foc.steps, config)
        for problem in dict.fromkeys(problems.values())
    }
    widened = []
    for each in candidates:
        covariance = each.solution.covariance + shared[problems[each.label]]
        for added in timing_covariances(each.solution, hand.onset_ns is None, config.duration, plant):
            covariance += added
        solution = each.solution.with_covariance(covariance)
        widened.append(PredictedCandidate(each.candidate, solution, each.sides, each.cost, each.likelihood))
    return widened
