"""Parameters of the predictor itself, by replays: each setting replays the recordings, and what it foretold is scored.

A setting has two scores, means over the recordings: the log-likelihood of the way really taken, among the ways, and that of the
true positions 0.25, 0.5 and 1 s ahead, under the mixture of the candidates. Both are proper: no setting gains by claiming more or
less than it knows. In both, what needs no replay is at its own best for each setting: the likelihood's parameters, the doubt
about plans. Ways come first: of the settings that are within one standard error of the best in these (Breiman et al. 1984), the
one with the best positions is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from foc_ros.evaluation.forecasts import of_shares, power_rule
from foc_ros.evaluation.heldout import asked
from foc_ros.evaluation.observations import Observations
from foc_ros.evaluation.observe import observe
from foc_ros.evaluation.recordings import Recording
from foc_ros.evaluation.workers import collected
from foc_ros.foc.config import ARRIVALS, Config, LikelihoodConfig, flatten, updated
from foc_ros.foc.records import Array

from .densities import FEWER_DOUBTS, NO_DOUBT, log_densities
from .duration_fit import CONSTANTS
from .estimates import bounded

Key = tuple[str, int]
"""A prediction: recording and stamp [ns]."""
NOISE, ETA, ARRIVAL, MODEL, DURATION, ACCELERATION = 'noise', 'eta', 'arrival', 'model', 'duration', 'acceleration'
LEVELS = {
    NOISE: (0.06, 0.25, 2.0),
    ETA: (0.7, 0.5, 0.95),
    DURATION: (0.8, 1.25, 1.6, 2.0),
    ACCELERATION: (0.0, 0.05, 0.1, 0.2),
}
"""What is tried in turn: factors on noise and durations, values of the others."""
RULES = tuple(
    replace(LikelihoodConfig(), beta=beta, spent_share=share, lookahead_s=seconds)
    for seconds, beta, share in product((0.0, 0.35, 0.7), (0.5, 1.0, 2.0, 3.0, 6.0, 12.0), (1.0, 0.0))
)
"""The likelihoods of which each setting is judged by its best: by one alone, settings that suit the others would lose."""


@dataclass(frozen=True)
class Foretold:
    """The scores of one setting by prediction: of ways and positions, rows of log-likelihoods over what needs no replay."""

    ways: Mapping[Key, Array]
    positions: Mapping[Key, Array]


def observed(
    recordings: Mapping[str, Recording], config: Config, executor: Executor, words: str
) -> tuple[list[Observations], dict[str, str]]:
    """Replay recordings by motor noise alone; return the observations, and why others gave none, by name."""
    plain = updated(config, NO_DOUBT.parameters())
    return collected(partial(observe, config=plain), list(recordings.items()), executor, words)


def scored(observations: Sequence[Observations], config: Config) -> Foretold:
    """Score what one setting foretold."""
    ways, positions = {}, {}
    for recording in observations:
        for seen, question in asked(recording):
            ways[recording.name, seen.stamp_ns] = np.log(
                [of_shares(power_rule(seen, rule), question).true(question) for rule in RULES]
            )
        for seen in recording.each:
            row = log_densities(seen, seen.ways.likelihood, config, FEWER_DOUBTS)
            if row is not None:
                positions[recording.name, seen.stamp_ns] = row
    return Foretold(ways, positions)


def compared(settings: Sequence[Foretold], names: Sequence[str]) -> Array:
    """Return the scores of each setting in each recording, of ways and of positions, (2, s, n) [nat].

    A prediction that a setting could not make counts as the worst of those that others made in its place.
    """
    scores = np.zeros((2, len(settings), len(names)))
    for score, table in zip(scores, ([each.ways for each in settings], [each.positions for each in settings]), strict=True):
        best = [_best(each) for each in table]
        worst: dict[Key, float] = {}
        for each in best:
            for key, value in each.items():
                worst[key] = min(value, worst.get(key, value))
        for place, name in enumerate(names):
            keys = [key for key in worst if key[0] == name]
            if keys:
                score[:, place] = [np.mean([each.get(key, worst[key]) for key in keys]) for each in best]
    return scores


def preferred(scores: Array) -> int:
    """Return the setting to take, by scores as of `compared`."""
    ways, positions = scores
    behind = ways[ways.mean(axis=1).argmax()] - ways
    as_good = behind.mean(axis=1) <= behind.std(axis=1) / np.sqrt(ways.shape[1])
    return int(np.where(as_good, positions.mean(axis=1), -np.inf).argmax())


def _best(rows: Mapping[Key, Array]) -> dict[Key, float]:
    """Return the log-likelihoods at what is best for all of them together."""
    if not rows:
        return {}
    place = int(np.sum(list(rows.values()), axis=0).argmax())
    return {key: float(row[place]) for key, row in rows.items()}


def levels(kind: str, config: Config) -> list[Config]:
    """Return the configurations that are tried beside one."""
    if kind == ARRIVAL:
        return [updated(config, {'duration.arrival': each}) for each in ARRIVALS if each != config.duration.arrival]
    if kind == DURATION:
        return [_scaled(config, CONSTANTS[config.duration.model], factor) for factor in LEVELS[kind]]
    if kind == NOISE:
        return [_scaled(config, {'foc.noise_x': 1.0, 'foc.noise_y': 1.0}, factor) for factor in LEVELS[kind]]
    name = {ACCELERATION: 'estimator.acceleration_time_s', ETA: 'foc.eta'}[kind]
    return [changed for value in LEVELS[kind] if (changed := updated(config, {name: value})) != config]


def _scaled(config: Config, powers: Mapping[str, float], factor: float) -> Config:
    """Multiply each of the parameters by its power of a factor."""
    before = flatten(config)
    return updated(config, {name: bounded(name, factor**power * float(before[name])) for name, power in powers.items()})
