"""Association of candidates over time: which candidate of one prediction continues which candidate of the prediction before.

A label names only the obstacles that matter. It changes when an obstacle is left behind or comes near: the candidate
`goal0:+1-2` continues as `goal0:-2`. A track follows the candidate through such changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from foc_ros.core.types import Array

from .drawing import CLASS_COLOURS, CLASSES
from .snapshots import Snapshot, parse_label

LONGEST_GAP_NS = 300_000_000
"""A track continues after a gap of up to this length, in which its candidate was not solved."""


@dataclass(frozen=True)
class CandidateTracks:
    """Snapshots with their candidates associated over time.

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
    """Associate the candidates of successive snapshots and give the tracks their letters and colours."""
    tracks = associate_tracks(snapshots)
    return CandidateTracks(snapshots, tracks, assign_slots(snapshots, tracks))


def associate_tracks(snapshots: Sequence[Snapshot]) -> list[dict[str, int]]:
    """Return the number of the track of each candidate, by label, for each snapshot.

    A candidate continues a track of the same goal that passes no common obstacle on the other side: preferably the one with the
    same label, then the one that shares most sides, then the latest, then the most likely. All tracks end when the goals change.
    """
    associated: list[dict[str, int]] = []
    count = 0
    last_seen: dict[int, tuple[int, str]] = {}
    goals: Array | None = None
    for snapshot in snapshots:
        if goals is None or not np.array_equal(goals, snapshot.goals):
            last_seen = {}
        goals = snapshot.goals
        alive = {track: seen for track, seen in last_seen.items() if snapshot.stamp_ns - seen[0] <= LONGEST_GAP_NS}
        tracks = _continue_tracks(snapshot, {track: label for track, (_, label) in alive.items()})
        for each in snapshot.candidates:
            if each.label not in tracks:
                tracks[each.label], count = count, count + 1
        current = {tracks[each.label]: (snapshot.stamp_ns, each.label) for each in snapshot.candidates}
        last_seen = current | {track: seen for track, seen in alive.items() if track not in current}
        associated.append(tracks)
    return associated


def assign_slots(
    snapshots: Sequence[Snapshot], tracks: Sequence[Mapping[str, int]], count: int = CLASSES, colours: int = len(CLASS_COLOURS)
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


def _continue_tracks(snapshot: Snapshot, labels: Mapping[int, str]) -> dict[str, int]:
    """Return the track of each candidate that continues one, by label; labels: of the earlier tracks. No track is split."""
    ids = snapshot.obstacles.ids
    parsed = {track: parse_label(label, ids) for track, label in labels.items()}
    pairs = []
    for each in snapshot.candidates:
        goal, sides = parse_label(each.label, ids)
        for track, (other_goal, others) in parsed.items():
            if other_goal == goal and all(sides.get(name, side) == side for name, side in others.items()):
                pairs.append((each.label == labels[track], len(sides.items() & others.items()), each.label, track))
    continued: dict[str, int] = {}
    for *_, label, track in sorted(pairs, key=lambda pair: pair[:2], reverse=True):
        if label not in continued and track not in continued.values():
            continued[label] = track
    return continued
