# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that need replays: of the predictor itself, in a race of settings; then those of the likelihood and the covariance.

**The race.** A setting has two scores, means over the recordings. The score of classes is the log-likelihood of the homotopy
class that was taken plus that of the gap taken in the next row, or without obstacles that of the goal. (Assistance acts on the
next gap first, and less chance is in it than in choices that the operator has yet to make.) The score of positions is the
log-density of the true ones 0.25, 0.5 and 1 s ahead under the mixture of the candidates, by which settings are ranked that are
alike in classes. Both are proper scores: no setting gains by claiming more or less than it knows. What needs no replay, the
parameters of the likelihood and the widening of the covariance, is at its best for each setting. The race is successive halving
(Jamieson and Talwalkar 2016, arXiv:1502.07943): all settings predict a few recordings, the better half of them twice as many,
and so on. The given setting stays unless another one is better by more than chance.

**One replay** is enough for the parameters of the likelihood, and for those that widen the covariance: process noise, scatter of
the end point, spread of the duration. The latter change nothing but covariances, so that all of them are tried on observations
with motor noise alone, by the density of the true positions under the mixture of the candidates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from foc_ros.analysis.evaluation.baselines import (
    Baseline,
    Forecast,
    forecast_shares,
    make_ahead,
    make_plain,
    power_rule_shares,
)
from foc_ros.analysis.evaluation.observations import (
    GAP,
    TIMES_S,
    Observation,
    ObservedRecording,
    ask_all,
    ask_main,
    interpolate_steps,
    observe,
)
from foc_ros.analysis.evaluation.scores import (
    EXACT,
    HORIZONS,
    SEED,
    compute_denser_share,
    compute_log_likelihoods,
    is_inside_ellipse,
    log_mixture_density,
    resample,
)
from foc_ros.analysis.parallel import collect, collect_all
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import ARRIVALS, WHOLE_WAY_S, Config, LikelihoodConfig, flatten, replace_values
from foc_ros.core.hand.duration import is_passing
from foc_ros.core.plant.replanning import triple_integrator_goal_map, triple_integrator_process_covariance
from foc_ros.core.types import Array

from . import Estimate, Findings, Setting, SettingTable, clip_to_bounds
from .direct import CONSTANTS, RecordedHand, fit_other_models

NOISES, DURATIONS = (0.06, 0.25, 2.0), (0.7, 1.4, 2.0)
"""Factors tried beside 1."""
ETAS = (0.7, 0.5, 0.95)
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
CONFIDENT = 0.95
"""Probability with which a setting is better than the given one, and share of the resamples with which a choice is sure."""
WORSE_NAT = 0.05
"""Loss of log-density of the true positions above which there is a warning."""
RULES = (
    *(make_plain(LikelihoodConfig(), beta) for beta in (0.5, 1.0, 2.0, 3.0, 6.0, 12.0)),
    *(
        make_ahead(LikelihoodConfig(), horizon, seconds, beta)
        for horizon, seconds, beta in product((0.0, 2.5), (0.0, 0.5, 1.0), (1.0, 2.0, 3.0, 6.0))
    ),
)
"""The likelihoods of which each setting gets its best. By a single one, settings that suit the others would lose."""
LIKELIHOODS = {
    'likelihood.beta': (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 16.0),
    'likelihood.planning_horizon_s': (0.0, 1.5, 2.5),
    'likelihood.lookahead_s': (0.0, 0.25, 0.5, 1.0, 2.0),
    'likelihood.weaving': (0.0, 1.0, 2.0, 4.0, 8.0),
}
"""Values that are tried, and the given ones; of the exponent also without a planning horizon."""
MISSED = 0.1
"""Share of predictions without the true class among their candidates above which there is a warning."""
PROCESS_NOISE, ENDPOINT_STDDEV, SPREAD = 'foc.process_noise', 'foc.endpoint_stddev', 'duration.spread'
WIDENINGS = {
    PROCESS_NOISE: (0.0, *np.geomspace(0.01, 100.0, 33).tolist()),
    ENDPOINT_STDDEV: (0.0, 1e-3, 2e-3, 3e-3, 4e-3, 6e-3, 8e-3, 12e-3, 16e-3, 24e-3, 32e-3, 48e-3, 72e-3, 0.11, 0.16),
    SPREAD: (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.9),
}
"""Values that are tried, and the given ones: process noises [m/s^2.5] from far below the jerk density of the filter to that of a
hand in free motion; scatter of the end [m], of which Fitts' law expects 48 mm for a target of 0.2 m."""
NO_WIDENING: Setting = dict.fromkeys(WIDENINGS, 0.0)
FEW_WIDENINGS = tuple(product((0.0, *WIDENINGS[PROCESS_NOISE][1::4]), (0.0, 3e-3, 8e-3, 24e-3, 72e-3), (0.0, 0.2, 0.4)))
"""Widenings whose best is good enough to compare predictions that differ in other parameters."""
COVERAGE_S, COVERAGE_LEVEL = 0.5, 0.9
"""Time ahead and probability of the ellipses and regions whose coverage is reported."""
FURTHEST = -30.0
"""Least log-density that counts [nat], so that one unexpected position does not rule the rest."""

