"""The effect of a control on a linear plant, as sums of impulse responses.

A unit control at step k of one channel changes a quantity at step s by h(s - k), with h(0) = 0 and no effect on earlier steps.
One response of N + 1 numbers therefore stands for a whole matrix. Responses (q, 2, N + 1) are those of q quantities to both
channels; a control is stacked, (2N,): the first channel at steps 0..N-1, then the second.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled


@compiled
def apply_impulse_response(responses: Tensor, control: Vector) -> Matrix:
    """Return the q quantities at steps 0..N, (q, N + 1), from responses (q, 2, N + 1) and a stacked control (2N,)."""
    quantities, _, times = responses.shape
    moved = np.zeros((quantities, times))
    for q in range(quantities):
        for channel in range(2):
            if not responses[q, channel].any():  # each axis responds to its own channel only
                continue
            for k in range(times - 1):
                value = control[channel * (times - 1) + k]
                for s in range(k + 1, times):
                    moved[q, s] += responses[q, channel, s - k] * value
    return moved
