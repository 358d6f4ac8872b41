# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One point of the curves of strategies: problems that are solved together for given k, tau and lambda."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.types import Array

from .iterates import Iterates
from .margin import Contacts, Indices, Margins
from .minima import find_minima
from .problem import Problem
from .solver import LARGEST_RATE, MOST_ITERATIONS, Solver
from .start import Start, follow

TOUCHING, TOUCHING_NEAR = 1e-3, 0.05
"""Distance that the mean lacks, relative to the scene, up to which a class has a path, and within which it is looked for."""
BETWEEN = 0.3
"""Part of the least radius by which a mean that is held off at the steps alone may enter an obstacle between them."""
LEAP = 2.0
"""Angle by which the direction of an obstacle turns between two points of the grid if the mean leaps over it [rad]."""
TIGHTNESS, HELD_OFF = (1e-4, 1e-2, 1.0, 1e2, 1e4), 0.5
"""How tightly a guess is followed: as the first of these with which the path stays in its class, and farther from the polygons
than this part of the radii. Tightly followed, a guess takes an effort, and so has a variance, that makes margins meaningless."""


@dataclass
class Point:
    """Solutions of b problems at one point of their curves.

    solver, now: the solver and where its sequence ended; k (b,): the safety factors of the controls.
    """

    solver: Solver
    now: Iterates
    k: Array

    def is_late(self, row: int) -> bool:
        """Return whether the time was up before a problem was solved or had its iterations."""
        return not self.now.is_done[row] and bool(self.now.iterations[row] < self.solver.most)

    def is_touching(self) -> NDArray[np.bool_]:
        """Return whether the mean enters an obstacle or its clearance, or leaps over one between two points of the grid, (b,).

        Where it is held off at the steps alone, it may enter between them by a part of the radius.
        """
        margins = self.solver.margins.look_between()
        rows = np.arange(len(self.k))
        motion, none = margins.move(rows, self.now.control), np.zeros(len(rows))
        grid = margins.measure_grid(rows, motion, none)
        is_near = grid.value < TOUCHING_NEAR * margins.extent[:, None, None]
        places, _ = find_minima(margins, rows, motion, none, grid, is_near)
        least = np.full(len(rows), np.inf)
        np.minimum.at(least, places.problem, margins.measure(places, places.problem, motion, none[places.problem]).value)
        allowed = TOUCHING * margins.extent
        if not self.solver.margins.between and margins.count:
            allowed = np.maximum(allowed, BETWEEN * np.sqrt(margins.reach_square.min(axis=1)))
        short = least < -allowed
        leaps: NDArray[np.bool_] = np.abs(margins.turn(rows, margins.find_path(motion))).max(axis=(1, 2), initial=0.0) > LEAP
        return short | leaps

    def is_kept_at_steps(self) -> NDArray[np.bool_]:
        """Return whether the mean is held off at the steps alone, and keeps its distances there, (b,)."""
        margins, rows = self.solver.margins, np.arange(len(self.k))
        if margins.between:
            return np.zeros(len(rows), dtype=np.bool_)
        grid = margins.measure_grid(rows, margins.move(rows, self.now.control), np.zeros(len(rows)))
        is_kept: NDArray[np.bool_] = grid.value.min(axis=(1, 2), initial=np.inf) >= -TOUCHING * margins.extent
        return is_kept


