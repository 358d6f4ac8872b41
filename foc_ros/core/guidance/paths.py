# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Paths of guidance: where the hand is on each candidate, how stiff guidance is there, and where help is needed.

The progress along a path follows the hand and never jumps to a distant part. Stiffness comes from the covariance of a candidate:
stiff where the operator is precise, soft where not, always bounded. Help is needed where the hand would come nearer to an
obstacle than the clearance, if it went straight on. With a clearance of 0, guidance draws to the paths everywhere, as far ahead
as `lookahead_s`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import GuidanceConfig
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import Array, Record

from .limits import Margins

WINDOW_M = 0.02
"""Length of path [m] on both sides of the progress within which the nearest point is sought."""


class Places(NamedTuple):
    """A place on each of c paths: its row, the sample before it, and its share of the way to the next sample in [0, 1], (c,)."""

    row: NDArray[np.intp]
    before: NDArray[np.intp]
    share: Array


@dataclass(frozen=True, eq=False)
class GuidePaths(Record):
    """The mean paths of the c candidates with a likelihood, at m samples, by the length of the path.

    labels: of the candidates; likelihoods (c,); points (c, m, 2) [m]; lengths (c, m): of the path up to each sample [m];
    covariances (c, m, 2, 2): of the position [m^2].
    """

    labels: tuple[str, ...]
    likelihoods: Array
    points: Array
    lengths: Array
    covariances: Array

    def locate(self, at: Array) -> Places:
        """Return where a length (c,) [m] of each path is."""
        rows, before = np.arange(len(at)), self._find_segments(at)
        low, high = self.lengths[rows, before], self.lengths[rows, before + 1]
        share = np.minimum(np.maximum((at - low) / np.where(high > low, high - low, 1.0), 0.0), 1.0)
        return Places(rows, before, share)

    def interpolate(self, values: Array, places: Places) -> Array:
        """Return values (c, m, ...) of the samples at a place of each path."""
        rows, before, share = places
        share = share.reshape(-1, *[1] * (values.ndim - 2))
        found: Array = (1.0 - share) * values[rows, before] + share * values[rows, before + 1]
        return found

    def find_tangents(self, at: Array) -> Array:
        """Return the unit tangents (c, 2) at a length (c,) [m] of each path; zeros where a path has no length."""
        rows, before = np.arange(len(at)), self._find_segments(at)
        return normalize(self.points[rows, before + 1] - self.points[rows, before])

    def find_nearest(self, points: Array, low: Array, high: Array) -> Array:
        """Return the length (c,) [m] at which each path is nearest to its point (c, 2) [m], between two lengths (c,) [m]."""
        start, edge = self.points[:, :-1], np.diff(self.points, axis=1)
        long = np.diff(self.lengths, axis=1)
        along = ((points[:, None] - start) * edge).sum(axis=2) / np.where(long > 0.0, long, 1.0)
        at = np.minimum(np.maximum(self.lengths[:, :-1] + np.minimum(np.maximum(along, 0.0), long), low[:, None]), high[:, None])
        share = np.minimum(np.maximum((at - self.lengths[:, :-1]) / np.where(long > 0.0, long, 1.0), 0.0), 1.0)
        away = start + share[..., None] * edge - points[:, None]
        is_reached = (self.lengths[:, 1:] >= low[:, None]) & (self.lengths[:, :-1] <= high[:, None])
        squares = np.where(is_reached, (away**2).sum(axis=2), np.inf)
        nearest: Array = at[np.arange(len(at)), squares.argmin(axis=1)]
        return nearest

    def _find_segments(self, at: Array) -> NDArray[np.intp]:
        before: NDArray[np.intp] = np.minimum(
            np.maximum((self.lengths <= at[:, None]).sum(axis=1) - 1, 0), self.lengths.shape[1] - 2
        )
        return before


def build_paths(prediction: Prediction) -> GuidePaths:
    """Return the paths of the candidates with a likelihood."""
    taking_part = prediction.candidates_with_likelihood
    points = np.array([each.mean[:, :2] for each in taking_part]).reshape(len(taking_part), -1, 2)
    steps = np.hypot(*np.moveaxis(np.diff(points, axis=1), -1, 0))
    return GuidePaths(
        tuple(each.label for each in taking_part),
        np.array([each.likelihood for each in taking_part]),
        points,
        np.concatenate([np.zeros((len(points), 1)), np.cumsum(steps, axis=1)], axis=1),
        np.array([each.covariance[:, :2, :2] for each in taking_part]).reshape(*points.shape, 2),
    )


