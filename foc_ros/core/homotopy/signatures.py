"""Signatures: how often a path has crossed the ray of each circle, as octal digits of machine words.

A digit is the count and ZERO. Paths that follow each other add their counts, so words are added and subtracted as they are; a
digit that overflows borrows from its neighbours, but where all counts of a sum are within -1..1 all digits are right.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import FlagTable, Indices, Table, compiled_exactly

DIGITS = 21
"""Digits of a word of 63 bits."""
ZERO = 2
ONES = 0o111111111111111111111
FOURS = 4 * ONES


@compiled_exactly
def words(circles: int) -> int:
    """Return how many words have a digit for each of so many circles."""
    return (circles + DIGITS - 1) // DIGITS


@compiled_exactly
def packed(flags: FlagTable) -> Table:
    """Return flags (m, n) as digits (m, w): 1 where they are set, else 0."""
    m, n = flags.shape
    digits = np.zeros((m, words(n)), np.intp)
    for row in range(m):
        for k in range(n):
            digits[row, k // DIGITS] |= flags[row, k] << 3 * (k % DIGITS)
    return digits


@compiled_exactly
def masked(named: Indices, size: int) -> Indices:
    """Return so many words whose digits are 7 for the named circles, else 0."""
    mask = np.zeros(size, np.intp)
    for k in named:
        mask[k // DIGITS] |= 7 << 3 * (k % DIGITS)
    return mask


@compiled_exactly
def count(signatures: Table, one: int, k: int) -> int:
    """Return how often the ray of a circle has been crossed."""
    digit: int = signatures[one, k // DIGITS] >> 3 * (k % DIGITS) & 7
    return digit - ZERO


@compiled_exactly
def winds(signatures: Table, one: int, mask: Indices) -> bool:
    """Tell whether a path has crossed the ray of a named circle, of those with digit 7, more than once the same way."""
    for i in range(signatures.shape[1]):
        above = signatures[one, i] - (ONES & mask[i])  # 0, 1, 2 for counts -1, 0, 1
        if above & FOURS or above & above >> 1 & ONES:
            return True
    return False


@compiled_exactly
def among(signatures: Table, one: int, more: Indices, less: Indices) -> bool:
    """Tell whether a count is 1 where `more` has a digit 1, or -1 where `less` has one; all counts are within -1..1."""
    for i in range(signatures.shape[1]):
        odd, above = signatures[one, i], signatures[one, i] >> 1
        if odd & (above & more[i] | ~above & less[i]):
            return True
    return False


@compiled_exactly
def equal(signatures: Table, one: int, other: int) -> bool:
    """Tell whether two signatures agree."""
    for i in range(signatures.shape[1]):  # noqa: SIM110  machine code has no generators
        if signatures[one, i] != signatures[other, i]:
            return False
    return True