Key = tuple[str, int]
"""A prediction: recording and stamp [ns]."""
Logs = dict[Key, Array]
"""Log-likelihoods of a prediction under each of the parameters that need no replay."""


def make_noise_settings(config: Config) -> list[Config]:
    """Return the configuration, and it with other noise."""
    return [config, *(_scale(config, {'foc.noise_x': 1.0, 'foc.noise_y': 1.0}, factor) for factor in NOISES)]


def make_eta_settings(config: Config, may_be_lower: bool) -> list[Config]:
    """Return the configuration, and it with other probabilities of avoiding; may_be_lower: than the given one."""
    etas = [eta for eta in ETAS if may_be_lower or eta > config.foc.eta]
    return list(dict.fromkeys([config, *(replace_values(config, {'foc.eta': eta}) for eta in etas)]))


def make_movement_settings(hands: Sequence[RecordedHand], config: Config) -> list[Config]:
    """Return every combination of model, duration, arrival and whether accelerations fade, the given one first.

    Where a goal that is passed is modelled as one where the hand stops, no duration is right, nor where an acceleration that
    lasts is modelled as one that fades.
    """
    models = [config, *fit_other_models(hands, config)]
    scaled = [_scale(each, CONSTANTS[each.duration.model], factor) for each, factor in product(models, (1.0, *DURATIONS))]
    arrivals = dict.fromkeys([config.duration.arrival, *ARRIVALS])
    fading_times = dict.fromkeys([config.estimator.acceleration_time_s, 0.0])
    return [
        replace_values(each, {'duration.arrival': arrival, 'estimator.acceleration_time_s': fading_s})
        for each, arrival, fading_s in product(scaled, arrivals, fading_times)
    ]


def _scale(config: Config, powers: Mapping[str, float], factor: float) -> Config:
    """Multiply each of the parameters by its power of a factor."""
    before = flatten(config)
    return replace_values(
        config, {name: clip_to_bounds(name, factor**power * float(before[name])) for name, power in powers.items()}
    )


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
    _known: dict[Config, dict[str, ReplayScores]] = field(default_factory=dict)

    def score(self, settings: Sequence[Config], names: Sequence[str], description: str) -> Array:
        """Return the scores of settings in named recordings, as of `compare_settings`; description: for the progress bar."""
        known = [self._known.setdefault(setting, {}) for setting in settings]
        missing = [(number, name) for number, done in enumerate(known) for name in names if name not in done]
        items = [
            (f'{name} {number}', (number, self.recordings[name], replace_values(settings[number], self.thinned)))
            for number, name in missing
        ]
        for number, name, found in collect(_score_replay, items, description)[0]:
            known[number][name] = found
        for number, name in missing:
            known[number].setdefault(name, ReplayScores())
        return compare_settings([[done[name] for name in names] for done in known], names)


