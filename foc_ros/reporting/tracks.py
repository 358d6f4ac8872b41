# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Candidates over time: a track has the candidates of one class, and a slot, which gives its letter and colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from foc_ros.core.types import Array

from .views import COLOURS, SLOTS, Snapshot


@dataclass(frozen=True)
class CandidateTracks:
    """Snapshots with their candidates associated over time: a track has the candidates whose class has the same number.

    tracks: for each snapshot, the number of the track of each candidate, by label; slots: of each track, the slot that gives its
    letter and colour. Tracks without a slot are missing there.
    """

    snapshots: Sequence[Snapshot]
    tracks: Sequence[Mapping[str, int]]
    slots: Mapping[int, int]

    def between(self, start_ns: int, end_ns: int) -> CandidateTracks:
        """Return the part with start_ns <= stamp <= end_ns."""
        rows = [row for row, each in enumerate(self.snapshots) if start_ns <= each.stamp_ns <= end_ns]
        return CandidateTracks([self.snapshots[row] for row in rows], [self.tracks[row] for row in rows], self.slots)

    def slots_at(self, row: int) -> dict[str, int]:
        """Return the slots of the candidates of one snapshot, by label."""
        return {label: self.slots[track] for label, track in self.tracks[row].items() if track in self.slots}

    def likelihoods(self) -> dict[int, tuple[int, Array]]:
        """Return, for each track, its first row and its likelihoods from there on, NaN where it has no candidate."""
        known: dict[int, dict[int, float]] = {}
        for row, (snapshot, tracks) in enumerate(zip(self.snapshots, self.tracks, strict=True)):
            for each in snapshot.candidates:
                known.setdefault(tracks[each.label], {})[row] = each.likelihood
        return {
            track: (min(rows), np.array([rows.get(row, np.nan) for row in range(min(rows), max(rows) + 1)]))
            for track, rows in sorted(known.items())
        }


def build_candidate_tracks(snapshots: Sequence[Snapshot]) -> CandidateTracks:
    """Return the candidates of successive snapshots by track, and give the tracks their letters and colours.

    A track has the candidates of one class. Tracks are numbered from 0 in order of their appearance, whatever the classes were
    numbered before the first snapshot.
    """
    numbers: dict[int, int] = {}
    tracks = [{each.label: numbers.setdefault(each.way, len(numbers)) for each in snapshot.candidates} for snapshot in snapshots]
    return CandidateTracks(snapshots, tracks, assign_slots(snapshots, tracks))


def assign_slots(
    snapshots: Sequence[Snapshot], tracks: Sequence[Mapping[str, int]], count: int = SLOTS, colours: int = COLOURS
) -> dict[int, int]:
    """Return the slot in [0, count) of each track; simultaneous tracks have different slots.

    Tracks that begin together receive their slots in order of likelihood. A slot whose colour (slot modulo colours) is unused at
    that time is preferred, then the one that has been free for longest. A track that finds no free slot has none.
    """
    last_row = {track: row for row, numbers in enumerate(tracks) for track in numbers.values()}
    slots: dict[int, int] = {}
    begun: set[int] = set()
    taken_until = dict.fromkeys(range(count), -1)
    for row, (snapshot, numbers) in enumerate(zip(snapshots, tracks, strict=True)):
        for track in (numbers[each.label] for each in snapshot.candidates):
            free = [slot for slot, until in taken_until.items() if until < row]
            if track not in begun and free:
                used = {slot % colours for slot, until in taken_until.items() if until >= row}
                slots[track] = min(free, key=lambda slot: (slot % colours in used, taken_until[slot], slot))
                taken_until[slots[track]] = last_row[track]
            begun.add(track)
    return slots
