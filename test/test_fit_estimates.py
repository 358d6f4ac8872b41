# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a fit finds without a prediction, and those that it finds by replays."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import FIT_GOALS, TWO_CLASSES, bowed_reach, observation, reach, recorded, recorded_hand, write_fit_tables

from foc_ros.analysis.evaluation.observations import observe
from foc_ros.analysis.evaluation.positions import compute_log_densities
from foc_ros.analysis.evaluation.truth import HORIZONS, TIMES_S
from foc_ros.analysis.fitting import SettingTable, race
from foc_ros.analysis.fitting.direct import FADING, fit_duration, fit_estimator, fit_fading, fit_wait
from foc_ros.analysis.fitting.fit import Fit
from foc_ros.analysis.fitting.one_replay import fit_widening
from foc_ros.analysis.fitting.race import Replays, make_eta_settings
from foc_ros.analysis.recordings import find_recordings
from foc_ros.cli.main import main
from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.kalman import compute_gramian, compute_transition
from foc_ros.core.obstacle_table import make_obstacles

CONFIG = replace_values(Config(), {'estimator.acceleration_time_s': 0.0})
GOAL = np.array([[0.3, 0.0]])
BETA, WEAVING = 'likelihood.beta', 'likelihood.weaving'
VALUES = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])


GIVEN = {BETA: 2.0, WEAVING: 4.0}
FLAT = 'all values tried, 1 to 8, explain the recordings within 2 nat'
BOTH_FLAT = {BETA: FLAT, WEAVING: FLAT}
END = '8, the end of the values tried, explains the recordings best'
NEAR = 'it explains the recordings within 2 nat of the best value tried, 3'


def _estimate(log_likelihood, values=VALUES):
    """Return what a table of one recording by exponent and weaving determines."""
    grid = [(beta, weaving) for beta in values for weaving in values]
    settings = tuple({BETA: beta, WEAVING: weaving} for beta, weaving in grid)
    return SettingTable(log_likelihood(*np.array(grid).T)[None], settings).estimate(GIVEN, 'how')[0]


@pytest.mark.parametrize(
    ('log_likelihood', 'values', 'expected', 'undetermined'),
    [
        pytest.param(lambda b, w: -10 * ((b - 6) ** 2 + (w - 2) ** 2), VALUES, (6.0, 2.0), {}, id='a sharp peak'),
        pytest.param(lambda b, w: -0.01 * ((b - 6) ** 2 + (w - 2) ** 2), VALUES, (None, None), BOTH_FLAT, id='flat'),
        pytest.param(lambda b, w: -1.5 * (b - 3) ** 2 - 10 * (w - 2) ** 2, VALUES, (None, 2.0), {BETA: NEAR}, id='hardly better'),
        pytest.param(lambda b, w: 10 * b - 10 * (w - 2) ** 2, VALUES, (None, 2.0), {BETA: END}, id='best at the end'),
        pytest.param(lambda b, w: -10 * b - 10 * (w - 2) ** 2, np.append(0.0, VALUES), (0.0, 2.0), {}, id='best at a bound'),
    ],
)
def test_what_a_table_of_log_likelihoods_determines(log_likelihood, values, expected, undetermined):
    found = _estimate(log_likelihood, values)
    assert found.values == {name: each for name, each in zip(GIVEN, expected, strict=True) if each is not None}
    assert found.undetermined == undetermined


def test_a_value_whose_given_one_lies_within_its_interval_is_not_determined():
    """One recording alone asks for another value, by much, and the others by chance for the given one."""
    settings = tuple({BETA: beta} for beta in VALUES)
    values = np.array([-100.0 * np.abs(VALUES - 6.0), *3 * [-10.0 * np.abs(VALUES - 2.0)]])
    found = SettingTable(values, settings).estimate({BETA: 2.0}, 'how')[0]
    assert not found.estimates and 'interval' in found.undetermined[BETA]


def test_where_only_a_sum_is_determined_one_part_is_kept_and_the_other_follows():
    found = _estimate(lambda beta, weaving: -10.0 * (beta + weaving - 7.0) ** 2)
    (name,), (kept,) = found.estimates, found.undetermined
    assert found.estimates[name].value == 7.0 - GIVEN[kept]


def _drifting(stddev, density):
    """Return six hands that are driven by white jerk, as the filter expects."""
    rng, found = np.random.default_rng(2), []
    times = np.cumsum(rng.uniform(0.01, 0.03, 200))
    for number in range(6):
        state, path = np.zeros((3, 2)), []
        for dt in np.diff(times, prepend=times[0] - 0.02):
            driven = np.linalg.cholesky(compute_gramian(dt)) @ rng.standard_normal((3, 2))
            state = compute_transition(dt) @ state + density * driven
            path.append(state[0] + rng.normal(0.0, stddev, 2))
        found.append(recorded_hand(f'{number}', times, np.array(path), make_obstacles(), FIT_GOALS))
    return found


