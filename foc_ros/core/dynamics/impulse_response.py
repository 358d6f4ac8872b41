"""The effect of a control on a linear plant, as sums of impulse responses.

A unit control at step k of one channel changes a quantity at step s by h(s - k), with h(0) = 0 and no effect on earlier steps.
One response of N + 1 numbers therefore stands for a whole matrix. Responses (q, 2, N + 1) are those of q quantities to both
channels; a control is stacked, (2N,): the first channel at steps 0..N-1, then the second.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided

from foc_ros.core.types import Array


def apply_impulse_response(responses: Array, control: Array) -> Array:
    """Return the q quantities at steps 0..N, (q, N + 1), from responses (q, 2, N + 1) and a stacked control (2N,)."""
    quantities, channels, times = responses.shape
    moved: Array = responses.reshape(quantities, -1) @ _shift_control(control, channels, times)
    return moved


def _shift_control(control: Array, channels: int, times: int) -> Array:
    """Return the control at step s - m for each channel and each m, s = 0..N, (2 (N + 1), N + 1); zero before step 0."""
    padded = np.zeros((channels, 2 * times - 1))
    padded[:, times - 1 : -1] = control.reshape(channels, -1)
    row, item = padded.strides
    return as_strided(padded[:, times - 1 :], (channels, times, times), (row, -item, item)).reshape(channels * times, times)
