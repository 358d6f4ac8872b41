"""The node as a program: one executor, one thread, an end without an error whenever it is asked to stop."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from foc_ros.core.errors import FocError

from .stop_signals import StopSignals

SPIN_S = 0.1
"""Longest wait before the stop flag is looked at again [s]."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT, SIGTERM or the end of its context; return the exit code, 2 where it cannot start.

    arguments: those of the process by default, without the program's name; all are ROS's (`--ros-args ...`).
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
    gc.freeze()  # what is there by now stays: a full collection of it would hold a prediction up by 80 ms
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    while not stop.requested and context.ok():
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
