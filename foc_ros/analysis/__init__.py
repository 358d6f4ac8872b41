# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Analysis: recordings enter; replays, scores, baselines and fitted parameters leave.

May import `foc_ros.ros` (messages and parameters, never rclpy), `foc_ros.io` and `foc_ros.core`.
"""
