# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of `foc_ros.core.config` on a node: their declaration with ranges, and their changes, all of them or none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter as RosParameter

from foc_ros.core.config import Config, flatten, replace_values
from foc_ros.core.errors import FocError, ParameterError, collect, join_errors, suggest
from foc_ros.core.parameter import Parameter

from .parameters import AUTOSTART, KNOWN, NODE_ONLY, describe_meaning


def declare_parameters(node: Any) -> Config:
    """Declare every parameter and `autostart` on a node, and return the configuration with which it starts.

    The node must be created with `automatically_declare_parameters_from_overrides`. Raises ParameterError, also for an unknown
    name, with a note for every further error.
    """
    given = {name: parameter.value for name, parameter in node.get_parameters_by_prefix('').items()}
    errors: list[FocError] = []
    for name, value in given.items():
        if name in KNOWN or name == AUTOSTART:
            node.undeclare_parameter(name)
        elif name.split('.')[0] not in NODE_ONLY:
            errors.append(ParameterError(name, f'a known parameter{suggest(name, (*KNOWN, *NODE_ONLY))}', repr(value)))
    autostart = given.get(AUTOSTART, True)
    if not isinstance(autostart, bool):
        errors.append(ParameterError(AUTOSTART, 'true or false', repr(autostart)))
    checked = collect(errors, replace_values, Config(), {name: value for name, value in given.items() if name in KNOWN})
    if checked is None or errors:
        raise join_errors(errors)
    values = flatten(checked)
    rows = [(name, values[name], _build_descriptor(parameter)) for name, parameter in KNOWN.items()]
    meaning = 'configure and activate the node when it starts; false: a lifecycle manager does it'
    rows.append((AUTOSTART, autostart, ParameterDescriptor(description=meaning, read_only=True)))
    node.declare_parameters('', rows, ignore_override=True)
    return checked


def _build_descriptor(parameter: Parameter) -> ParameterDescriptor:
    bound = parameter.bound
    descriptor = ParameterDescriptor(
        name=parameter.name,
        description=describe_meaning(bound),
        additional_constraints=f'one of {", ".join(bound.choices)}' if bound.choices else '',
        read_only=bound.read_only,
    )
    if bound.low is not None and bound.high is not None:
        if isinstance(parameter.default, int):
            descriptor.integer_range = [IntegerRange(from_value=int(bound.low), to_value=int(bound.high), step=1)]
        else:
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(bound.low), to_value=float(bound.high))]
    return descriptor


class LiveParameters:
    """The parameters of a running node; `apply` is called with every new configuration. Attributes: config, the present one."""

    def __init__(self, node: Any, config: Config, apply: Callable[[Config], None]) -> None:
        self.config = config
        self._node, self._apply = node, apply
        node.add_pre_set_parameters_callback(self._convert)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._accept)

    def _convert(self, changed: list[RosParameter]) -> list[RosParameter]:
        """Convert integers given for floats; refuse unknown parameters by name, which rclpy does not."""
        if unknown := [each.name for each in changed if not self._node.has_parameter(each.name)]:
            raise ParameterNotDeclaredException(unknown)
        floats = {name for name, parameter in KNOWN.items() if isinstance(parameter.default, float)}
        is_whole = [each.type_ == RosParameter.Type.INTEGER and each.name in floats for each in changed]
        return [RosParameter(e.name, value=float(e.value)) if whole else e for e, whole in zip(changed, is_whole, strict=True)]

    def _check(self, changed: list[RosParameter]) -> SetParametersResult:
        try:
            replace_values(self.config, {each.name: each.value for each in changed if each.name in KNOWN})
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, changed: list[RosParameter]) -> None:
        if any(each.name in KNOWN for each in changed):
            self.config = replace_values(Config(), {name: self._node.get_parameter(name).value for name in KNOWN})
            self._apply(self.config)
