# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of a scene as evidence: they change the likelihoods of the candidates, and their paths.

A recording r counts by how near its states come to the position p [m] and the velocity v [m/s] of the hand,

    w_r = max_m exp(-|p - p_rm|^2 / 2 a^2 - |v - v_rm|^2 / 2 b^2),  a = `POSITION_STDDEV`,  b = `VELOCITY_STDDEV`.

It counts from shortly before its onset on: for a hand at rest the movement begins now, as it does for the plan.

Of the N_g recordings that end at goal g, n_g = sum of their w_r are where the hand is now. The likelihoods of the goals change as
these shares differ from that of all recordings, q = sum_g n_g / sum_g N_g, which counts as n_2 = `PRIOR_COUNT_GOAL` recordings of
each goal. With W all classes, or those of the same way through all rows if a row is ahead,

    p_i <- p_W p_i f_i / sum_W p_j f_j,   f_i = (n_2 q + n_g) / (n_2 + N_g),   g the goal of class i.

How often a goal was reached does not matter here, because `habits` counts it. A goal without recordings keeps f_i = q.

From the state m of the maximum on, a recording passes obstacles on the sides of some classes. With G the classes that take the
same gap in the next row, W those of the same way through all rows, and n_G and n_W = sums of the w_r of recordings that lead to
the goal of such a class too, the likelihoods of gaps and ways are means of Dirichlet distributions. Their counts are n_0 =
`PRIOR_COUNT` for the gap, and n_1 = `PRIOR_COUNT_BEYOND` for the way beyond it; the recordings are observations:

    p_G <- (n_0 p_G + n_G) / (n_0 + sum n),    p_W <- p_G (n_1 p_W / p_G + n_W) / (n_1 + n_G),

with the p_G and p_W of the model in the fraction p_W / p_G.

The path of a class is pooled with the recordings that take its gap in the next row, each up to where it passes an obstacle on
another side than the class. If this path leaves the class or enters an obstacle, only the recordings of the class count, and if
that one does so too, the path stays that of the plan. Effort and eta are always those of the plan. Without recordings near the
hand, all is the model. Recordings of the running program change likelihoods of goals and paths only, unless
`experience.learning` is `online`: people vary their ways between obstacles more than their paths.

