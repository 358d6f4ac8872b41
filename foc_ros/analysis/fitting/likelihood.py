# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the likelihood, for which one replay of the recordings is enough."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.baselines import Baseline, forecast_shares, make_ahead, make_plain, power_rule_shares
from foc_ros.analysis.evaluation.observations import ObservedRecording
from foc_ros.analysis.evaluation.questions import ask_main
from foc_ros.analysis.evaluation.scores import compute_log_likelihoods
from foc_ros.analysis.parallel import collect_all
from foc_ros.core.config import WHOLE_WAY_S, Config, LikelihoodConfig, replace_values
from foc_ros.core.types import Array

from . import Findings, Setting, SettingTable, is_cross_validated, list_settings

RULES = (
    *(make_plain(LikelihoodConfig(), beta) for beta in (0.5, 1.0, 2.0, 3.0, 6.0, 12.0)),
    *(
        make_ahead(LikelihoodConfig(), horizon, seconds, beta)
        for horizon, seconds, beta in product((0.0, 2.5), (0.0, 0.5, 1.0), (1.0, 2.0, 3.0, 6.0))
    ),
)
"""The likelihoods of which each setting of the race gets its best. By a single one, settings that suit the others would lose."""
LIKELIHOODS = {
    'likelihood.beta': (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 16.0),
    'likelihood.planning_horizon_s': (0.0, 1.5, 2.5),
    'likelihood.lookahead_s': (0.0, 0.25, 0.5, 1.0, 2.0),
    'likelihood.weaving': (0.0, 1.0, 2.0, 4.0, 8.0),
}
"""Values that are tried, and the given ones; of the exponent also without a planning horizon."""
MISSED = 0.1
"""Share of predictions without the true class among their candidates above which there is a warning."""


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
    names = [each.name for each in recordings]
    scores = {'uniform': float(np.mean(uniform))}
    scores |= {how: table.score(each) for how, each in table.list_choices(given, columns, names).items()}
    if is_cross_validated(recordings):
        taken = [each[0][1].answers[each[0][1].truth] if each else name for each, name in zip(questions, names, strict=True)]
        if len(set(taken)) > 1:
            scores['without its way'] = table.score(table.choose_held_out(columns, taken))
    return found, {'ways': scores}


def _list_likelihoods(given: Setting) -> tuple[Setting, ...]:
    """Return the settings of the likelihood that are tried, the given one first."""
    ahead = list_settings({name: (given[name], *tried) for name, tried in LIKELIHOODS.items()})
    betas = dict.fromkeys(each['likelihood.beta'] for each in ahead)
    plain = [{**given, 'likelihood.beta': beta, 'likelihood.planning_horizon_s': WHOLE_WAY_S} for beta in betas]
    return (*ahead, *plain)


def _tabulate_classes(recording: ObservedRecording, rule: Baseline) -> Array:
    questions = ask_main(recording)
    return compute_log_likelihoods(questions, rule) / len(questions) if questions else np.full(len(rule.settings), np.nan)
