"""Effort of a movement so far: the integral of its squared jerk [m^2/s^5], estimated from noisy positions.

A minimum-jerk movement between two states is the quintic that joins them, and its effort has a closed form: over a segment of
duration T, with positions sum_k c_k s^k (s = t / T in [0, 1], k = 0..5),

    J = c' H c / T^5,  H_jk = j(j-1)(j-2) k(k-1)(k-2) / (j + k - 5),  e.g. 720 D^2 / T^5 from rest to rest over a distance D.

Jerk is a third derivative, so the filter's states at two stamps close together give mostly noise. Instead, a quintic is fitted to
all samples of a segment, and a segment is as long as one quintic explains it. The noise then grows neither with the sampling rate
nor with the slowness of the movement. The samples enter through sums only, so that an update costs the same for any length.

Only jerk that is significant in the samples is counted. In coordinates y = L' c that are uncorrelated (L L': the sums of powers,
so that y_k is what degree k adds), each degree k >= 3 is shrunk by max(0, 1 - 12 E / |y_k|^2), where E = 2 sigma^2 is the
expectation under noise alone. A degree is used only once noise alone would add less than a tenth of the effort of a straight
reach as long as the segment. The estimate therefore starts at zero and stays low, but never reports noise.

Measured over 0.3 m from rest to rest in 0.6 to 4 s, at 15, 50 and 200 Hz, with 1 mm or 0.1 mm of noise: near the end, the median
is 0.4 to 0.8 of the true effort so far (0.35 to 0.9 with a detour of 60 mm); a third of it is lost before onset, where the jerk
is highest. It never exceeds 1.03 of the whole effort. With 1 mm of noise it is near zero until half of the movement.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.types import NANOSECONDS, Array, Record, as_readonly

DEGREE = 5
LEAST_SAMPLES = 8
LEAST_TIME_S = 0.2
"""Duration from which a segment is fitted. With shorter ones, an outlier of 10 mm at 200 Hz gave 1e5 times the true effort."""
SHRINKAGE = 12.0
"""Noise exceeds it once in exp(12) = 2e5 times; with 8, one movement of 40 had a peak of 38 times the final effort."""
NOISE_SHARE = 0.1
MISFIT = 2.0
"""Root mean square of the residuals, in standard deviations of a position, above which a quintic does not explain a segment."""

ROUNDING = 1e-12
"""Share of the sum of squares that rounding leaves in the residuals; 2e-13 was seen with 20000 samples."""

LEAST_PIVOT = 1e-9
"""Share of its own sum of squares that a degree has to add to those below it: for clustered stamps the degrees are degenerate."""

_POWERS = np.arange(2.0 * DEGREE + 1.0)
"""Exponents of t in the sums of `Effort.powers`, (11,)."""
_K = np.arange(DEGREE + 1)
_THIRD = _K * (_K - 1.0) * (_K - 2.0)
_H: Array = np.outer(_THIRD, _THIRD) / np.maximum(_K[:, None] + _K - 5.0, 1.0)


@dataclass(frozen=True, eq=False)
class Effort(Record):
    """The effort of a movement and the sums over its present segment.

    spent: effort so far [m^2/s^5]; before: the part before the present segment. The sums are over samples at times t [s] since
    start_ns (None: no sample yet) and positions z (2,) [m] from origin: powers (11,) of t^0..t^10, products (6, 2) of t^k z,
    square of |z|^2; last_s: time of the last sample [s].
    """

    spent: float = 0.0
    before: float = 0.0
    start_ns: int | None = None
    last_s: float = 0.0
    origin: Array = field(default_factory=lambda: np.zeros(2))
    powers: Array = field(default_factory=lambda: np.zeros(2 * DEGREE + 1))
    products: Array = field(default_factory=lambda: np.zeros((DEGREE + 1, 2)))
    square: float = 0.0


def add_sample(effort: Effort, stamp_ns: int, position: Array, stddev: float) -> Effort:
    """Return the effort with the next sample of the movement; stddev: of a measured position [m].

    A sample that the quintic of the segment does not explain ends the segment and belongs to none, since it may be an outlier.
    """
    start_ns, origin = (stamp_ns, position) if effort.start_ns is None else (effort.start_ns, effort.origin)
    seconds, z = (stamp_ns - start_ns) / NANOSECONDS, position - origin
    powers, products = map(as_readonly, add_to_sums(effort.powers, effort.products, seconds, z))
    square, spent = effort.square + float(z @ z), effort.spent
    if powers[0] >= LEAST_SAMPLES and seconds >= LEAST_TIME_S:
        is_determined, added, is_explained = fit_quintic(powers, products, square, seconds, stddev)
        if is_determined and not is_explained:
            return Effort(spent=effort.spent, before=effort.spent)
        spent = effort.before + added if is_determined else spent
    return Effort(spent, effort.before, start_ns, seconds, origin, powers, products, square)


def add_to_sums(powers: Array, products: Array, seconds: float, z: Array) -> tuple[Array, Array]:
    """Return the sums of `Effort` with one more sample."""
    power = seconds**_POWERS
    return powers + power, products + power[: DEGREE + 1, None] * z


def fit_quintic(powers: Array, products: Array, square: float, T: float, stddev: float) -> tuple[bool, float, bool]:
    """Fit the quintic of a segment of T [s].

    Return whether the samples determine all degrees, the effort [m^2/s^5], and whether the quintic explains the samples.
    """
    n, count, unit = len(products), float(powers[0]), T**-_POWERS
    gram = (powers * unit)[_K[:, None] + _K]
    try:
        root = np.linalg.cholesky(gram)
    except np.linalg.LinAlgError:
        return False, 0.0, False
    if not (root.diagonal() ** 2 > LEAST_PIVOT * gram.diagonal()).all():
        return False, 0.0, False
    inverse = np.linalg.inv(root)
    y = inverse @ (products * unit[:n, None])
    energy = (y**2).sum(axis=1)
    freedom = 2.0 * (count - n)
    residual, rounding = max(square - float(energy.sum()), 0.0) / freedom, ROUNDING * square / freedom
    noise = 2.0 * max(stddev**2, residual, rounding)
    jerk = inverse @ _H @ inverse.T
    length_squared = 12.0 * energy[1:].sum() / count
    is_used = (_K >= 3) & (noise * jerk.diagonal() <= NOISE_SHARE * 720.0 * length_squared)
    y *= np.where(is_used, np.maximum(1.0 - SHRINKAGE * noise / np.maximum(energy, noise), 0.0), 0.0)[:, None]
    spent = max(float((y * (jerk @ y)).sum()), 0.0) / T**5
    return True, spent, residual <= (MISFIT * stddev) ** 2 + rounding
