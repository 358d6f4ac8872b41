# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The numeric core: a hand state and a scene enter, a prediction leaves.

It may import NumPy, PIQP and its own modules. It knows no ROS, no files and no plots.
"""
