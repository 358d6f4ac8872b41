"""The parameters of the likelihood, from one replay: every setting tried on every recording once.

So the cross-validation is exact: held out, a recording, or all that took the same way, is judged by the setting that is best for
the others. Of the likelihood's two forms the plain one stays unless the one that looks ahead is better held out by a margin.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np

from foc_ros.analysis.evaluation.families import power_rules
from foc_ros.analysis.evaluation.forecasts import Forecast, of_shares, power_rule
from foc_ros.analysis.evaluation.heldout import Family, asked, chosen, log_likelihoods
from foc_ros.analysis.evaluation.observations import Observation, Observations
from foc_ros.analysis.evaluation.questions import Question
from foc_ros.analysis.evaluation.workers import Failure, run
from foc_ros.core.config import Config, LikelihoodConfig
from foc_ros.core.errors import RecordingError
from foc_ros.core.types import Array
from foc_ros.io.terminal import track

from .densities import Doubt
from .estimates import Estimate
from .resampling import CENTRAL, resamples

MARGIN_NAT = 0.02
"""By how much per prediction the likelihood that looks ahead has to be better, held out."""
UNTOLD_NAT = 2.0
"""Settings whose log-likelihoods together are less than this below the best are not told from it: the 95 % of chi-square / 2."""
NAMES = ('likelihood.beta', 'likelihood.spent_share', 'likelihood.lookahead_s')
MISSED = 0.1
"""Share of predictions without the way taken among their candidates that is told."""


@dataclass(frozen=True)
class Table:
    """Mean log-likelihood, or log-density, per prediction of each recording under each setting (n, s); nan: nothing was asked."""

    values: Array
    settings: tuple[LikelihoodConfig | Doubt, ...]

    def best(self, columns: Sequence[int]) -> int:
        """Return the best of some settings for all recordings."""
        return int(columns[int(np.nansum(self.values[:, columns], axis=0).argmax())])

    def held_out(self, columns: Sequence[int], groups: Sequence[Hashable]) -> Array:
        """Return the log-likelihood of each recording (n,) under the setting that is best for the other groups."""
        values = np.nan_to_num(self.values[:, columns])
        picked = values[np.arange(len(values)), chosen(values, groups)]
        return np.where(np.isnan(self.values[:, 0]), np.nan, picked)

    def resampled(self, columns: Sequence[int]) -> list[int]:
        """Return the best setting of each resample of the recordings."""
        return [columns[place] for place in (resamples(len(self.values)) @ np.nan_to_num(self.values[:, columns])).argmax(axis=1)]


def choice_table(observations: Sequence[Observations], config: Config, executor: Executor) -> Table:
    """Try every setting of the likelihood on every recording; the settings given are the first."""
    settings = (config.likelihood, *power_rules(config.likelihood))
    family = Family('foc', settings, forecast)
    items = [(each.name, each) for each in observations]
    rows = []
    for name, row in track(run(partial(_row, family=family), items, executor), 'likelihood', len(items)):
        if isinstance(row, Failure):
            raise RecordingError(f'{name}: {row.reason}')
        rows.append(row)
    return Table(np.array(rows), settings)


def forecast(seen: Observation, question: Question, setting: LikelihoodConfig) -> Forecast:
    """Return what the node would foretell with a setting."""
    return of_shares(power_rule(seen, setting), question)


def _row(recording: Observations, family: Family) -> Array:
    pairs = asked(recording)
    return log_likelihoods(pairs, family) / len(pairs) if pairs else np.full(len(family.settings), np.nan)


def uniform(observations: Sequence[Observations]) -> Array:
    """Return the mean log-likelihood of the uniform guess in each recording, (n,); nan: nothing was asked."""
    opened = [[-math.log(question.open) for _, question in asked(each)] for each in observations]
    return np.array([np.mean(each) if each else np.nan for each in opened])


def classes(observations: Sequence[Observations]) -> list[Hashable]:
    """Return the way that each recording took."""
    found: list[Hashable] = []
    for recording in observations:
        pairs = asked(recording)
        found.append(pairs[0][1].answers[pairs[0][1].truth] if pairs else recording.name)
    return found


def unheard(observations: Sequence[Observations]) -> list[str]:
    """Return a warning where the way taken is often not among the candidates: then the likelihood is fitted to the others."""
    questions = [question for recording in observations for _, question in asked(recording)]
    missed = float(np.mean([question.truth not in question.given for question in questions]))
    if missed <= MISSED:
        return []
    words = 'the way taken is not among the candidates; the exponent is fitted to what is left: raise homotopy.max_candidates'
    return [f'likelihood.beta: in {100 * missed:.0f} % of the predictions {words}']


def plain_or_ahead(table: Table, groups: Sequence[Hashable]) -> list[int]:
    """Return the columns of the form of likelihood that is better held out; the plain one, unless the other is clearly better."""
    looking = [isinstance(each, LikelihoodConfig) and each.lookahead_s > 0.0 for each in table.settings]
    plain = [place for place, ahead in enumerate(looking) if place and not ahead]
    ahead = [place for place, ahead in enumerate(looking) if place and ahead]
    gain = np.nanmean(table.held_out(ahead, groups)) - np.nanmean(table.held_out(plain, groups))
    return ahead if gain > MARGIN_NAT else plain


def likelihood_estimates(table: Table, columns: Sequence[int]) -> tuple[dict[str, Estimate], list[str]]:
    """Return the estimates of the likelihood's parameters, and warnings in words."""
    best = table.settings[table.best(columns)]
    assert isinstance(best, LikelihoodConfig)
    drawn = [table.settings[place] for place in table.resampled(columns)]
    total = np.nansum(table.values[:, columns], axis=0)
    alike = [table.settings[columns[place]] for place in np.flatnonzero(total > total.max() - UNTOLD_NAT).tolist()]
    estimates, warnings = {}, []
    for name in NAMES:
        leaf = name.partition('.')[2]
        values = [float(getattr(each, leaf)) for each in drawn]
        low, high = np.percentile(values, CENTRAL)
        estimates[name] = Estimate(name, float(getattr(best, leaf)), float(low), float(high), 'likelihood of the ways taken')
        reach = [float(getattr(each, leaf)) for each in alike]
        tried = {float(getattr(table.settings[place], leaf)) for place in columns}
        if len(tried) > 1 and {min(reach), max(reach)} == {min(tried), max(tried)}:
            warnings.append(
                f'{name}: the recordings do not tell it: from {min(reach):.3g} to {max(reach):.3g}, all that was tried, '
                f'explains the ways within {UNTOLD_NAT:g} nat, other parameters following it'
            )
    return estimates, warnings
