# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The hand: stamped positions enter; its state and its time to go leave.

It may import the ground modules of `foc_ros.core` (types, config, errors).
"""