@pytest.mark.parametrize(('stddev', 'density'), [(1e-3, 3.0), (3e-4, 20.0)])
def test_the_deviations_that_made_the_data_are_found(stddev, density):
    found = fit_estimator(_drifting(stddev, density), replace_values(Config(), {'estimator.position_stddev': 0.01}))
    assert found.undetermined == {}
    for name, true in (('estimator.position_stddev', stddev), ('estimator.jerk_density', density)):
        each = found.estimates[name]
        assert each.low <= each.value <= each.high
        assert each.value == pytest.approx(true, rel=0.1)
        assert 0.8 * each.low < true < 1.2 * each.high


PRECISE = replace_values(Config(), {'estimator.position_stddev': 2e-4})
A, B = 'duration.fitts_a_s', 'duration.fitts_b_s'


def _bits(distance):
    return np.log2(np.asarray(distance) / PRECISE.duration.target_width + 1)


def _fit_reaches(durations, distances):
    rng, hands = np.random.default_rng(4), []
    for seconds, distance in zip(durations, distances, strict=True):
        goal = np.array([distance, 0.0])
        rows = bowed_reach(goal, 0.0, seconds, 100.0, rng, 2e-4)
        hands.append(recorded_hand(str(len(hands)), rows[:, 0], rows[:, 1:], make_obstacles(), goal[None]))
    return fit_duration(hands, PRECISE)


def test_one_factor_is_fitted_where_distances_are_alike_and_intercept_and_slope_where_they_differ():
    given = PRECISE.duration
    found = _fit_reaches([2.0 * (given.fitts_a_s + given.fitts_b_s * _bits(0.3))] * 5, [0.3] * 5)
    a, b = found.estimates[A], found.estimates[B]
    assert a.value / given.fitts_a_s == pytest.approx(b.value / given.fitts_b_s, rel=1e-4)
    assert a.value / given.fitts_a_s == pytest.approx(2.0, rel=0.2)
    assert a.low <= a.value <= a.high
    assert any('too alike to tell intercept and slope apart' in words for words in found.warnings)
    distances = [0.05, 0.1, 0.2, 0.4, 0.8]
    durations = 0.5 + 0.3 * _bits(distances)
    found = _fit_reaches(durations.tolist(), distances)
    assert found.warnings == [] and found.undetermined == {}
    fitted = found.estimates[A].value + found.estimates[B].value * _bits(distances)
    # the filter detects each onset equally late
    assert (fitted - durations).min() > -0.25 and (fitted - durations).max() < 0.0
    assert np.ptp(fitted - durations) < 0.05


@pytest.mark.parametrize('fading_s', [0.06, 0.2])
def test_the_time_in_which_accelerations_fade_is_found(fading_s):
    rng, dt = np.random.default_rng(5), 0.005
    hands = []
    for number in range(4):
        state, path = np.array([[0.0, 0.0], [0.2, 0.0], [0.0, 0.0]]), []
        for _ in range(2000):
            state = compute_transition(dt) @ state
            # white jerk drives a fading acceleration
            state[2] = state[2] * np.exp(-dt / fading_s) + 3.0 * np.sqrt(dt) * rng.standard_normal(2)
            path.append(state[0])
        hands.append(recorded_hand(str(number), dt * np.arange(2000.0), np.array(path), make_obstacles(), GOAL))
    # this filter follows accelerations at once, so that its lag does not affect the estimate
    config = replace_values(CONFIG, {'estimator.position_stddev': 1e-6, 'estimator.jerk_density': 30.0})
    found = fit_fading(hands, config).estimates[FADING]
    assert found.low <= found.value <= found.high
    assert found.value == pytest.approx(fading_s, rel=0.25)


def test_half_of_the_wait_is_left_on_average_and_the_stay_at_the_goal_does_not_count():
    hands = [recorded_hand('one', *reach(0.0, (0.3, 0.0), rest=rest), make_obstacles(), GOAL) for rest in (0.6, 1.0)]
    found = fit_wait(hands, Config()).estimates['duration.wait_s']
    # the wait includes the first 0.15 s of a movement, until its onset is detected
    assert found.value == pytest.approx(0.4, abs=0.1)
    assert found.low < found.value < found.high


SEARCH_CONFIG = replace_values(
    Config(), {'foc.steps': 15, 'homotopy.max_candidates': 2, 'rate_hz': 4.0, 'estimator.acceleration_time_s': 0.0}
)
ARRIVALS = [SEARCH_CONFIG, replace_values(SEARCH_CONFIG, {'duration.arrival': 'passing'})]


