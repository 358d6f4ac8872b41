# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Homotopy classes of the paths from the hand to the goals: which classes exist, their names, and an initial guess in each.

Enters: the hand, the goals and the obstacles. Leaves: candidates, the side on which a given path passes an obstacle, and the
decisions that tell candidates apart.
May import `foc_ros.core.plant`, `obstacles`, `hand` and the ground modules.
"""

from .search import Search, SearchOrder, search
from .sides import compute_swept_angles, find_path_sides

__all__ = [
    'Search',
    'SearchOrder',
    'compute_swept_angles',
    'find_path_sides',
    'search',
]
