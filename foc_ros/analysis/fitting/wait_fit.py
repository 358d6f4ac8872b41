"""How long the operator's hand at rest waits: the mean of the time to the next movement, over all samples at rest before one.

That is the likeliest mean of an exponential distribution, which does not depend on how long the hand has waited already.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.analysis.evaluation.path import Path
from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS

from .demonstrations import Demonstration
from .estimates import Estimate, bounded
from .resampling import CENTRAL, resamples

NAME = 'duration.wait_s'


def fit_wait(demonstrations: Sequence[Demonstration], config: Config) -> tuple[dict[str, Estimate], list[str]]:
    """Return the estimate, none where no hand waits before a movement; no warnings."""
    waits = [mean for each in demonstrations if (mean := _mean_wait(each, config)) is not None]
    if not waits:
        return {}, []
    drawn = resamples(len(waits)) @ np.array(waits) / len(waits)
    low, high = np.percentile(drawn, CENTRAL)
    return {NAME: Estimate(NAME, bounded(NAME, float(np.mean(waits))), float(low), float(high), 'time until movements begin')}, []


def _mean_wait(demonstration: Demonstration, config: Config) -> float | None:
    """Return the mean time [s] from the samples at rest to the movement that follows, until the goal is reached."""
    path = Path(demonstration.stamps_ns, demonstration.positions, demonstration.goals)
    waits, following = list[float](), None
    for state in reversed(demonstration.states(config)):
        if state.stamp_ns > path.end_ns:
            continue
        if state.onset_ns is not None:
            following = state.onset_ns
        elif following is not None:
            waits.append((following - state.stamp_ns) / NANOSECONDS)
    return float(np.mean(waits)) if waits else None
