# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a fit finds by replays: settings of the predictor in a race, and what widens the covariance."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import TWO_CLASSES, H, observation, recorded
from fit_recordings import write_tables

from foc_ros.analysis.evaluation.truth import TIMES_S
from foc_ros.analysis.fitting import race
from foc_ros.analysis.fitting.fit import Fit, find_lower_coverage
from foc_ros.analysis.fitting.one_replay import fit_widening
from foc_ros.analysis.fitting.race import Replays, make_eta_settings
from foc_ros.analysis.recordings import find_recordings
from foc_ros.cli.main import main
from foc_ros.core.config import Config, replace_values

CONFIG = replace_values(
    Config(), {'foc.steps': 15, 'homotopy.max_candidates': 2, 'rate_hz': 4.0, 'estimator.acceleration_time_s': 0.0}
)
ARRIVALS = [CONFIG, replace_values(CONFIG, {'duration.arrival': 'passing'})]


class KnownReplays:
    """Replays with known scores by setting and recording; keeps the number of settings and recordings of each round."""

    def __init__(self, classes, positions=None):
        self.classes = np.asarray(classes, dtype=float)
        self.positions = np.zeros_like(self.classes) if positions is None else np.asarray(positions, dtype=float)
        self.recordings = {str(place): None for place in range(self.classes.shape[1])}
        self.rounds: list[tuple[int, int]] = []

    def search(self, settings):
        self.settings = settings
        return race.search_settings('kind', settings, self)  # type: ignore[arg-type]

    def score(self, settings, names, words):
        self.rounds.append((len(settings), len(names)))
        rows, columns = [self.settings.index(each) for each in settings], [int(name) for name in names]
        return np.array([self.classes[rows][:, columns], self.positions[rows][:, columns]])


def test_the_better_choice_is_taken():
    config, found = KnownReplays([[0.0] * 8, [0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, -0.1]]).search(ARRIVALS)
    assert found.chosen == {'duration.arrival': 'passing'} and config.duration.arrival == 'passing'
    assert found.warnings == [] and found.undetermined == {}
    config, found = KnownReplays(np.zeros((2, 8))).search(ARRIVALS)
    assert config == CONFIG and found.chosen == {}, 'equal scores'


@pytest.mark.parametrize('scores', [[1.5, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, 0.0], [0.5, 1.5], [1.0]])
def test_a_choice_that_is_better_by_chance_only_is_undetermined(scores):
    config, found = KnownReplays([[0.0] * len(scores), scores]).search(ARRIVALS)
    assert config == CONFIG and found.chosen == {}
    assert found.undetermined['duration.arrival'].startswith('no other value tried is better by more than chance')


def test_a_setting_that_predicts_nothing_loses_and_no_recording_is_replayed_twice(tmp_path, monkeypatch):
    recordings = find_recordings(write_tables(tmp_path / 'data', count=2, hz=30.0))
    names = list(recordings)
    hopeless = replace_values(CONFIG, {'foc.noise_x': 2.0, 'foc.noise_y': 2.0, 'likelihood.shortfall': math.inf})
    replays = Replays(recordings, {})
    scores = replays.score([hopeless, CONFIG], names, 'both')
    assert scores.shape == (2, 2, 2) and scores[0, 1].mean() > scores[0, 0].mean() + 0.1
    monkeypatch.setattr('foc_ros.analysis.fitting.race._score_replay', None)
    assert np.array_equal(replays.score([CONFIG, hopeless], names, 'again'), scores[:, ::-1])


def test_eta_is_lowered_only_if_that_is_allowed():
    assert {each.foc.eta for each in make_eta_settings(CONFIG, may_be_lower=False)} == {0.9, 0.95}
    assert {each.foc.eta for each in make_eta_settings(CONFIG, may_be_lower=True)} == {0.9, 0.95, 0.7, 0.5}


