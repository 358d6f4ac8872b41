# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fit` from the command line: it turns recordings into a parameter file that the node accepts."""

import json
import re

import pytest
from bag_helpers import write_bag
from evaluation_samples import use_few_predictions, write_fit_tables

from foc_ros.analysis.fitting import STAGES
from foc_ros.analysis.fitting import fit as fitting
from foc_ros.cli.main import main
from foc_ros.core.config import Config, flatten, replace_values
from foc_ros.io import terminal
from foc_ros.ros.parameters import dump_parameter_file, load_parameter_file

QUICK = {'foc.steps': 10, 'homotopy.max_candidates': 2, 'duration.fitts_a_s': 0.3}


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    use_few_predictions(monkeypatch)
    monkeypatch.setattr(terminal, 'QUIET_S', 60.0)


def _fit(folder, capsys, *arguments, **parameters):
    given, output = folder.parent / 'given.yaml', folder.parent / 'fitted.yaml'
    given.write_text(dump_parameter_file(replace_values(Config(), {**QUICK, **parameters})))
    options = ['--params', str(given), '--workers', '1', '--json', '--allow', 'eta,positions', *arguments]
    code = main(['fit', str(folder), '--output', str(output), *options])
    printed = capsys.readouterr()
    assert code == (2 if 'bad: ' in printed.err else 0), printed.err
    return json.loads(printed.out) | {'progress': printed.err}, load_parameter_file(output)


def test_everything_is_fitted_and_written_for_the_node(tmp_path, capsys):
    answer, config = _fit(write_fit_tables(tmp_path / 'data'), capsys)
    stages = re.findall(r'^stage (\d) of 7, (\w+).* \d+ of \d+$', answer['progress'], re.MULTILINE)
    assert list(dict.fromkeys(stages)) == [(str(number), name) for number, name in enumerate(STAGES, 1)]
    assert answer['recordings'] == 6 and answer['failed'] == {}
    values = flatten(config)
    fitted = {'estimator.position_stddev', 'estimator.jerk_density', 'duration.fitts_a_s', 'duration.fitts_b_s'}
    kept = {'foc.noise_x', 'foc.noise_y', 'foc.eta', 'foc.process_noise', 'likelihood.beta', 'likelihood.lookahead_s'}
    assert fitted <= set(answer['parameters'])
    assert kept <= set(answer['parameters']) | set(answer['undetermined'])
    assert not set(answer['parameters'] | answer['chosen']) & set(answer['undetermined'])
    for name, each in answer['parameters'].items():
        assert values[name] == each['value']
        assert each['interval'][0] <= each['value'] * 1.01 and each['value'] <= each['interval'][1] * 1.01, name
    for name, choice in answer['chosen'].items():
        assert values[name] == choice['value'] != choice['given']
    unfitted = {name: value for name, value in values.items() if name not in answer['parameters'] | answer['chosen']}
    assert unfitted == {name: value for name, value in flatten(replace_values(Config(), QUICK)).items() if name in unfitted}
    assert answer['parameters']['estimator.position_stddev']['value'] == pytest.approx(5e-4, rel=0.2)
    assert [values[f'{each}.adaptation'] for each in ('duration', 'covariance')] == ['online', 'online']
    classes = answer['scores']['ways']
    assert classes['fitted'] >= classes['held out'] and classes['fitted'] > classes['uniform']
    assert set(classes) == {'uniform', 'as given', 'fitted', 'held out'}
    assert 0.5 < answer['scores']['inside_90']['fitted'] <= 1.0
    errors = {f'error_m {t}' for t in ('0.25', '0.5', '1')}
    assert set(answer['comparison']) == {'class_gain', 'gap_right', 'nlpd', 'inside_90', *errors}
    # six recordings determine how the hand moves, not how classes are weighed, so that these gain nothing
    assert answer['comparison']['class_gain']['after'] > answer['comparison']['class_gain']['before'] - 0.02
    assert answer['comparison']['nlpd']['after'] < answer['comparison']['nlpd']['before']
    assert answer['node'][0] == f'python -m foc_ros node --ros-args --params-file {tmp_path / "fitted.yaml"}'
    assert any('too alike to tell intercept and slope apart' in words for words in answer['warnings'])


def test_without_obstacles_goals_are_distinguished_and_margins_are_kept(tmp_path, capsys):
    answer, config = _fit(write_fit_tables(tmp_path / 'data', obstacle=False), capsys, **{'homotopy.max_candidates': 3})
    assert not {'foc.eta', 'foc.noise_x', 'foc.noise_y'} & set(answer['parameters'])
    assert (config.foc.eta, config.foc.noise_x) == (Config().foc.eta, Config().foc.noise_x)
    why = [answer['undetermined'][name]['why'] for name in ('foc.eta', 'foc.noise_x', 'foc.noise_y')]
    assert all(each.startswith('no recording has an obstacle') for each in why)
    assert answer['scores']['ways']['fitted'] > answer['scores']['ways']['uniform'] + 0.1


