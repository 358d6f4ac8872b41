# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the config classes in the parameter file and on the node."""

import dataclasses
import itertools
import re
import warnings
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.config import Config, list_parameters, replace_values
from foc_ros.core.errors import FocError, FocWarning, InputError, ParameterError
from foc_ros.ros import parameters as module
from foc_ros.ros.parameters import check_parameter_files, dump_parameter_file, load_parameter_file, write_parameter_file


def load(folder, text):
    file = folder / 'params.yaml'
    file.write_text(text, 'utf-8')
    return load_parameter_file(file)


def values_of(parameter):
    bound = parameter.bound
    if bound.choices:
        return st.sampled_from(tuple(bound.choices))
    if isinstance(parameter.default, str):
        return st.text(st.characters(codec='ascii', exclude_categories=['Cc']), max_size=12)
    if isinstance(parameter.default, bool):
        return st.booleans()
    if isinstance(parameter.default, int):
        return st.integers(int(bound.low), int(bound.high))
    return st.floats(bound.low, bound.high)


@settings(max_examples=40)
@given(st.fixed_dictionaries({}, optional={parameter.name: values_of(parameter) for parameter in list_parameters()}))
def test_every_configuration_is_read_as_it_was_written(tmp_path_factory, values):
    config = replace_values(Config(), values)
    assert load(tmp_path_factory.getbasetemp(), dump_parameter_file(config)) == config


@pytest.mark.parametrize('key', ['/**', 'foc', '/foc', '/: {foc'])
@pytest.mark.parametrize(
    'body', ['foc: {eta: 0.8, steps: 20}', '{foc.eta: 0.8, foc.steps: 20}', '{foc: {eta: 0.8}, foc.steps: 20}']
)
def test_names_are_nested_or_dotted(tmp_path, key, body):
    text = f'{key}: {{ros__parameters: {{{body.strip("{}") if body[0] == "{" else body}}}}}'
    config = load(tmp_path, text + '}' * key.count('{'))
    assert (config.foc.eta, config.foc.steps) == (0.8, 20)
    assert dataclasses.replace(config, foc=Config().foc) == Config()


def test_parameters_of_others_in_the_file_are_skipped(tmp_path):
    text = """
/other_node: {ros__parameters: {gain: 3}}
/**:
  ros__parameters:
    use_sim_time: true
    start_type_description_service: false
    qos_overrides: {/hand_pose: {subscription: {depth: 10}}}
    rate_hz: 20
foc: {ros__parameters: {rate_hz: 25}}
"""
    with pytest.warns(FocWarning, match='params.yaml: /other_node does not apply to the node /foc$'):
        config = load(tmp_path, text)
    assert config.rate_hz == 25.0 and isinstance(config.rate_hz, float)


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        ('rate: 5', 'rate: expected a known parameter (did you mean rate_hz?), got 5'),
        ('foc: {etta: 0.5}', 'foc.etta: expected a known parameter (did you mean foc.eta?), got 0.5'),
        ('foc: {eta: {low: 1}}', 'foc.eta: expected a finite number'),
        ('likelihood: {beta_beyond: 0.1}', 'likelihood.beta_beyond: expected no value, because it was removed'),
        ('experience.prior_count: 2.0', 'how much recordings count is fixed, got 2.0'),
        ('duration: {model: cost_of_time}', "duration.model: expected one of fixed, fitts, got 'cost_of_time'"),
        ('foc: 5', 'foc: expected a group of parameters, got 5'),
        ('foc: {eta: 1.5}', 'foc.eta: expected a number in [0, 0.999], got 1.5'),
        ('foc: {eta: .nan}', 'foc.eta: expected a finite number in [0, 0.999], got nan'),
        ('foc: {steps: 20.5}', 'foc.steps: expected a whole number in [5, 400], got 20.5'),
        ('foc: {steps: true}', 'foc.steps: expected a finite number in [5, 400], got True'),
        ('foc: {steps: null}', 'foc.steps: expected a finite number in [5, 400], got None'),
        ('foc: {strategy: best}', "foc.strategy: expected one of lv, hc, optimal, algorithm1, fixed, got 'best'"),
        ('frame_id: 7', 'frame_id: expected a text, got 7'),
        (f'rate_hz: {"9" * 400}', 'rate_hz: expected a number in [0.1, 1000] Hz, got 9999'),
        (f'foc.steps: {"9" * 4000}', 'foc.steps: expected a number in [5, 400], got a whole number'),
        ('foc: {steps: 9}, foc.steps: 9', 'foc.steps: expected one value in section /**, got two'),
    ],
)
def test_a_wrong_value_is_refused_with_its_reason(tmp_path, values, words):
    with pytest.raises(ParameterError, match=re.escape(words)):
        load(tmp_path, f'/**: {{ros__parameters: {{{values}}}}}')


