# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Candidates over time: a track has the candidates of one class, and a slot, which gives its letter and colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from foc_ros.core.prediction import Prediction
from foc_ros.core.types import Array

from .views import COLOURS, SLOTS


@dataclass(frozen=True)
class CandidateTracks:
    """Snapshots with their candidates associated over time: a track has the candidates of one class.

    tracks: for each snapshot, the number of the track of each candidate, by label; slots: of each track, the slot that gives its
    letter and colour. Tracks without a slot are missing there.
    """

    snapshots: Sequence[Prediction]
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
            for each in snapshot.candidates_with_likelihood:
                known.setdefault(tracks[each.label], {})[row] = each.likelihood
        return {
            track: (min(rows), np.array([rows.get(row, np.nan) for row in range(min(rows), max(rows) + 1)]))
            for track, rows in sorted(known.items())
        }


class Slots:
    """Gives each class a slot of letter and colour, which it keeps also over an absence, unless another class needs it."""

    def __init__(self) -> None:
        self._owners: dict[int, int] = {}
        self._used = [0] * SLOTS
        self._turn = 0

    def assign(self, ways: Sequence[int]) -> list[int | None]:
        """Return the slots of the present classes, by their numbers; a class that finds none has None.

        A slot whose colour (slot modulo COLOURS) is unused is preferred, then the one that has been free for longest.
        """
        self._turn += 1
        slots = {way: slot for slot, way in self._owners.items() if way in ways}
        for way in ways:
            colours = {slot % COLOURS for slot in slots.values()}
            free = [slot for slot in range(SLOTS) if slot not in slots.values()]
            if way not in slots and free:
                slots[way] = min(free, key=lambda slot: (slot % COLOURS in colours, self._used[slot], slot))
                self._owners[slots[way]] = way
        for slot in slots.values():
            self._used[slot] = self._turn
        return [slots.get(way) for way in ways]


def build_candidate_tracks(snapshots: Sequence[Prediction]) -> CandidateTracks:
    """Return the candidates of successive snapshots by track, and the letters and colours of the tracks.

    A track has the candidates of one class, as long as it has one letter. Tracks are numbered from 0 in order of their
    appearance, whatever the classes were numbered before the first snapshot.
    """
    given, numbers, tracks = Slots(), dict[tuple[int, int | None], int](), list[dict[str, int]]()
    for snapshot in snapshots:
        shown = snapshot.candidates_with_likelihood
        ways = [each.way for each in shown]
        keys = zip(ways, given.assign(ways), strict=True)
        found = [numbers.setdefault(key, len(numbers)) for key in keys]
        tracks.append({each.label: track for each, track in zip(shown, found, strict=True)})
    return CandidateTracks(snapshots, tracks, {track: slot for (_, slot), track in numbers.items() if slot is not None})
