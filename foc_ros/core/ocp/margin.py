# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The margin: by how much the mean movement clears an obstacle at a time, beyond what its uncertainty asks for.

With D the signed distance of the mean from the polygon, n the outward normal, P the covariance of the position relative to the
obstacle, and the moments of the radius R,

    g(u, t; k, tau) = D - k s - sqrt(k^2 s^2 + E),    s^2 = n' P n + Var[R^2] / (4 D^2),    E = E[R^2] + tau,

is zero where E[C] + tau + k sqrt(Var[C]) = E + 2 k D s - D^2 is (paper, equations 8-15): it is the same condition as a distance.
An obstacle holds the movement off where the safety factor k(t) = (D^2 - E) / (2 D s) is least (`minima`, `gradients`).

All functions take several problems at once, because NumPy takes as long for one as for a few.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.interpolation import hermite, hermite_quintic, pair_steps
from foc_ros.core.obstacle_table import Edges, tabulate_edges
from foc_ros.core.obstacles.geometry import find_offset
from foc_ros.core.plant.response import fall_as_minimum_jerk
from foc_ros.core.types import Array

from .problem import Problem

Indices = NDArray[np.intp]

LEAST_STDDEV = 1e-6
"""Standard deviation, relative to the scene, that is added to every other one: without any, k has no effect on the margin."""
EXCESS = 1e-9
"""Distance, relative to the scene, that is kept beyond what is asked for: without noise, rounding would decide about k."""
LEAST_REACH = 1e-6
"""Least distance to keep from a polygon, relative to the scene: where none is asked for, a sharp corner has no normal."""
ELASTIC_STDDEV = 1e-2
"""Standard deviation, relative to the scene, with which k measures a distance that is missing where no chance is constrained."""
GRID = 4
"""Points for each step on which closest approaches are looked for."""


class Contacts(NamedTuple):
    """Places where obstacles may hold the mean off: row of the problem, row of the obstacle, and time [steps]; (q,) each."""

    problem: Indices
    obstacle: Indices
    time: Array

    def mark(self, problems: Indices) -> NDArray[np.bool_]:
        """Return whether each is of one of some problems, (q,)."""
        found: NDArray[np.bool_] = (self.problem[:, None] == problems).any(axis=1)
        return found

    def take(self, rows: NDArray[np.bool_] | Indices) -> Contacts:
        """Return some of them."""
        return Contacts(self.problem[rows], self.obstacle[rows], self.time[rows])

    def join(self, *others: Contacts) -> Contacts:
        """Return these and others."""
        return Contacts(*(np.concatenate(each) for each in zip(self, *others, strict=True)))


NO_CONTACTS = Contacts(np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp), np.zeros(0))


class Motion(NamedTuple):
    """Movements of r problems over their N steps: what is known at both ends of each step, with rates per step.

    mean (r, N, 4, 2): x, y [m], and their rates; variance (r, N, 6, 3): xx, yy, xy [m^2], their rates and second derivatives.
    """

    mean: Array
    variance: Array


class Margin(NamedTuple):
    """Margins g [m] at some places, of any shape (...), and what they follow from.

    distance: D, with what the recovery allows [m]; normal_x, normal_y; stddev: s [m]; root: sqrt(k^2 s^2 + E) [m]; variance_x,
    variance_y: P n [m^2]; trace: of P [m^2]; is_on_edge: whether the nearest point is on an edge; factor: the safety factor k(t),
    linear in D where the mean is inside the obstacle.
    """

    value: Array
    distance: Array
    normal_x: Array
    normal_y: Array
    stddev: Array
    root: Array
    variance_x: Array
    variance_y: Array
    trace: Array
    is_on_edge: NDArray[np.bool_]
    factor: Array

    def take(self, rows: Indices) -> Margin:
        """Return some of them."""
        return Margin(*(each[rows] for each in self))  # type: ignore[arg-type]  # all fields are arrays


