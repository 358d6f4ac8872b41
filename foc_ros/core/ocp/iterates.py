# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the sequential QP knows: where it is, what it knows of the controls there, and the solutions of its QPs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

from .margin import NO_CONTACTS, Contacts, Indices


@dataclass
class Evaluation:
    """What the sequence knows of the controls of r problems.

    cost (r,): J, in units of `gain`^2; loss (r,): what is minimised; factor (r,): the safety factor k; angles (r, m): swept
    angles [rad]; margin, factors (r, m, T), normal (r, 2, m, T): on the grid; contacts (q,): minima of the safety factors near
    the path.
    """

    cost: Array
    loss: Array
    factor: Array
    angles: Array
    margin: Array
    normal: Array
    factors: Array
    contacts: Contacts

    def put(self, rows: Indices, other: Evaluation, taken: NDArray[np.bool_], problems: Indices) -> None:
        """Take rows over from the evaluation of some problems: those that are marked."""
        self.cost[rows], self.loss[rows], self.factor[rows] = other.cost[taken], other.loss[taken], other.factor[taken]
        self.angles[rows], self.margin[rows], self.normal[rows] = other.angles[taken], other.margin[taken], other.normal[taken]
        self.factors[rows] = other.factors[taken]
        old, new = ~self.contacts.mark(problems[taken]), other.contacts.mark(problems[taken])
        self.contacts = self.contacts.take(old).join(other.contacts.take(new))


@dataclass
class Iterates:
    """Where the sequence is: a row for each of b problems.

    control (b, 2N), in units of `Horizon.gain`; k (b,): safety factor at which margins are linearised; at: what is known of the
    controls; contacts and multipliers (q,) of the last QPs; angles (b, m): swept angles of the class [rad]; is_done (b,): whether
    the sequence has ended, is_settled (b,): at a minimum; gain (b,): what the last QP promised; iterations (b,);
    bound (b,): what the loss must not exceed; is_exact (b,): whether to end only where the next step would change nothing;
    is_waiting (b,): whether it is so unlikely that it goes on in the next prediction; has_failed (b,): whether no step was
    taken in the last iteration; trial: contacts of the last whole steps that failed.
    """

    control: Array
    k: Array
    at: Evaluation
    contacts: Contacts
    multipliers: Array
    angles: Array
    is_done: NDArray[np.bool_]
    is_settled: NDArray[np.bool_]
    gain: Array
    iterations: Indices
    bound: Array
    is_exact: NDArray[np.bool_]
    is_waiting: NDArray[np.bool_]
    has_failed: NDArray[np.bool_]
    trial: Contacts = NO_CONTACTS
