"""One point on the curve in one call: its contacts settled by Newton steps, its class held, and the k that it achieves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.homotopy import is_same_class, sweep_angles
from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.ocp.minimum_k import MinimumSafetyFactor, minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import required_margins
from foc_ros.core.types import Array

from .active_set import update_active_contacts
from .contacts import Contacts
from .hermite import compute_trajectory

ITS_OWN = np.zeros(0)


@dataclass(frozen=True, eq=False)
class KktPoint:
    """A control (2N,), the contacts that hold it, and the smallest k that it achieves, with its place."""

    control: Array
    contacts: Contacts
    least: MinimumSafetyFactor


def solve_kkt_point(
    problem: Problem, control: Array, contacts: Contacts, tau: float, lam: float, way: Array | None = None
) -> KktPoint | None:
    """Find the solution at (tau, lambda) near a control (2N,) that keeps out of circles between the steps too.

    contacts: to begin with; way (m,): the class that it has to be in, as of `newton.way_of`; that of the control if not given.
    None where there is none in that class.
    """
    found, solution, obstacle, time, force, least = kkt_point_kernel(
        *problem.circles,
        *required_margins(problem, tau),
        *problem.costs,
        lam,
        *contacts.columns,
        np.ascontiguousarray(control, dtype=float),
        problem.extent,
        *problem.chances,
        problem.courses,
        ITS_OWN if way is None else way,
    )
    return KktPoint(solution, Contacts(obstacle, time, force), least) if found else None


@compiled
def path(course: Matrix) -> Matrix:
    """Return the positions (N + 1, 2) [m] of a course (4, N + 1)."""
    return course[:2].T.copy()


@compiled
def kkt_point_kernel(
    motion: Tensor,
    free: Matrix,
    centre: Matrix,
    drift: Matrix,
    reach: Vector,
    short: Vector,
    pace: float,
    weighted_variance: Vector,
    summed_variance: Vector,
    goal_rows: Matrix,
    goal_targets: Vector,
    softness: Vector,
    lam: float,
    obstacle: Indices,
    time: Vector,
    force: Vector,
    near: Vector,
    extent: float,
    maps: Tensor,
    free_variance: Matrix,
    error_course: Tensor,
    initial_covariance: Matrix,
    noise_variance: Vector,
    centres: Tensor,
    size_mean: Vector,
    size_variance: Vector,
    centre_covariance: Tensor,
    leaving: Vector,
    courses: Tensor,
    way: Vector,
) -> tuple[bool, Vector, Indices, Vector, Vector, tuple[float, int, float]]:
    """Return whether there is a point, its control, its contacts' obstacles, times and forces, and `least_k`: see `settled`."""
    hessian = 2.0 * (1.0 + weighted_variance + lam * summed_variance)
    found, changed, control, course, obstacle, time, force = update_active_contacts(
        motion,
        free,
        centre,
        drift,
        reach,
        short,
        pace,
        hessian,
        goal_rows,
        goal_targets,
        softness,
        obstacle,
        time,
        force,
        near,
        extent,
    )
    if found and (changed or len(way) > 0):  # with the same contacts it is in the class of the control
        wanted = way if len(way) > 0 else sweep_angles(path(compute_trajectory(motion, free, near)), courses)
        found = is_same_class(sweep_angles(path(course), courses), wanted)
    if not found:
        return False, control, obstacle, time, force, (0.0, 0, 0.0)
    least = minimum_safety_factor(
        motion,
        course,
        centre,
        drift,
        maps,
        free_variance,
        error_course,
        initial_covariance,
        noise_variance,
        centres,
        size_mean,
        size_variance,
        centre_covariance,
        leaving,
        control,
    )
    return True, control, obstacle, time, force, least
