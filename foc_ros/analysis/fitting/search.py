"""Settings of the predictor in a race by replays, and what the best of them says of each parameter.

The race is successive halving (Jamieson and Talwalkar 2016, arXiv:1502.07943): all settings foretell a few recordings, the better
half of them twice as many, and so on. What is hard to tell gets the data, and what is plainly worse none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.config import Config, flatten
from foc_ros.core.types import Array

from .duration_fit import CONSTANTS
from .estimates import Estimate
from .found import Fit
from .replays import Replays
from .resampling import CENTRAL, RESAMPLES, SEED

FIRST = 6
"""Recordings that all settings foretell."""
FINALISTS = 4
"""Settings that come to the end and foretell all recordings, unless they are plainly worse."""
MOST = 48
"""Recordings in which settings are compared; more make no difference that counts."""
PLAIN = 3.0
"""Standard errors by which a setting behind the best is plainly worse."""
SURE = 0.95
"""Share of the resamples below which a choice is said to be unsure."""


def search(kind: str, settings: Sequence[Config], replays: Replays, found: Fit) -> None:
    """Take the best of some settings; the first is what is held so far."""
    finalists, scores = race(kind, settings, replays)
    n = scores.shape[2]
    draws = np.random.default_rng(SEED)
    drawn = [finalists[preferred(scores[:, :, draws.integers(n, size=n)])] for _ in range(RESAMPLES)]
    found.config = best = finalists[preferred(scores)]
    given, constants = flatten(settings[0]), [name for each in CONSTANTS.values() for name in each]
    for name, value in flatten(best).items():
        if name in constants and name not in CONSTANTS[best.duration.model]:
            continue
        if isinstance(value, str):
            _take_choice(name, value, str(given[name]), drawn, found)
            continue
        alike = [each for each in settings if name not in constants or each.duration.model == best.duration.model]
        _take_value(name, float(value), alike, [each for each in drawn if each in alike], found)


def race(kind: str, settings: Sequence[Config], replays: Replays) -> tuple[list[Config], Array]:
    """Return the finalists, in the order given, with their scores as of `compared`."""
    names = list(replays.recordings)
    # every beginning of the list is a fair sample of the recordings, however they were ordered
    names = [names[place] for place in np.random.default_rng(SEED).permutation(len(names))[:MOST]]
    left, count = list(settings), FIRST
    while True:
        known = names[:count]
        scores = replays.scores(left, known, f'{kind} {len(left)}')
        if len(known) == len(names) or len(left) == 1:
            return left, scores
        kept = set(ranked(scores)[: max(-(-len(left) // 2), FINALISTS)]) - worse(scores)
        left, count = [left[place] for place in sorted(kept)], 2 * count


def ranked(scores: Array) -> list[int]:
    """Return the settings from the best to the worst: by ways, and where these are equal by positions."""
    ways, positions = scores.mean(axis=2)
    order: list[int] = np.lexsort((-positions, -ways)).tolist()
    return order


def worse(scores: Array) -> set[int]:
    """Return the settings that are plainly worse than the best in ways."""
    ways = scores[0]
    behind = ways[ways.mean(axis=1).argmax()] - ways
    return set(np.flatnonzero(behind.mean(axis=1) > PLAIN * behind.std(axis=1) / np.sqrt(ways.shape[1])).tolist())


def preferred(scores: Array) -> int:
    """Return the setting to take, by scores as of `compared`."""
    return ranked(scores)[0]


def _take_choice(name: str, value: str, given: str, drawn: Sequence[Config], found: Fit) -> None:
    """Take what is no number."""
    if value != given:
        found.chosen[name] = value
    sure = float(np.mean([flatten(each)[name] == value for each in drawn]))
    if sure < SURE:
        found.warnings.append(f'{name}: {value} is the best, but only in {100 * sure:.0f} % of the resamples')


def _take_value(name: str, value: float, settings: Sequence[Config], drawn: Sequence[Config], found: Fit) -> None:
    """Take a number, if any was tried."""
    tried = {float(flatten(each)[name]) for each in settings}
    if len(tried) == 1:
        return
    low, high = np.percentile([float(flatten(each)[name]) for each in drawn], CENTRAL).tolist()
    if (low, high) == (min(tried), max(tried)):
        found.warnings.append(f'{name}: from {low:.3g} to {high:.3g}, all that was tried, resampled recordings agree as well')
    before, how = found.estimates.get(name), 'positions and ways foretold'
    if before is not None:
        how = before.how if how in before.how else f'{before.how}, then {how}'
        low, high = (min(low, before.low), max(high, before.high)) if before.value == value else (low, high)
    found.estimates[name] = Estimate(name, value, low, high, how)