class KnownReplays:
    """Replays with known scores by setting and recording; keeps the number of settings and recordings of each round."""

    def __init__(self, classes, positions=None):
        self.classes = np.asarray(classes, dtype=float)
        self.positions = np.zeros_like(self.classes) if positions is None else np.asarray(positions, dtype=float)
        self.recordings = {str(place): None for place in range(self.classes.shape[1])}
        self.rounds: list[tuple[int, int]] = []

    def search(self, settings):
        self.settings = settings
        found = race.search_settings('movement', settings, self)  # type: ignore[arg-type]
        return replace_values(settings[0], found.values), found

    def score(self, settings, names, words):
        self.rounds.append((len(settings), len(names)))
        rows, columns = [self.settings.index(each) for each in settings], [int(name) for name in names]
        return np.array([self.classes[rows][:, columns], self.positions[rows][:, columns]])


def test_the_better_choice_is_taken():
    config, found = KnownReplays([[0.0] * 8, [0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, -0.1]]).search(ARRIVALS)
    assert found.chosen == {'duration.arrival': 'passing'} and config.duration.arrival == 'passing'
    assert found.warnings == [] and found.undetermined == {}
    config, found = KnownReplays(np.zeros((2, 8))).search(ARRIVALS)
    assert config == SEARCH_CONFIG and found.chosen == {}, 'equal scores'


@pytest.mark.parametrize('scores', [[1.5, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, 0.0], [0.5, 1.5], [1.0], [-1.0]])
def test_a_choice_that_is_better_by_chance_only_is_undetermined(scores):
    config, found = KnownReplays([[0.0] * len(scores), scores]).search(ARRIVALS)
    assert config == SEARCH_CONFIG and found.chosen == {}
    assert found.undetermined['duration.arrival'].startswith('no other value tried is better by more than chance')


def test_half_of_the_settings_leave_each_round_and_the_finalists_have_all_recordings():
    settings = [replace_values(SEARCH_CONFIG, {'foc.eta': 0.5 + 0.02 * place}) for place in range(20)]
    quality = -np.abs(np.arange(20.0) - 13.0)[:, None] + 0.1 * np.random.default_rng(3).standard_normal((20, 40))
    replays = KnownReplays(quality)
    config, found = replays.search(settings)
    assert replays.rounds == [(20, 6), (11, 12), (7, 24), (5, 40)], 'half of them, and the given one'
    assert config == settings[13]
    each = found.estimates['foc.eta']
    assert each.low <= each.value == settings[13].foc.eta <= each.high
    many = KnownReplays(np.zeros((2, 500)))
    many.search(ARRIVALS)
    assert many.rounds[-1] == (2, race.MAX_RECORDINGS)


def test_a_setting_that_predicts_nothing_loses_and_no_recording_is_replayed_twice(tmp_path, monkeypatch):
    recordings = find_recordings(write_fit_tables(tmp_path / 'data', count=2))
    names = list(recordings)
    hopeless = replace_values(SEARCH_CONFIG, {'foc.noise_x': 2.0, 'foc.noise_y': 2.0, 'likelihood.shortfall': math.inf})
    replays = Replays(recordings, {})
    scores = replays.score([hopeless, SEARCH_CONFIG], names, 'both')
    assert scores.shape == (2, 2, 2) and scores[0, 1].mean() > scores[0, 0].mean() + 0.1
    monkeypatch.setattr('foc_ros.analysis.fitting.race._score_replay', None)
    assert np.array_equal(replays.score([SEARCH_CONFIG, hopeless], names, 'again'), scores[:, ::-1])


def test_settings_are_compared_by_what_the_predictor_answers_with_them(tmp_path, monkeypatch):
    """It learns the pace, for which the spread of durations is the prior, and expects other goals by the scatter of ends."""
    recording = find_recordings(write_fit_tables(tmp_path / 'data', count=1))['r0']
    given = {'foc.process_noise': 0.5, 'foc.endpoint_stddev': 0.02, 'duration.spread': 0.3}
    config = replace_values(SEARCH_CONFIG, {**given, 'covariance.adaptation': 'none'})
    observed = observe(recording, config).observations
    expected = {}
    for each in observed:
        densities = compute_log_densities(each, each.candidates.mixture, each.candidates.covariance)
        if each.movement_age_s > 0.0 and np.isfinite(densities[0]):
            expected['r0', each.stamp_ns] = pytest.approx([np.nanmean(np.maximum(densities, -30.0))], abs=1e-6)
    monkeypatch.setattr(race, 'FEW_WIDENINGS', [tuple(given.values())])
    _, found = race._score_replay((0, recording, config, {}))
    assert found.positions == expected


