"""Parameters of the predictor itself, by a race of settings: each replays recordings, and its predictions are scored.

A setting has two scores, means over the recordings. The score of classes is the log-likelihood of the homotopy class that was
taken plus that of the gap taken in the next row, or without obstacles that of the goal. (Assistance acts on the next gap first,
and less chance is in it than in choices that the operator has yet to make.) The score of positions is the log-density of the true
ones 0.25, 0.5 and 1 s ahead under the mixture of the candidates, by which settings are ranked that are alike in classes. Both are
proper scores: no setting gains by claiming more or less than it knows. What needs no replay, the parameters of the likelihood and
the widening of the covariance, is at its best for each setting.

The race is successive halving (Jamieson and Talwalkar 2016, arXiv:1502.07943): all settings predict a few recordings, the better
half of them twice as many, and so on. Settings that are hard to tell apart get the data, and plainly worse ones none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.evaluation.baselines import make_ahead, make_plain
from foc_ros.analysis.evaluation.bootstrap import CENTRAL, RESAMPLES, SEED
from foc_ros.analysis.evaluation.forecasts import Forecast, power_rule_shares
from foc_ros.analysis.evaluation.observations import ObservedRecording, observe
from foc_ros.analysis.evaluation.questions import GAP, ask_all, ask_main
from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config, LikelihoodConfig, flatten, replace_values
from foc_ros.core.types import Array

from .covariance_fit import FEW_WIDENINGS, NO_WIDENING, compute_log_densities
from .duration_fit import CONSTANTS
from .estimates import Estimate, Fit

FIRST = 6
"""Recordings that all settings predict."""
FINALISTS = 4
"""Settings that predict all recordings, unless they are plainly worse."""
MAX_RECORDINGS = 48
"""Recordings in which settings are compared; more make no difference that counts."""
PLAINLY_WORSE = 3.0
"""Standard errors by which a setting behind the best is plainly worse."""
ALIKE = 1.0
"""Standard errors within which settings are alike in classes, so that positions decide (Breiman et al. 1984)."""
WORSE_NAT = 0.05
"""Loss of log-density of the true positions above which there is a warning."""
CONFIDENT = 0.95
"""Share of the resamples below which a choice has a warning."""
RULES = (
    *(make_plain(LikelihoodConfig(), beta) for beta in (0.5, 1.0, 2.0, 3.0, 6.0, 12.0)),
    *(
        make_ahead(LikelihoodConfig(), horizon, seconds, beta)
        for horizon, seconds, beta in product((0.0, 2.5), (0.0, 0.5, 1.0), (1.0, 2.0, 3.0, 6.0))
    ),
)
"""The likelihoods of which each setting gets its best. By a single one, settings that suit the others would lose."""

Key = tuple[str, int]
"""A prediction: recording and stamp [ns]."""
Logs = dict[Key, Array]
"""Log-likelihoods of a prediction under each of the parameters that need no replay."""


@dataclass(frozen=True)
class ReplayScores:
    """Scores of one setting by prediction; uniform: log-likelihood of a uniform guess among the classes."""

    classes: Logs = field(default_factory=dict)
    positions: Logs = field(default_factory=dict)
    uniform: dict[Key, float] = field(default_factory=dict)


@dataclass
class Replays:
    """Replays of recordings under settings, each made once; thinned: parameters of these replays alone."""

    recordings: Mapping[str, Recording]
    thinned: Mapping[str, object]
    executor: Executor
    _known: dict[Config, dict[str, ReplayScores]] = field(default_factory=dict)

    def score(self, settings: Sequence[Config], names: Sequence[str], description: str) -> Array:
        """Return the scores of settings in named recordings, as of `compare_settings`; description: for the progress bar."""
        known = [self._known.setdefault(setting, {}) for setting in settings]
        missing = [(number, name) for number, done in enumerate(known) for name in names if name not in done]
        items = [
            (f'{name} {number}', (number, self.recordings[name], replace_values(settings[number], self.thinned)))
            for number, name in missing
        ]
        for number, name, found in collect(_score_replay, items, self.executor, description)[0]:
            known[number][name] = found
        for number, name in missing:
            known[number].setdefault(name, ReplayScores())
        return compare_settings([[done[name] for name in names] for done in known], names)


def observe_by_motor_noise(
    recordings: Mapping[str, Recording], config: Config, executor: Executor, description: str
) -> tuple[list[ObservedRecording], dict[str, str]]:
    """Replay recordings with motor noise alone; return the observations, and the reason of every failure by name."""
    return collect(partial(observe, config=_without_widening(config)), list(recordings.items()), executor, description)


def _without_widening(config: Config) -> Config:
    return replace_values(config, NO_WIDENING.parameters())


def _score_replay(item: tuple[int, Recording, Config]) -> tuple[int, str, ReplayScores]:
    number, recording, config = item
    return number, recording.name, score_observations(observe(recording, _without_widening(config)), config)


def score_observations(recording: ObservedRecording, config: Config) -> ReplayScores:
    """Score the predictions of one setting in a recording."""
    found = ReplayScores()
    gaps = {observation.stamp_ns: question for observation, question in ask_all(recording, GAP)}
    for observation, question in ask_main(recording):
        key = recording.name, observation.stamp_ns
        questions = [question, *([gaps[observation.stamp_ns]] if observation.stamp_ns in gaps else [])]
        shares = [power_rule_shares(observation, rule) for rule in RULES]
        found.classes[key] = np.sum(
            [[np.log(Forecast.from_shares(each, about).true_probability(about)) for each in shares] for about in questions],
            axis=0,
        )
        found.uniform[key] = -sum(np.log(about.possible) for about in questions)
    for observation in recording.observations:
        densities = compute_log_densities(observation, observation.candidates.mixture, config, FEW_WIDENINGS)
        if densities is not None:
            found.positions[recording.name, observation.stamp_ns] = densities
    return found


def compare_settings(settings: Sequence[Sequence[ReplayScores]], names: Sequence[str]) -> Array:
    """Return the scores of each setting in each recording, of classes and of positions, (2, s, n) [nat].

    settings: by setting and recording. A prediction that a setting could not make counts as the worst of those that others made
    in its place; of classes at most as a uniform guess.
    """
    uniform = {key: value for parts in settings for part in parts for key, value in part.uniform.items()}
    scores = np.zeros((2, len(settings), len(names)))
    for score, kind, most in zip(scores, ('classes', 'positions'), (uniform, {}), strict=True):
        best = [_take_best([getattr(part, kind) for part in parts]) for parts in settings]
        worst: dict[Key, float] = dict(most)
        for each in best:
            for key, value in each.items():
                worst[key] = min(value, worst.get(key, value))
        for column, name in enumerate(names):
            keys = sorted(key for key in worst if key[0] == name)
            if keys:
                score[:, column] = [np.mean([each.get(key, worst[key]) for key in keys]) for each in best]
    return scores


def _take_best(parts: Sequence[Logs]) -> dict[Key, float]:
    """Return the log-likelihoods under the parameters that are best for all predictions together."""
    rows = {key: row for part in parts for key, row in part.items()}
    if not rows:
        return {}
    index = int(np.sum(list(rows.values()), axis=0).argmax())
    return {key: float(row[index]) for key, row in rows.items()}


def search_settings(kind: str, settings: Sequence[Config], replays: Replays, fit: Fit) -> None:
    """Take the best of some settings into a fit; the first is the present one."""
    finalists, scores, first_scores = race(kind, settings, replays)
    n = scores.shape[2]
    draws = np.random.default_rng(SEED)
    resampled = [finalists[rank(scores[:, :, draws.integers(n, size=n)])[0]] for _ in range(RESAMPLES)]
    fit.config = best = finalists[rank(scores)[0]]
    positions = first_scores[1].mean(axis=1)
    if (loss := float(positions[0] - positions[settings.index(best)])) > WORSE_NAT:
        words = (
            'the setting that explains the classes best predicts positions worse: the mean log-density of the true ones falls by'
        )
        fit.warnings.append(f'{kind}: {words} {loss:.2g} nat')
    given, constants = flatten(settings[0]), [name for each in CONSTANTS.values() for name in each]
    for name, value in flatten(best).items():
        if name in constants and name not in CONSTANTS[best.duration.model]:
            continue
        if isinstance(value, str):
            _take_choice(name, value, str(given[name]), resampled, fit)
            continue
        alike = [each for each in settings if name not in constants or each.duration.model == best.duration.model]
        change = float(given[name]), float(value)
        _take_value(name, change, alike, [each for each in resampled if each in alike], fit)


def race(kind: str, settings: Sequence[Config], replays: Replays) -> tuple[list[Config], Array, Array]:
    """Return the finalists, in the given order, with their scores as of `compare_settings`, and all scores of the first round."""
    names = sample_names(list(replays.recordings))
    left, count = list(settings), FIRST
    first_scores = scores = replays.score(left, names[:count], f'{kind} {len(left)}')
    while count < len(names) and len(left) > 1:
        is_behind = find_behind(scores, PLAINLY_WORSE)
        kept = [index for index in rank(scores)[: max(-(-len(left) // 2), FINALISTS)] if not is_behind[index]]
        left, count = [left[index] for index in sorted(kept)], 2 * count
        scores = replays.score(left, names[:count], f'{kind} {len(left)}')
    return left, scores, first_scores


def sample_names(names: Sequence[str]) -> list[str]:
    """Return at most `MAX_RECORDINGS` names, of which every beginning is a fair sample, however the recordings were ordered."""
    return [names[index] for index in np.random.default_rng(SEED).permutation(len(names))[:MAX_RECORDINGS]]


def rank(scores: Array) -> list[int]:
    """Return the settings from the best to the worst: those alike in classes by positions, then the others by classes."""
    classes, positions = scores.mean(axis=2)
    is_behind = find_behind(scores, ALIKE)
    order: list[int] = np.lexsort((-classes, np.where(is_behind, 0.0, -positions), is_behind)).tolist()
    return order


def find_behind(scores: Array, errors: float) -> NDArray[np.bool_]:
    """Tell which settings are behind the best in classes by more than some standard errors."""
    classes = scores[0]
    behind = classes[classes.mean(axis=1).argmax()] - classes
    return np.asarray(behind.mean(axis=1) > errors * behind.std(axis=1) / np.sqrt(classes.shape[1]))


def _take_choice(name: str, value: str, given: str, resampled: Sequence[Config], fit: Fit) -> None:
    """Take a value that is no number."""
    if value != given:
        fit.chosen[name] = value
    if (share := float(np.mean([flatten(each)[name] == value for each in resampled]))) < CONFIDENT:
        fit.warnings.append(f'{name}: {value} is the best, but only in {100 * share:.0f} % of the resamples')


def _take_value(
    name: str, change: tuple[float, float], settings: Sequence[Config], resampled: Sequence[Config], fit: Fit
) -> None:
    """Take a number, if several were tried, or if it was fitted for the model of duration that was chosen.

    change: the number before and after.
    """
    tried, (given, value) = {float(flatten(each)[name]) for each in settings}, change
    if len(tried) == 1:
        if value != given:
            fit.estimates[name] = Estimate(name, value, math.nan, math.nan, 'measured durations')
        return
    low, high = np.percentile([float(flatten(each)[name]) for each in resampled], CENTRAL).tolist()
    if (low, high) == (min(tried), max(tried)):
        fit.warnings.append(f'{name}: resampled recordings agree with all values tried, from {low:.3g} to {high:.3g}')
    before, how = fit.estimates.get(name), 'predicted positions and classes'
    if before is not None:
        how = before.how if how in before.how else f'{before.how}, then {how}'
        low, high = (min(low, before.low), max(high, before.high)) if before.value == value else (low, high)
    fit.estimates[name] = Estimate(name, value, low, high, how)
