"""Recordings of a scene as evidence: they change the likelihoods of the candidates.

A recording r counts by how near its path comes to the position p [m] and the velocity v [m/s] of the hand,

    w_r = max_m exp(-|p - p_rm|^2 / 2 a^2 - |v - v_rm|^2 / 2 b^2),  a = `position_stddev`,  b = `velocity_stddev`,

without the second term for a hand that has not begun to move. From the point m of this maximum on, it passes obstacles on the
sides of a class i towards the goal at its end. With G the classes that take the same gap in the next row, n_i = sum of the w_r
of class i, and n_G = sum of the n_i in G, the likelihoods p_i of the model are means of two Dirichlet distributions, of the gap
and of the class beyond it. They count as n_0 = `prior_count` and n_1 = `prior_count_beyond` recordings; the recordings are
observations:

    p_G <- (n_0 p_G + n_G) / (n_0 + sum n),    p_i <- p_G (n_1 p_i / p_G + n_i) / (n_1 + n_G),

with the p_G of the model in the last fraction.

Paths and covariances stay those of the model, because eta holds for them. Without recordings near the hand, all is the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .config import ExperienceConfig
from .decisions import find_decisions, tabulate_sides
from .homotopy.demonstrations import NEAR, POINTS, Demonstration, is_same_demonstration
from .types import LEFT, RIGHT, Array, Candidate, HandState, Obstacles, PredictedCandidate, Record

MOST_NEAR = 64
"""Number of recordings, the nearest ones, that count in one prediction: its time is bounded whatever the size of the library."""
LEAST_WEIGHT = 1e-6
"""Weight below which a recording does not count."""
LEAST_STEP_S = 1e-3
"""Shortest time between two points of a recording, for its velocity [s]."""


@dataclass(frozen=True, eq=False)
class Library(Record):
    """The class library.

    demonstrations: one of each class, to recall; recordings: those with times, r of them; position and velocity (r, m, 2) [m,
    m/s] of their paths; sides: for each recording, LEFT or RIGHT (m, n) on which the rest of its path from each point passes its
    n obstacles; scene (r,): equal numbers for recordings in the same scene.
    """

    demonstrations: tuple[Demonstration, ...]
    recordings: tuple[Demonstration, ...]
    position: Array
    velocity: Array
    sides: tuple[NDArray[np.int8], ...]
    scene: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Evidence(Record):
    """Of recordings that count: their weights (e,), rows in the library (e,) and points (e,) at which they are nearest."""

    weight: Array
    row: NDArray[np.intp]
    point: NDArray[np.intp]


def make_library(found: Sequence[Demonstration]) -> Library:
    """Return the library of demonstrations, of which those with times are recordings."""
    distinct: list[Demonstration] = []
    for each in found:
        if not any(is_same_demonstration(each, known) for known in distinct):
            distinct.append(each)
    recordings = tuple(each for each in found if each.times_s is not None)
    position = np.array([each.path for each in recordings]).reshape(-1, POINTS, 2)
    times_s = np.array([each.times_s for each in recordings]).reshape(-1, POINTS)
    velocity = np.zeros_like(position)
    if recordings:
        steps_s = np.maximum(np.gradient(times_s, axis=1), LEAST_STEP_S)
        velocity = np.gradient(position, axis=1) / steps_s[..., None]
    sides, numbers = tuple(_find_rest_sides(each) for each in recordings), dict[tuple[object, ...], int]()
    scene = tuple(numbers.setdefault((each.frame_id, each.ids, each.centre.tobytes()), len(numbers)) for each in recordings)
    return Library(tuple(distinct), recordings, position, velocity, sides, scene)


def _find_rest_sides(recording: Demonstration) -> NDArray[np.int8]:
    """Return the sides (m, n) on which the rest of a path from each of its m points passes its n obstacles."""
    offset = recording.path[:, None] - recording.centre
    turns = np.unwrap(np.arctan2(offset[..., 1], offset[..., 0]), axis=0)
    return np.where(turns[-1] - turns < 0.0, LEFT, RIGHT).astype(np.int8)


NO_LIBRARY = make_library(())


def find_evidence(library: Library, hand: HandState, obstacles: Obstacles, config: ExperienceConfig) -> Evidence:
    """Find the recordings that count: nearest first, at most MOST_NEAR, only those whose obstacles are where they were."""
    apart = ((library.position - hand.mean[:2]) ** 2).sum(axis=2) / config.position_stddev**2
    if hand.onset_ns is not None:
        apart += ((library.velocity - hand.mean[2:4]) ** 2).sum(axis=2) / config.velocity_stddev**2
    point = apart.argmin(axis=1)
    weight = np.exp(-0.5 * apart[np.arange(len(apart)), point])
    rows, is_same = list[int](), dict[int, bool]()
    for row in np.argsort(-weight, kind='stable').tolist():
        if weight[row] < LEAST_WEIGHT or len(rows) == MOST_NEAR:
            break
        scene = library.scene[row]
        if scene not in is_same:
            is_same[scene] = library.recordings[row].matches(hand.frame_id, obstacles)
        if is_same[scene]:
            rows.append(row)
    return Evidence(weight[rows], np.array(rows, dtype=np.intp), point[rows])


def pool_likelihoods(
    candidates: Sequence[PredictedCandidate],
    library: Library,
    hand: HandState,
    obstacles: Obstacles,
    goals: Array,
    config: ExperienceConfig,
) -> list[PredictedCandidate]:
    """Return candidates with the likelihoods that the recordings of a library change, the most likely first; goals (g, 2) [m]."""
    taken = [each for each in candidates if each.has_likelihood]
    if not taken or not library.recordings:
        return list(candidates)
    evidence = find_evidence(library, hand, obstacles, config)
    if not len(evidence.row):
        return list(candidates)
    counts = np.array([_count_recordings(each.candidate, library, evidence, goals) for each in taken])
    sides = tabulate_sides([each.solution for each in taken], obstacles)
    gap = find_decisions(sides, obstacles, hand, goals).next_gap
    likelihoods = _count_gaps_and_classes(np.array([each.likelihood for each in taken]), counts, gap, config)
    pooled = [replace(each, likelihood=share) for each, share in zip(taken, likelihoods.tolist(), strict=True)]
    pooled.sort(key=lambda each: (-each.likelihood, each.label))
    return pooled + [each for each in candidates if not each.has_likelihood]


def _count_recordings(candidate: Candidate, library: Library, evidence: Evidence, goals: Array) -> float:
    """Return the weight of the recordings that lead to the goal of a candidate, on its sides of all obstacles in its label."""
    at_goal = np.hypot(*(library.position[evidence.row, -1] - goals[candidate.goal]).T) <= NEAR
    count = 0.0
    for number in np.flatnonzero(at_goal).tolist():
        row = evidence.row[number]
        sides = dict(zip(library.recordings[row].ids, library.sides[row][evidence.point[number]].tolist(), strict=True))
        if all(sides.get(name) == side for name, side in candidate.sides):
            count += float(evidence.weight[number])
    return count


def _count_gaps_and_classes(likelihoods: Array, counts: Array, gap: NDArray[np.intp], config: ExperienceConfig) -> Array:
    """Return likelihoods (k,) that counts (k,) change, first those of the gaps (k,) and then those of the classes in each gap."""
    of_gap, counts_of_gap = np.bincount(gap, likelihoods), np.bincount(gap, counts)
    near, beyond = config.prior_count, config.prior_count_beyond
    of_gap_now = (near * of_gap + counts_of_gap) / (near + counts.sum())
    within = np.divide(likelihoods, of_gap[gap], out=np.zeros(len(gap)), where=of_gap[gap] > 0.0)
    pooled: Array = of_gap_now[gap] * (beyond * within + counts) / (beyond + counts_of_gap[gap])
    pooled /= pooled.sum()
    return pooled