def transfer_progress(paths: GuidePaths, known: dict[str, Array], position: Array, travelled: float) -> Array:
    """Return the progress (c,) [m] on the paths of a new prediction.

    A new path begins at the hand of its stamp, so the progress is at most the way since then and the window. It is that of the
    point that is nearest to the reference of the same label before, or to the hand (2,) [m] where the label is new.

    known: references (2,) [m] by label; travelled: the way of the hand since the stamp of the prediction [m].
    """
    points = np.array([known.get(label, position) for label in paths.labels]).reshape(-1, 2)
    return paths.find_nearest(points, np.zeros(len(points)), np.full(len(points), travelled + WINDOW_M))


def advance_progress(paths: GuidePaths, progress: Array, position: Array, velocity: Array, dt: float) -> Array:
    """Return the progress (c,) [m] a time `dt` [s] later.

    It moves with the velocity v of the hand along the tangent u, and approaches the point s* that is nearest to the hand within
    `WINDOW_M` with the time constant T = 0.05 s, so that it is continuous:

        s <- s + u . v dt,    s <- s + (1 - exp(-dt / T)) (s* - s).
    """
    ends = paths.lengths[:, -1]
    moved = np.minimum(
        np.maximum(progress + dt * np.minimum(np.maximum(paths.find_tangents(progress) @ velocity, -1e3), 1e3), 0.0), ends
    )
    nearest = paths.find_nearest(np.broadcast_to(position, (len(moved), 2)), moved - WINDOW_M, moved + WINDOW_M)
    advanced: Array = np.minimum(np.maximum(moved + (1.0 - np.exp(-dt / 0.05)) * (nearest - moved), 0.0), ends)
    return advanced


def normalize(vectors: Array) -> Array:
    """Return vectors (..., 2) of unit length; zero vectors stay as they are."""
    norms = np.hypot(vectors[..., 0], vectors[..., 1])[..., None]
    unit: Array = vectors / np.where(norms > 0.0, norms, 1.0)
    return unit


PRECISION_LOW, PRECISION_HIGH = 100.0, 2500.0
"""Precisions between which the stiffness grows from 0 to `k_max` [1/m^2]: standard deviations of 100 mm and of 20 mm."""
POSITION_STDDEV = 0.002
"""Standard deviation that is added to that of every predicted position [m]: that of a good tracker and of its registration."""


def compute_stiffness(covariances: Array, config: GuidanceConfig) -> Array:
    """Return the stiffness K (c, 2, 2) [N/m] of position covariances S (c, 2, 2) [m^2].

    With the precision matrix P = (S + s0^2 I)^-1 and its eigenpairs (l_j, w_j),

        K = sum_j k_max clip((l_j - l_lo) / (l_hi - l_lo), 0, 1) w_j w_j',

    which is symmetric, positive semidefinite and bounded by k_max (Muehlbauer et al. 2025, arXiv 2506.10239). Here l_lo is
    `PRECISION_LOW`, l_hi `PRECISION_HIGH` and s0 `POSITION_STDDEV`.
    """
    variances, axes = np.linalg.eigh(covariances)
    precisions = 1.0 / (np.maximum(variances, 0.0) + POSITION_STDDEV**2)
    shares = np.minimum(np.maximum((precisions - PRECISION_LOW) / (PRECISION_HIGH - PRECISION_LOW), 0.0), 1.0)
    stiffness: Array = config.k_max * np.einsum('cj,caj,cbj->cab', shares, axes, axes)
    return stiffness


def project_out(stiffness: Array, tangents: Array) -> Array:
    """Return N K N with N = I - u u' (c, 2, 2): no stiffness along the unit tangents u (c, 2), so the operator sets the pace."""
    across = np.eye(2) - tangents[:, :, None] * tangents[:, None, :]
    projected: Array = across @ stiffness @ across
    return projected


def find_deflection(stiffness: Array, force: Array) -> Array:
    """Return the smallest deflection e (2,) [m] for which K e is a force (2,) [N], as far as K (2, 2) [N/m] can give it."""
    values, axes = np.linalg.eigh(stiffness)
    is_stiff = values > 1e-6 * max(values[-1], 1e-300)  # others are directions without any
    deflection: Array = axes @ np.where(is_stiff, axes.T @ force / np.where(is_stiff, values, 1.0), 0.0)
    return deflection


