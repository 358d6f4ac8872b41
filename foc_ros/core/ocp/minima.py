# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where safety factors are least in time: the contacts at which the solver keeps margins, and the factor that a solution reports.

Factors are computed on the grid of the margins, sampled finely around their lowest points there, and measured at the minima.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacles.risk import CERTAIN_K, compute_safety_factor
from foc_ros.core.types import Array

from .margin import Contacts, Indices, Margin, Margins, Motion

BRACKET, NARROW = np.linspace(-1.0, 1.0, 9), np.linspace(-0.25, 0.25, 33)
"""Times, relative to the distance of points on the grid, at which safety factors are sampled: first to tell minima apart, then
around each. The last ones are 4e-3 steps apart, and a parabola or two lines pass through them."""
CHANGE_RATIO = 1.5
"""Between two points of the grid a safety factor may change by this factor more than from one point to the next."""


def find_minima(
    margins: Margins, rows: Indices, motion: Motion, k: Array, grid: Margin, is_wanted: NDArray[np.bool_]
) -> tuple[Contacts, Array]:
    """Return the local minima in time of the safety factors, and the factors there.

    Parameters
    ----------
    rows, motion, k
        As for `measure_grid`.
    grid : Margin
        What it returned for them.
    is_wanted : NDArray[np.bool_]
        Which points of the grid may be minima that matter, (r, m, T).

    Returns
    -------
    Contacts, Array
        Minima with refined times, and the safety factors there, (q,).
    """
    factor = grid.factor
    at, obstacle, place = np.nonzero(mark_lowest(factor) & is_wanted)
    places = Contacts(rows[at], obstacle, margins.times[place])
    if not margins.between or not len(at):
        return places, factor[at, obstacle, place]
    return _refine(margins, motion, k, at, places)


def find_least_factors(margins: Margins, control: Array, factors: Array | None = None) -> tuple[Array, Indices, Array]:
    """Return the least safety factors of controls (b, 2N) over all obstacles and times after the recovery, and where they are.

    Wherever a factor that changes from one point of the grid to the next as it does there may fall below the least one, it is
    sampled between them, and the minima are refined.

    Parameters
    ----------
    control : Array
        The controls.
    factors : Array, optional
        Their safety factors on the grid, (b, m, T), where they are known.

    Returns
    -------
    Array, Indices, Array
        Safety factors k (b,), `CERTAIN_K` without obstacles; rows of the obstacles; times [steps].
    """
    rows = np.arange(len(control))
    k, row, moment = np.full(len(rows), CERTAIN_K), np.zeros(len(rows), dtype=np.intp), np.zeros(len(rows))
    if not margins.count:
        return k, row, moment
    motion, zero_k = margins.move(rows, control), np.zeros(len(rows))
    if factors is None:
        factors = margins.measure_grid(rows, motion, zero_k).factor
    is_counted = margins.counts[..., None] & (margins.times >= margins.recovery_steps[..., None])
    factors = np.where(is_counted, factors, np.inf)
    least = factors.min(axis=(1, 2))
    may_be_least = np.isfinite(factors) & (factors - CHANGE_RATIO * _vary(factors) <= least[:, None, None])
    at, obstacle, place = np.nonzero(may_be_least)
    times = np.maximum(margins.times[place], margins.recovery_steps[at, obstacle])
    places, _ = _refine(margins, motion, zero_k, at, Contacts(at, obstacle, times), least)
    places = places._replace(time=np.maximum(places.time, margins.recovery_steps[places.problem, places.obstacle]))
    found = _measure_exactly(margins, places, control)
    for which in np.argsort(-found, kind='stable').tolist():  # the least one is written last
        problem = places.problem[which]
        k[problem], row[problem], moment[problem] = found[which], places.obstacle[which], places.time[which]
    return k, row, moment


