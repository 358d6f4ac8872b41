# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the predictor itself, each setting of which needs replays: a race of settings.

A setting has two scores, means over the recordings. The score of classes is the log-likelihood of the homotopy class that was
taken plus that of the gap taken in the next row, on which assistance acts first, or without obstacles that of the goal. The score
of positions is the log-density of the true ones 0.25, 0.5 and 1 s ahead under the mixture of the candidates, by which settings
are ranked that are alike in classes. What needs no replay, the parameters of the likelihood and the widening of the covariance,
is at its best for each setting. The race is successive halving (Jamieson and Talwalkar 2016, arXiv:1502.07943): all settings
predict a few recordings, the better half of them twice as many, and so on. The given setting stays unless another one is better
by more than chance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from foc_ros.analysis.evaluation.baselines import Forecast, power_rule_shares
from foc_ros.analysis.evaluation.observations import GAP, ask_all, ask_main, observe
from foc_ros.analysis.evaluation.scores import SEED, resample
from foc_ros.analysis.evaluation.truth import RecordedHand
from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import ARRIVALS, Config, flatten, replace_values
from foc_ros.core.types import Array

from . import Estimate, Findings, clip_to_bounds
from .direct import CONSTANTS, fit_duration
from .one_replay import FEW_WIDENINGS, RULES, compute_mean_densities

NOISES, DURATIONS = (0.06, 0.25, 2.0), (0.7, 1.4, 2.0)
"""Factors tried beside 1."""
ETAS = (0.7, 0.5, 0.95)
FIRST = 6
"""Recordings that all settings predict."""
MAX_RECORDINGS = 48
"""Recordings in which settings are compared; more make no difference that counts."""
CONFIDENT = 0.95
"""Probability with which a setting is better than the given one, and share of the resamples with which a choice is sure."""
Key = tuple[str, int]
"""A prediction: recording and stamp [ns]."""


def make_noise_settings(config: Config) -> list[Config]:
    """Return the configuration, and it with other noise."""
    return [config, *(_scale(config, ('foc.noise_x', 'foc.noise_y'), factor) for factor in NOISES)]


def make_eta_settings(config: Config, may_be_lower: bool) -> list[Config]:
    """Return the configuration, and it with other probabilities of avoiding; may_be_lower: than the given one."""
    etas = [config.foc.eta, *(eta for eta in ETAS if may_be_lower or eta > config.foc.eta)]
    return [replace_values(config, {'foc.eta': eta}) for eta in dict.fromkeys(etas)]


def make_movement_settings(hands: Sequence[RecordedHand], config: Config) -> list[Config]:
    """Return every combination of model, duration, arrival and whether accelerations fade, the given one first.

    Where a goal that is passed is modelled as one where the hand stops, no duration is right.
    """
    models = [config]
    if config.duration.model != 'fitts':
        fitts = replace_values(config, {'duration.model': 'fitts'})
        models.append(replace_values(fitts, fit_duration(hands, fitts).values))
    arrivals = dict.fromkeys([config.duration.arrival, *ARRIVALS])
    fading_times = dict.fromkeys([config.estimator.acceleration_time_s, 0.0])
    return [
        replace_values(
            _scale(model, CONSTANTS[model.duration.model], factor),
            {'duration.arrival': arrival, 'estimator.acceleration_time_s': fading_s},
        )
        for model, factor, arrival, fading_s in product(models, (1.0, *DURATIONS), arrivals, fading_times)
    ]


def _scale(config: Config, names: Iterable[str], factor: float) -> Config:
    before = flatten(config)
    return replace_values(config, {name: clip_to_bounds(name, factor * float(before[name])) for name in names})


class ReplayScores(NamedTuple):
    """Log-likelihoods of predictions, of classes above uniform, each under all parameters that need no replay, (q,) [nat]."""

    classes: dict[Key, Array]
    positions: dict[Key, Array]


@dataclass
class Replays:
    """Replays of recordings under settings, each made once; thinned: parameters of these replays alone."""

    recordings: Mapping[str, Recording]
    thinned: Mapping[str, object]
    _known: dict[tuple[Config, str], ReplayScores] = field(default_factory=dict)

    def score(self, settings: Sequence[Config], names: Sequence[str], description: str) -> Array:
        """Return the scores of settings in recordings, of classes and of positions, (2, s, n) [nat]; description: for a bar.

        A prediction that a setting could not make counts as the worst of the others', of classes at most as a uniform guess.
        """
        missing = [key for key in product(settings, names) if key not in self._known]
        items = [
            (f'{name} {number}', (number, self.recordings[name], setting, self.thinned))
            for number, (setting, name) in enumerate(missing)
        ]
        found = dict(collect(_score_replay, items, description)[0])
        self._known |= {key: found.get(number, ReplayScores({}, {})) for number, key in enumerate(missing)}
        # by kind and setting, the log-likelihoods of all predictions
        classes, positions = zip(*(self._gather(setting, names) for setting in settings), strict=True)
        return np.array([_average_by_recording(classes, 0.0, names), _average_by_recording(positions, np.inf, names)])

    def _gather(self, setting: Config, names: Sequence[str]) -> list[dict[Key, float]]:
        """Return the log-likelihoods of classes and of positions under the parameters best for all predictions of a setting."""
        best = []
        for kind in zip(*(self._known[setting, name] for name in names), strict=True):
            rows = {key: row for each in kind for key, row in each.items()}
            column = int(np.sum(list(rows.values()), axis=0).argmax()) if rows else 0
            best.append({key: float(row[column]) for key, row in rows.items()})
        return best


