# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node's program: an executor in this thread, a process for predictions, and an end without an error at any time."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Sequence
from io import UnsupportedOperation
from types import FrameType
from typing import Any

from foc_ros.core.errors import FocError, list_messages, print_messages, print_warnings

from .parameters import check_parameter_files


class StopSignals:
    """Ends the process on SIGINT and SIGTERM: at once until `is_deferred` is set, and then by `is_requested`.

    rclpy's own handlers shut the context down during a callback, and some of the stops then end with an error. During an import
    the process ends without an exception, which some imports would hide.
    """

    def __init__(self) -> None:
        self.is_requested = self.is_deferred = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._request)

    def _request(self, _number: int, _frame: FrameType | None) -> None:
        self.is_requested = True
        if not self.is_deferred:
            os._exit(0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT, SIGTERM or the end of its context; return the exit code, 2 if it cannot start.

    arguments: ROS arguments (`--ros-args ...`) without the program's name; by default those of the process.
    """
    stop = StopSignals()
    # with matrices of a hundred columns the threads of a linear algebra library only wait for each other; NumPy is not loaded yet
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    given = ['foc_node', *(sys.argv[1:] if arguments is None else arguments)]
    try:
        with print_warnings('foc_node'):
            check_parameter_files(given)
    except FocError as error:
        return print_messages('foc_node', list_messages(error))
    from .worker import Worker

    worker = Worker(lambda text: print(f'foc_node: warning: {text}', file=sys.stderr))
    import rclpy  # it may start threads, and a process is forked before
    from rclpy.executors import ExternalShutdownException
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import remove_ros_args

    from .node import FocNode

    context = rclpy.Context()
    stop.is_deferred = True
    try:
        extra = remove_ros_args(given)[1:]
        if extra:
            raise FocError(f'unrecognized arguments: {" ".join(extra)} (those of ROS follow --ros-args)')
        rclpy.init(args=given, context=context, signal_handler_options=SignalHandlerOptions.NO)
        node = FocNode(worker.run, context=context)
    except (FocError, RuntimeError, ValueError) as error:
        worker.stop()
        context.try_shutdown()
        if 'initialize logging' in str(error):
            error.add_note('ROS_LOG_DIR names another directory for the log')
        return print_messages('foc_node', list_messages(error))
    # an update of guidance gives the interpreter away several times, and the other threads are to return it soon
    sys.setswitchinterval(0.0002)
    gc.collect()
    gc.freeze()  # these objects stay alive: a full collection over them would delay a prediction by 80 ms
    executor = create_executor(context)
    executor.add_node(node)
    while not stop.is_requested and context.ok():
        try:
            executor.spin_once(timeout_sec=0.1)
            node.rest()
        except ExternalShutdownException:
            break
        except Exception as error:
            node.report(error)
    worker.stop()
    executor.remove_node(node)
    node.destroy_node()
    executor.shutdown()
    context.try_shutdown()
    if node.is_busy_after(0.5):
        os._exit(0)  # otherwise the interpreter waits for the computation
    return 0


def create_executor(context: Any) -> Any:
    """Return rclpy's executor that is called for each event, where rclpy has it (since 7.1.4), and its plain one elsewhere.

    The plain one looks at every topic, service and timer of the node for each message.
    """
    try:
        from rclpy.experimental.events_executor import EventsExecutor

        return EventsExecutor(context=context)
    except (ImportError, UnsupportedOperation):  # it wants a standard error that is a file, for the traces of crashes
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor(context=context)


if __name__ == '__main__':
    sys.exit(main())
