# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The derivatives of margins with respect to the control, and what they add to the Hessian of the Lagrangian.

Contacts slide along obstacles: by the envelope theorem a margin at its minimum in time has the Hessian g_uu - g_ut g_ut' / g_tt.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

from .margin import Contacts, Margin, Margins

DIFFERENCE = 5e-3
"""Time on both sides of a contact by whose gradients its sliding is found [steps]."""
LEAST_BEND = 3e-2
"""Least second derivative of a margin in time, relative to scene and whole time: along a flat side the contact is anywhere."""
FACTORS = 5
"""Vectors of which the second derivatives of a margin consist, besides a diagonal."""


class Turning(NamedTuple):
    """What the second derivatives of q margins follow from.

    k; is_free: whether k changes with the control; worth: -dg/dw of the variance w = s^2; turn: 1 / D where the normal turns,
    else 0 [1/m]; across: dw by the angle of the normal; size: Var[R^2] / 4 where it counts [m^4]; bend: second derivative in
    time. All are (q,).
    """

    k: Array
    is_free: NDArray[np.bool_]
    worth: Array
    turn: Array
    across: Array
    size: Array
    bend: Array


class Gradients(NamedTuple):
    """Margins at q places, linearised.

    value (q,) [m]; gradient (q, 2N), with respect to the control; stddev_rate (q,): -dg/dk [m]. For the h places that hold the
    mean off, diagonal (h, 2N): what a unit of the multiplier adds to the diagonal of the Hessian of the Lagrangian; factors
    (h, 5, 2N) and weights (h, 5, 5): the remaining part of it, sum_ab weights_ab factors_a factors_b'.
    """

    value: Array
    gradient: Array
    stddev_rate: Array
    diagonal: Array
    factors: Array
    weights: Array


def linearise(
    margins: Margins, places: Contacts, control: Array, k: Array, is_held: NDArray[np.bool_], is_free: NDArray[np.bool_]
) -> Gradients:
    """Return margins at q places with their first and second derivatives.

    Parameters
    ----------
    places : Contacts
        The places.
    control, k : Array
        Control (2N,) and safety factor for each place, (q, 2N) and (q,).
    is_held : NDArray[np.bool_]
        Which places hold the mean off, (q,): those that slide with it, and have second derivatives.
    is_free : NDArray[np.bool_]
        Where the safety factor changes with the control, (q,).
    """
    count, held = len(places.time), np.flatnonzero(is_held)
    moments = places.time[held]
    beside = np.clip(np.concatenate((moments - DIFFERENCE, moments + DIFFERENCE)), 1.0, float(margins.steps))
    rows = np.concatenate((np.arange(count), held, held))
    whole = Contacts(places.problem[rows], places.obstacle[rows], np.concatenate((places.time, beside)))
    control, k = control[rows], k[rows]
    margin, response = margins.respond(whole, control, k)
    noise = margins.noise_variance[whole.problem] * control
    nx, ny = margin.normal_x[:, None], margin.normal_y[:, None]
    along, aside = nx * response[:, 0] + ny * response[:, 1], nx * response[:, 1] - ny * response[:, 0]
    stddev, distance = margin.stddev, margin.distance
    # what the variance w = s^2 costs, -dg/dw, and how the normal turns: not where an edge is nearest
    worth = margins.is_chance * (k + k * k * stddev / margin.root) / (2.0 * stddev)
    turn = np.where(margin.is_on_edge, 0.0, 1.0 / distance)
    across = 2.0 * (margin.normal_x * margin.variance_y - margin.normal_y * margin.variance_x)
    is_far = distance**2 > 0.25 * margins.reach_square[whole.problem, whole.obstacle]
    size = np.where(is_far, margins.size_variance[whole.problem, whole.obstacle] / 4.0, 0.0)
    spread = 2.0 * noise * along**2 + (across * turn)[:, None] * aside - (2.0 * size / distance**3)[:, None] * along  # dw/du
    gradient = along - worth[:, None] * spread
    rate = stddev * (1.0 + k * stddev / margin.root)
    earlier, later = slice(count, count + len(held)), slice(count + len(held), None)
    apart = whole.time[later] - whole.time[earlier]
    apart = np.where(apart > 0.0, apart, 1.0)  # there is but one time in a single step
    rise, fall = margin.value[later] - margin.value[held], margin.value[earlier] - margin.value[held]
    bend = 4.0 * (rise + fall) / apart**2
    before, after = (
        np.where(is_free[held], rate[held] / rate[beside], 1.0)[:, None] * gradient[beside] for beside in (earlier, later)
    )
    slide = (after - before) / apart[:, None]
    # where the nearest point passes from an edge to a corner, the margin has a kink in time: the least margin moves with both
    # sides, by so much of each that it does not change with time
    is_kink = (margin.is_on_edge[later] != margin.is_on_edge[earlier]) & (rise > 0.0) & (fall > 0.0)
    share = np.divide(rise, rise + fall, out=np.zeros(len(held)), where=is_kink)[:, None]
    mixed = share * gradient[earlier] + (1.0 - share) * gradient[later]
    gradient = gradient[:count]
    gradient[held] = np.where(is_kink[:, None], mixed, gradient[held])
    bend = np.where(is_kink, np.inf, bend)
    moved = 4.0 * noise[held] * along[held] * aside[held]
    factors = np.stack((aside[held], gradient[held], moved, spread[held], slide), axis=1)
    terms = Turning(k[held], is_free[held], worth[held], turn[held], across[held], size[held], bend)
    weights = _weigh_factors(margins, places.take(held), margin.take(held), terms)
    diagonal = (2.0 * worth[held])[:, None] * margins.noise_variance[whole.problem[held]] * along[held] ** 2
    return Gradients(margin.value[:count], gradient, rate[:count], diagonal, factors, weights)