def observe_by_motor_noise(
    recordings: Mapping[str, Recording], config: Config, description: str
) -> tuple[list[ObservedRecording], dict[str, str]]:
    """Replay recordings with motor noise alone; return the observations, and the reason of every failure by name."""
    return collect(partial(observe, config=replace_values(config, NO_WIDENING)), list(recordings.items()), description)


def _score_replay(item: tuple[int, Recording, Config]) -> tuple[int, str, ReplayScores]:
    number, recording, config = item
    return number, recording.name, score_observations(observe(recording, replace_values(config, NO_WIDENING)), config)


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


def search_settings(kind: str, settings: Sequence[Config], replays: Replays) -> tuple[Config, Findings]:
    """Return the best of some settings, of which the first is the given one, and what is new in it."""
    finalists, scores, first_scores = race(kind, settings, replays)
    best, given = rank(scores)[0], settings[0]
    winners = resample(lambda rows: rank(scores[:, :, rows])[0], scores.shape[2]).astype(int)
    if given in finalists and not is_better(scores[:, best], scores[:, finalists.index(given)]):
        best = finalists.index(given)
    before, after = flatten(given), flatten(finalists[best])
    others = {name for model, names in CONSTANTS.items() for name in names if model != after['duration.model']}
    drawn, found = [flatten(finalists[each]) for each in winners], Findings()
    tried = [flatten(each) for each in settings]
    for name, value in after.items():
        if name in others or all(each[name] == before[name] for each in tried):
            continue
        share = float(np.mean([each[name] == value for each in drawn]))
        if value == before[name] and share < CONFIDENT:
            found.undetermined[name] = 'no other value tried is better by more than chance'
        elif isinstance(value, str):
            found.chosen |= {name: value} if value != before[name] else {}
        else:
            # of another model of duration, a constant has no other values
            values = [float(each[name]) for each in drawn if each['duration.model'] == after['duration.model']] or [float(value)]
            found.estimates[name] = Estimate.from_resamples(name, float(value), values, 'predicted positions and classes')
        if value != before[name] and share < CONFIDENT:
            found.warnings.append(f'{name}: {value} is the best, but only in {100 * share:.0f} % of the resamples')
    positions = first_scores[1].mean(axis=1)
    if (loss := float(positions[0] - positions[settings.index(finalists[best])])) > WORSE_NAT:
        words = (
            'the setting that explains the classes best predicts positions worse: the mean log-density of the true ones falls by'
        )
        found.warnings.append(f'{kind}: {words} {loss:.2g} nat')
    return finalists[best], found


