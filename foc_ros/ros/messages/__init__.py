# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""ROS messages: `decode_*` turns input messages into records of the core, `encode_*` turns records into messages.

A message is anything with the attributes of its type, from rclpy or from rosbags. May import `foc_ros.core`, and not rclpy.
"""
