# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fitting: recordings of an operator enter; the parameters that explain them best leave.

What is tried is a table: every setting of a grid on every recording once. So the bootstrap over recordings and the
cross-validation are exact. A parameter that the recordings do not determine keeps its given value: where its profile, the best
log-likelihood over all other parameters, is flat, hardly better than at the given value, or best at the end of what was tried,
unless that is a bound of the parameter. Of fewer than `FEWEST` recordings only the filter is fitted, to which each sample tells
something; its intervals then hold all values that explain the samples as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.scores import CENTRAL, FEWEST, choose_held_out, resample
from foc_ros.core.config import list_parameters
from foc_ros.core.types import Array

BOUNDS = {parameter.name: parameter.bound for parameter in list_parameters()}
FLAT_NAT = 2.0
"""A profile that varies by less is flat: settings this far apart are not distinguished (95 % of chi-square, halved)."""
STAGES = 'noise', 'eta', 'movement', 'replay', 'likelihood', 'before', 'after'
"""What takes time, in its order. Without obstacles there is neither noise nor eta to fit, of few recordings no prediction."""
Setting = Mapping[str, float]
"""Values by dotted name."""


@dataclass(frozen=True)
class Estimate:
    """A fitted value, its 95 % interval by bootstrap over recordings, and its data."""

    value: float
    low: float
    high: float
    how: str

    @classmethod
    def from_resamples(cls, value: float, resampled: Array | Sequence[float], how: str) -> Estimate:
        """Return the estimate whose interval holds the value and the central values of a bootstrap, (b,)."""
        low, high = np.percentile(resampled, CENTRAL).tolist()
        return cls(value, min(low, value), max(high, value), how)


@dataclass
class Findings:
    """What one step of a fit found.

    chosen: values that are no numbers, by name; undetermined: why a parameter keeps its given value, by name; scores: as plain
    values.
    """

    estimates: dict[str, Estimate] = field(default_factory=dict)
    chosen: dict[str, str] = field(default_factory=dict)
    undetermined: dict[str, str] = field(default_factory=dict)
    scores: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def values(self) -> dict[str, float | str]:
        """The values that were found, by name."""
        return {name: each.value for name, each in self.estimates.items()} | self.chosen

    def take(self, later: Findings) -> None:
        """Add what a later step found; what an earlier step determined stays determined."""
        for name, each in later.estimates.items():
            before = self.estimates.get(name, each)
            how = each.how if before.how == each.how else f'{before.how}, then {each.how}'
            ends = (before.low, before.high) if before.value == each.value else (each.low, each.high)
            self.estimates[name] = replace(each, low=min(each.low, ends[0]), high=max(each.high, ends[1]), how=how)
        self.chosen |= later.chosen
        undetermined = self.undetermined | later.undetermined
        self.undetermined = {name: why for name, why in undetermined.items() if name not in self.values}
        self.scores |= later.scores
        self.warnings += later.warnings


def clip_to_bounds(name: str, value: float) -> float:
    """Return a value within the bounds of a parameter, rounded, so that a file reads well."""
    bound = BOUNDS[name]
    assert bound.low is not None and bound.high is not None
    return float(f'{min(max(value, bound.low), bound.high):.6g}')


def list_settings(values: Mapping[str, Iterable[float]]) -> tuple[Setting, ...]:
    """Return all combinations of values by name, each value once."""
    return tuple(dict(zip(values, each, strict=True)) for each in product(*map(dict.fromkeys, values.values())))


