"""Parameters of the predictor itself, by replays: each setting replays the recordings, and what it foretold is scored.

A setting has two scores, means over the recordings. That of ways is the log-likelihood of the way really taken plus that of the
gap really taken in the next row, or where there are no ways that of the goal. (The next gap is what help acts on first, and
less is left to chance in it than in choices that the operator has yet to make.) That of positions is the log-likelihood of the
true ones 0.25, 0.5 and 1 s ahead, under the mixture of the candidates. All are proper: no setting gains by claiming more or less
than it knows. What needs no replay is at its own best for each setting: the likelihood's parameters, the doubt about plans.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product

import numpy as np

from foc_ros.analysis.evaluation.forecasts import of_shares, power_rule
from foc_ros.analysis.evaluation.heldout import asked, asked_about
from foc_ros.analysis.evaluation.observations import Observations
from foc_ros.analysis.evaluation.observe import observe
from foc_ros.analysis.evaluation.questions import GAP
from foc_ros.analysis.evaluation.recordings import Recording
from foc_ros.analysis.evaluation.workers import collected
from foc_ros.core.config import Config, LikelihoodConfig, updated
from foc_ros.core.types import Array

from .densities import FEWER_DOUBTS, NO_DOUBT, log_densities

Key = tuple[str, int]
"""A prediction: recording and stamp [ns]."""
RULES = tuple(
    replace(LikelihoodConfig(), beta=beta, spent_share=share, lookahead_s=seconds)
    for seconds, beta, share in product((0.0, 0.35, 0.7), (0.5, 1.0, 2.0, 3.0, 6.0, 12.0), (1.0, 0.0))
)
"""The likelihoods of which each setting is judged by its best: by one alone, settings that suit the others would lose."""


@dataclass(frozen=True)
class Foretold:
    """The scores of one setting by prediction.

    ways, positions: rows of log-likelihoods over what needs no replay; even: that of an even guess among the ways.
    """

    ways: dict[Key, Array] = field(default_factory=dict)
    positions: dict[Key, Array] = field(default_factory=dict)
    even: dict[Key, float] = field(default_factory=dict)


@dataclass
class Replays:
    """Replays of recordings under settings, each made once.

    thin: parameters of these replays alone.
    """

    recordings: Mapping[str, Recording]
    thin: Mapping[str, float]
    executor: Executor
    _known: dict[Config, dict[str, Foretold]] = field(default_factory=dict)

    def scores(self, settings: Sequence[Config], names: Sequence[str], words: str) -> Array:
        """Return the scores of settings in the recordings of these names, as of `compared`; words: for the progress bar."""
        known = [self._known.setdefault(setting, {}) for setting in settings]
        missing = [(place, name) for place, done in enumerate(known) for name in names if name not in done]
        items = [
            (f'{name} {place}', (place, self.recordings[name], updated(settings[place], self.thin))) for place, name in missing
        ]
        for place, name, found in collected(_foretold, items, self.executor, words)[0]:
            known[place][name] = found
        for place, name in missing:
            known[place].setdefault(name, Foretold())
        return compared([_together(done[name] for name in names) for done in known], names)


def observed(
    recordings: Mapping[str, Recording], config: Config, executor: Executor, words: str
) -> tuple[list[Observations], dict[str, str]]:
    """Replay recordings by motor noise alone; return the observations, and why others gave none, by name."""
    return collected(partial(observe, config=_plain(config)), list(recordings.items()), executor, words)


def _plain(config: Config) -> Config:
    return updated(config, NO_DOUBT.parameters())


def _foretold(item: tuple[int, Recording, Config]) -> tuple[int, str, Foretold]:
    place, recording, config = item
    return place, recording.name, scored(observe(recording, _plain(config)), config)


def _together(each: Iterable[Foretold]) -> Foretold:
    whole = Foretold()
    for part in each:
        whole.ways.update(part.ways)
        whole.positions.update(part.positions)
        whole.even.update(part.even)
    return whole


def scored(recording: Observations, config: Config) -> Foretold:
    """Score what one setting foretold in a recording."""
    found = Foretold()
    gaps = {seen.stamp_ns: question for seen, question in asked_about(recording, GAP)}
    for seen, question in asked(recording):
        questions = [question, *([gaps[seen.stamp_ns]] if seen.stamp_ns in gaps else [])]
        shares = [power_rule(seen, rule) for rule in RULES]
        found.ways[recording.name, seen.stamp_ns] = np.sum(
            [[np.log(of_shares(each, about).true(about)) for each in shares] for about in questions], axis=0
        )
        found.even[recording.name, seen.stamp_ns] = -sum(np.log(about.open) for about in questions)
    for seen in recording.each:
        row = log_densities(seen, seen.ways.likelihood, config, FEWER_DOUBTS)
        if row is not None:
            found.positions[recording.name, seen.stamp_ns] = row
    return found


def compared(settings: Sequence[Foretold], names: Sequence[str]) -> Array:
    """Return the scores of each setting in each recording, of ways and of positions, (2, s, n) [nat].

    A prediction that a setting could not make counts as the worst of those that others made in its place, of ways at most as an
    even guess.
    """
    scores = np.zeros((2, len(settings), len(names)))
    even = {key: value for each in settings for key, value in each.even.items()}
    tables = [each.ways for each in settings], [each.positions for each in settings]
    for score, table, most in zip(scores, tables, (even, {}), strict=True):
        best, worst = [_best(each) for each in table], dict(most)
        for each in best:
            for key, value in each.items():
                worst[key] = min(value, worst.get(key, value))
        for place, name in enumerate(names):
            keys = [key for key in worst if key[0] == name]
            if keys:
                score[:, place] = [np.mean([each.get(key, worst[key]) for key in keys]) for each in best]
    return scores


def _best(rows: Mapping[Key, Array]) -> dict[Key, float]:
    """Return the log-likelihoods at what is best for all of them together."""
    if not rows:
        return {}
    place = int(np.sum(list(rows.values()), axis=0).argmax())
    return {key: float(row[place]) for key, row in rows.items()}
