"""The node's program: one executor, one thread, and an end without an error at any time."""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Sequence
from types import FrameType

from foc_ros.core.errors import FocError

SPIN_S = 0.1
"""Longest time between two checks of the stop flag [s]."""


class StopSignals:
    """Sets :attr:`is_requested` on SIGINT and SIGTERM, until the end of the process.

    rclpy's own handlers shut the context down during a callback, and some of the stops then end with an error. This flag ends
    the loop between two callbacks.
    """

    def __init__(self) -> None:
        self.is_requested = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._request)

    def _request(self, _number: int, _frame: FrameType | None) -> None:
        self.is_requested = True


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT, SIGTERM or the end of its context; return the exit code, 2 if it cannot start.

    arguments: ROS arguments (`--ros-args ...`) without the program's name; by default those of the process.
    """
    stop = StopSignals()
    import rclpy
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import remove_ros_args

    from .node import FocNode

    given = ['foc_node', *(sys.argv[1:] if arguments is None else arguments)]
    context = rclpy.Context()
    try:
        extra = remove_ros_args(given)[1:]
        if extra:
            raise FocError(f'unrecognized arguments: {" ".join(extra)} (those of ROS follow --ros-args)')
        rclpy.init(args=given, context=context, signal_handler_options=SignalHandlerOptions.NO)
        node = FocNode(context=context)
    except (FocError, RuntimeError, ValueError) as error:
        context.try_shutdown()
        print(f'foc_node: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    gc.collect()
    gc.freeze()  # these objects stay alive: a full collection over them would delay a prediction by 80 ms
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    while not stop.is_requested and context.ok():
        try:
            executor.spin_once(timeout_sec=SPIN_S)
        except ExternalShutdownException:
            break
        except Exception as error:
            node.report(error)
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