def test_eta_is_lowered_only_if_that_is_allowed():
    assert {each.foc.eta for each in make_eta_settings(SEARCH_CONFIG, may_be_lower=False)} == {0.9, 0.95}
    assert {each.foc.eta for each in make_eta_settings(SEARCH_CONFIG, may_be_lower=True)} == {0.9, 0.95, 0.7, 0.5}


@pytest.mark.parametrize(
    ('answer', 'options', 'is_written'),
    [(None, (), False), (None, ('--allow', 'positions'), True), ('y', (), True), ('', (), False)],
)
def test_worse_positions_are_written_only_if_allowed_or_if_a_terminal_agrees(
    tmp_path, monkeypatch, capsys, answer, options, is_written
):
    worse = 'predicted positions 0.5 s ahead become worse with the fitted parameters: from 63 to 96 mm\n'
    output, fit, asked = tmp_path / 'operator.yaml', Fit(config=SEARCH_CONFIG), []

    def ask(question):
        assert worse in capsys.readouterr().err and not output.exists()
        asked.append(question)
        return answer

    fit.comparison = {'error_m 0.25': {'before': 0.010, 'after': 0.011}, 'error_m 0.5': {'before': 0.063, 'after': 0.096}}
    fit.comparison |= {'class_gain': {'before': 0.5, 'after': 0.1}, 'error_m 1': {'before': None, 'after': 0.2}}
    monkeypatch.setattr('foc_ros.analysis.fitting.fit.fit_parameters', lambda *_, **__: fit)
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, 'isatty', lambda: answer is not None)
    monkeypatch.setattr('builtins.input', ask)
    data = write_fit_tables(tmp_path / 'data', count=1)
    assert main(['fit', str(data), '--output', str(output), '--workers', '1', *options]) == (0 if is_written else 2)
    assert output.exists() == is_written
    assert asked == ([] if answer is None else [f'Write {output} all the same? [y/N] '])
    shown, error = capsys.readouterr()
    assert 'error of positions 0.5 s ahead [mm]' in shown and ('Run the node' in shown) == is_written
    assert (f'{output} is not written; --allow positions writes it all the same' in error) != is_written
    assert answer is not None or (worse in error and error.count('become worse') == 1)


S = np.array(TIMES_S)
TO_GOAL = 10 * S**3 - 15 * S**4 + 6 * S**5
LATE = 9.0 * (S**3 * (1 - S) ** 2)[:, None] * [1.0, 0.0]
KNOWN = np.tile(1e-8 * np.eye(2), (2, 3, 1, 1))
SCATTERED = (TO_GOAL**2)[HORIZONS, None, None] * np.eye(2)
ADDED = S[HORIZONS, None, None] * np.eye(2), SCATTERED, (LATE[:, :, None] * LATE[:, None])[HORIZONS]
CANDIDATES = replace(TWO_CLASSES, covariance=KNOWN, plans=np.stack([KNOWN, *(KNOWN + each for each in ADDED)]))


def _make_recordings(endpoint, spread):
    """Return twelve recordings of eight movements of 1 s each, with scattered ends and durations."""
    draws = np.random.default_rng(3)
    moved = []
    for _ in range(96):
        end, late = np.outer(TO_GOAL, draws.normal(0.0, endpoint, 2)), draws.normal(0.0, spread) * LATE
        moved.append(end - late + draws.normal(0.0, 1e-4, LATE.shape))
    observed = [observation(CANDIDATES, positions=each) for each in moved]
    return [recorded(*observed[8 * number : 8 * number + 8], name=str(number)) for number in range(12)]


@pytest.mark.parametrize(('endpoint', 'spread'), [(0.006, 0.0), (0.002, 0.3)])
def test_the_true_values_are_found_and_ellipses_then_have_their_coverage(endpoint, spread):
    recordings = _make_recordings(endpoint, spread)
    # 0.4, the given value, would be as good as 0.3 to within 2 nat
    found = fit_widening(recordings, replace_values(Config(), {'duration.spread': 0.9}))
    assert found.undetermined == {} or set(found.undetermined) == {'foc.process_noise'}
    found, scores = found.estimates, found.scores
    assert found['foc.endpoint_stddev'].value == pytest.approx(endpoint, rel=0.4)
    assert found['duration.spread'].value == pytest.approx(spread, abs=0.11)
    for each in found.values():
        assert each.low <= each.value <= each.high
    assert scores['inside_90']['motor noise alone'] < 0.1
    for kind in ('inside_90', 'inside_all_90'):
        assert scores[kind]['fitted'] == pytest.approx(0.9, abs=0.08)
        assert scores[kind]['held out'] == pytest.approx(0.9, abs=0.08)
