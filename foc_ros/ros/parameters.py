"""The parameters of `foc_ros.core.config` as a ROS 2 parameter file, which the node and the commands read alike.

`python -m foc_ros.ros.parameters > config/foc.yaml` writes the file with every default.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from foc_ros.core.config import Config, Parameter, flatten, list_parameters, replace_values
from foc_ros.core.errors import FocError, InputError, ParameterError
from foc_ros.io.documents import parse_yaml, read_document

NODE_KEYS = ('/**', 'foc', '/foc')
"""Sections of a parameter file that the node reads under its default name."""
AUTOSTART = 'autostart'
NODE_ONLY = ('use_sim_time', 'start_type_description_service', 'qos_overrides', AUTOSTART)
"""Parameters of the node alone, which may stand in the same file; the predictor does not use them."""
KNOWN = {parameter.name: parameter for parameter in list_parameters()}
_WIDTH = 100


def load_parameter_file(path: Path | str) -> Config:
    """Return the configuration of a ROS 2 parameter file; parameters that it does not contain have their defaults.

    Later sections override earlier ones; sections of other nodes and parameters of the node alone are skipped. Raises
    ParameterError, naming the parameter, for one that is unknown or out of bounds, with a note for every further one, and
    RecordingError if the file is no YAML.
    """
    return replace_values(Config(), _read_values(path))


def check_parameters(arguments: Sequence[str]) -> None:
    """Raise ParameterError for wrong parameters in the ROS arguments of a node, before the node is imported, which takes seconds.

    This leaves to the node what it cannot read as simply as ROS would: a node with another name or namespace, a file without a
    section for the default name, parameters of one node among several, and texts that PyYAML takes for dates or numbers. The
    node checks all that it is given.
    """
    values: dict[str, object] = {}
    try:
        for option, given in pairwise(arguments):
            if any(rule in given for rule in ('__node:=', '__name:=', '__ns:=')):
                return
            if option == '--params-file':
                values.update(_read_values(given))
            elif option in ('-p', '--param'):
                name, _, text = given.partition(':=')
                if ':' in name:
                    return
                value = parse_yaml(text)
                if name in KNOWN and isinstance(KNOWN[name].default, str) and not isinstance(value, str):
                    return
                values.update(_flatten_group({name: value}))
    except (FocError, ValueError, yaml.YAMLError):
        return
    replace_values(Config(), values)


def _read_values(path: Path | str) -> dict[str, object]:
    """Return the values of a parameter file by dotted name; see `load_parameter_file`."""
    document = read_document(Path(path))
    if not isinstance(document, Mapping) or not any(key in NODE_KEYS for key in document):
        keys = ', '.join(map(str, document)) if isinstance(document, Mapping) else type(document).__name__
        raise ParameterError(str(path), f'a section {" or ".join(NODE_KEYS)}', keys or 'an empty file')
    values: dict[str, object] = {}
    for key, section in document.items():
        if key in NODE_KEYS:
            if not isinstance(section, Mapping) or not isinstance(section.get('ros__parameters'), Mapping):
                raise ParameterError(f'{path}: {key}', 'ros__parameters with parameters below it', repr(section)[:_WIDTH])
            given = list(_flatten_group(section['ros__parameters']))
            names = Counter(name for name, _ in given)
            if len(names) < len(given):
                raise ParameterError(names.most_common(1)[0][0], f'one value in section {key}', 'two, nested and dotted')
            values.update(given)
    return values


def _flatten_group(group: Mapping[Any, object], prefix: str = '') -> Iterator[tuple[str, object]]:
    """Yield every value by dotted name; names in the file may be nested, dotted or both."""
    for key, value in group.items():
        name = f'{prefix}{key}'
        if name.split('.')[0] in NODE_ONLY:
            continue
        if isinstance(value, Mapping) and any(known.startswith(f'{name}.') for known in KNOWN):
            yield from _flatten_group(value, f'{name}.')
        else:
            yield name, value


def dump_parameter_file(config: Config) -> str:
    """Return a parameter file with every value, and its description, unit and range as a comment."""
    lines = ['# Parameters of foc_ros, for the node (ros2 run, launch) and for replay --params.', '/**:', '  ros__parameters:']
    values, group = flatten(config), ''
    for parameter in sorted(list_parameters(), key=lambda each: '.' in each.name):
        head, _, leaf = parameter.name.rpartition('.')
        if head != group:
            lines.append(f'    {head}:')
            group = head
        indent = ' ' * (6 if head else 4)
        value = yaml.safe_dump(values[parameter.name], default_flow_style=True).splitlines()[0]
        lines += [f'{indent}# {_describe(parameter)}', f'{indent}{leaf}: {value}']
    return '\n'.join(lines) + '\n'


def write_parameter_file(option: str, file: Path, config: Config) -> None:
    """Write a parameter file; raises InputError, which names the option of the command, where that is impossible."""
    try:
        file.write_text(dump_parameter_file(config), encoding='utf-8')
    except OSError as error:
        raise InputError(option, 'a file that can be written', f'{file}: {error.strerror}') from error


def _describe(parameter: Parameter) -> str:
    """Return the description, unit, and range or choices of a parameter in one line."""
    bound, choices = parameter.bound, tuple(parameter.bound.choices)
    parts = [f'{bound.meaning} [{bound.unit}]' if bound.unit else bound.meaning]
    if bound.low is not None and bound.high is not None:
        parts.append(f'{bound.low:g} to {bound.high:g}')
    if choices:
        parts.append(' | '.join(choices))
    if bound.read_only:
        parts.append('fixed once the node runs')
    return '; '.join(parts)


if __name__ == '__main__':
    sys.stdout.write(dump_parameter_file(Config()))
