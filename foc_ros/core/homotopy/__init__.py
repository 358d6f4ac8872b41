"""Ways round: homotopy classes found, named and seeded, and the side on which a path really passes an obstacle."""

from .search import Search, search
from .shown import named_obstacles, timed
from .sides import compute_swept_angles, is_same_class, path_sides, sweep_angles

__all__ = ['Search', 'compute_swept_angles', 'is_same_class', 'named_obstacles', 'path_sides', 'search', 'sweep_angles', 'timed']
