# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The preference for safety: what a class loses where its movement is less safe than wanted.

The weight of a class falls with its cost J as J^-beta, and with each unit by which its safety factor k is below the wanted one as
exp(-shortfall). A strategy therefore minimises, within a class,

    beta log J + shortfall max(0, k_wanted - k),

and the likelihood weighs classes by the same sum. Where the wanted k costs little effort the minimum is there. Where it costs
much, or cannot be reached, the minimum is at a smaller k, to which it passes continuously. With an infinite shortfall the wanted
k is a condition, as in the paper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

COST_FLOOR = 1e-9
"""Smallest cost that is distinguished from zero [m^2/s^5]: the effort of a reach of 1 um in 1 s, 720 D^2 / T^5 = 7e-10."""


@dataclass(frozen=True)
class SafetyPreference:
    """How effort and safety are weighed in one problem.

    beta: exponent of the cost; shortfall: loss per unit of safety factor below the wanted one; fixed_cost: part of the cost that
    is not effort to go [m^2/s^5]; dt: length of a step [s], by which an effort becomes a cost.
    """

    beta: float = 1.0
    shortfall: float = math.inf
    fixed_cost: float = 0.0
    dt: float = 1.0

    @property
    def is_hard(self) -> bool:
        """Whether the wanted safety factor is a condition."""
        return self.shortfall == math.inf

    def compute_effort_loss(self, effort: float) -> float:
        """Return beta log J for an effort [m^2/s^6]."""
        return self.beta * math.log(max(effort * self.dt + self.fixed_cost, COST_FLOOR))

    def compute_loss(self, effort: float, k: float, wanted_k: float) -> float:
        """Return the loss for an effort [m^2/s^6] and a safety factor; infinite where a condition is missed."""
        return self.compute_effort_loss(effort) + (self.shortfall * (wanted_k - k) if k < wanted_k else 0.0)


HARD = SafetyPreference()
"""The wanted safety factor is a condition."""
