"""The parameters of `foc_ros.core.config` as ROS parameters and as a parameter file.

`python -m foc_ros.ros.parameters > config/foc.yaml` writes the file with every default, for the node and for replay alike.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from foc_ros.core.config import Config, Parameter, flatten, parameters, updated
from foc_ros.core.errors import ParameterError
from foc_ros.io.documents import read_document

NODE_KEYS = ('/**', 'foc', '/foc')
"""Keys of a parameter file under which the node, by its own name, finds its parameters."""
AUTOSTART = 'autostart'
ROS_OWN = ('use_sim_time', 'start_type_description_service', 'qos_overrides', AUTOSTART)
"""Parameters of the node alone, no business of the predictor; they may stand in the same file."""
KNOWN = {parameter.name: parameter for parameter in parameters()}
_WIDTH = 100


def given_config(file: Path | None) -> Config:
    """Return the configuration of a parameter file that may be given, or the default one; raises as `load_parameter_file`."""
    return Config() if file is None else load_parameter_file(file)


def load_parameter_file(path: Path | str) -> Config:
    """Return the configuration of a ROS 2 parameter file; what is not in it keeps its default.

    Later sections overrule earlier ones; sections of other nodes and parameters that every node has are skipped. Raises
    ParameterError, naming the parameter, for one that is unknown or out of bounds; RecordingError where the file is no YAML.
    """
    document = read_document(Path(path))
    if not isinstance(document, Mapping) or not any(key in NODE_KEYS for key in document):
        keys = ', '.join(map(str, document)) if isinstance(document, Mapping) else type(document).__name__
        raise ParameterError(str(path), f'a section {" or ".join(NODE_KEYS)}', keys or 'an empty file')
    values: dict[str, object] = {}
    for key, section in document.items():
        if key in NODE_KEYS:
            if not isinstance(section, Mapping) or not isinstance(section.get('ros__parameters'), Mapping):
                raise ParameterError(f'{path}: {key}', 'ros__parameters with parameters below it', repr(section)[:_WIDTH])
            values.update(_leaves(section['ros__parameters']))
    return updated(Config(), values)


def _leaves(group: Mapping[Any, object], prefix: str = '') -> Iterator[tuple[str, object]]:
    """Yield every value by dotted name; names may be nested, dotted or both."""
    for key, value in group.items():
        name = f'{prefix}{key}'
        if name.split('.')[0] in ROS_OWN:
            continue
        if name not in KNOWN and not any(known.startswith(f'{name}.') for known in KNOWN):
            raise ParameterError(name, 'a known parameter', repr(value)[:_WIDTH])
        if name in KNOWN:
            if isinstance(value, int) and abs(value) >= 2**63:
                raise ParameterError(name, 'a number of 64 bits', f'one of {len(str(value))} digits')
            yield name, value
        elif isinstance(value, Mapping):
            yield from _leaves(value, f'{name}.')
        else:
            raise ParameterError(name, 'a group of parameters', repr(value)[:_WIDTH])


def dump_parameter_file(config: Config) -> str:
    """Return a parameter file with every value, and its meaning, unit and range as a comment."""
    lines = ['# Parameters of foc_ros, for the node (ros2 run, launch) and for replay --params.', '/**:', '  ros__parameters:']
    values, group = flatten(config), ''
    for parameter in sorted(parameters(), key=lambda each: '.' in each.name):
        head, _, leaf = parameter.name.rpartition('.')
        if head != group:
            lines.append(f'    {head}:')
            group = head
        indent = ' ' * (6 if head else 4)
        lines.append(f'{indent}# {describe(parameter)}')
        lines.append(f'{indent}{leaf}: {_scalar(values[parameter.name])}')
    return '\n'.join(lines) + '\n'


def describe(parameter: Parameter) -> str:
    """Return meaning, unit, range or choices of a parameter in one line."""
    bound = parameter.bound
    words = [f'{bound.meaning} [{bound.unit}]' if bound.unit else bound.meaning]
    if bound.low is not None and bound.high is not None:
        words.append(f'{bound.low:g} to {bound.high:g}')
    if bound.choices:
        words.append(' | '.join(bound.choices))
    if bound.read_only:
        words.append('fixed once the node runs')
    return '; '.join(words)


def _scalar(value: object) -> str:
    return yaml.safe_dump(value, default_flow_style=True).splitlines()[0]


def declare_all(node: Any, config: Config) -> Config:
    """Declare every parameter on an rclpy node and return the configuration it starts with.

    config: the defaults. The node is made with `automatically_declare_parameters_from_overrides`, so the values it was started
    with are there already: they are checked together, and unknown ones are warned of. Raises ParameterError.
    """
    given = {name: parameter.value for name, parameter in node.get_parameters_by_prefix('').items()}
    for name in given:
        if name in KNOWN:
            node.undeclare_parameter(name)
        elif name.split('.')[0] not in ROS_OWN:
            node.get_logger().warning(f'parameter {name} is unknown and has no effect')
    config = updated(config, {name: value for name, value in given.items() if name in KNOWN})
    values = flatten(config)
    node.declare_parameters(
        '', [(name, values[name], _descriptor(parameter)) for name, parameter in KNOWN.items()], ignore_override=True
    )
    return config


def config_of(node: Any) -> Config:
    """Return the configuration that a node's declared parameters make."""
    return updated(Config(), {name: node.get_parameter(name).value for name in KNOWN})


def autostart(node: Any) -> bool:
    """Declare the parameter that says whether a managed node activates itself when it is made, and return its value."""
    from rcl_interfaces.msg import ParameterDescriptor

    given = node.get_parameter(AUTOSTART).value if node.has_parameter(AUTOSTART) else True
    if not isinstance(given, bool):
        raise ParameterError(AUTOSTART, 'true or false', repr(given))
    if node.has_parameter(AUTOSTART):
        node.undeclare_parameter(AUTOSTART)
    description = 'configure and activate the node when it starts; false: a manager of lifecycles does'
    node.declare_parameter(AUTOSTART, given, ParameterDescriptor(description=description, read_only=True), ignore_override=True)
    return given


def _descriptor(parameter: Parameter) -> Any:
    from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

    bound, ranges = parameter.bound, {}
    if bound.low is not None and bound.high is not None:
        if isinstance(parameter.default, int):
            ranges['integer_range'] = [IntegerRange(from_value=int(bound.low), to_value=int(bound.high), step=1)]
        else:
            ranges['floating_point_range'] = [FloatingPointRange(from_value=float(bound.low), to_value=float(bound.high))]
    return ParameterDescriptor(
        name=parameter.name,
        description=f'{bound.meaning} [{bound.unit}]' if bound.unit else bound.meaning,
        additional_constraints=f'one of {", ".join(bound.choices)}' if bound.choices else '',
        read_only=bound.read_only,
        **ranges,
    )


if __name__ == '__main__':
    sys.stdout.write(dump_parameter_file(Config()))