@pytest.mark.parametrize(
    ('answer', 'options', 'is_written'),
    [(None, (), False), (None, ('--allow', 'positions'), True), ('y', (), True), ('', (), False)],
)
def test_worse_positions_are_written_only_if_allowed_or_if_a_terminal_agrees(
    tmp_path, monkeypatch, capsys, answer, options, is_written
):
    worse = 'predicted positions 0.5 s ahead become worse with the fitted parameters: from 63 to 96 mm\n'
    output, fit, asked = tmp_path / 'operator.yaml', Fit(CONFIG), []

    def ask(question):
        assert worse in capsys.readouterr().err and not output.exists()
        asked.append(question)
        return answer

    fit.comparison = {'error_m 0.5': {'before': 0.063, 'after': 0.096}}
    monkeypatch.setattr('foc_ros.analysis.fitting.fit.fit_parameters', lambda *_, **__: fit)
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, 'isatty', lambda: answer is not None)
    monkeypatch.setattr('builtins.input', ask)
    data = write_tables(tmp_path / 'data', count=1)
    assert main(['fit', str(data), '--output', str(output), '--workers', '1', *options]) == (0 if is_written else 2)
    assert output.exists() == is_written
    assert asked == ([] if answer is None else [f'Write {output} all the same? [y/N] '])
    error = capsys.readouterr().err
    assert (f'{output} is not written; --allow positions writes it all the same' in error) != is_written
    assert answer is not None or worse in error


@pytest.mark.parametrize(
    ('held_out', 'before', 'after', 'words'),
    [
        ((0.92, 0.81), 0.9, 0.9, 'of recordings held out 0.5 s ahead with the fitted parameters: 81 % instead of 92 %'),
        ((None, None), 0.93, 0.85, 'true positions 0.5 s ahead with the fitted parameters: 85 % instead of 93 %'),
        ((0.8, 0.9), 0.9, 0.9, None),
        ((None, None), None, None, None),
    ],
)
def test_a_lower_coverage_is_told_in_one_sentence(held_out, before, after, words):
    fit = Fit(CONFIG, comparison={'inside_90': {'before': before, 'after': after}})
    fit.scores = {'inside_all_90': dict(zip(('as given', 'without the recording'), held_out, strict=True))}
    found = find_lower_coverage(fit)
    assert len(found) == (words is not None) and all(each.endswith(words) for each in found)


S = np.array(TIMES_S)
TO_GOAL = 10 * S**3 - 15 * S**4 + 6 * S**5
LATE = 9.0 * (S**3 * (1 - S) ** 2)[:, None] * [1.0, 0.0]
CANDIDATES = replace(TWO_CLASSES, covariance=np.tile(1e-8 * np.eye(2), (2, H, 1, 1)), duration_sensitivity=np.stack([LATE, LATE]))


def _make_recordings(endpoint, spread):
    """Return twelve recordings of eight movements of 1 s each, with scattered ends and durations."""
    draws = np.random.default_rng(3)
    moved = [
        np.outer(TO_GOAL, draws.normal(0.0, endpoint, 2)) - draws.normal(0.0, spread) * LATE + draws.normal(0.0, 1e-4, (H, 2))
        for _ in range(96)
    ]
    observed = [observation(CANDIDATES, positions=each) for each in moved]
    return [recorded(*observed[8 * number : 8 * number + 8], name=str(number)) for number in range(12)]


@pytest.mark.parametrize(('endpoint', 'spread'), [(0.006, 0.0), (0.002, 0.3)])
def test_the_true_values_are_found_and_ellipses_then_have_their_coverage(endpoint, spread):
    recordings = _make_recordings(endpoint, spread)
    found, scores = fit_widening(recordings, Config())
    assert found.undetermined == {} or set(found.undetermined) == {'foc.process_noise'}
    found = found.estimates
    assert found['foc.endpoint_stddev'].value == pytest.approx(endpoint, rel=0.4)
    assert found['duration.spread'].value == pytest.approx(spread, abs=0.11)
    for each in found.values():
        assert each.low <= each.value <= each.high
    assert scores['inside_90']['motor noise alone'] < 0.1
    for kind in ('inside_90', 'inside_all_90'):
        assert scores[kind]['fitted'] == pytest.approx(0.9, abs=0.08)
        assert scores[kind]['without the recording'] == pytest.approx(0.9, abs=0.08)
