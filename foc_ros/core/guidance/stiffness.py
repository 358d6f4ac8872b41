"""Stiffness from the covariance of a candidate: stiff where the operator is precise, soft where not, always bounded."""

from __future__ import annotations

import numpy as np

from foc_ros.core.config import GuidanceConfig
from foc_ros.core.types import Array

SINGULAR = 1e-6
"""Stiffness below which a direction counts as one without any, as a share of the largest one."""


def compute_stiffness(covariances: Array, config: GuidanceConfig) -> Array:
    """Return the stiffness K (c, 2, 2) [N/m] of position covariances S (c, 2, 2) [m^2].

    With the precision matrix P = (S + s0^2 I)^-1 and its eigenpairs (l_j, w_j),

        K = sum_j k_max clip((l_j - l_lo) / (l_hi - l_lo), 0, 1) w_j w_j',

    which is symmetric, positive semidefinite and bounded by k_max (Muehlbauer et al. 2025, arXiv 2506.10239). Here l_lo is
    `precision_low`, l_hi `precision_high` and s0 `position_stddev`.
    """
    variances, axes = np.linalg.eigh(covariances)
    precisions = 1.0 / (np.maximum(variances, 0.0) + config.position_stddev**2)
    width = max(config.precision_high - config.precision_low, 1e-9)
    shares = np.minimum(np.maximum((precisions - config.precision_low) / width, 0.0), 1.0)
    stiffness: Array = config.k_max * np.einsum('cj,caj,cbj->cab', shares, axes, axes)
    return stiffness


def project_out(stiffness: Array, tangents: Array) -> Array:
    """Return N K N with N = I - u u' (c, 2, 2): no stiffness along the unit tangents u (c, 2), so the operator sets the pace."""
    across = np.eye(2) - tangents[:, :, None] * tangents[:, None, :]
    projected: Array = across @ stiffness @ across
    return projected


def find_deflection(stiffness: Array, force: Array) -> Array:
    """Return the smallest deflection e (2,) [m] for which K e is a force (2,) [N], as far as K (2, 2) [N/m] can give it."""
    values, axes = np.linalg.eigh(stiffness)
    is_stiff = values > SINGULAR * max(values[-1], 1e-300)
    deflection: Array = axes @ np.where(is_stiff, axes.T @ force / np.where(is_stiff, values, 1.0), 0.0)
    return deflection
