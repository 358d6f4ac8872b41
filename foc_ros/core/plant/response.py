# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The response of the position to the control at any time of the horizon, between the steps too.

Within a step the position of a plant is the cubic through its positions and velocities at both ends. For the triple integrator,
whose jerk is constant within a step, this is exact. Times are in steps, and controls in units of `Horizon.gain`, in which the
triple integrator has the same response for every length of a step.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from foc_ros.core.interpolation import hermite, locate, pair_steps
from foc_ros.core.types import Array


def fall_as_minimum_jerk(share: Array) -> tuple[Array, Array, Array]:
    """Return how a distance falls from 1 to 0 in a minimum-jerk movement, with its first two derivatives.

    It is 1 - s^3 (10 - 15 s + 6 s^2) for a share s (...) of the time, in [0, 1].
    """
    s, left = share, 1.0 - share
    return 1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2), -30.0 * s**2 * left**2, -60.0 * s * left * (1.0 - 2.0 * s)


class Response:
    """The response of the position to a control of N steps, for two channels.

    Parameters
    ----------
    motion : Array
        Impulse responses of x, y and their velocities per step to both channels, (4, 2, N + 1).

    Attributes
    ----------
    steps : int
        N.
    within : Array
        The response of position and velocity, of x and y, over each step: at its beginning, then at its end, (N, 4, 2, 2N).
    """

    def __init__(self, motion: Array) -> None:
        self.steps = motion.shape[-1] - 1
        since = np.arange(self.steps + 1)[:, None] - np.arange(self.steps)
        # a later control has no effect: the response at 0 is 0
        at_steps = motion[..., np.maximum(since, 0)].transpose(2, 0, 1, 3)
        self.within = pair_steps(at_steps.reshape(self.steps + 1, 2, 2, -1))

    def at(self, times: Array) -> Array:
        """Return the response of x and y at times (q,) in steps to the stacked control, (q, 2, 2N)."""
        step, share = self.locate(times)
        weight = hermite(share)
        response: Array = (weight[:, None] @ self.within.reshape(self.steps, 4, -1)[step])[:, 0]
        return response.reshape(len(times), 2, self.within.shape[-1])

    def locate(self, times: Array) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.intp]], Array]:
        """Return the step in which each time lies, and the share of it that has passed."""
        return locate(times, self.steps)

    @cached_property
    def at_steps(self) -> Array:
        """The response of x and y at steps 1..N, (N, 2, 2N)."""
        return self.within[:, 2]

    @cached_property
    def mean_map(self) -> Array:
        """Matrix (2N, 8 N) from the control to what `Motion` holds of x and y over each step."""
        return np.ascontiguousarray(self.within.reshape(-1, self.within.shape[-1]).T)

    @cached_property
    def variance_map(self) -> Array:
        """Matrix (2N, 18 N) from the variance of each control to xx, yy, xy and both their derivatives over each step."""
        begin, rate, end, end_rate = self.within.swapaxes(0, 1)
        bends = 6.0 * (end - begin) - 4.0 * rate - 2.0 * end_rate, 6.0 * (begin - end) + 2.0 * rate + 4.0 * end_rate
        known = []
        for place, change, bend in ((begin, rate, bends[0]), (end, end_rate, bends[1])):
            for one, other in ((place, place), (place, change), (place, bend)):
                extra = change if one is place and other is bend else np.zeros_like(change)
                known.append(_multiply(one, other) * (1.0 if other is place else 2.0) + 2.0 * _multiply(extra, extra))
        return np.ascontiguousarray(np.stack(known, axis=1).reshape(-1, self.within.shape[-1]).T)

    @cached_property
    def smoothing(self) -> float:
        """Weight of the effort of a control that follows a guess, relative to squared distances at the steps: see `follow`."""
        return 4e-9 * float((self.at_steps**2).sum())


def _multiply(one: Array, other: Array) -> Array:
    """Return the products xx, yy, xy of responses (N, 2, 2N), symmetric in both, (N, 3, 2N)."""
    mixed = 0.5 * (one[:, 0] * other[:, 1] + one[:, 1] * other[:, 0])
    return np.stack((one[:, 0] * other[:, 0], one[:, 1] * other[:, 1], mixed), axis=1)


def compute_curve(path: Array, velocity: Array, dt: Array | float) -> Array:
    """Return m > 50 points (m, ..., 2) [m] on mean paths, which look smooth then: the steps and, where needed, some between.

    path, velocity (N + 1, ..., 2) [m, m/s]: at steps dt (..., 1) [s] apart. Equal parts of a step lie between two points. Paths
    of more steps, or of one point, are returned as they are.
    """
    steps = len(path) - 1
    parts = -(-50 // max(steps, 1))
    if steps < 1 or parts == 1:
        return path
    return sample_curve(path, velocity, dt, parts)


def sample_curve(path: Array, velocity: Array, dt: Array | float, parts: int) -> Array:
    """Return mean paths at equal parts of their steps, (parts N + 1, ..., 2) [m], for positions and velocities as above."""
    ends = pair_steps(np.stack((path, dt * velocity), axis=1))
    points: Array = (hermite(np.arange(parts) / parts) @ ends.reshape(len(ends), 4, -1)).reshape(-1, *path.shape[1:])
    return np.concatenate((points, path[-1:]))
