"""The reference on each candidate: a progress along its path that follows the hand and never jumps to a distant part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array, Prediction, Record

WINDOW_M = 0.02
"""Length of path [m] on both sides of the progress within which the nearest point is sought."""
CORRECTION_S = 0.05
"""Time constant with which the progress approaches the nearest point [s]."""


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
    low = np.zeros(len(points))
    return paths.find_nearest(points, low, np.full(len(points), travelled + WINDOW_M))


def advance_progress(paths: GuidePaths, progress: Array, position: Array, velocity: Array, dt: float) -> Array:
    """Return the progress (c,) [m] a time `dt` [s] later.

    It moves with the velocity v of the hand along the tangent u, and approaches the point s* that is nearest to the hand within
    `WINDOW_M` with the time constant T of `CORRECTION_S`, so that it is continuous:

        s <- s + u . v dt,    s <- s + (1 - exp(-dt / T)) (s* - s).
    """
    ends = paths.lengths[:, -1]
    moved = np.minimum(
        np.maximum(progress + dt * np.minimum(np.maximum(paths.find_tangents(progress) @ velocity, -1e3), 1e3), 0.0), ends
    )
    nearest = paths.find_nearest(np.broadcast_to(position, (len(moved), 2)), moved - WINDOW_M, moved + WINDOW_M)
    advanced: Array = np.minimum(np.maximum(moved + (1.0 - np.exp(-dt / CORRECTION_S)) * (nearest - moved), 0.0), ends)
    return advanced


def normalize(vectors: Array) -> Array:
    """Return vectors (..., 2) of unit length; zero vectors stay as they are."""
    norms = np.hypot(vectors[..., 0], vectors[..., 1])[..., None]
    unit: Array = vectors / np.where(norms > 0.0, norms, 1.0)
    return unit
