# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The situation of a prediction: the state that it starts from, the time to go to each goal, and the obstacles on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .config import REFERENCE_STEP_S, Config, EstimatorConfig
from .hand.duration import estimate_times_to_go, is_passing, limit_change
from .height import HeightPredictor
from .obstacle_table import Obstacles
from .obstacles.clearance import cull_obstacles
from .obstacles.geometry import find_holders
from .obstacles.risk import RiskBound, count_events
from .ocp.problem import Problem, rest_to_goal
from .plant.covariance import SharedCovariances, scale_noise, widen_covariance
from .plant.models import make_plant_model
from .prediction import PredictedCandidate
from .safety_preference import SafetyPreference
from .tracks import Tracks
from .types import Array, HandState, Record


@dataclass(frozen=True, eq=False)
class Situation(Record):
    """What the candidates of one prediction are found and solved in.

    config: all parameters; hand: the state that they start from; goals (g, 2) [m]; durations_s: time to go to each [s]; objects:
    the id of the obstacle that each goal is; obstacles: all n, as they were given; blocking: those that the hand does not clear
    by its height, grown by its radius; near: those of them that are not culled; in_the_way: those of them that neither hold the
    goal nor are its object, for each goal; cleared (n,): whether the hand clears each obstacle by its height; heights: the
    prediction of the height; covariances: what all candidates share of theirs.
    """

    config: Config
    hand: HandState
    goals: Array
    durations_s: list[float]
    objects: Sequence[str | None]
    obstacles: Obstacles
    blocking: Obstacles
    near: Obstacles
    in_the_way: list[Obstacles]
    cleared: NDArray[np.bool_]
    heights: HeightPredictor
    covariances: SharedCovariances

    def pose_problem(self, goal: int) -> Problem:
        """Return the problem of reaching the goal of a row."""
        return build_problem(self.config, self.hand, self.in_the_way[goal], self.goals[goal], self.durations_s[goal])

    def add_uncertainty(self, candidate: PredictedCandidate) -> PredictedCandidate:
        """Add the predictive covariance, and that of the timing, to the covariance that motor noise causes."""
        solution, is_at_rest = candidate.solution, self.hand.onset_ns is None
        covariance = widen_covariance(solution, self.covariances[solution.dt], is_at_rest, self.config)
        return replace(candidate, solution=solution.with_covariance(covariance))


def prepare_situation(
    config: Config,
    estimated: HandState,
    obstacles: Obstacles,
    goals: Array,
    objects: Sequence[str | None],
    goal_heights: Array | None,
    known: Tracks,
) -> Situation:
    """Return the situation of a prediction from an estimated state of the hand; the other arguments are those of `predict`.

    Speed and acceleration of a hand at rest are left out, because they are noise. Times to go change only gradually from those of
    the known tracks.
    """
    hand = simplify_start(estimated, config.estimator)
    durations_s = _find_durations(hand, goals, known, config)
    grown = obstacles.grow(config.scene.hand_radius)
    covariances = SharedCovariances(hand, config)
    heights = HeightPredictor(config, hand, goal_heights, covariances)
    cleared = heights.find_cleared(grown, goals, durations_s)
    blocking = grown.take(np.flatnonzero(~cleared)) if cleared.any() else grown
    near = cull_obstacles(blocking, hand.mean[:2], goals, max(durations_s), config.scene.max_obstacles)
    in_the_way = take_in_the_way(near, goals, durations_s, objects)
    tables = obstacles, blocking, near, in_the_way
    return Situation(config, hand, goals, durations_s, objects, *tables, cleared, heights, covariances)


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


def simplify_start(hand: HandState, config: EstimatorConfig) -> HandState:
    """Return the state that a prediction starts from.

    Speed and acceleration of a hand that has not begun to move, those of its height too, are set to zero, because they are noise:
    with 1 mm of noise of the position at 100 Hz, the efforts of a hand at rest would differ by a factor of three from one sample
    to the next, and the classes of a symmetric obstacle would swap their ranks 24 times a second. The covariance is that of a
    hand that moves with about `estimator.onset_speed` at most.

    An acceleration a that decays as exp(-t / theta) leads from the speed v to v + theta a. Where the operator commands speed, as
    with a thumb stick, theta is short, and a plan that starts from v + theta a without acceleration is nearer to what follows.
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