def test_two_recordings_determine_the_filter_alone_which_is_said_at_the_start(tmp_path, capsys):
    answer, config = _fit(write_fit_tables(tmp_path / 'data', count=2), capsys, **{'covariance.near': 1.5})
    (changed,) = set(answer['parameters']) - {'estimator.jerk_density'}
    low, high = answer['parameters'][changed]['interval']
    assert changed == 'estimator.position_stddev' and low < answer['parameters'][changed]['value'] < high
    assert {'duration.arrival', 'duration.fitts_a_s', 'duration.wait_s', 'foc.eta', *fitting.FROM_ONE_REPLAY} <= set(
        answer['undetermined']
    )
    values, given = flatten(config), flatten(replace_values(Config(), QUICK | {'covariance.near': 1.5}))
    assert {name: each for name, each in values.items() if name not in answer['parameters']} == {
        name: each for name, each in given.items() if name not in answer['parameters']
    }
    few = answer['undetermined']['foc.eta']['why']
    assert few == 'too few recordings: 2, 6 are needed'
    assert answer['progress'].index('Too few recordings (2): ') < answer['progress'].index('stage 1 of 2, before')
    assert answer['warnings'][-1].startswith('Too few recordings (2): only what the filter')
    answer['chosen'] = {'covariance.near': {'given': 1.5, 'value': '1.0'}}
    shown = {row[0]: row[1:3] for row in (*fitting.format_parameters(answer), *fitting.format_kept(answer))}
    assert shown['foc.eta'] == ('0.9', few) and shown['covariance.near'] == ('1.5', '1.0')


def test_recordings_of_which_too_few_can_be_predicted_do_not_determine_what_needs_predictions(monkeypatch):
    monkeypatch.setattr(fitting, 'collect', lambda *_: ([None] * 5, {'sixth': 'nothing could be predicted'}))
    fit = fitting.Fit(config=replace_values(Config(), {'covariance.far': 1.5}))
    fitting._fit_to_one_replay({}, fit, {})
    assert set(fit.undetermined) == set(fitting.FROM_ONE_REPLAY) and fit.values == {} and fit.config.covariance.far == 1.5


def test_a_coverage_that_falls_is_told():
    (told,) = fitting.make_verdict({'scores': {}, 'comparison': {'inside_90': {'before': 0.853, 'after': 0.765}}})
    assert told.startswith('Worse on the same recordings, with the fitted parameters: positions in') and '85.3 to 76.5' in told


FIXED = {'foc.strategy': 'fixed', 'foc.tau': 1e-4}


def test_one_bag_and_a_broken_one_with_strategy_fixed_which_keeps_its_tau_and_lambda(tmp_path, capsys, monkeypatch):
    real, kept = fitting.fit_parameters, []

    def keep(*given, **named):
        kept.append(real(*given, **named))
        return kept[-1]

    monkeypatch.setattr(fitting, 'fit_parameters', keep)
    write_bag(tmp_path / 'bags' / 'good')
    (tmp_path / 'bags' / 'bad').mkdir()
    (tmp_path / 'bags' / 'bad' / 'bad.mcap').write_bytes(b'nothing')
    answer, config = _fit(tmp_path / 'bags', capsys, **FIXED)
    assert answer['recordings'] == 1 and set(answer['failed']) == {'bad'}
    assert any(words.startswith('Too few recordings (1): ') for words in answer['warnings'])
    assert not {'foc.tau', 'foc.lam', 'foc.eta'} & set(answer['parameters'])
    assert {'duration.fitts_a_s', 'duration.arrival'} <= set(answer['undetermined']), 'they may be the best by chance'
    assert config.foc.tau == 1e-4
    assert any(words.startswith('foc.tau, foc.lam: kept as they are') for words in answer['warnings'])
    # the same fit as tables and as a page
    monkeypatch.setattr(fitting, 'fit_parameters', lambda *_, **__: kept[0])
    output = tmp_path / 'out.yaml'
    options = ['--params', str(tmp_path / 'given.yaml'), '--workers', '1', '--allow', 'positions', '--report', str(tmp_path)]
    assert main(['fit', str(tmp_path / 'bags'), '--output', str(output), *options]) == 2
    words = capsys.readouterr().out
    assert 'Parameters that keep their values' in words and 'note: Too few recordings (1)' in words
    assert 'on the same recordings, with the fitted parameters: ' in words
    assert max(len(line) for line in words.splitlines() if str(tmp_path) not in line) <= 80
    assert words.endswith(f'\nreport: file://{tmp_path}/fit.html\n')
    assert f'python -m foc_ros node --ros-args --params-file {output}' in words