def _weigh_factors(margins: Margins, places: Contacts, margin: Margin, terms: Turning) -> Array:
    """Return the weights (q, 5, 5) of the factors: displacement across the normal, the gradient, and the effect on P, w, t.

    The displacement along the normal is the gradient and worth times the effect on w. Where k is free, the margin is zero at
    a k(u) whose second derivatives are r k_uu = g_uu + g_uk k_u' + k_u g_uk' + g_kk k_u k_u', with k_u = g_u / r.
    """
    k, is_free, worth, turn, across, size, bend = terms
    reach, variance = margins.reach_square[places.problem, places.obstacle], margin.stddev**2
    difference = 2.0 * margin.trace - 4.0 * (margin.normal_x * margin.variance_x + margin.normal_y * margin.variance_y)
    turned, along = -worth * across * turn**2, 6.0 * worth * size / margin.distance**4
    ratio = k * margin.stddev / margin.root
    rate = margin.stddev * (1.0 + ratio)
    weights = np.zeros((len(k), FACTORS, FACTORS))
    weights[:, 0, 0] = turn * (-1.0 + worth * (turn * difference - 2.0 * size / margin.distance**3))
    weights[:, 0, 1] = weights[:, 1, 0] = turned
    weights[:, 0, 2] = weights[:, 2, 0] = worth * turn
    weights[:, 0, 3] = weights[:, 3, 0] = worth * turned
    weights[:, 1, 1] = along + is_free * variance * reach / (margin.root**3 * rate**2)
    mixed = is_free * (1.0 + 2.0 * ratio - ratio**3) / (2.0 * margin.stddev * rate)
    weights[:, 1, 3] = weights[:, 3, 1] = worth * along + mixed
    bent = margins.is_chance * k * k * reach / (4.0 * variance * margin.root**3) - worth / (2.0 * variance)
    weights[:, 3, 3] = bent + worth**2 * along
    is_inside = (places.time > 1.0) & (places.time < margins.steps) & margins.between
    floor = LEAST_BEND * margins.extent[places.problem] / margins.steps**2
    weights[:, 4, 4] = np.where(is_inside, 1.0 / np.maximum(bend, floor), 0.0)
    return weights
