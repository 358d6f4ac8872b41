"""What is tried of the predictor: margins each by itself, how long a movement takes and how it begins and ends together.

Where a goal that is passed is taken for one where the hand stops, no duration is right, nor where an acceleration that lasts is
taken for one that fades. So they are tried in all combinations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

from foc_ros.core.config import ARRIVALS, Config, flatten, updated

from .demonstrations import Demonstration
from .duration_fit import CONSTANTS, other_models
from .estimates import bounded

NOISES, DURATIONS = (0.06, 0.25, 2.0), (0.7, 1.4, 2.0)
"""Factors tried beside 1."""
ETAS = (0.7, 0.5, 0.95)


def noises(config: Config) -> list[Config]:
    """Return the configuration, and with other noise."""
    return [config, *(_scaled(config, {'foc.noise_x': 1.0, 'foc.noise_y': 1.0}, factor) for factor in NOISES)]


def etas(config: Config) -> list[Config]:
    """Return the configuration, and with other probabilities of avoiding."""
    return list(dict.fromkeys([config, *(updated(config, {'foc.eta': eta}) for eta in ETAS)]))


def movements(demonstrations: Sequence[Demonstration], config: Config) -> list[Config]:
    """Return every combination of model, duration, arrival and whether accelerations fade, the configuration's own first."""
    models = [config, *other_models(demonstrations, config)]
    lasting = [_scaled(each, CONSTANTS[each.duration.model], factor) for each, factor in product(models, (1.0, *DURATIONS))]
    arrivals = dict.fromkeys([config.duration.arrival, *ARRIVALS])
    fadings = dict.fromkeys([config.estimator.acceleration_time_s, 0.0])
    return [
        updated(each, {'duration.arrival': arrival, 'estimator.acceleration_time_s': fading})
        for each, arrival, fading in product(lasting, arrivals, fadings)
    ]


def _scaled(config: Config, powers: Mapping[str, float], factor: float) -> Config:
    """Multiply each of the parameters by its power of a factor."""
    before = flatten(config)
    return updated(config, {name: bounded(name, factor**power * float(before[name])) for name, power in powers.items()})
