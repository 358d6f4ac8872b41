"""Recordings of a scene as evidence: they change the likelihoods of the candidates and where the candidates lead.

A recording r counts by how near its path comes to the position p [m] and the velocity v [m/s] of the hand,

    w_r = max_m exp(-|p - p_rm|^2 / 2 a^2 - |v - v_rm|^2 / 2 b^2),  a = `position_stddev`,  b = `velocity_stddev`,

without the second term for a hand that has not begun to move. From the point m of this maximum on, it passes obstacles on the
sides of a class i towards the goal at its end. With G the classes that take the same gap in the next row, n_i = sum of the w_r
of class i, and n_G = sum of the n_i in G, the likelihoods p_i of the model are means of two Dirichlet distributions, of the gap
and of the class beyond it. They count as n_0 = `prior_count` and n_1 = `prior_count_beyond` recordings; the recordings are
observations:

    p_G <- (n_0 p_G + n_G) / (n_0 + sum n),    p_i <- p_G (n_1 p_i / p_G + n_i) / (n_1 + n_G),

with the p_G of the model in the last fraction.

The recordings of a class also say where it leads. Their displacements from m on, moved to the hand, have the weighted mean and
covariance c_i(t), C_i(t), where b^2 t^2 is added because a velocity that differs by b leads b t away. They are pooled with the
mean and covariance mu_i(t), P_i(t) of the candidate by the logarithmic pool of two Gaussians (Genest and Zidek 1986,
doi:10.1214/ss/1177013825):

    S^-1 = (1 - s) P_i^-1 + s C_i^-1,  S^-1 c = (1 - s) P_i^-1 mu_i + s C_i^-1 c_i,  s = n_i / (n_0 + n_i).

Without recordings near the hand, both are the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .config import ExperienceConfig
from .decisions import find_decisions, tabulate_sides
from .homotopy.demonstrations import NEAR, POINTS, Demonstration, is_free, is_same_demonstration
from .types import LEFT, RIGHT, Array, HandState, Obstacles, PredictedCandidate, Record, Solution, as_readonly

MOST_NEAR = 64
"""Number of recordings, the nearest ones, that count in one prediction: its time is bounded whatever the size of the library."""
LEAST_WEIGHT = 1e-6
"""Weight below which a recording does not count."""
EXACT = 1e-12
"""Variance of a position that is known [m^2]: that of a micrometre."""
LEAST_STEP_S = 1e-3
"""Shortest time between two points of a recording, for its velocity [s]."""


@dataclass(frozen=True, eq=False)
class Library(Record):
    """The class library.

    demonstrations: one of each class, to recall; recordings: those with times, r of them; position and velocity (r, m, 2) [m,
    m/s] and times_s (r, m) of their paths; sides: for each recording the sides (m, n) of the n obstacles that it passed on which
    the rest of its path from each point runs; scene (r,): equal numbers for recordings in the same scene.
    """

    demonstrations: tuple[Demonstration, ...]
    recordings: tuple[Demonstration, ...]
    position: Array
    velocity: Array
    times_s: Array
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
    return Library(tuple(distinct), recordings, position, velocity, times_s, sides, scene)


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


class Experience:
    """What a library says in one prediction.

    Attributes: evidence.
    """

    def __init__(self, library: Library, hand: HandState, obstacles: Obstacles, goals: Array, config: ExperienceConfig) -> None:
        self._library, self._hand, self._obstacles, self._goals, self._config = library, hand, obstacles, goals, config
        self.evidence = find_evidence(library, hand, obstacles, config)
        self._passed = [
            (
                self._find_goals(row, goals),
                dict(zip(library.recordings[row].ids, library.sides[row][point].tolist(), strict=True)),
            )
            for row, point in zip(self.evidence.row.tolist(), self.evidence.point.tolist(), strict=True)
        ]

    def _find_goals(self, row: int, goals: Array) -> frozenset[int]:
        """Return the goals (g, 2) [m] at the end of a recording."""
        return frozenset(np.flatnonzero(np.hypot(*(goals - self._library.position[row, -1]).T) <= NEAR).tolist())

    def find_members(self, candidate: PredictedCandidate) -> NDArray[np.intp]:
        """Return which recordings that count lead to the goal of a candidate, on its sides of all obstacles in its label."""
        goal, named = candidate.candidate.goal, candidate.candidate.sides
        members = [
            number
            for number, (ends, sides) in enumerate(self._passed)
            if goal in ends and all(sides.get(name) == side for name, side in named)
        ]
        return np.array(members, dtype=np.intp)

    def pool_likelihoods(self, candidates: Sequence[PredictedCandidate]) -> list[PredictedCandidate]:
        """Return candidates with the likelihoods that the recordings change, the most likely first."""
        if not len(self.evidence.row):
            return list(candidates)
        taken = [each for each in candidates if each.has_likelihood]
        counts = np.array([self.evidence.weight[self.find_members(each)].sum() for each in taken])
        sides = tabulate_sides([each.solution for each in taken], self._obstacles)
        gap = find_decisions(sides, self._obstacles, self._hand, self._goals).next_gap
        likelihoods = _count_gaps_and_classes(np.array([each.likelihood for each in taken]), counts, gap, self._config)
        pooled = [replace(each, likelihood=share) for each, share in zip(taken, likelihoods.tolist(), strict=True)]
        pooled.sort(key=lambda each: (-each.likelihood, each.label))
        return pooled + [each for each in candidates if not each.has_likelihood]

    def pool_paths(self, candidates: Sequence[PredictedCandidate]) -> tuple[PredictedCandidate, ...]:
        """Return candidates with the positions that the recordings change.

        A pooled mean path that runs through an obstacle is not taken: that candidate keeps its own path.
        """
        if not len(self.evidence.row):
            return tuple(candidates)
        return tuple(replace(each, solution=self._pool_path(each)) if each.has_likelihood else each for each in candidates)

    def _pool_path(self, candidate: PredictedCandidate) -> Solution:
        members, solution = self.find_members(candidate), candidate.solution
        count = float(self.evidence.weight[members].sum())
        if not count:
            return solution
        mean, covariance = self._forecast(members, solution.times)
        share = count / (self._config.prior_count + count)
        own, given = np.linalg.inv(solution.covariance[1:, :2, :2] + EXACT * np.eye(2)), np.linalg.inv(covariance[1:])
        pooled = np.linalg.inv((1.0 - share) * own + share * given)
        towards = (1.0 - share) * own @ solution.path[1:, :, None] + share * given @ mean[1:, :, None]
        path = np.vstack([solution.path[:1], (pooled @ towards)[..., 0]])
        return _change_positions(solution, path, pooled) if is_free(path, self._obstacles) else solution

    def _forecast(self, members: NDArray[np.intp], times_s: Array) -> tuple[Array, Array]:
        """Return mean (h, 2) [m] and covariance (h, 2, 2) [m^2] of the recordings at times from now (h,) [s]."""
        weight = self.evidence.weight[members] / self.evidence.weight[members].sum()
        positions = np.empty((len(members), len(times_s), 2))
        for number, member in enumerate(members.tolist()):
            row, point = self.evidence.row[member], self.evidence.point[member]
            at, path = self._library.times_s[row, point] + times_s, self._library.position[row]
            for axis in range(2):
                positions[number, :, axis] = np.interp(at, self._library.times_s[row], path[:, axis]) - path[point, axis]
        mean = np.tensordot(weight, positions, 1)
        offset = positions - mean
        covariance = np.einsum('r,rhi,rhj->hij', weight, offset, offset)
        covariance += (self._config.velocity_stddev * times_s)[:, None, None] ** 2 * np.eye(2)
        return mean + self._hand.mean[:2], covariance


def _count_gaps_and_classes(likelihoods: Array, counts: Array, gap: NDArray[np.intp], config: ExperienceConfig) -> Array:
    """Return likelihoods (k,) that counts (k,) change, first those of the gaps (k,) and then those of the classes in each gap."""
    of_gap, counts_of_gap = np.bincount(gap, likelihoods), np.bincount(gap, counts)
    near, beyond = config.prior_count, config.prior_count_beyond
    of_gap_now = (near * of_gap + counts_of_gap) / (near + counts.sum())
    within = np.divide(likelihoods, of_gap[gap], out=np.zeros(len(gap)), where=of_gap[gap] > 0.0)
    pooled: Array = of_gap_now[gap] * (beyond * within + counts) / (beyond + counts_of_gap[gap])
    pooled /= pooled.sum()
    return pooled


def _change_positions(solution: Solution, path: Array, covariance: Array) -> Solution:
    """Return a solution with other mean positions (N + 1, 2) [m] and position covariances (N, 2, 2) [m^2] from the first step on.

    The conditional distribution of the other states given the position stays what it was, and the mean velocity follows the path.
    """
    mean, total = solution.mean.copy(), solution.covariance.copy()
    mean[:, 2:4] += np.gradient(path - solution.path, solution.dt, axis=0)
    mean[:, :2] = path
    before, cross, rest = total[1:, :2, :2], total[1:, 2:, :2], total[1:, 2:, 2:]
    gain = cross @ np.linalg.inv(before + EXACT * np.eye(2))
    total[1:, 2:, 2:] = rest + gain @ (covariance - before) @ gain.transpose(0, 2, 1)
    total[1:, 2:, :2] = gain @ covariance
    total[1:, :2, 2:] = total[1:, 2:, :2].transpose(0, 2, 1)
    total[1:, :2, :2] = covariance
    return replace(solution.with_covariance(total), mean=as_readonly(mean))