**Pooled paths.**
The recordings e that pass the next row as a candidate does, displaced so that they begin at the hand, are at a time t from now at
x_e with weights w_e, which fade out over the FADE_S before a recording ends or parts from the class, and before the plan ends, so
that every path leads to its goal. With P the covariance of the
position of the hand, b = `VELOCITY_STDDEV`, by which their velocities differ from that of the hand, and the covariance S of the
plan, which tells as much of their spread as n_0 recordings,

    n = sum w_e,   r = sum w_e x_e / n,   R = (n_0 S + sum w_e (x_e - r) (x_e - r)') / (n_0 + n) + P + (b t / 2)^2 I.

The position of a plan with mean m and covariance S becomes the logarithmic opinion pool (Genest and Zidek 1986,
doi:10.1214/ss/1177013825) of both normal distributions, in which the plan counts as n_3 = `PRIOR_COUNT_PATH` recordings:

    S' = ((1 - a) S^-1 + a R^-1)^-1,   m' = S' ((1 - a) S^-1 m + a R^-1 r),   a = n / (n + n_3).

Velocity and acceleration change by the derivatives of m' - m. Given the position, their distribution remains that of the plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.classes import find_path_sides
from foc_ros.core.classes.library import NEAR, POINTS, STEP_S, Demonstration, is_same_demonstration
from foc_ros.core.classes.rows import Decisions, find_decisions, tabulate_sides
from foc_ros.core.classes.sides import measure_passages
from foc_ros.core.likelihood import divide_among_groups
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.clearance import find_blocked, measure_clearance
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.prediction import PredictedCandidate
from foc_ros.core.solution import Candidate, Solution
from foc_ros.core.types import Array, HandState, Record, as_readonly

MOST_NEAR = 64
"""Number of recordings, the nearest ones, that count in one prediction: its time is bounded whatever the size of the library."""
POSITION_STDDEV, VELOCITY_STDDEV = 0.02, 0.03
"""Distance [m] and difference of velocities [m/s] at which a recording counts less."""
PRIOR_COUNT, PRIOR_COUNT_BEYOND, PRIOR_COUNT_PATH, PRIOR_COUNT_GOAL = 1.0, 30.0, 0.3, 2.0
"""Numbers of recordings as which the model counts: for the gap in the next row, and for the spread of paths; for the way beyond
this row; for the path itself; for the goal. Operators vary more in far choices than their recordings say, and less in their
paths than plans do."""
LEAST_WEIGHT = 1e-3
"""Weight of a recording below which it is not near."""
FADE_S = 0.25
"""Time over which the weight of a recording falls to zero [s]."""
SEEN_AFTER_S = 0.1
"""Time from the beginning of a movement to its onset [s]: the onset is seen when the hand already moves."""
ROUNDING_M = 1e-5
"""Distance of a recorded state from the beginning of the path that is rounding [m]."""
EXACT = 1e-12
"""Variance of a position that is known [m^2]: that of a micrometre."""


@dataclass(frozen=True, eq=False)
class Library(Record):
    """The class library.

    demonstrations: one of each class, to recall; recordings: those with states, r of them; states (r, m, 4): x, y, vx, vy [m,
    m/s], infinite before the movement of each and beyond its end; ends (r,): the last state of each; paths (r, k, 2): to
    their goals [m]; scene (r,): equal numbers for recordings in the same scene; shows_ways (r,): whether a recording is evidence
    of ways between obstacles, or only of goals and paths.
    """

    demonstrations: tuple[Demonstration, ...]
    recordings: tuple[Demonstration, ...]
    states: Array
    ends: NDArray[np.intp]
    paths: Array
    scene: tuple[int, ...]
    shows_ways: NDArray[np.bool_]

    def find_here(self, frame_id: str, obstacles: Obstacles) -> NDArray[np.bool_]:
        """Tell which recordings (r,) are of this scene: their obstacles are where they were, and leave their paths free."""
        one_of_each = dict(zip(self.scene, self.recordings, strict=True))
        here = {scene: each.ids for scene, each in one_of_each.items() if each.matches(frame_id, obstacles)}
        names = {name for ids in here.values() for name in ids}
        known = obstacles.take([row for row, name in enumerate(obstacles.ids) if name in names])
        is_here = np.isin(self.scene, list(here))
        is_here[is_here] = ~find_blocked(self.paths[is_here], known)
        return is_here


@dataclass(frozen=True, eq=False)
class Evidence(Record):
    """The e recordings that count, beside the n obstacles and g goals of the prediction.

    weight (e,); row (e,) in the library; state (e,), the nearest one; sides (e, n): LEFT or RIGHT, on which each passes the
    obstacles from there on, 0 for an obstacle that it does not know; passing_s (e, n): the time until then [s]; is_at_goal (e,
    g): whether it ends at a goal; recorded (g,): how many recordings of this scene end at each goal, near the hand or not.
    """

    weight: Array
    row: NDArray[np.intp]
    state: NDArray[np.intp]
    sides: NDArray[np.int8]
    passing_s: Array
    is_at_goal: NDArray[np.bool_]
    recorded: NDArray[np.intp]


def make_library(given: Sequence[Demonstration], learnt: Sequence[Demonstration] = ()) -> Library:
    """Return the library of demonstrations, of which those with states are recordings; learnt: those that show no ways."""
    found = (*given, *learnt)
    distinct: list[Demonstration] = []
    for each in found:
        if not any(is_same_demonstration(each, known) for known in distinct):
            distinct.append(each)
    recordings = tuple(each for each in found if each.states is not None)
    tables = [each.states for each in recordings if each.states is not None]
    states = np.full((len(tables), max(map(len, tables), default=0), 4), np.inf)
    for row, (each, table) in enumerate(zip(recordings, tables, strict=True)):
        apart = np.hypot(*(table[:, :2] - each.path[0]).T)
        onset = int(np.flatnonzero(apart <= apart.min() + ROUNDING_M)[-1])
        begin = max(onset - round(SEEN_AFTER_S / STEP_S), 0)
        states[row, begin : len(table)] = table[begin:]
    ends = np.array([len(table) - 1 for table in tables], dtype=np.intp)
    paths = np.array([each.path for each in recordings]).reshape(-1, POINTS, 2)
    numbers = dict[tuple[object, ...], int]()
    scene = tuple(numbers.setdefault((each.frame_id, each.ids, each.centre.tobytes()), len(numbers)) for each in recordings)
    shows_ways = np.arange(len(recordings)) < sum(each.states is not None for each in given)
    return Library(tuple(distinct), recordings, states, ends, paths, scene, shows_ways)


NO_LIBRARY = make_library(())


def find_evidence(library: Library, hand: HandState, obstacles: Obstacles, goals: Array) -> Evidence:
    """Find the recordings that count: the MOST_NEAR nearest whose obstacles are where they were and leave their paths free."""
    apart = (((library.states - hand.mean[:4]) / np.repeat([POSITION_STDDEV, VELOCITY_STDDEV], 2)) ** 2).sum(axis=2)
    state = apart.argmin(axis=1)
    weight = np.exp(-0.5 * apart[np.arange(len(apart)), state])
    is_near, is_here = weight >= LEAST_WEIGHT, np.zeros(len(weight), dtype=np.bool_)
    if is_near.any():
        is_here = library.find_here(hand.frame_id, obstacles)
    rows = np.argsort(-weight, kind='stable')
    rows = rows[(is_near & is_here)[rows]][:MOST_NEAR]
    column = {name: number for number, name in enumerate(obstacles.ids)}
    sides, passing_s = np.zeros((len(rows), len(obstacles)), dtype=np.int8), np.zeros((len(rows), len(obstacles)))
    for number, row in enumerate(rows.tolist()):
        recording = library.recordings[row]
        columns = [column[name] for name in recording.ids]
        sides[number, columns] = recording.rest_sides[state[row]]
        passing_s[number, columns] = STEP_S * (recording.passing - state[row])
    is_at_goal = np.hypot(*(library.paths[:, -1:] - goals).transpose(2, 0, 1)) <= NEAR
    return Evidence(weight[rows], rows, state[rows], sides, passing_s, is_at_goal[rows], is_at_goal[is_here].sum(axis=0))


def pool_recordings(
    candidates: Sequence[PredictedCandidate],
    library: Library,
    hand: HandState,
    obstacles: Obstacles,
    goals: Array,
) -> list[PredictedCandidate]:
    """Return candidates with likelihoods and paths that the recordings of a library change, the most likely first.

    hand: as estimated; obstacles: grown by the radius of the hand; goals (g, 2) [m].
    """
    taken = [each for each in candidates if each.has_likelihood]
    if not taken or not library.recordings:
        return list(candidates)
    evidence = find_evidence(library, hand, obstacles, goals)
    if not len(evidence.row):
        return list(candidates)
    goal = np.array([each.candidate.goal for each in taken], dtype=np.intp)
    sides = tabulate_sides(measure_passages([each.solution for each in taken], obstacles))
    decisions = find_decisions(sides, goal, obstacles, hand, goals)
    agreements = [compare_with_class(each.candidate, evidence, obstacles, decisions.next_row) for each in taken]
    of_ways = evidence.weight * library.shows_ways[evidence.row]
    on_ways = np.array([of_ways[is_same].sum() for is_same, _ in agreements])
    likelihoods = update_ways(np.array([each.likelihood for each in taken]), on_ways, decisions)
    group = decisions.way if len(decisions.next_row) else np.zeros_like(goal)
    of_groups = np.bincount(group, likelihoods).astype(float)
    likelihoods = divide_among_groups(likelihoods * compute_goal_factors(evidence)[goal], group, of_groups)
    pooled = []
    for each, share, (is_same, until_s) in zip(taken, likelihoods.tolist(), agreements, strict=True):
        paths, weights = follow_recordings(library, evidence, until_s, hand, each.times)
        solution, uncertainty = each.solution, (hand.covariance[:2, :2], 0.5 * VELOCITY_STDDEV)
        for is_used in (until_s > 0.0, is_same):
            if not is_used.any():
                break
            found = pool_path(each.solution, paths[is_used], weights[is_used], *uncertainty)
            if stays_in_class(each, found, obstacles):
                solution = found
                break
        pooled.append(replace(each, likelihood=share, solution=solution))
    pooled.sort(key=lambda each: (-each.likelihood, each.label))
    return pooled + [each for each in candidates if not each.has_likelihood]


def compare_with_class(
    candidate: Candidate, evidence: Evidence, obstacles: Obstacles, next_row: NDArray[np.intp]
) -> tuple[NDArray[np.bool_], Array]:
    """Return which recordings (e,) are of the class of a candidate, and how long (e,) [s] they may lead its path.

    They are of the class if they have its goal, and its sides of all obstacles in its label.

    A recording may lead the path until it passes an obstacle on another side, or the last obstacle if its goal is another one;
    not at all if that obstacle is in the next row, which is empty where only goals differ, or not known to the recording.
    """
    column = {name: number for number, name in enumerate(obstacles.ids)}
    columns = [column[name] for name, _ in candidate.sides if name in column]
    sides, passing_s = evidence.sides[:, columns], evidence.passing_s[:, columns]
    is_other = sides != [side for name, side in candidate.sides if name in column]
    is_at_goal = evidence.is_at_goal[:, candidate.goal]
    until_s = np.where(is_other, passing_s, np.inf).min(axis=1, initial=np.inf)
    until_s = np.where(is_at_goal, until_s, np.minimum(until_s, passing_s.max(axis=1, initial=0.0)))
    until_s[(is_other & (np.isin(columns, next_row) | (sides == 0))).any(axis=1)] = 0.0
    if not len(next_row):
        until_s[~is_at_goal] = 0.0
    return is_at_goal & ~is_other.any(axis=1), until_s


def follow_recordings(library: Library, evidence: Evidence, until_s: Array, hand: HandState, times: Array) -> tuple[Array, Array]:
    """Return where recordings lead the hand at times (m,) [s] from now, (e, m, 2) [m], and their weights (e, m).

    They have a weight up to until_s (e,) [s] and before the last time. Paths are linear between states, and stay at the last one.
    """
    row, ends = evidence.row[:, None], library.ends[evidence.row]
    at = np.minimum(evidence.state[:, None] + times / STEP_S, ends[:, None])
    before = np.minimum(at.astype(np.intp), ends[:, None] - 1)
    share = (at - before)[..., None]
    paths = (1.0 - share) * library.states[row, before, :2] + share * library.states[row, before + 1, :2]
    paths += (hand.mean[:2] - library.states[evidence.row, evidence.state, :2])[:, None]
    left_s = np.minimum(np.minimum(STEP_S * (ends - evidence.state), until_s), times[-1])
    return paths, evidence.weight[:, None] * np.clip((left_s[:, None] - times) / FADE_S, 0.0, 1.0)


def compute_goal_factors(evidence: Evidence) -> Array:
    """Return the factors (g,) on the likelihoods of goals by which recordings change them."""
    near = evidence.weight @ evidence.is_at_goal
    whole = max(int(evidence.recorded.sum()), 1)
    factors: Array = (PRIOR_COUNT_GOAL * near.sum() / whole + near) / (PRIOR_COUNT_GOAL + evidence.recorded)
    return factors if factors.any() else np.ones(len(factors))


def update_ways(likelihoods: Array, counts: Array, decisions: Decisions) -> Array:
    """Return likelihoods (k,) that counts (k,) of recordings change: of the gaps, and of the ways in each gap.

    Where no row is ahead, there are none.
    """
    if not len(decisions.next_row) or not counts.any():
        return likelihoods
    whole, each, none = np.zeros(len(counts), dtype=np.intp), np.arange(len(counts)), np.zeros(len(counts))
    levels = (
        (whole, decisions.next_gap, PRIOR_COUNT, counts),
        (decisions.next_gap, decisions.way, PRIOR_COUNT_BEYOND, counts),
        (decisions.way, each, 1.0, none),  # within a way the model decides
    )
    pooled = np.ones(len(counts))
    for group, part, prior_count, seen in levels:
        of_group, of_part = (np.bincount(number, likelihoods)[number] for number in (group, part))
        in_group, in_part = (np.bincount(number, seen)[number] for number in (group, part))
        even = 1.0 / np.bincount(group[np.unique(part, return_index=True)[1]])[group]
        share = np.divide(of_part, of_group, out=even, where=of_group > 0.0)
        pooled *= (prior_count * share + in_part) / (prior_count + in_group)
    return pooled


def pool_path(solution: Solution, paths: Array, weights: Array, position_covariance: Array, drift: float) -> Solution:
    """Return a solution with the mean and the covariance that recordings change; effort, costs and eta stay those of the plan.

    Parameters
    ----------
    solution
        The plan; its motor covariance remains.
    paths, weights
        What e recordings do at the m times of the plan: paths (e, m, 2) [m] that begin at the hand, and their weights (e, m).
    position_covariance
        That of the hand now (2, 2) [m^2].
    drift
        The b / 2 by which a recording departs from the hand [m/s].
    """
    times, count = solution.times, weights.sum(axis=0)
    shares = np.divide(weights, count, out=np.zeros_like(weights), where=count > 0.0)
    centre, position = np.einsum('em,emi->mi', shares, paths), solution.covariance[:, :2, :2] + EXACT * np.eye(2)
    offset = paths - centre
    spread = PRIOR_COUNT * position + np.einsum('em,emi,emj->mij', weights, offset, offset)
    spread = spread / (PRIOR_COUNT + count)[:, None, None] + position_covariance
    spread += ((drift * times) ** 2)[:, None, None] * np.eye(2)
    share = (count / (count + PRIOR_COUNT_PATH))[:, None, None]
    precision, recorded_precision = np.linalg.inv(position), np.linalg.inv(spread)
    pooled = np.linalg.inv((1.0 - share) * precision + share * recorded_precision)
    pooled[0] = position[0]
    displaced = (pooled @ (share * recorded_precision) @ (centre - solution.path)[..., None])[..., 0]
    displaced[0] = 0.0
    gain = solution.covariance[:, :, :2] @ precision
    covariance = solution.covariance + gain @ (pooled - position) @ gain.swapaxes(1, 2)
    mean = solution.mean + _differentiate(displaced, solution.dt, solution.mean.shape[1] // 2)
    return replace(solution.with_covariance(covariance), mean=as_readonly(mean))


def _differentiate(positions: Array, dt: float, orders: int) -> Array:
    """Return positions (m, 2) and their derivatives (m, 2 orders) at steps of dt [s]; the first state stays as it is."""
    found = [positions]
    for _ in range(orders - 1):
        rate = np.gradient(found[-1], dt, axis=0)
        rate[0] = 0.0
        found.append(rate)
    return np.concatenate(found, axis=1)


def stays_in_class(planned: PredictedCandidate, pooled: Solution, obstacles: Obstacles) -> bool:
    """Tell whether a pooled path passes all obstacles that the plan does, on its sides, and enters none more deeply.

    obstacles: grown by the radius of the hand.
    """
    centres = centre_trajectories(obstacles.centre, pooled.dt * obstacles.velocity, len(pooled.mean) - 1)
    sides = find_path_sides(pooled.path, obstacles, centres)
    if any(sides.get(identity) != side for identity, side in planned.sides.items()):
        return False
    clearance = measure_clearance(pooled.path, obstacles, pooled.dt)
    return clearance >= 0.0 or clearance >= measure_clearance(planned.solution.path, obstacles, pooled.dt)
