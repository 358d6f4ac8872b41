"""The energy tank: guidance gives to the hand what the tank contains, and no more.

An energy tank makes a force passive whose parameters change (Franken et al. 2011, doi 10.1109/TRO.2011.2142430). The tank pays
for the work on the hand and takes up the work of the hand on guidance, such as that of damping, up to its capacity.
"""

from __future__ import annotations

import math

from foc_ros.core.types import Array


def update_energy(energy: float, force: Array, displacement: Array, capacity: float) -> float:
    """Return the energy [J] after a force (2,) [N] was held while the hand moved by a displacement (2,) [m].

    E <- min(E - f . dx, E_max)
    """
    return min(energy - float(force @ displacement), capacity)


def limit_by_energy(energy: float, slew: float, speed: float, period: float) -> float:
    """Return the largest force [N] for which the tank pays until it is slewed to zero.

    From f, a hand that flees at the speed w extracts w (f T + f^2 / (2 r)) at most while f is held for another T, and then falls
    at the rate r. So f is the positive root of w (f T + f^2 / (2 r)) = E.

    energy: E [J]; slew: r [N/s]; speed: w, of the fastest hand [m/s]; period: T, longest time between two updates [s].
    """
    held = slew * period
    return math.sqrt(held * held + 2.0 * slew * max(energy, 0.0) / speed) - held
