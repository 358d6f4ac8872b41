"""The parameters of the likelihood, from one replay: every setting is tried on every recording once.

So the cross-validation is exact: a recording, or all that took the same path class, is held out and scored with the setting that
is best for the others. The plain form of the likelihood, with one exponent for all choices, stays unless one in which near and
far choices differ is better held out by a margin.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.baselines import Baseline, forecast_shares, is_plain, make_power_rules
from foc_ros.analysis.evaluation.cross_validation import compute_log_likelihoods
from foc_ros.analysis.evaluation.forecasts import power_rule_shares
from foc_ros.analysis.evaluation.observations import ObservedRecording
from foc_ros.analysis.evaluation.questions import ask_main
from foc_ros.analysis.parallel import collect_all
from foc_ros.core.config import Config
from foc_ros.core.types import Array

from .estimates import Estimate, Estimates
from .resampling import SettingTable

MARGIN_NAT = 0.02
"""By how much per prediction, held out, a likelihood in which near and far choices differ has to be better."""
INDISTINCT_NAT = 2.0
"""Settings whose total log-likelihood is less than this below the best are not distinguished: 95 % of chi-square, halved."""
NAMES = tuple(f'likelihood.{each}' for each in ('beta', 'planning_horizon_s', 'lookahead_s', 'weaving'))
MISSED = 0.1
"""Share of predictions without the true class among their candidates above which there is a warning."""


def tabulate_likelihoods(recordings: Sequence[ObservedRecording], config: Config, executor: Executor) -> SettingTable:
    """Try every setting of the likelihood on every recording; the given settings are the first."""
    settings = (config.likelihood, *make_power_rules(recordings, config.likelihood))
    rule = Baseline('foc', partial(forecast_shares, power_rule_shares), settings)
    rows = collect_all(partial(_tabulate, rule=rule), [(each.name, each) for each in recordings], executor, 'likelihood')
    return SettingTable(np.array(rows), settings)


def _tabulate(recording: ObservedRecording, rule: Baseline) -> Array:
    questions = ask_main(recording)
    return compute_log_likelihoods(questions, rule) / len(questions) if questions else np.full(len(rule.settings), np.nan)


def warn_of_missed_classes(recordings: Sequence[ObservedRecording]) -> list[str]:
    """Return a warning where the true class is often not among the candidates, so that the likelihood is fitted to the rest."""
    questions = [question for recording in recordings for _, question in ask_main(recording)]
    missed = float(np.mean([question.truth not in question.given for question in questions]))
    if missed <= MISSED:
        return []
    words = 'the class taken is not among the candidates; the exponent is fitted to the others: raise homotopy.max_candidates'
    return [f'likelihood.beta: in {100 * missed:.0f} % of the predictions {words}']


def choose_form(table: SettingTable, groups: Sequence[Hashable]) -> list[int]:
    """Return the columns of the form of the likelihood that is better held out; the plain one if the gain is small."""
    columns = range(1, len(table.settings))
    forms = [
        [each for each in columns if is_plain(table.settings[each]) == has_one_exponent] for has_one_exponent in (True, False)
    ]
    plain, ahead = (table.score(table.choose_held_out(form, groups)) for form in forms)
    return forms[int(ahead - plain > MARGIN_NAT)]


def estimate_likelihood(table: SettingTable, columns: Sequence[int]) -> tuple[Estimates, list[str]]:
    """Return the estimates of the parameters of the likelihood, and warnings in words."""
    best = table.settings[table.find_best(columns)]
    resampled = [table.settings[column] for column in table.resample_best(columns)]
    total = np.nansum(table.values[:, columns], axis=0)
    alike = [table.settings[columns[index]] for index in np.flatnonzero(total > total.max() - INDISTINCT_NAT).tolist()]
    estimates, warnings = {}, []
    for name in NAMES:
        leaf = name.partition('.')[2]
        values = [float(getattr(each, leaf)) for each in resampled]
        estimates[name] = Estimate.from_resamples(name, float(getattr(best, leaf)), values, 'likelihood of the classes taken')
        indistinct = [float(getattr(each, leaf)) for each in alike]
        tried = {float(getattr(table.settings[column], leaf)) for column in columns}
        if len(tried) > 1 and {min(indistinct), max(indistinct)} == {min(tried), max(tried)}:
            warnings.append(
                f'{name}: the recordings do not determine it: all values tried, from {min(indistinct):.3g} to '
                f'{max(indistinct):.3g}, explain the classes taken within {INDISTINCT_NAT:g} nat if other parameters follow'
            )
    return estimates, warnings


def score_classes(
    table: SettingTable, columns: Sequence[int], recordings: Sequence[ObservedRecording], cross: bool
) -> dict[str, Any]:
    """Return mean log-likelihoods by how the setting was chosen; cross: also held out, by recording and by class taken."""
    questions = [ask_main(each) for each in recordings]
    uniform = [np.mean([-math.log(question.possible) for _, question in each]) for each in questions if each]
    scores = {
        'uniform': float(np.mean(uniform)),
        'as given': table.score(0),
        'fitted': table.score(table.find_best(columns)),
    }
    if cross:
        names = [each.name for each in recordings]
        taken = [each[0][1].answers[each[0][1].truth] if each else name for each, name in zip(questions, names, strict=True)]
        scores['without the recording'] = table.score(table.choose_held_out(columns, names))
        if len(set(taken)) > 1:
            scores['without its way'] = table.score(table.choose_held_out(columns, taken))
    return {'ways': scores}