@pytest.mark.parametrize(('text', 'got'), [('/other: {ros__parameters: {rate_hz: 5}}', '/other'), ('', 'an empty file')])
def test_a_file_without_a_section_for_the_node_is_refused(tmp_path, text, got):
    with pytest.raises(ParameterError, match=f'expected a section for the node /foc, such as .* or /foc, got {got}$'):
        load(tmp_path, text)


def make_node(ros):
    return ros.node('foc', automatically_declare_parameters_from_overrides=True)


SECTIONS = ['/**', '/*', 'foc', '/foc', '/**/foc', '/*/foc', '/**/**', '/arm/foc', '/arm/*', '/arm/**', 'arm/foc', '/arm/left/*']


@pytest.mark.parametrize('namespace', ['/', '/arm', '/arm/left'])
def test_sections_apply_as_ros_applies_them(tmp_path, namespace):
    """All pairs of sections, of which the later one wins, in the node and in what is checked before it."""
    from ros_helpers import graph

    file = tmp_path / 'params.yaml'
    node = f'{namespace}/foc'.replace('//', '/')
    arguments = ['--ros-args', '--params-file', str(file), '-r', f'__ns:={namespace}']
    for first, second in itertools.permutations(SECTIONS, 2):
        rates = {first: 5.0, second: 6.0}
        file.write_text('\n'.join(f'{name}: {{ros__parameters: {{rate_hz: {rate}}}}}' for name, rate in rates.items()))
        applied = [rate for name, rate in rates.items() if module._applies(f'/{name.lstrip("/")}', node)]
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', FocWarning)
            assert module._read_values(file, node, is_needed=False) == ({'rate_hz': applied[-1]} if applied else {})
            if namespace == '/' and applied:
                assert load_parameter_file(file).rate_hz == applied[-1]
        if first == '/**':  # which applies always: it shows whether the second one does; a node takes a while
            with graph(arguments) as ros:
                overrides = make_node(ros).get_parameters_by_prefix('')
                assert [each.value for name, each in overrides.items() if name == 'rate_hz'] == applied[-1:]


def test_a_section_that_does_not_apply_is_named(tmp_path):
    file = tmp_path / 'params.yaml'
    file.write_text('arm: {foc: {ros__parameters: {rate_hz: -1.0}}}\n/**: {ros__parameters: {rate_hz: 6}}')
    with pytest.warns(FocWarning, match='params.yaml: /arm/foc does not apply to the node /foc$'):
        assert load_parameter_file(file).rate_hz == 6.0
    arguments = ['foc_node', '--ros-args', '--params-file', str(file)]
    with pytest.warns(FocWarning, match='does not apply to the node /foc$'):
        check_parameter_files(arguments)
    for others in (['-r', '__ns:=/left'], ['-r', '__node:=arm'], ['--remap', '__name:=arm']):
        with pytest.warns(FocWarning, match='/arm/foc does not apply to the node /(left/foc|arm)$'):
            check_parameter_files([*arguments, *others])


