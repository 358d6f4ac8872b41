"""What an error of the initial state becomes when the operator corrects it on the way.

The operator sees the hand and moves from where it is: whatever the true state, its plan ends at the goal. With least effort,
u = -R_N^+ A^N e takes an error e of the state to zero at step N, so that at step t it is (A^t - R_t R_N^+ A^N) e. Without this, the
estimator's doubt about acceleration would grow with t^2 over the whole horizon, although no hand would act on it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .dynamics import CACHED_HORIZONS, Horizon
from .records import Array


@lru_cache(maxsize=CACHED_HORIZONS)
def replanned_error_map(horizon: Horizon) -> Array:
    """Return what an initial error becomes at steps 0..N, (N + 1, n, n), for a goal that fixes every state."""
    last = horizon.response[-1]
    # rows scaled to unit length first: they mix metres, metres per second and their like
    scale = 1.0 / np.sqrt((last**2).sum(axis=1))
    correction = -np.linalg.pinv(scale[:, None] * last) @ (scale[:, None] * horizon.powers[-1])
    error_map = horizon.powers.copy()
    error_map[1:] += horizon.response @ correction
    error_map.flags.writeable = False
    return error_map
