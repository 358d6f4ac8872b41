"""Signatures as words say what the counts say, and the heap gives entries in their order."""

import numpy as np
import pytest

from foc_ros.core.homotopy.heap import pop, push
from foc_ros.core.homotopy.signatures import DIGITS, ZERO, among, count, equal, masked, packed, winds


def words(counts):
    """Signatures (m, w) of counts (m, n), by the definition: a digit is the count and ZERO."""
    size = -(-counts.shape[1] // DIGITS)
    return np.array(
        [
            [sum(int(c + ZERO) << 3 * i for i, c in enumerate(row[DIGITS * w : DIGITS * (w + 1)])) for w in range(size)]
            for row in counts
        ],
        dtype=np.intp,
    )


@pytest.mark.parametrize('n', [1, 21, 22, 64])
def test_counts_are_read_as_they_were_written(n):
    counts = np.random.default_rng(n).integers(-1, 2, (5, n))
    signatures = words(counts)
    assert [[count(signatures, row, k) for k in range(n)] for row in range(5)] == counts.tolist()
    assert all(equal(signatures, i, j) == (counts[i] == counts[j]).all() for i in range(5) for j in range(5))
    np.testing.assert_array_equal(packed(counts == 1), words((counts == 1) - ZERO))


@pytest.mark.parametrize('n', [3, 21, 40])
def test_a_sum_that_winds_about_a_named_circle_is_told(n):
    rng, told = np.random.default_rng(n), set()
    for _ in range(300):
        before, onto = rng.integers(-1, 2, n), np.where(rng.random(n) < 2 / n, rng.integers(-4, 5, n), 0)
        named = np.flatnonzero(rng.random(n) < 0.6)
        mask = masked(named, -(-n // DIGITS))
        step = (
            (words(np.maximum(onto, 0)[None]) & mask) - (words(np.maximum(-onto, 0)[None]) & mask)
            if abs(onto).max() < 5
            else None
        )
        summed = (words(before[None]) & mask) + step
        far = bool((np.abs(before + onto)[named] > 1).any())
        assert winds(summed, 0, mask) is far
        told.add(far)
        if not far:
            assert [count(summed, 0, k) for k in named] == (before + onto)[named].tolist()
    assert told == {True, False}


def test_a_count_of_one_either_way_is_found_where_it_is_asked_for():
    counts = np.array([[0, 1, -1, 0, 1]])
    signatures, nothing = words(counts), np.zeros(1, dtype=np.intp)
    for k in range(5):
        asked = packed(np.arange(5)[None] == k)[0]
        assert among(signatures, 0, asked, nothing) == (counts[0, k] == 1)
        assert among(signatures, 0, nothing, asked) == (counts[0, k] == -1)


def test_the_heap_gives_the_least_key_first_and_of_equal_ones_the_lower_number():
    rng = np.random.default_rng(1)
    key, entry, size, number, waiting = np.empty(300), np.empty(300, dtype=np.intp), 0, 0, []
    for _ in range(600):
        if waiting and (number == 300 or rng.random() < 0.4):
            assert pop(key, entry, size) == waiting.pop(waiting.index(min(waiting)))[1]
            size -= 1
        elif number < 300:
            waiting.append((float(rng.integers(0, 20)), number))
            push(key, entry, size, *waiting[-1])
            size, number = size + 1, number + 1
    assert number == 300 and size == len(waiting)
