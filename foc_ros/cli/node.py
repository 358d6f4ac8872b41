"""`node`: runs the node; all arguments are passed on to ROS."""

from __future__ import annotations

import argparse
from importlib.util import find_spec

from foc_ros.core.errors import FocError


def run(arguments: argparse.Namespace) -> int:
    """Run the node until it is stopped."""
    if find_spec('rclpy') is None:
        raise FocError('rclpy is not installed: source a ROS 2 installation, or install the extra `ros`')
    from foc_ros.ros.main import main

    return main(arguments.rest)
