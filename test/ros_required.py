# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Imported first by the tests of the node: where rclpy is missing, they are skipped, or fail if FOC_ROS_REQUIRE_ROS=1."""

from ros_helpers import require_ros

require_ros()
