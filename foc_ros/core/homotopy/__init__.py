"""Ways round: homotopy classes found, named and seeded, and the side on which a path really passes an obstacle."""

from .search import Search, search
from .shown import named_obstacles, timed
from .sides import path_sides, same_way, swept, swept_angles

__all__ = ['Search', 'named_obstacles', 'path_sides', 'same_way', 'search', 'swept', 'swept_angles', 'timed']
