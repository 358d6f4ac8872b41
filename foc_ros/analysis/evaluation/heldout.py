"""Parameters of a predictor chosen by likelihood, each recording judged by those that the others would choose.

A family is one predictor with a fixed grid of settings. Every setting is tried on every recording once; held out, a recording is
judged by the setting that is best for the rest, so nothing it says about itself helps it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

from .forecasts import Forecast
from .observations import Observation, Observations
from .questions import GOAL, WAY, Question, question, relevant


@dataclass(frozen=True)
class Family:
    """A predictor and the settings that it can have.

    forecast: importable by name, where it is used by worker processes; takes one observation, one question and a setting.
    """

    name: str
    settings: tuple[Any, ...]
    forecast: Callable[[Observation, Question, Any], Forecast]


Pairs = list[tuple[Observation, Question]]


def asked(recording: Observations) -> Pairs:
    """Return what one set of parameters is fitted to: the ways asked about; in a scene where none ever is, the goals."""
    return asked_about(recording, WAY) or asked_about(recording, GOAL)


def asked_about(recording: Observations, name: str) -> Pairs:
    """Return a question with each prediction that it can be put to."""
    matters = relevant(recording)
    pairs = ((seen, question(name, seen, matters)) for seen in recording.each)
    return [(seen, each) for seen, each in pairs if each is not None]


def log_likelihoods(pairs: Sequence[tuple[Observation, Question]], family: Family) -> Array:
    """Return the sum of log-likelihoods of what came true, for each setting of a family, (s,)."""
    return np.array([sum(np.log(family.forecast(*pair, setting).true(pair[1])) for pair in pairs) for setting in family.settings])


def chosen(table: Array, groups: Sequence[Hashable]) -> NDArray[np.intp]:
    """Return the setting (r,) for each recording: the best for all recordings of other groups, the first of equals.

    table (r, s): log-likelihoods. groups: of each recording; every one its own: leave-one-recording-out. With one
    group alone there is nobody to learn from, and all are used.
    """
    places = {group: [row for row, each in enumerate(groups) if each == group] for group in dict.fromkeys(groups)}
    total = table.sum(axis=0)
    best = {
        group: int((total - table[rows].sum(axis=0) if len(places) > 1 else total).argmax()) for group, rows in places.items()
    }
    return np.array([best[group] for group in groups], dtype=np.intp)
