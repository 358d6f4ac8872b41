# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 node: input messages enter; predictions, markers and diagnostics leave.

May import `foc_ros.io` and `foc_ros.core`. No other folder imports rclpy; `messages`, `intake` and `parameters` do not import it
either, because replays without ROS use them.
"""
