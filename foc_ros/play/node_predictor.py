"""The real node behind the page: a process of its own on a ROS graph of its own on this host, reached over DDS."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import Any

import rclpy
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from foc_ros.core.config import Config, flatten
from foc_ros.io.bags import TYPESTORE
from foc_ros.io.topics import CLOUD, GOALS, HAND, TYPES
from foc_ros.ros.isolated_node import NodeDiedError, NodeProcess, private_environment, reserve_domain, set_environment
from foc_ros.ros.messages.types import find_message_class
from foc_ros.ros.parameters import KNOWN

from .predictors import KINDS, NODE, LivePredictor, Receive, State, describe_health

DIAGNOSTICS = '/diagnostics'
DIAGNOSTICS_TYPE = 'diagnostic_msgs/msg/DiagnosticArray'
SILENT_S = 3.0
"""Time without diagnostics, which come once a second, after which the node is gone [s]."""
SPIN_S = 0.1
DEPTH = 50


class NodePredictor(LivePredictor):
    """The node `foc_node`, which is started again if its process ends, and given its parameters whenever it appears."""

    name = 'node over DDS'

    def __init__(self, config: Config, receive: Receive) -> None:
        super().__init__(config, receive)
        self._resources, self._process = ExitStack(), ExitStack()
        self._end = Event()
        self._health, self._heard_s = 'starting', -SILENT_S
        self._is_configured, self._failure = False, ''

    def start(self) -> None:
        """Start the node, and connect to it; it is ready when `check` says so."""
        folder = Path(self._resources.enter_context(tempfile.TemporaryDirectory(prefix='foc_ros_play_')))
        domain = self._resources.enter_context(reserve_domain())
        self._environment, self._log = private_environment(domain, folder), folder / 'node.txt'
        self._resources.enter_context(set_environment(self._environment))
        self._resources.callback(self._process.close)
        self._start_process()
        context = rclpy.Context()
        rclpy.init(context=context, args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('foc_play', context=context, enable_rosout=False, start_parameter_services=False)
        self._publishers = {
            role: self._node.create_publisher(find_message_class(TYPES[role]), role, DEPTH) for role in (HAND, CLOUD, GOALS)
        }
        for topic, kind in KINDS.items():
            self._subscribe(topic, kind, self.receive)
        self._subscribe(DIAGNOSTICS, DIAGNOSTICS_TYPE, self._note_health)
        self._parameters = self._node.create_client(SetParametersAtomically, f'{NODE}/set_parameters_atomically')
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._thread = Thread(target=self._spin, name='dds', daemon=True)
        self._thread.start()
        self._resources.callback(self._disconnect, context)

    def stop(self) -> None:
        """End the connection and the node."""
        self._resources.close()

    def send(self, role: str, raw: bytes) -> None:
        """Publish a message."""
        self._publishers[role].publish(raw)

    def configure(self, config: Config) -> None:
        """Set the parameters of the node; `check` repeats it when a node appears."""
        self.config, self._is_configured = config, False
        self._set_parameters()

    def check(self) -> State:
        """Return the state of the node, and start a new one in place of a process that has ended."""
        try:
            self._node_process.check()
        except NodeDiedError as error:
            self._start_process()
            return State(False, f'{error}; starting again')
        if monotonic() - self._heard_s > SILENT_S:
            self._is_configured = False
            return State(False, 'the node starts' if self._health == 'starting' else 'the node does not answer')
        if not self._is_configured:
            self._set_parameters()
        return State(True, self._failure or self._health)

    @property
    def pid(self) -> int:
        """Process id of the node."""
        return self._node_process.pid

    def _start_process(self) -> None:
        self._process.close()
        self._node_process = self._process.enter_context(NodeProcess(self._environment, self._log))
        self._health, self._heard_s, self._is_configured = 'starting', -SILENT_S, False

    def _subscribe(self, topic: str, kind: str, receive: Receive) -> None:
        self._node.create_subscription(find_message_class(kind), topic, lambda raw: receive(topic, raw), DEPTH, raw=True)

    def _note_health(self, _: str, raw: bytes) -> None:
        message: Any = TYPESTORE.deserialize_cdr(raw, DIAGNOSTICS_TYPE)
        self._health, self._heard_s = describe_health('; '.join(each.message for each in message.status)), monotonic()

    def _set_parameters(self) -> None:
        if not self._parameters.service_is_ready():
            return
        self._is_configured = True
        values = {name: value for name, value in flatten(self.config).items() if not KNOWN[name].bound.read_only}
        rows = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        future = self._parameters.call_async(SetParametersAtomically.Request(parameters=rows))
        future.add_done_callback(self._note_answer)

    def _note_answer(self, future: Any) -> None:
        result = future.result().result
        self._failure = '' if result.successful else f'parameters refused: {result.reason}'

    def _spin(self) -> None:
        while not self._end.is_set():
            self._executor.spin_once(timeout_sec=SPIN_S)

    def _disconnect(self, context: Any) -> None:
        self._end.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        context.try_shutdown()
        context.destroy()