@dataclass(frozen=True)
class SettingTable:
    """Log-likelihoods, or log-densities, of n recordings under s settings (n, s) [nat]; nan where nothing is known.

    Predictions within a recording are not independent: their mean counts as one observation.
    """

    values: Array
    settings: tuple[Setting, ...]

    @classmethod
    def from_errors(cls, errors: Array, settings: Sequence[Setting]) -> SettingTable:
        """Return the table of mean absolute errors (n, s), by Laplace's distribution of the scale of the best."""
        scale = max(float(errors.mean(axis=0).min()), 1e-9)
        return cls(-errors / scale, tuple(settings))

    @property
    def best(self) -> Setting:
        """The setting that is best for all recordings, the first of equal ones."""
        return self.settings[int(np.nansum(self.values, axis=0).argmax())]

    def list_choices(self, given: Setting) -> dict[str, list[Setting]]:
        """Return the settings chosen for the recordings (n,), by how they were chosen: for each of them, or for all others."""
        choices, count = {'as given': given, 'fitted': self.best}, len(self.values)
        found = {how: [setting] * count for how, setting in choices.items()}
        if count >= FEWEST:
            found['held out'] = [self.settings[each] for each in choose_held_out(np.nan_to_num(self.values))]
        return found

    def score(self, chosen: Sequence[Setting]) -> float:
        """Return the mean over the recordings under the setting chosen for each of them (n,)."""
        return float(np.nanmean([row[self.settings.index(each)] for row, each in zip(self.values, chosen, strict=True)]))

    def determine(self, given: Setting) -> tuple[SettingTable, dict[str, str]]:
        """Return the settings that are left without the parameters that are not determined, and why they are not, by name.

        These keep their given values, one after the other, the flattest first, because one that is kept may determine another.
        """
        left, undetermined = self, dict[str, str]()
        while True:
            drawn = left.draw_best()
            found = [(*left._examine(name, value, drawn), name) for name, value in given.items() if name not in undetermined]
            doubted = min((each for each in found if each[1]), default=None)
            if doubted is None:
                return left, undetermined
            _, undetermined[doubted[2]], name = doubted
            columns = [column for column, each in enumerate(left.settings) if each[name] == given[name]]
            left = SettingTable(left.values[:, columns], tuple(left.settings[column] for column in columns))

    def draw_best(self) -> list[Setting]:
        """Return the settings that are best in resamples of the recordings, none where none is left."""
        if not self.settings:
            return []
        values = np.nan_to_num(self.values)
        drawn = resample(lambda rows: int(values[rows].sum(axis=0).argmax()), len(values))
        return [self.settings[each] for each in drawn.astype(int).tolist()]

    def _examine(self, name: str, given: float, drawn: Sequence[Setting]) -> tuple[float, str]:
        """Return how much the profile of a parameter varies [nat], and why it is undetermined, empty if it is determined."""
        profile: dict[float, float] = {}
        for setting, total in zip(self.settings, np.nansum(self.values, axis=0).tolist(), strict=True):
            profile[setting[name]] = max(total, profile.get(setting[name], -math.inf))
        best, least, most, bound = max(profile, key=profile.__getitem__), min(profile), max(profile), BOUNDS[name]
        variation, why = profile[best] - min(profile.values()), ''
        if len(profile) == 1:
            pass
        elif variation < FLAT_NAT:
            why = f'all values tried, {least:.3g} to {most:.3g}, explain the recordings within {FLAT_NAT:g} nat'
        elif best in (least, most) and best not in (bound.low, bound.high):
            why = f'{best:.3g}, the end of the values tried, explains the recordings best'
        elif best != given and profile[best] - profile.get(given, -math.inf) < FLAT_NAT:
            why = f'it explains the recordings within {FLAT_NAT:g} nat of the best value tried, {best:.3g}'
        elif best != given:
            low, high = np.percentile([each[name] for each in drawn], CENTRAL).tolist()
            if low <= given <= high:
                why = f'it lies within the interval of the best value tried, {best:.3g}: {low:.3g} to {high:.3g}'
        return variation, why

    def estimate(self, given: Setting, how: str) -> tuple[Findings, SettingTable]:
        """Return the values that are best for all recordings, with intervals, and what is undetermined; and the settings left."""
        left, undetermined = self.determine(given)
        found = Findings(undetermined=undetermined)
        if len(undetermined) == len(given):  # which may be among none of the settings
            return found, left
        best, drawn, totals = left.best, left.draw_best(), np.nansum(left.values, axis=0)
        alike = [left.settings[each] for each in np.flatnonzero(totals > totals.max() - FLAT_NAT)]
        for name in [each for each in given if each not in undetermined]:
            resampled = [each[name] for each in drawn]
            if len(self.values) < FEWEST:
                resampled = [*{*resampled, *(each[name] for each in alike)}]
            found.estimates[name] = Estimate.from_resamples(clip_to_bounds(name, best[name]), resampled, how)
        return found, left