def _score_replay(item: tuple[int, Recording, Config, Mapping[str, object]]) -> tuple[int, ReplayScores]:
    number, given, config, thinned = item
    config = replace_values(config, thinned)
    recording, found = observe(given, config, with_plans=True), ReplayScores({}, {})
    gaps = {observation.stamp_ns: question for observation, question in ask_all(recording, GAP)}
    for observation, question in ask_main(recording):
        shares, logs = [power_rule_shares(observation, rule) for rule in RULES], np.zeros(len(RULES))
        for asked in filter(None, (question, gaps.get(observation.stamp_ns))):
            probabilities = [Forecast.from_shares(each, asked).true_probability(asked) for each in shares]
            logs += np.log(np.multiply(probabilities, asked.possible))
        found.classes[recording.name, observation.stamp_ns] = logs
    for observation in recording.observations:
        densities = compute_mean_densities(observation, observation.candidates.mixture, FEW_WIDENINGS)
        if densities is not None:
            found.positions[recording.name, observation.stamp_ns] = densities
    return number, found


def _average_by_recording(found: Sequence[Mapping[Key, float]], most: float, names: Sequence[str]) -> Array:
    """Return the means (s, n) over the predictions of each recording; most: what a missing prediction counts at most."""
    keys = sorted({key for each in found for key in each})
    table = np.array([[each.get(key, np.nan) for key in keys] for each in found])
    table = np.where(np.isnan(table), np.minimum(np.nanmin(table, axis=0), most), table)
    recording = np.array([names.index(name) for name, _ in keys], dtype=np.intp)
    counts = np.maximum(np.bincount(recording, minlength=len(names)), 1)
    return np.array([np.bincount(recording, row, len(names)) / counts for row in table])


def search_settings(stage: str, settings: Sequence[Config], replays: Replays) -> Findings:
    """Return what is new in the best of some settings, of which the first is the given one; stage: words of a progress bar."""
    finalists, scores = race(stage, settings, replays)
    best, winners = rank(scores)[0], list(range(len(finalists)))
    if scores.shape[2] > 1:  # else any of them may be the best by chance
        winners = resample(lambda rows: rank(scores[:, :, rows])[0], scores.shape[2]).astype(int).tolist()
    if not is_better(scores[:, best], scores[:, 0]):
        best = 0
    return _describe_choice(finalists[best], settings, [finalists[each] for each in winners])


def _describe_choice(chosen: Config, settings: Sequence[Config], winners: Sequence[Config]) -> Findings:
    """Return what a chosen setting says of the parameters in which the settings differ; winners: the best of each resample."""
    tried, drawn = [flatten(each) for each in settings], [flatten(each) for each in winners]
    after, found = flatten(chosen), Findings()
    others = {name for model, names in CONSTANTS.items() for name in names if model != after['duration.model']}
    for name, value in after.items():
        before = tried[0][name]
        if name in others or all(each[name] == before for each in tried):
            continue
        share = float(np.mean([each[name] == value for each in drawn]))
        if value == before and share < CONFIDENT:
            found.undetermined[name] = 'no other value tried is better by more than chance'
        elif isinstance(value, str):
            found.chosen |= {name: value} if value != before else {}
        else:
            # of another model of duration, a constant has no other values
            values = [float(each[name]) for each in drawn if each['duration.model'] == after['duration.model']] or [float(value)]
            found.estimates[name] = Estimate.from_resamples(float(value), values, 'predicted positions and paths')
        if value != before and share < CONFIDENT:
            found.warnings.append(f'{name}: {value} is the best, but only in {100 * share:.0f} % of the resamples')
    return found


def race(stage: str, settings: Sequence[Config], replays: Replays) -> tuple[list[Config], Array]:
    """Return the finalists, the given one first, with their scores."""
    names, left, count = sample_names(list(replays.recordings)), list(settings), FIRST
    while True:
        scores = replays.score(left, names[:count], f'{stage}, {len(left)} settings')
        if count >= len(names) or len(left) == 1:
            return left, scores
        kept = {0, *rank(scores)[: max(-(-len(left) // 2), 4)]}
        left, count = [left[index] for index in sorted(kept)], 2 * count


def sample_names(names: Sequence[str]) -> list[str]:
    """Return at most `MAX_RECORDINGS` names, of which every beginning is a fair sample, however the recordings were ordered."""
    return [names[index] for index in np.random.default_rng(SEED).permutation(len(names))[:MAX_RECORDINGS]]


def rank(scores: Array) -> list[int]:
    """Return the settings from the best to the worst: those alike in classes by positions, then the others by classes.

    Alike are those within one standard error (Breiman et al. 1984).
    """
    classes, positions = scores.mean(axis=2)
    behind = scores[0, classes.argmax()] - scores[0]
    is_behind = behind.mean(axis=1) > behind.std(axis=1) / np.sqrt(scores.shape[2])
    order: list[int] = np.lexsort((-classes, np.where(is_behind, 0.0, -positions), is_behind)).tolist()
    return order


def is_better(scores: Array, given: Array) -> bool:
    """Return whether a setting beats the given one in classes or in positions (2, n), by more than chance (Student's t)."""
    difference, n = scores - given, scores.shape[1]
    if n < 2:
        return False
    error = difference.std(axis=1, ddof=1) / np.sqrt(n)
    return bool((difference.mean(axis=1) > stdtrit(n - 1, CONFIDENT) * error).any())
