"""A binary heap of entries by key, the lower number first of equal keys; `heapq` on a list of pairs takes six times as long."""

from __future__ import annotations

from foc_ros.core.kernels import Indices, Register, Scratch, Vector, compiled_exactly


@compiled_exactly
def before(key: Vector, entry: Indices, one: int, other: int) -> bool:
    """Tell which of two places of a heap comes first."""
    # without branches, which a processor would guess wrongly half of the time
    first: bool = (key[one] < key[other]) | ((key[one] == key[other]) & (entry[one] < entry[other]))
    return first


@compiled_exactly
def push(key: Scratch, entry: Register, size: int, new_key: float, new: int) -> None:
    """Add an entry, with a higher number than all others, to a heap of some size; there is room for it."""
    at = size
    while at > 0 and new_key < key[(at - 1) >> 1]:
        above = (at - 1) >> 1
        key[at], entry[at], at = key[above], entry[above], above
    key[at], entry[at] = new_key, new


@compiled_exactly
def pop(key: Scratch, entry: Register, size: int) -> int:
    """Take the first entry from a heap of some size > 0."""
    first, last, at, below = entry[0], size - 1, 0, 1
    while below < last:
        if below + 1 < last:
            below += before(key, entry, below + 1, below)
        if before(key, entry, last, below):
            break
        key[at], entry[at] = key[below], entry[below]
        at, below = below, 2 * below + 1
    key[at], entry[at] = key[last], entry[last]
    return int(first)
