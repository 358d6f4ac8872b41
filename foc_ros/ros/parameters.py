# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of `foc_ros.core.config` as a ROS 2 parameter file, which the node and the commands read alike."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from foc_ros.core.config import Config, flatten, list_parameters, replace_values
from foc_ros.core.errors import InputError, ParameterError, warn
from foc_ros.core.parameter import Bound
from foc_ros.io.documents import read_document
from foc_ros.io.outputs import write_whole

NODE = '/foc'
"""Name of the node, with its namespace, unless it is started with another one."""
AUTOSTART = 'autostart'
NODE_ONLY = ('use_sim_time', 'start_type_description_service', 'qos_overrides', AUTOSTART)
"""Parameters of the node alone, which may stand in the same file; the predictor does not use them."""
KNOWN = {parameter.name: parameter for parameter in list_parameters()}


def load_parameter_file(path: Path | str) -> Config:
    """Return the configuration of a ROS 2 parameter file; parameters that it does not contain have their defaults.

    Later sections override earlier ones; sections that do not apply to the node `NODE` are skipped with a warning. Raises
    ParameterError for a parameter that is unknown or out of bounds, with a note for every further one, and where no section
    applies, and RecordingError if the file is no YAML.
    """
    return replace_values(Config(), _read_values(path, NODE, is_needed=True))


def check_parameter_files(arguments: Sequence[str]) -> None:
    """Raise FocError for a parameter file in the ROS arguments of a node that the commands would refuse and ROS would not."""
    given = re.findall(r'__(node|name|ns):=(\S+)', ' '.join(arguments))
    names = {'node': 'foc', 'ns': ''} | {key.replace('name', 'node'): value for key, value in given}
    node = f'/{names["ns"].strip("/")}/{names["node"]}'.replace('//', '/')
    for option, path in pairwise(arguments):
        if option == '--params-file':
            _read_values(path, node, is_needed=False)


def _read_values(path: Path | str, node: str, *, is_needed: bool) -> dict[str, object]:
    """Return the values of a parameter file for a node by dotted name; is_needed: whether it must have a section for the node."""
    document = read_document(Path(path))
    expected = f'a section for the node {node}, such as /** or {node}'
    if document is None and not is_needed:
        return {}
    if not isinstance(document, Mapping):
        raise ParameterError(str(path), expected, 'an empty file' if document is None else type(document).__name__)
    sections = list(_list_sections(document, str(path)))
    others = [name for name, _ in sections if not _applies(name, node)]
    if is_needed and len(others) == len(sections):
        raise ParameterError(str(path), expected, ', '.join(others) or 'none')
    if others:
        warn(f'{path}: {", ".join(others)} {"does" if len(others) == 1 else "do"} not apply to the node {node}')
    values: dict[str, object] = {}
    for name, section in sections:
        if name not in others:
            given = list(_flatten_group(section))
            names = Counter(each for each, _ in given)
            if len(names) < len(given):
                raise ParameterError(names.most_common(1)[0][0], f'one value in section {name}', 'two, nested and dotted')
            values.update(given)
    return values


def _list_sections(group: Mapping[Any, object], path: str, name: str = '') -> Iterator[tuple[str, Mapping[Any, object]]]:
    """Yield the sections of a parameter file, each with the name of its nodes, which may be nested."""
    for key, value in group.items():
        inner = name if key == 'ros__parameters' else f'{name.rstrip("/")}/{str(key).removeprefix("/" if not name else "")}'
        if not re.fullmatch(r'(/(\*\*?|[A-Za-z_]\w*))+', inner, re.ASCII) and inner != '/':  # as rcl allows it
            expected = 'the name of a node, such as /foc, or /** for any number of its parts and /* for one'
            raise ParameterError(path, f'{expected}, above ros__parameters', inner or 'none')
        if not isinstance(value, Mapping) or (not value and inner != name):
            given = group if name else value
            raise ParameterError(f'{path}: {name or inner}', 'ros__parameters with parameters below it', repr(given)[:100])
        if inner == name:
            yield name, value
        else:
            yield from _list_sections(value, path, inner)


def _applies(section: str, node: str) -> bool:
    """Return whether rcl applies a section to a node: `*` stands for one part of its name, `**` for any number of them."""
    pattern = re.escape(section).replace(r'/\*\*', r'(/\w+)*').replace(r'/\*', r'/\w+')
    return re.fullmatch(pattern, node) is not None


def _flatten_group(group: Mapping[Any, object], prefix: str = '') -> Iterator[tuple[str, object]]:
    for key, value in group.items():
        name = f'{prefix}{key}'
        if isinstance(value, Mapping) and any(known.startswith(f'{name}.') for known in KNOWN):
            yield from _flatten_group(value, f'{name}.')
        elif name.split('.')[0] not in NODE_ONLY:
            yield name, value


def describe_meaning(bound: Bound) -> str:
    """Return what a parameter means, with its unit."""
    return f'{bound.meaning} [{bound.unit}]' if bound.unit else bound.meaning


def dump_parameter_file(config: Config) -> str:
    """Return a parameter file with every value, and its description, unit and range as a comment."""
    lines = ['# Parameters of foc_ros, for the node (ros2 run, launch) and for replay --params.', '/**:', '  ros__parameters:']
    values, group = flatten(config), ''
    for parameter in sorted(list_parameters(), key=lambda each: '.' in each.name):
        head, _, leaf = parameter.name.rpartition('.')
        if head != group:
            lines.append(f'    {head}:')
            group = head
        bound, indent = parameter.bound, ' ' * (6 if head else 4)
        parts = [describe_meaning(bound)]
        if bound.low is not None and bound.high is not None:
            parts.append(f'{bound.low:g} to {bound.high:g}')
        if bound.choices:
            parts.append(' | '.join(bound.choices))
        if bound.read_only:
            parts.append('fixed once the node runs')
        value = yaml.safe_dump(values[parameter.name], default_flow_style=True).splitlines()[0]
        lines += [f'{indent}# {"; ".join(parts)}', f'{indent}{leaf}: {value}']
    return '\n'.join(lines) + '\n'


def write_parameter_file(option: str, file: Path, config: Config) -> None:
    """Write a parameter file, or nothing; raises InputError, which names the option of the command, where that is impossible."""
    try:
        with write_whole(file) as unfinished:
            unfinished.write_text(dump_parameter_file(config), encoding='utf-8')
    except OSError as error:
        raise InputError(option, 'a file that can be written', f'{file}: {error.strerror}') from error