def solve_at(
    problems: Sequence[Problem],
    starts: Sequence[Start],
    weights: tuple[Array, Array],
    *,
    is_chance: bool,
    between: bool = True,
    deadline: Deadline = NEVER,
    before: Point | None = None,
    most: int = MOST_ITERATIONS,
) -> Point:
    """Solve problems at one point of a curve.

    Parameters
    ----------
    problems, starts
        b problems with the same response, and where each begins.
    weights
        Clearance terms tau [m^2] and weights lambda of the variances [1/s^6], (b,) each.
    is_chance
        Whether the wanted k is asked for, as far as it is worth its effort; otherwise the mean keeps tau.
    between
        Whether obstacles count between the steps too.
    deadline
        Looked at once an iteration.
    before
        A solution of the same problems at another point, from which the search begins instead.
    most
        Most iterations.
    """
    tau, lam = weights
    margins = Margins(problems, tau, is_chance=is_chance, between=between)
    wanted = np.array([each.wanted_k for each in problems]) * is_chance
    preferences = [each.preference for each in problems]
    rates = [min(each.shortfall / each.beta, LARGEST_RATE) if each.beta > 0.0 else LARGEST_RATE for each in preferences]
    # without a chance constraint no safety is wanted, and the rate has no effect
    rate = np.array(rates) if is_chance else np.ones(len(problems))
    solver = Solver(margins, wanted, rate, lam, goes_on=deadline.goes_on and is_chance)
    if before is None:
        control, angles = _begin(margins, problems, starts)
        contacts, multipliers = _stack_forces(starts)
        k = np.array([each.safety_factor for each in starts])
    else:
        last = before.now
        control, k, angles = last.control.copy(), last.k.copy(), last.angles
        contacts, multipliers = last.contacts, last.multipliers
    is_cold = np.array([each.control is None for each in starts])
    now = solver.begin(control, contacts, multipliers, np.where(k > 0.0, np.minimum(k, wanted), wanted), angles, is_cold)
    solver.run(now, deadline, most)
    return Point(solver, now, now.at.factor)


def _begin(margins: Margins, problems: Sequence[Problem], starts: Sequence[Start]) -> tuple[Array, Array]:
    """Return the controls (b, 2N) at which the search begins, and the swept angles (b, m) of the classes."""
    angles, control = margins.sweep_steps(np.stack([each.path for each in starts])), np.zeros((len(starts), 2 * margins.steps))
    for row, (problem, start) in enumerate(zip(problems, starts, strict=True)):
        if start.control is not None:
            control[row] = start.control * problem.horizon.gain
    rows = np.array([row for row, start in enumerate(starts) if start.control is None], dtype=np.intp)
    control[rows] = _follow_guesses(margins, rows, [starts[row].path for row in rows.tolist()], angles[rows])
    return control, angles


def _follow_guesses(margins: Margins, rows: Indices, guesses: Sequence[Array], angles: Array) -> Array:
    """Return the controls (r, 2N) that follow guesses of problems (r,) no more tightly than it takes to stay in their classes.

    guesses (N + 1, 2), and the angles (r, m) that they sweep. A path that enters a polygon may be nearest to an edge on the wrong
    side of it.
    """
    control, left = np.zeros((len(rows), 2 * margins.steps)), np.arange(len(rows))
    times, smoothing = 1.0 + np.arange(margins.steps), margins.response.smoothing
    for tightness in TIGHTNESS:
        if not len(left):
            break
        now = rows[left]
        where, places = np.repeat(np.arange(len(now)), margins.steps), np.concatenate([guesses[row][1:] for row in left.tolist()])
        problems, weight = [margins.problems[row] for row in now.tolist()], np.full(len(now), smoothing / tightness)
        control[left] = follow(problems, where, np.tile(times, len(now)), places, weight)
        motion = margins.move(now, control[left])
        swept, grid = margins.sweep(now, margins.find_path(motion)), margins.measure_grid(now, motion, np.zeros(len(now)))
        least = HELD_OFF * np.sqrt(margins.reach_square[now])[..., None]
        left = left[~((np.abs(swept - angles[left]) < np.pi).all(axis=1) & (grid.distance > least).all(axis=(1, 2)))]
    return control


def _stack_forces(starts: Sequence[Start]) -> tuple[Contacts, Array]:
    """Return the contacts of starts, and their multipliers (q,)."""
    forces = [each.forces for each in starts]
    rows = np.repeat(np.arange(len(starts)), [len(each.time) for each in forces])
    contacts = Contacts(rows, *(np.concatenate([each[i] for each in forces]) for i in (0, 1)))
    return contacts, np.concatenate([each.multiplier for each in forces])