def race(kind: str, settings: Sequence[Config], replays: Replays) -> tuple[list[Config], Array, Array]:
    """Return the finalists, in the given order, with their scores as of `compare_settings`, and all scores of the first round."""
    names = sample_names(list(replays.recordings))
    left, count = list(settings), FIRST
    first_scores = scores = replays.score(left, names[:count], f'{kind} {len(left)}')
    while count < len(names) and len(left) > 1:
        is_behind = find_behind(scores, PLAINLY_WORSE)
        kept = {index for index in rank(scores)[: max(-(-len(left) // 2), FINALISTS)] if not is_behind[index]}
        if left[0] == settings[0] and not is_behind[0]:
            kept.add(0)
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


def is_better(scores: Array, given: Array) -> bool:
    """Return whether a setting is better than the given one, in classes or in positions, by more than chance (Student's t).

    scores, given (2, n): of classes and of positions.
    """
    difference, n = scores - given, scores.shape[1]
    if n < 2:
        return False
    error = difference.std(axis=1, ddof=1) / np.sqrt(n)
    return bool((difference.mean(axis=1) > stdtrit(n - 1, CONFIDENT) * error).any())


def fit_likelihood(recordings: Sequence[ObservedRecording], config: Config) -> tuple[Findings, dict[str, Any]]:
    """Return the parameters of the likelihood, from one replay of the recordings, and their scores.

    Scores `ways`: mean log-likelihoods by how the setting was chosen, with at least three recordings also held out, by recording
    and by the class taken. Empty where no class or goal is in question.
    """
    questions = [ask_main(each) for each in recordings]
    if not any(questions):
        reason = 'no recording has an obstacle to pass on one of two sides, or a second goal'
        return Findings(undetermined=dict.fromkeys(LIKELIHOODS, reason)), {}
    given = {name: float(getattr(config.likelihood, name.partition('.')[2])) for name in LIKELIHOODS}
    settings = _list_likelihoods(given)
    rules = [replace_values(config, each).likelihood for each in settings]
    rule = Baseline('foc', partial(forecast_shares, power_rule_shares), tuple(rules))
    rows = collect_all(partial(_tabulate_classes, rule=rule), [(each.name, each) for each in recordings], 'likelihood')
    table = SettingTable(np.array(rows), settings)
    found, columns = table.estimate(given, 'likelihood of the classes taken')
    missed = float(np.mean([question.truth not in question.given for each in questions for _, question in each]))
    if missed > MISSED:
        words = 'the class taken is not among the candidates; the exponent is fitted to the others: raise homotopy.max_candidates'
        found.warnings.append(f'likelihood.beta: in {100 * missed:.0f} % of the predictions {words}')
    uniform = [np.mean([-np.log(question.possible) for _, question in each]) for each in questions if each]
    scores = {'uniform': float(np.mean(uniform)), 'as given': table.score(0), 'fitted': table.score(table.find_best(columns))}
    if is_cross_validated(recordings):
        names = [each.name for each in recordings]
        taken = [each[0][1].answers[each[0][1].truth] if each else name for each, name in zip(questions, names, strict=True)]
        scores['without the recording'] = table.score(table.choose_held_out(columns, names))
        if len(set(taken)) > 1:
            scores['without its way'] = table.score(table.choose_held_out(columns, taken))
    return found, {'ways': scores}


def is_cross_validated(recordings: Sequence[object]) -> bool:
    """Return whether there are enough recordings to hold one out."""
    return len(recordings) >= 3


def _list_likelihoods(given: Setting) -> tuple[Setting, ...]:
    """Return the settings of the likelihood that are tried, the given one first."""
    values = [dict.fromkeys((given[name], *tried)) for name, tried in LIKELIHOODS.items()]
    ahead = [dict(zip(LIKELIHOODS, each, strict=True)) for each in product(*values)]
    plain = [{**given, 'likelihood.beta': beta, 'likelihood.planning_horizon_s': WHOLE_WAY_S} for beta in values[0]]
    return (*ahead, *plain)


def _tabulate_classes(recording: ObservedRecording, rule: Baseline) -> Array:
    questions = ask_main(recording)
    return compute_log_likelihoods(questions, rule) / len(questions) if questions else np.full(len(rule.settings), np.nan)


def fit_widening(recordings: Sequence[ObservedRecording], config: Config) -> tuple[Findings, dict[str, Any]]:
    """Return the parameters that widen the covariance, from a replay with motor noise alone, and scores.

    Scores: mean log-densities and coverage by how the widening was chosen, with at least three recordings also held out.
    """
    before = flatten(config)
    given = {name: float(before[name]) for name in WIDENINGS}
    axes = [dict.fromkeys((0.0, given[name], *tried)) for name, tried in WIDENINGS.items()]
    settings = tuple(dict(zip(WIDENINGS, each, strict=True)) for each in product(*axes))
    widenings, rows = [tuple(each.values()) for each in settings], []
    for recording in recordings:
        densities = [
            compute_log_densities(each, power_rule_shares(each, config.likelihood), config, widenings)
            for each in recording.observations
        ]
        known = [each for each in densities if each is not None]
        rows.append(np.mean(known, axis=0) if known else np.full(len(settings), np.nan))
    table, n = SettingTable(np.array(rows), settings), len(recordings)
    found, columns = table.estimate(given, 'density of true positions')
    chosen = {'motor noise alone': np.zeros(n, dtype=np.intp), 'as given': np.full(n, settings.index(given))}
    chosen['fitted'] = np.full(n, table.find_best(columns))
    if is_cross_validated(recordings):
        chosen['without the recording'] = table.choose_held_out(columns, [each.name for each in recordings])
    coverage = {name: compute_coverage(recordings, config, [widenings[each] for each in chosen[name]]) for name in chosen}
    return found, {
        'positions': {name: table.score(each) for name, each in chosen.items()},
        **{kind: {name: each[kind] for name, each in coverage.items()} for kind in ('inside_90', 'inside_all_90')},
    }


def compute_log_densities(
    observation: Observation, shares: Array, config: Config, widenings: Iterable[Sequence[float]]
) -> Array | None:
    """Return the log-density of the true positions, mean over the horizons, under each widening, (q,) [nat, metres].

    shares (k,): of the candidates; config: of the replay; widenings: values of `WIDENINGS`. None where the movement ends before
    the first horizon or has not begun, because a hand at rest shows how long it waits, not how it moves.
    """
    true = observation.truth.positions[HORIZONS]
    known = np.isfinite(true[:, 0])
    counted = np.flatnonzero(shares > 0.0)
    if observation.movement_age_s == 0.0 or not known.any() or not len(counted):
        return None
    rows, times = np.ix_(counted, np.array(HORIZONS)[known])
    covariance = widen_covariances(observation, widenings, config)[:, rows, times] + EXACT * np.eye(2)
    offset = true[known] - observation.candidates.mean[rows, times]
    entries = covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1]
    return np.asarray(np.maximum(log_mixture_density(shares[counted], offset, *entries), FURTHEST).mean(axis=1))


def widen_covariances(observation: Observation, widenings: Iterable[Sequence[float]], config: Config) -> Array:
    """Return the covariance (q, k, h, 2, 2) [m^2] of the candidates' positions at `TIMES_S` with each widening."""
    candidates, late, squares = observation.candidates, observation.candidates.duration_sensitivity, np.array(widenings) ** 2
    unit = np.array([_compute_unit_variances(float(time_s), config) for time_s in candidates.time_s])
    both = np.tensordot(squares[:, :2], unit, (1, 1))
    spread = np.multiply.outer(squares[:, 2], late[..., :, None] * late[..., None, :])
    return np.asarray(candidates.covariance + both[..., None, None] * np.eye(2) + spread)


def _compute_unit_variances(time_s: float, config: Config) -> Array:
    """Return the variance of a position at `TIMES_S` by process noise and by scatter of the end, of 1 each, (2, h)."""
    steps = config.foc.steps
    kind = time_s / steps, steps, is_passing(config.duration)
    jerk, end = triple_integrator_process_covariance(*kind), triple_integrator_goal_map(*kind) ** 2
    return np.array([interpolate_steps(each[:, 0, 0], kind[0]) for each in (jerk, end)])


def compute_coverage(
    recordings: Sequence[ObservedRecording], config: Config, widenings: Sequence[Sequence[float]]
) -> dict[str, float | None]:
    """Return the shares of true positions of moving hands after 0.5 s inside 90 % ellipses and regions.

    inside_90: the ellipse of the likeliest candidate; inside_all_90: the smallest region of all candidates; widenings (n,): for
    each recording, so that each can be judged by one that it did not influence.
    """
    time, counted = TIMES_S.index(COVERAGE_S), []
    for recording, widening in zip(recordings, widenings, strict=True):
        for each in recording.observations:
            if each.movement_age_s > 0.0 and np.isfinite(each.truth.positions[time, 0]):
                shares = power_rule_shares(each, config.likelihood)
                covariance, row = widen_covariances(each, [widening], config)[0], int(shares.argmax())
                likeliest = is_inside_ellipse(each.truth.positions - each.candidates.mean[row], covariance[row], COVERAGE_LEVEL)
                is_inside_region = compute_denser_share(each, shares, covariance) < COVERAGE_LEVEL
                counted.append((likeliest[time], float(is_inside_region[time])))
    one, together = np.mean(counted, axis=0).tolist() if counted else (None, None)
    return {'inside_90': one, 'inside_all_90': together}
