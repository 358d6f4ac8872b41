# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Obstacles: shapes and tables of several sources enter; obstacles at a stamp and the moments of their constraint leave.

It may import the ground modules of `foc_ros.core`.
"""