def _refine(
    margins: Margins, motion: Motion, k: Array, at: Indices, places: Contacts, bound: Array | None = None
) -> tuple[Contacts, Array]:
    """Return the minima beside some places of the grid, of movements in rows `at`, and the safety factors there.

    There may be several beside one place, next to the corners of a small obstacle. Those are left out that cannot be below
    the least factor found for their movement and a bound (r,), if there is one.
    """
    times, factors, is_on_edge = _sample(margins, motion, k, at, places, BRACKET)
    is_lowest = mark_lowest(factors.T)
    if bound is not None:
        bound = bound.copy()
        np.minimum.at(bound, at, factors.min(axis=0))
        is_lowest &= factors.T - CHANGE_RATIO * _vary(factors.T) <= bound[at, None]
    which, column = np.nonzero(is_lowest)
    at, places = at[which], Contacts(places.problem[which], places.obstacle[which], times[column, which])
    times, factors, is_on_edge = times[:, which], factors[:, which], is_on_edge[:, which]
    places = places._replace(time=_estimate(margins, times, factors, is_on_edge, column, BRACKET))
    times, factors, is_on_edge = _sample(margins, motion, k, at, places, NARROW)
    column = factors.argmin(axis=0)
    found = places._replace(time=_estimate(margins, times, factors, is_on_edge, column, NARROW))
    best = np.arange(len(column))
    lowest, least = factors[column, best], margins.measure(found, at, motion, k[at]).factor
    return found._replace(time=np.where(least <= lowest, found.time, times[column, best])), np.minimum(least, lowest)


def _sample(
    margins: Margins, motion: Motion, k: Array, at: Indices, places: Contacts, bracket: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return times (n, q) in a bracket (n,) around places (q,), the safety factors, and whether an edge is nearest there."""
    times = np.clip(places.time + margins.spacing * bracket[:, None], 1.0, float(margins.steps))
    margin = margins.measure(places._replace(time=times), at, motion, k[at])
    return times, margin.factor, margin.is_on_edge


def _estimate(
    margins: Margins, times: Array, factors: Array, is_on_edge: NDArray[np.bool_], column: Indices, bracket: Array
) -> Array:
    """Return the times (q,) of minima near the given one of the samples (n, q) of each in a bracket (n,)."""
    row, best = np.clip(column, 2, len(times) - 3), np.arange(len(column))
    near = np.stack([factors[row + step, best] for step in range(-2, 3)])
    shift = _find_lowest(near, is_on_edge[row - 2, best] != is_on_edge[row + 2, best])
    is_inside = (times[0] > 1.0) & (times[-1] < margins.steps)
    spacing = margins.spacing * (bracket[1] - bracket[0])
    return np.where(is_inside, times[row, best] + spacing * shift, times[column, best])


def _measure_exactly(margins: Margins, places: Contacts, control: Array) -> Array:
    """Return the safety factors of controls (b, 2N) at q places as the paper has them, (q,)."""
    margin, _ = margins.respond(places, control[places.problem], np.zeros(len(places.time)))
    along = margin.normal_x * margin.variance_x + margin.normal_y * margin.variance_y
    where = places.problem, places.obstacle
    return compute_safety_factor(margin.distance, along, margins.size_mean[where], margins.size_variance[where])


def mark_lowest(values: Array) -> NDArray[np.bool_]:
    """Mark the values (..., T) that are not above their neighbours; of equal ones the last."""
    before, after = np.full_like(values, np.inf), np.full_like(values, np.inf)
    before[..., 1:], after[..., :-1] = values[..., :-1], values[..., 1:]
    return (values <= before) & (values < after)


def _vary(values: Array) -> Array:
    """Return the larger change of values (..., T) to a neighbour; 0 between infinite ones."""
    changes = np.zeros((*values.shape[:-1], values.shape[-1] + 1))
    is_finite = np.isfinite(values)
    np.subtract(values[..., 1:], values[..., :-1], out=changes[..., 1:-1], where=is_finite[..., 1:] & is_finite[..., :-1])
    np.abs(changes, out=changes)
    return np.maximum(changes[..., 1:], changes[..., :-1])


def _find_lowest(values: Array, is_kink: NDArray[np.bool_]) -> Array:
    """Return where the least of five evenly spaced values (5, q) is, counted from the middle, (q,).

    It is the vertex of a parabola, or where the lines through the first two and the last two values meet.
    """
    first, low, middle, high, last = values
    bend, fall, rise = low - 2.0 * middle + high, low - first, last - high
    vertex = np.clip(np.divide(0.5 * (low - high), bend, out=np.zeros_like(bend), where=bend > 0.0), -0.5, 0.5)
    meeting = np.divide(low - high + fall + rise, rise - fall, out=np.zeros_like(bend), where=rise > fall)
    is_kink = is_kink & (fall < 0.0) & (rise > 0.0) & (np.abs(meeting) <= 1.0)
    lowest: Array = np.where(is_kink, meeting, vertex)
    return lowest
