"""Settings of the predictor in a race by replays, and the time in which accelerations fade."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from fit_recordings import recorded_hand, write_tables

from foc_ros.analysis.fitting import setting_search
from foc_ros.analysis.fitting.comparison import find_worse_positions
from foc_ros.analysis.fitting.duration_fit import fit_duration, fit_other_models
from foc_ros.analysis.fitting.estimates import Fit
from foc_ros.analysis.fitting.estimator_fit import FADING, fit_fading
from foc_ros.analysis.fitting.predictor_settings import DURATIONS, make_eta_settings, make_movement_settings
from foc_ros.analysis.fitting.setting_search import Replays
from foc_ros.analysis.fitting.tables import make_verdict
from foc_ros.analysis.parallel import IsolatedProcessPool
from foc_ros.analysis.recordings import find_recordings
from foc_ros.cli.main import main
from foc_ros.core.config import Config, replace_values
from foc_ros.core.estimation.kalman_filter import compute_transition
from foc_ros.core.types import Array, make_obstacles

CONFIG = replace_values(
    Config(), {'foc.steps': 15, 'homotopy.max_candidates': 2, 'rate_hz': 4.0, 'estimator.acceleration_time_s': 0.0}
)
GOAL = np.array([[0.3, 0.0]])
ARRIVALS = [CONFIG, replace_values(CONFIG, {'duration.arrival': 'passing'})]


class KnownReplays:
    """Replays with known scores by setting and recording; keeps the number of settings and recordings of each round."""

    def __init__(self, classes: Array, positions: Array | None = None) -> None:
        self.classes = np.asarray(classes, dtype=float)
        self.positions = np.zeros_like(self.classes) if positions is None else np.asarray(positions, dtype=float)
        self.recordings = {str(place): None for place in range(self.classes.shape[1])}
        self.rounds: list[tuple[int, int]] = []

    def search(self, settings: list[Config]) -> Fit:
        self.settings, found = settings, Fit(settings[0])
        setting_search.search_settings('kind', settings, self, found)  # type: ignore[arg-type]
        return found

    def score(self, settings: list[Config], names: list[str], words: str) -> Array:
        self.rounds.append((len(settings), len(names)))
        rows, columns = [self.settings.index(each) for each in settings], [int(name) for name in names]
        return np.array([self.classes[rows][:, columns], self.positions[rows][:, columns]])


def test_the_better_choice_is_taken() -> None:
    found = KnownReplays([[0.0] * 8, [0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, -0.1]]).search(ARRIVALS)
    assert found.chosen == {'duration.arrival': 'passing'} and found.config.duration.arrival == 'passing'
    assert found.warnings == []


def test_a_choice_that_resampled_recordings_do_not_support_has_a_warning() -> None:
    found = KnownReplays([[0.0] * 8, [1.5, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, 0.0]]).search(ARRIVALS)
    assert found.config.duration.arrival == 'passing'
    assert any(words.startswith('duration.arrival: passing is the best, but only in ') for words in found.warnings)


def test_the_given_setting_is_kept_where_scores_are_equal() -> None:
    found = KnownReplays(np.zeros((2, 8))).search(ARRIVALS)
    assert found.config == CONFIG and found.chosen == {}


def test_half_of_the_settings_leave_each_round_and_the_finalists_have_all_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(setting_search, 'PLAINLY_WORSE', 1e6)
    settings = [replace_values(CONFIG, {'foc.eta': 0.5 + 0.02 * place}) for place in range(20)]
    quality = -np.abs(np.arange(20.0) - 13.0)[:, None] + 0.1 * np.random.default_rng(3).standard_normal((20, 40))
    replays = KnownReplays(quality)
    found = replays.search(settings)
    assert replays.rounds == [(20, 6), (10, 12), (5, 24), (4, 40)]
    assert found.config == settings[13]
    each = found.estimates['foc.eta']
    assert each.low <= each.value == settings[13].foc.eta <= each.high


def test_plainly_worse_settings_leave_at_once() -> None:
    spread = 0.2 * np.random.default_rng(4).standard_normal((6, 24))
    replays = KnownReplays(np.array([-1.0, 0.0, 0.05, -1.1, -1.2, 0.1])[:, None] + spread)
    found = replays.search([replace_values(CONFIG, {'foc.eta': 0.5 + 0.02 * place}) for place in range(6)])
    assert replays.rounds == [(6, 6), (3, 12), (3, 24)]
    assert found.config.foc.eta in (0.52, 0.54, 0.6)


def test_the_number_of_replayed_recordings_is_bounded() -> None:
    replays = KnownReplays(np.zeros((2, 500)))
    replays.search(ARRIVALS)
    assert replays.rounds[-1] == (2, setting_search.MAX_RECORDINGS)


def test_classes_decide_and_positions_where_classes_are_alike() -> None:
    positions = np.array([[0.0, 0.0], [5.0, 5.0], [1.0, 1.0]])
    assert setting_search.rank(np.array([[[1.0, 1.2], [0.5, 0.8], [0.9, 1.4]], positions])) == [2, 0, 1]
    assert setting_search.rank(np.array([[[1.0, 1.2], [0.7, 1.55], [0.9, 1.4]], positions])) == [1, 2, 0]
    assert setting_search.rank(np.array([np.zeros((3, 2)), positions])) == [1, 2, 0]


def test_worse_positions_have_a_warning() -> None:
    found = KnownReplays([[0.0] * 8, [1.0] * 8], [[0.0] * 8, [-0.3] * 8]).search(ARRIVALS)
    assert found.config.duration.arrival == 'passing'
    assert [words for words in found.warnings if 'predicts positions worse' in words and '0.3 nat' in words]


def test_models_durations_arrivals_and_fading_are_tried_in_all_combinations() -> None:
    reaches, fading = _reaches(CONFIG), replace_values(CONFIG, {'estimator.acceleration_time_s': 0.06})
    for config, accelerations in ((CONFIG, {0.0}), (fading, {0.06, 0.0})):
        tried = make_movement_settings(reaches, config)
        assert tried[0] == config
        assert len(set(tried)) == len(tried) == 2 * (1 + len(DURATIONS)) * 2 * len(accelerations)
        assert {each.duration.model for each in tried} == {'fitts', 'cost_of_time'}
        assert {each.estimator.acceleration_time_s for each in tried} == accelerations
        factors = {round(each.duration.fitts_a_s / CONFIG.duration.fitts_a_s, 6) for each in tried}
        assert factors == {1.0, *DURATIONS}


def _reaches(config: Config) -> list:
    t = np.arange(0.0, 1.61, 0.02)
    s = np.clip((t - 0.1) / 1.5, 0.0, 1.0)
    path = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None] * GOAL
    return [recorded_hand(str(number), t, path, make_obstacles(), GOAL) for number in range(3)]


def test_the_other_models_of_duration_come_with_their_constants_fitted() -> None:
    (priced,) = fit_other_models(_reaches(CONFIG), CONFIG)
    assert priced.duration.model == 'cost_of_time'
    assert (3600.0 * 0.3**2 / priced.duration.time_cost) ** (1 / 6) == pytest.approx(1.5, rel=0.1)
    given = replace_values(CONFIG, {'duration.model': 'fixed'})
    assert [each.duration.model for each in fit_other_models(_reaches(CONFIG), given)] == ['fitts', 'cost_of_time']
    assert fit_duration(_reaches(CONFIG), given)[0]


@pytest.mark.parametrize('fading_s', [0.06, 0.2])
def test_the_time_in_which_accelerations_fade_is_found(fading_s: float) -> None:
    rng, dt = np.random.default_rng(5), 0.005
    hands = []
    for number in range(6):
        state, path = np.array([[0.0, 0.0], [0.2, 0.0], [0.0, 0.0]]), []
        for _ in range(2000):
            state = compute_transition(dt) @ state
            # white jerk drives a fading acceleration
            state[2] = state[2] * np.exp(-dt / fading_s) + 3.0 * np.sqrt(dt) * rng.standard_normal(2)
            path.append(state[0])
        hands.append(recorded_hand(str(number), dt * np.arange(2000.0), np.array(path), make_obstacles(), GOAL))
    # this filter follows accelerations at once, so that its lag does not affect the estimate
    config = replace_values(CONFIG, {'estimator.position_stddev': 1e-6, 'estimator.jerk_density': 30.0})
    found = fit_fading(hands, config)[0][FADING]
    assert found.low <= found.value <= found.high
    assert found.value == pytest.approx(fading_s, rel=0.25)


def test_a_lasting_acceleration_is_recognised() -> None:
    t = np.arange(0.0, 3.0, 0.02)
    hands = [recorded_hand(str(a), t, np.outer(0.5 * a * t**2, [1.0, 0.0]), make_obstacles(), GOAL) for a in (0.3, 0.5)]
    assert fit_fading(hands, replace_values(CONFIG, {'estimator.position_stddev': 1e-6}))[0][FADING].value == 0.0


def test_hands_at_rest_give_no_fading_time() -> None:
    still = recorded_hand('still', 0.02 * np.arange(50.0), np.zeros((50, 2)), make_obstacles(), GOAL)
    estimates, warnings = fit_fading([still], CONFIG)
    assert estimates == {} and warnings[0].startswith(f'{FADING}: ')


def test_a_setting_that_predicts_nothing_loses_and_no_recording_is_replayed_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recordings = find_recordings(write_tables(tmp_path / 'data', count=4, hz=30.0))
    names = list(recordings)
    hopeless = replace_values(CONFIG, {'foc.noise_x': 2.0, 'foc.noise_y': 2.0, 'likelihood.shortfall': math.inf})
    with IsolatedProcessPool(1) as executor:
        replays = Replays(recordings, {}, executor)
        scores = replays.score([hopeless, CONFIG], names, 'both')
        assert scores.shape == (2, 2, 4) and scores[0, 1].mean() > scores[0, 0].mean() + 0.1
        monkeypatch.setattr('foc_ros.analysis.fitting.setting_search._score_replay', None)
        assert np.array_equal(replays.score([CONFIG, hopeless], names, 'again'), scores[:, ::-1])


def test_eta_is_lowered_only_if_that_is_allowed() -> None:
    assert {each.foc.eta for each in make_eta_settings(CONFIG, may_be_lower=False)} == {0.9, 0.95}
    assert {each.foc.eta for each in make_eta_settings(CONFIG, may_be_lower=True)} == {0.9, 0.95, 0.7, 0.5}


def test_worse_positions_are_named_with_both_errors() -> None:
    comparison = {
        'class_gain': {'before': 0.5, 'after': 0.1},
        'error_m 0.25': {'before': 0.010, 'after': 0.011},
        'error_m 0.5': {'before': 0.063, 'after': 0.096},
        'error_m 1': {'before': None, 'after': 0.2},
    }
    words = 'predicted positions 0.5 s ahead become worse with the fitted parameters: from 63 to 96 mm'
    assert find_worse_positions(comparison) == [words]
    (sentence,) = make_verdict({'comparison': {name: comparison[name] for name in ('error_m 0.5', 'error_m 1')}})
    assert sentence == 'Worse with the fitted parameters: error of positions 0.5 s ahead [mm] 63.0 to 96.0.'


@pytest.mark.parametrize(('options', 'code'), [([], 2), (['--allow', 'positions'], 0)])
def test_without_a_terminal_worse_positions_are_written_only_if_allowed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], options: list[str], code: int
) -> None:
    fit, output = Fit(CONFIG), tmp_path / 'operator.yaml'
    fit.comparison = {'error_m 0.5': {'before': 0.063, 'after': 0.096}}
    monkeypatch.setattr('foc_ros.analysis.fitting.fit.fit_parameters', lambda *_, **__: fit)
    data = write_tables(tmp_path / 'data', count=1)
    assert main(['fit', str(data), '--output', str(output), '--workers', '1', *options]) == code
    error = capsys.readouterr().err
    assert 'predicted positions 0.5 s ahead become worse with the fitted parameters: from 63 to 96 mm\n' in error
    assert output.exists() == (code == 0)
    assert (f'{output} is not written; --allow positions writes it all the same' in error) == (code == 2)


@pytest.mark.parametrize(('answer', 'is_written'), [('y', True), ('Yes ', True), ('', False), ('no', False)])
def test_a_terminal_is_asked_before_worse_positions_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], answer: str, is_written: bool
) -> None:
    asked = []

    def ask(question: str) -> str:
        assert 'become worse' in capsys.readouterr().err and not output.exists()
        asked.append(question)
        return answer

    output, fit = tmp_path / 'operator.yaml', Fit(CONFIG)
    fit.comparison = {'error_m 0.5': {'before': 0.063, 'after': 0.096}}
    monkeypatch.setattr('foc_ros.analysis.fitting.fit.fit_parameters', lambda *_, **__: fit)
    monkeypatch.setattr(sys.stdin, 'isatty', lambda: True)
    monkeypatch.setattr(sys.stdout, 'isatty', lambda: True)
    monkeypatch.setattr('builtins.input', ask)
    data = write_tables(tmp_path / 'data', count=1)
    code = main(['fit', str(data), '--output', str(output), '--workers', '1'])
    assert (code, output.exists()) == ((0, True) if is_written else (2, False))
    assert asked == [f'Write {output} all the same? [y/N] ']
