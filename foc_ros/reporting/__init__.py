# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reporting: predictions, scores and fits enter; pictures and pages leave.

May import everything below `foc_ros.cli`.
"""