class Margins:
    """The margins of several problems with the same response to the control.

    Parameters
    ----------
    problems : Sequence[Problem]
        b problems of N steps; the table of obstacles with the largest number m of rows sets the shape of all.
    tau : Array
        Clearance term of each, (b,) [m^2].
    is_chance : bool
        Whether the margin holds against the uncertainty of hand and obstacles. Otherwise k measures a missing distance, in units
        of `ELASTIC_STDDEV`.
    between : bool
        Whether margins are kept between the steps too, as contacts that slide. Otherwise they are kept at the steps.
    """

    def __init__(self, problems: Sequence[Problem], tau: Array, *, is_chance: bool, between: bool = True) -> None:
        self.problems, self.is_chance, self.between = problems, is_chance, between
        self.response = problems[0].horizon.position_response
        self.steps = self.response.steps
        self._set_times(between)
        self.start = np.stack([each.initial_mean[:2] for each in problems])
        self.extent = np.array([each.extent for each in problems])
        self.step_s = np.array([each.horizon.dt for each in problems])
        self.noise_variance = np.stack([each.noise_variance for each in problems])
        self.count = max(len(each.obstacles) for each in problems)
        self._set_free_motion()
        self._set_obstacles(tau)

    def _set_times(self, between: bool) -> None:
        """Set the grid of times."""
        points = GRID if between else 1
        self.times, self.spacing = np.arange(points, points * self.steps + 1) / points, 1.0 / points
        self._step, share = self.response.locate(self.times)
        self._weight, self._quintic = hermite(share), hermite_quintic(share)

    def look_between(self) -> Margins:
        """Return the same margins, with a grid between the steps too."""
        other = copy(self)
        other.between = True
        other._set_times(True)  # noqa: SLF001  of the same class
        return other

    def _set_free_motion(self) -> None:
        """Set the movements without control: their means, and the covariances that uncertain starts cause."""
        rate = np.ones((len(self.problems), 1, 2, 1))
        rate[:, 0, 1, 0] = self.step_s
        means = np.stack([each.free[:, :4] for each in self.problems]).reshape(-1, self.steps + 1, 2, 2) * rate
        variance = np.zeros((len(self.problems), self.steps, 6, 3))
        for problem in {id(each): each for each in self.problems}.values():
            if problem.initial_covariance.any():
                variance[[each is problem for each in self.problems]] = _spread_start(problem)
        self._free = Motion(np.concatenate((means[:, :-1], means[:, 1:]), axis=2), variance)

    def _set_obstacles(self, tau: Array) -> None:
        """Stack the obstacles of the problems; rows that a problem does not have never count."""
        tables = {id(each.obstacles): each.obstacles for each in self.problems}
        row_of = {key: row for row, key in enumerate(tables)}
        rows = [row_of[id(each.obstacles)] for each in self.problems]
        width = max(each.vertices.shape[1] for each in tables.values())

        def stack(read: str, *shape: int) -> Array:
            stacked = np.zeros((len(tables), self.count, *shape))
            for row, table in enumerate(tables.values()):
                values = getattr(table, read)
                part = tuple(slice(n) for n in values.shape)
                stacked[row][part] = values
            return stacked[rows]

        self.counts = np.arange(self.count) < np.array([len(each.obstacles) for each in self.problems])[:, None]
        self.is_polygon = stack('corners') > 1.0
        self.centre, self.drift = stack('centre', 2), stack('velocity', 2) * self.step_s[:, None, None]
        covariance = stack('centre_covariance', 2, 2)
        self.centre_variance = covariance[..., (0, 1, 0), (0, 1, 1)]
        radius, deviation = stack('radius'), stack('radius_stddev')
        self.size_mean = radius**2 + deviation**2
        self.size_variance = 4.0 * radius**2 * deviation**2 + 2.0 * deviation**4
        self.reach_square = np.maximum(self.size_mean + tau[:, None], (LEAST_REACH * self.extent[:, None]) ** 2)
        self.edges = tabulate_edges(stack('vertices', width, 2), stack('corners'))
        # a hand that is inside of a margin has to be out of it at the end at the latest
        recovery = np.minimum(np.array([each.recovery_s for each in self.problems]) / self.step_s, self.steps)
        self.recovery_steps = np.where(self.counts, recovery[:, None], 0.0)
        self.missing = np.zeros_like(radius)
        if recovery.any() and self.count:
            self.missing = self._measure_missing()
        self.recovery_steps = np.where(self.missing > 0.0, self.recovery_steps, 0.0)

    def _measure_missing(self) -> Array:
        """Return by how much the hand is inside the margin of each obstacle now, (b, m) [m]."""
        x, y = (self.start[:, None] - self.centre).transpose(2, 0, 1)
        variance = self.centre_variance + self._free.variance[:, 0, 0][:, None]
        k = np.array([each.wanted_k for each in self.problems])[:, None] * self.is_chance
        where = np.arange(len(self.problems))[:, None], np.arange(self.count)
        inside = -self._measure(x, y, variance, where, self.edges, np.zeros(1), k).value
        return np.where(self.recovery_steps > 0.0, np.maximum(inside, 0.0), 0.0)

    def move(self, rows: Indices, control: Array) -> Motion:
        """Return the movements of problems (r,) under controls (r, 2N), in units of `Horizon.gain`."""
        mean = (control @ self.response.mean_map).reshape(len(rows), self.steps, 4, 2)
        spread = self.noise_variance[rows] * control * control
        variance = (spread @ self.response.variance_map).reshape(len(rows), self.steps, 6, 3)
        return Motion(mean + self._free.mean[rows], variance + self._free.variance[rows])

    def find_path(self, motion: Motion) -> Array:
        """Return the mean positions on the grid, (r, 2, T) [m]."""
        path: Array = (self._weight[:, None] @ motion.mean[:, self._step])[:, :, 0]
        return path.swapaxes(1, 2)

    def find_step(self, step: Array) -> Array:
        """Return how changes (r, 2N) of controls displace the mean on the grid, (r, 2, T) [m]."""
        mean = (step @ self.response.mean_map).reshape(len(step), self.steps, 4, 2)
        displaced: Array = (self._weight[:, None] @ mean[:, self._step])[:, :, 0]
        return displaced.swapaxes(1, 2)

    def measure_grid(self, rows: Indices, motion: Motion, k: Array) -> Margin:
        """Return the margins of movements of problems (r,) on the grid, (r, m, T), for safety factors (r,)."""
        x, y = self.find_path(motion).swapaxes(0, 1)[:, :, None]
        variance = (self._quintic[:, None] @ motion.variance[:, self._step])[:, None, :, 0]
        centre = self.centre[rows][:, :, None] + self.times[:, None] * self.drift[rows][:, :, None]
        edges = self.edges.take(rows).take((slice(None), slice(None), None))
        where = rows[:, None, None], np.arange(self.count)[:, None]
        variance = variance + self.centre_variance[rows][:, :, None]
        found = self._measure(x - centre[..., 0], y - centre[..., 1], variance, where, edges, self.times, k[:, None, None])
        is_there = self.counts[rows, :, None]
        value, distance, factor = (np.where(is_there, each, np.inf) for each in (found.value, found.distance, found.factor))
        return found._replace(value=value, distance=distance, factor=factor)

    def measure(self, places: Contacts, at: Indices, motion: Motion, k: Array) -> Margin:
        """Return margins at q places, or at n times of each.

        Parameters
        ----------
        places : Contacts
            The places; their times may have the shape (n, q).
        at : Indices
            Row of the movement of each place, (q,).
        motion : Motion
            The movements. Covariances are interpolated between the steps, by quintics.
        k : Array
            Safety factor for each place, (q,).
        """
        step, share = self.response.locate(places.time)
        mean = (hermite(share)[..., None, :] @ motion.mean[at, step])[..., 0, :]
        variance = (hermite_quintic(share)[..., None, :] @ motion.variance[at, step])[..., 0, :]
        return self._measure_places(places, mean, variance, k)

    def _measure_places(self, places: Contacts, mean: Array, variance: Array, k: Array) -> Margin:
        """Return margins at q places, for positions (..., q, 2) and their covariances (..., q, 3)."""
        where = places.problem, places.obstacle
        offset = mean - self.centre[where] - places.time[..., None] * self.drift[where]
        edges = self.edges.take(where)
        return self._measure(offset[..., 0], offset[..., 1], variance + self.centre_variance[where], where, edges, places.time, k)

    def _measure(
        self, x: Array, y: Array, variance: Array, where: tuple[Indices, Indices], edges: Edges, time: Array, k: Array
    ) -> Margin:
        """Return margins at points relative to centres, for covariances (..., 3); where: rows of the problems and obstacles."""
        found, reach = find_offset(x, y, edges), self.reach_square[where]
        nx, ny, distance = found.normal_x, found.normal_y, found.distance
        xx, yy, xy = variance[..., 0], variance[..., 1], variance[..., 2]
        variance_x, variance_y = xx * nx + xy * ny, xy * nx + yy * ny
        if self.missing.any():
            distance = distance + self.missing[where] * self._allow(self.recovery_steps[where], time)
        if self.is_chance:
            # a mean that is out of the obstacle is farther than half of its radius from the polygon
            own = self.size_variance[where] / (4.0 * np.maximum(distance * distance, 0.25 * reach))
            least = (LEAST_STDDEV * self.extent[where[0]]) ** 2
            stddev = np.sqrt(np.maximum(nx * variance_x + ny * variance_y, 0.0) + own + least)
        else:
            stddev = np.broadcast_to(ELASTIC_STDDEV * self.extent[where[0]], distance.shape)
        held, radius = k * stddev, np.sqrt(reach)
        root = np.sqrt(held * held + reach)
        is_outside, beyond = distance > radius, distance - radius
        factor = np.where(is_outside, beyond * (distance + radius) / (2.0 * np.where(is_outside, distance, 1.0)), beyond) / stddev
        value = distance - held - root - EXCESS * self.extent[where[0]]
        return Margin(value, distance, nx, ny, stddev, root, variance_x, variance_y, xx + yy, found.is_on_edge, factor)

    @staticmethod
    def _allow(recovery_steps: Array, time: Array) -> Array:
        """Return the share of the missing distance that is still allowed: it falls as a minimum-jerk movement does."""
        s = np.divide(time, recovery_steps, out=np.ones(np.broadcast(time, recovery_steps).shape), where=recovery_steps > 0.0)
        return fall_as_minimum_jerk(np.minimum(s, 1.0))[0]

    def sweep(self, rows: Indices, path: Array) -> Array:
        """Return the angles [rad] that the line from each centre to a path (r, 2, T) on the grid sweeps, (r, m)."""
        angles: Array = self.turn(rows, path).sum(axis=2)
        return angles

    def turn(self, rows: Indices, path: Array) -> Array:
        """Return by how much this line turns between the points of the grid, from now on, (r, m, T) [rad]."""
        from_now = np.concatenate((self.start[rows, :, None], path), axis=2)
        return self._turn(rows, from_now, np.concatenate(([0.0], self.times)))

    def sweep_steps(self, paths: Array) -> Array:
        """Return the swept angles of positions (b, N + 1, 2) of all problems at steps 0..N, (b, m)."""
        angles: Array = self._turn(np.arange(len(paths)), paths.swapaxes(1, 2), np.arange(self.steps + 1.0)).sum(axis=2)
        return angles

    def _turn(self, rows: Indices, path: Array, times: Array) -> Array:
        centre = self.centre[rows][..., None] + times * self.drift[rows][..., None]
        x, y = (path[:, None] - centre).transpose(2, 0, 1, 3)
        turned = x[..., :-1] * y[..., 1:] - y[..., :-1] * x[..., 1:]
        angles: Array = np.arctan2(turned, x[..., :-1] * x[..., 1:] + y[..., :-1] * y[..., 1:])
        return np.where(self.counts[rows, :, None], angles, 0.0)

    def respond(self, places: Contacts, control: Array, k: Array) -> tuple[Margin, Array]:
        """Return margins at q places with exact covariances, and the response (q, 2, 2N) of the position there."""
        response = self.response.at(places.time)
        step, share = self.response.locate(places.time)
        free = (hermite(share)[:, None] @ self._free.mean[places.problem, step])[:, 0]
        start = (hermite_quintic(share)[:, None] @ self._free.variance[places.problem, step])[:, 0]
        spread = (self.noise_variance[places.problem] * control * control)[:, None]
        products = np.stack((response[:, 0] ** 2, response[:, 1] ** 2, response[:, 0] * response[:, 1]), axis=1)
        mean = free + (response @ control[..., None])[..., 0]
        variance = start + (products @ spread.swapaxes(1, 2))[..., 0]
        return self._measure_places(places, mean, variance, k), response

    def measure_spread(self, places: Contacts, control: Array) -> tuple[Array, Array]:
        """Return sqrt(Var[C]) [m^2] and the distance D [m] at q contacts of controls (b, 2N)."""
        margin, _ = self.respond(places, control[places.problem], np.zeros(len(places.time)))
        return 2.0 * np.abs(margin.distance) * margin.stddev, margin.distance


def _spread_start(problem: Problem) -> Array:
    """Return the covariances xx, yy, xy of an uncertain start, with both derivatives, at both ends of each step, (N, 6, 3)."""
    rate = np.array([1.0, problem.horizon.dt])[:, None, None]
    errors = problem.error_map[:, :4].reshape(len(problem.error_map), 2, 2, -1) * rate
    begin, change, end, end_change = pair_steps(errors).swapaxes(0, 1)
    bends = 6.0 * (end - begin) - 4.0 * change - 2.0 * end_change, 6.0 * (begin - end) + 2.0 * change + 4.0 * end_change
    known = []
    for place, rates, bend in ((begin, change, bends[0]), (end, end_change, bends[1])):
        carried = place @ problem.initial_covariance
        moving, bent = carried @ rates.swapaxes(1, 2), carried @ bend.swapaxes(1, 2)
        square = rates @ problem.initial_covariance @ rates.swapaxes(1, 2)
        known += [carried @ place.swapaxes(1, 2), moving + moving.swapaxes(1, 2), bent + bent.swapaxes(1, 2) + 2.0 * square]
    return np.stack(known, axis=1)[..., (0, 1, 0), (0, 1, 1)]
