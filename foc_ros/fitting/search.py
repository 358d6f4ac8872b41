"""Settings of the predictor tried by replays, one kind after the other, and the best taken."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor

import numpy as np

from foc_ros.evaluation.recordings import Recording
from foc_ros.foc.config import Config, flatten, updated

from .duration_fit import CONSTANTS
from .estimates import Estimate
from .found import Fit
from .replays import ACCELERATION, ARRIVAL, DURATION, ETA, MODEL, NOISE, Foretold, compared, observed, preferred, scored
from .resampling import CENTRAL, RESAMPLES, SEED

SURE = 0.95
"""Share of the resamples in which another way to arrive, or another model of duration, has to be the better one."""
CHOICES = {ARRIVAL: 'duration.arrival', MODEL: 'duration.model'}
VALUES = {
    ACCELERATION: ('estimator.acceleration_time_s',),
    NOISE: ('foc.noise_x', 'foc.noise_y'),
    ETA: ('foc.eta',),
}


def search(
    kind: str,
    others: Sequence[Config],
    recordings: Mapping[str, Recording],
    found: Fit,
    thin: Mapping[str, float],
    executor: Executor,
    foretold: dict[Config, Foretold],
) -> None:
    """Try other settings of one kind and take the best.

    thin: parameters of these replays alone; foretold: what is known of settings, and is added to.
    """
    settings = [found.config, *others]
    for number, setting in enumerate(settings, 1):
        if setting not in foretold:
            words = f'{kind} {number}/{len(settings)}'
            foretold[setting] = scored(observed(recordings, updated(setting, thin), executor, words)[0], setting)
    scores = compared([foretold[setting] for setting in settings], list(recordings))
    draws, n = np.random.default_rng(SEED), scores.shape[2]
    drawn = [settings[preferred(scores[:, :, draws.integers(n, size=n)])] for _ in range(RESAMPLES)]
    best = settings[preferred(scores)]
    if kind in CHOICES:
        _take_choice(CHOICES[kind], best, drawn, found)
    else:
        names = CONSTANTS[best.duration.model] if kind == DURATION else VALUES[kind]
        _take_values(names, best, settings, drawn, found)


def _take_choice(name: str, best: Config, drawn: Sequence[Config], found: Fit) -> None:
    """Take what is no number, where it is better for sure; else keep what is given."""
    value, given = str(flatten(best)[name]), str(flatten(found.config)[name])
    if value == given:
        return
    sure = float(np.mean([each == best for each in drawn]))
    if sure < SURE:
        words = f'{value} is better than {given}, but only in {100 * sure:.0f} % of the resamples: {given} is kept'
        found.warnings.append(f'{name}: {words}')
        return
    found.chosen[name], found.config = value, best


def _take_values(names: Iterable[str], best: Config, settings: Sequence[Config], drawn: Sequence[Config], found: Fit) -> None:
    """Take the numbers of the best setting."""
    for name in names:
        value, tried = _value(best, name), {_value(setting, name) for setting in settings}
        if len(tried) == 1:
            continue
        low, high = np.percentile([_value(setting, name) for setting in drawn], CENTRAL)
        before = found.estimates.get(name)
        how = 'positions and ways foretold' if before is None else f'{before.how}, then positions and ways foretold'
        found.estimates[name] = Estimate(name, value, float(low), float(high), how)
        if (low, high) == (min(tried), max(tried)):
            found.warnings.append(f'{name}: from {low:.3g} to {high:.3g}, all that was tried, resampled recordings agree as well')
    found.config = best


def _value(config: Config, name: str) -> float:
    return float(flatten(config)[name])
