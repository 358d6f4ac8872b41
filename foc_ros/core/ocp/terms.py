"""The data of a problem as kernels take them: NamedTuples of frozen arrays, built once for each problem.

Arrays follow the conventions of the package: stacked controls have 2N entries, the first channel at steps 0..N-1, then the
second; trajectories have rows x, y, vx, vy at steps 0..N, with velocities in metres per step; m is the number of obstacles.
"""

from __future__ import annotations

from typing import NamedTuple

from foc_ros.core.dynamics.condensed import PositionNoise
from foc_ros.core.kernels import Matrix, Tensor, Vector
from foc_ros.core.obstacles.chance_constraint import UncertainObstacles
from foc_ros.core.obstacles.rounded_polygon import Polygons


class Motion(NamedTuple):
    """The mean as a function of the control.

    responses (4, 2, N + 1): impulse responses of x, y, vx, vy; free (4, N + 1): the trajectory without control [m].
    """

    responses: Tensor
    free: Matrix


class MovingObstacles(NamedTuple):
    """m rounded polygons and the distance that the mean has to keep from the polygons.

    centre (m, 2): at step 0 [m]; drift (m, 2): per step [m]; reach (m,): distance to keep [m]; missing (m,): by how much the hand
    is nearer than that at step 0 [m]; pace: one over the number of steps in which what is missing has to fall to zero;
    polygons: around the centres.
    """

    centre: Matrix
    drift: Matrix
    reach: Vector
    missing: Vector
    pace: float
    polygons: Polygons


class ChanceTerms(NamedTuple):
    """The chance constraint: noise of the position, uncertainty of the start, and the obstacles.

    error_trajectory (4, N + 1, n): how an error of each state at step 0 moves the trajectory; (4, 0, n) without such an error;
    initial_covariance (n, n): of the state at step 0.
    """

    noise: PositionNoise
    error_trajectory: Tensor
    initial_covariance: Matrix
    obstacles: UncertainObstacles


class CostTerms(NamedTuple):
    """The cost of a control and the goal.

    weighted_variance, summed_variance (2N,): factors on u^2 in the weighted variances of J_X and in the sum of the variances of x
    and y; goal_rows (r, 2N) with targets (r,) and softness (r,), as in `qp.Cost`.
    """

    weighted_variance: Vector
    summed_variance: Vector
    goal_rows: Matrix
    goal_targets: Vector
    softness: Vector


class ProblemTerms(NamedTuple):
    """A whole problem, but for the distances to keep, which depend on tau.

    centre_trajectories (N + 1, m, 2): mean centres at steps 0..N [m]; extent: size of the scene, to which tolerances are relative
    [m].
    """

    motion: Motion
    cost: CostTerms
    chance: ChanceTerms
    centre_trajectories: Tensor
    extent: float
