# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The plant: a plant and a number of steps enter; condensed horizons, covariances and predictive covariances leave.

It may import the ground modules of `foc_ros.core`, `hand` and `obstacles`.
"""
