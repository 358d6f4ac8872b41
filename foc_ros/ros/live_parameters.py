"""Changes of a running node's parameters: all that are set together are checked together, and applied or refused as one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter

from foc_ros.core.config import Config, updated
from foc_ros.core.errors import ParameterError

from .parameters import KNOWN, config_of


class LiveParameters:
    """Hands every new configuration to `apply`. Attributes: config, the one that holds."""

    def __init__(self, node: Any, config: Config, apply: Callable[[Config], None]) -> None:
        self.config = config
        self._node, self._apply = node, apply
        node.add_pre_set_parameters_callback(self._prepare)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._accept)

    def _prepare(self, changed: list[Parameter]) -> list[Parameter]:
        """Name the unknown ones, as rclpy does not; read a whole number as a real one where that is wanted."""
        unknown = [each.name for each in changed if not self._node.has_parameter(each.name)]
        if unknown:
            raise ParameterNotDeclaredException(unknown)
        return [
            Parameter(each.name, value=float(each.value))
            if each.type_ == Parameter.Type.INTEGER and each.name in KNOWN and isinstance(KNOWN[each.name].default, float)
            else each
            for each in changed
        ]

    def _check(self, changed: list[Parameter]) -> SetParametersResult:
        try:
            updated(self.config, {each.name: each.value for each in changed if each.name in KNOWN})
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, changed: list[Parameter]) -> None:
        if any(each.name in KNOWN for each in changed):
            self.config = config_of(self._node)
            self._apply(self.config)