class Need(NamedTuple):
    """Where help is needed, and how much.

    time_s: how far ahead [s]; share in [0, 1]: of the clearance, which the hand lacks on its way; normal (2,): unit vector in
    which it would have to be shifted, zeros without an obstacle.
    """

    time_s: float
    share: float
    normal: Array


def find_need(settings: GuidanceConfig, zones: Margins, position: Array, velocity: Array) -> Need:
    """Return where help is needed, and how much.

    The hand goes on at its velocity v for the look-ahead H at most. A zone is an obstacle that is larger by the clearance D. With
    the outward normal m and the length s of the shortest shift that brings the line x + t v, 0 <= t <= H, out of the zone,

        s m = argmin |y| over all y for which x + y + t v is outside,    n = clip(s / D, 0, 1).

    For the distance d of a line that stays outside of the obstacle, n is (D - d) / D and m the normal at its nearest point. For
    a line that leads through it, m is at right angles to v, towards the side that is nearer, as soon as this is shorter than a
    shift backward; a shift forward through the obstacle does not count. All of this is that of the zone with the largest s, and
    the time is the middle of that within this zone, as far as it is ahead.
    """
    if not settings.clearance:
        return Need(settings.lookahead_s, 1.0, np.zeros(2))
    if not len(zones.start):
        return Need(0.0, 0.0, np.zeros(2))
    way, angle = settings.lookahead_s * velocity, math.atan2(velocity[1], velocity[0])
    aside, offsets = np.array([-math.sin(angle), math.cos(angle)]), position - zones.start
    heights, slopes, left = (offsets * zones.normal).sum(axis=-1), zones.normal @ way, offsets @ aside
    shifts = -(heights + np.minimum(slopes, 0.0))
    shifts[(slopes > 0.0) & (shifts > settings.clearance)] = np.inf  # forward through the obstacle
    shifts = np.column_stack([shifts, -left.min(axis=1), left.max(axis=1)])
    row = int(shifts.min(axis=1).argmax())
    best = int(shifts[row].argmin())
    normal = [*zones.normal[row], aside, -aside][best]
    share = min(max(float(shifts[row, best]) / settings.clearance, 0.0), 1.0)
    slope = slopes[row]
    at = -heights[row] / np.where(slope == 0.0, 1.0, slope)
    # a line that enters and leaves a convex zone; a hand at rest does neither
    middle = 0.5 * (at[slope < 0.0].max(initial=-1e6) + at[slope > 0.0].min(initial=1e6))
    return Need(settings.lookahead_s * min(max(float(middle), 0.0), 1.0), share, normal)


def keep_clear(settings: GuidanceConfig, obstacles: Obstacles, points: Array) -> Array:
    """Return points (c, 2) of the paths moved outward by what they lack of the clearance D, added over the obstacles.

        x <- x + sum_j max(D - d_j(x), 0) n_j(x),

    with the distance d_j and the outward normal n_j. Between two obstacles this leads to the middle. A predicted path may be as
    near to an obstacle as the noise of the operator allows, which is nearer than a force should lead.
    """
    if not settings.clearance or not len(obstacles):
        return points
    offsets, distances = measure_offsets(points, obstacles)
    normals = offsets / np.where(distances == 0.0, 1.0, distances)[..., None]
    lacking = np.maximum(settings.clearance - (distances - obstacles.radius), 0.0)
    moved: Array = points + (lacking[..., None] * normals).sum(axis=1)
    return moved


def find_crossing(need: Need, errors: Array) -> NDArray[np.bool_]:
    """Return which errors e_i (c, 2) [m] lead across the nearest obstacle: e_i . m < 0 for the normal m of the need.

    The hand, going straight on, passes that obstacle on the side of m, and the candidate on the other one. Before the obstacle is
    crossed a force to the other side leads into it. So it is the operator who changes the side.
    """
    crossing: NDArray[np.bool_] = errors @ need.normal < 0.0
    return crossing


def saturate(settings: GuidanceConfig, errors: Array, need: float) -> Array:
    """Return errors e_i (c, 2) [m] that are not longer than what the hand lacks of the clearance D: e <- e min(1, n D / |e|).

    A longer force would lead the hand farther than it has to go. An unlikely candidate far away, such as that on the other side
    of an obstacle, does not outweigh a likely one nearby.
    """
    if not settings.clearance:
        return errors
    sizes = np.maximum(np.hypot(errors[:, 0], errors[:, 1]), 1e-12)
    saturated: Array = errors * np.minimum(need * settings.clearance / sizes, 1.0)[:, None]
    return saturated