ALIASES = ['a0: &a0 {x: 1}', *[f'a{i}: &a{i} {{b: *a{i - 1}, c: *a{i - 1}}}' for i in range(1, 60)]]
"""Nested ones stand for any amount of data; a parser of ROS refuses them, too."""


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('/**: {ros__parameters: [1, 2]}', '/**: expected ros__parameters with parameters below it'),
        ('foc:', 'foc: expected ros__parameters with parameters below it, got None'),
        ('[1, 2]', 'expected a section for the node /foc, such as /** or /foc, got list'),
        ('/**: {ros__parameters: {rate_hz: 5', 'params.yaml: not a YAML file'),
        ('!!python/object/apply:os.system ["true"]', 'params.yaml: not a YAML file'),
        ('\x00', 'params.yaml: not a YAML file'),
        ('other:\n  ' + '\n  '.join(ALIASES), 'tags (!name) and aliases (*name) are not supported'),
        (None, 'params.yaml: cannot be read'),
        ('foc: {ros__parameters: {rate_hz: 5}}\nfoc: {ros__parameters: {rate_hz: 6}}', 'the key foc is given twice'),
        ('foc: {ros__parameters: {rate_hz: 5, rate_hz: 6}}', 'the key rate_hz is given twice'),
        ('foc:\n\tros__parameters:\n\t\trate_hz: 5', "found character '\\t'"),
        ('foc: {ros__parameters: {<<: {rate_hz: 5}}}', 'merging (<<) is not supported'),
        ('foc: {rate_hz: 5}', '/foc: expected ros__parameters with parameters below it'),
        ('ros__parameters: {rate_hz: 5}', 'expected the name of a node'),
        ('arm: {/foc: {ros__parameters: {rate_hz: 5}}}', 'above ros__parameters, got /arm//foc'),
        *((f'{name}: {{ros__parameters: {{rate_hz: 5}}}}', f'got /{name}') for name in ('fo*', 'foc/', 'foc-x', '"***"', '2foc')),
    ],
)
def test_node_and_commands_refuse_the_same_files(tmp_path, text, words):
    file = tmp_path / 'params.yaml'
    if text is not None:
        file.write_text(text)
    for read in (load_parameter_file, lambda each: check_parameter_files(['--ros-args', '--params-file', str(each)])):
        with pytest.raises(FocError, match=re.escape(words.replace('"', ''))):
            read(file)


def test_numbers_with_an_exponent_need_no_point_and_those_with_a_sign_no_zero(tmp_path):
    config = load(tmp_path, 'foc: {ros__parameters: {budget_s: 1e-3, scene.timeout_s: 2E1, rate_hz: .5e2, foc.eta: +.5}}')
    assert (config.budget_s, config.scene.timeout_s, config.rate_hz, config.foc.eta) == (0.001, 20.0, 50.0, 0.5)
    with pytest.raises(ParameterError, match=r"rate_hz: expected a finite number in .*, got '1_0'"):  # a text for ROS
        load(tmp_path, 'foc: {ros__parameters: {rate_hz: 1_0}}')


def test_a_node_reads_the_file_that_replay_reads(tmp_path):
    from ros_helpers import graph

    from foc_ros.ros.node_parameters import declare_parameters

    config = replace_values(Config(), {'foc.lv_delta': 5e-5, 'foc.lam': 1e15, 'frame_id': 'base', 'foc.steps': 33})
    file = tmp_path / 'params.yaml'
    file.write_text(dump_parameter_file(config), 'utf-8')
    with graph(['--ros-args', '--params-file', str(file)]) as ros:
        assert declare_parameters(make_node(ros)) == config == load_parameter_file(file)


@pytest.mark.parametrize('before', ['an earlier one', None])
def test_a_full_disk_leaves_the_earlier_file_or_none(tmp_path, monkeypatch, before):
    def write_a_part(self, text, **_):
        self.write_bytes(text.encode()[:10])
        raise OSError(28, 'No space left on device')

    file = tmp_path / 'operator.yaml'
    if before is not None:
        file.write_text(before)
    monkeypatch.setattr(Path, 'write_text', write_a_part)
    with pytest.raises(InputError, match=r'--output: expected a file that can be written, got .*: No space left on device'):
        write_parameter_file('--output', file, Config())
    assert [each.read_text() for each in tmp_path.iterdir()] == ([] if before is None else [before])
