# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A private ROS graph for each test: own context, own domain, own executor; deadlines instead of sleeps.

Use the `ros` fixture of conftest.py (or :func:`graph`) and :meth:`Graph.spin_until`.
"""

import os
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from foc_ros.ros.isolated_node import reserve_domain

ASK_AGAIN_S = 3.0
"""Time after which a service's response counts as dropped, and the request is sent again [s]."""


def prepare_environment() -> None:
    """Turn on field checks and restrict graphs to this host; to be called before a message class is imported."""
    os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.setdefault('ROS_LOG_DIR', str(Path(tempfile.gettempdir()) / 'foc_ros_test_log'))
    with warnings.catch_warnings(), suppress(ImportError):
        warnings.simplefilter('ignore')  # the parser behind rosidl uses modules that Python has deprecated
        import rosidl_generator_py  # noqa: F401


def require_ros() -> None:
    """Skip the test if rclpy is missing; with FOC_ROS_REQUIRE_ROS=1 this is a failure by conftest.py."""
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        pytest.skip(f'rclpy cannot be imported ({error}): install ROS 2, or the extra `ros`', allow_module_level=True)


class Graph:
    """One context in one domain with one executor; `nodes` are destroyed with it."""

    def __init__(self, domain: int, args: list[str] | None = None) -> None:
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from foc_ros.ros.main import create_executor

        self.domain = domain
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=args or [], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self.executor = create_executor(self.context)
        self.nodes: list[Any] = []

    @property
    def environment(self) -> dict[str, str]:
        """The environment in which a child process joins this graph."""
        return os.environ | {'ROS_DOMAIN_ID': str(self.domain)}

    def add(self, node: Any) -> Any:
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def node(self, name: str = 'helper', **options: Any) -> Any:
        from rclpy.node import Node

        return self.add(Node(name, context=self.context, **options))

    def collect(self, node: Any, message_type: Any, topic: str, qos: Any = 100) -> list[Any]:
        """Subscribe, and return the list to which the messages are appended."""
        received: list[Any] = []
        node.create_subscription(message_type, topic, received.append, qos)
        return received

    def spin_until(self, condition: Callable[[], bool], what: str, seconds: float = 20.0) -> None:
        """Spin until the condition holds; fail after a deadline with `what` was awaited."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, f'waited {seconds} s for: {what}'
            self.executor.spin_once(timeout_sec=0.02)

    def spin_for(self, seconds: float) -> None:
        """Spin for a while, to check that something does not happen."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def call(self, node: Any, service_type: Any, name: str, request: Any, seconds: float = 20.0) -> Any:
        """Call a service and return its response.

        The request is sent again if there is no response: a server that has not yet discovered its client's reader drops the
        response (rmw logs "client will not receive response"). The service must therefore allow a second call.
        """
        client = node.create_client(service_type, name)
        self.spin_until(client.service_is_ready, f'service {name}', seconds)
        futures = [client.call_async(request)]
        asked, deadline = time.monotonic(), time.monotonic() + seconds
        while not any(future.done() for future in futures):
            assert time.monotonic() < deadline, f'waited {seconds} s for: the response of {name}, asked {len(futures)} times'
            self.executor.spin_once(timeout_sec=0.02)
            if time.monotonic() - asked > ASK_AGAIN_S:
                futures.append(client.call_async(request))
                asked = time.monotonic()
        node.destroy_client(client)
        return next(future.result() for future in futures if future.done())

    def close(self) -> None:
        for node in self.nodes:
            self.executor.remove_node(node)
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()
        self.context.destroy()


@contextmanager
def graph(args: list[str] | None = None) -> Iterator[Graph]:
    """Return a graph in a free domain; args: ROS arguments such as ['--ros-args', '-p', 'rate_hz:=20.0']."""
    require_ros()
    with reserve_domain() as domain, closing(Graph(domain, args)) as made:
        yield made
