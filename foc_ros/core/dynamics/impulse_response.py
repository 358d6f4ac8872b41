"""What a control does to a linear plant: sums of impulse responses, which do not depend on when the impulse was.

A quantity at step s owes h(s - k) to a unit control at step k <= s of a channel, with h(0) = 0, and nothing to what comes later:
one response of N + 1 numbers stands for a whole map. Responses (q, 2, N + 1) are those of q quantities to both channels; controls
are stacked, (2N,), the first channel at steps 0..N-1, then the second.
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
            if not responses[q, channel].any():  # axes that know nothing of each other
                continue
            for k in range(times - 1):
                push = control[channel * (times - 1) + k]
                for s in range(k + 1, times):
                    moved[q, s] += responses[q, channel, s - k] * push
    return moved
