"""Tracks of candidates have slots, which are letters and colours: different ones at the same time, reused as late as possible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.types import LEFT, RIGHT, make_obstacles
from foc_ros.reporting.snapshots import CandidateView, Snapshot, parse_label
from foc_ros.reporting.track_association import assign_slots, build_candidate_tracks

IDS = ('1', '12', 'post-2', '+')
STEP_NS = 20_000_000
WAYS: dict[str, int] = {}
"""Number of the class of each label."""


def snapshot(number: int, *labels: str, goals: tuple[tuple[float, float], ...] = ((1.0, 0.0), (1.0, 1.0))) -> Snapshot:
    obstacles = make_obstacles([[0.1 * i, 0.0] for i in range(len(IDS))], 0.01, ids=IDS)
    empty = np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, 2))
    head = '', False, 1.0 / max(len(labels), 1), 1.0, 1.0, 0.9, np.zeros(0)
    candidates = tuple(CandidateView(label, *head, *empty, WAYS.setdefault(label, len(WAYS))) for label in labels)
    return Snapshot(number * STEP_NS, obstacles, np.array(goals), candidates, labels[0] if labels else None)


def associate_tracks(snapshots: list[Snapshot]) -> list[dict[str, int]]:
    return list(build_candidate_tracks(snapshots).tracks)


@pytest.mark.parametrize(
    ('label', 'goal', 'sides'),
    [
        ('goal0:', 'goal0', {}),
        ('goal1:+1-12', 'goal1', {'1': LEFT, '12': RIGHT}),
        ('goal0:+12-1', 'goal0', {'12': LEFT, '1': RIGHT}),
        ('goal0:-post-2+1', 'goal0', {'post-2': RIGHT, '1': LEFT}),
        ('goal0:++-1', 'goal0', {'+': LEFT, '1': RIGHT}),
    ],
)
def test_a_label_is_split_into_goal_and_sides(label: str, goal: str, sides: dict[str, int]) -> None:
    assert parse_label(label, IDS) == (goal, sides)
    assert goal + ':' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides.items()) == label


def test_simultaneous_tracks_have_different_slots() -> None:
    """With fewer slots than tracks, the least likely of the tracks that begin together have none."""
    labels = ('goal0:+1', 'goal0:-1', 'goal1:+1', 'goal1:-1', 'goal1:-12')
    snapshots = [snapshot(number, *labels[number % 3 : number % 3 + 3]) for number in range(12)]
    tracks = associate_tracks(snapshots)
    for count in (2, 3, 5):
        slots = assign_slots(snapshots, tracks, count, count)
        assert set(slots.values()) == set(range(count))
        for numbers in tracks:
            used = [slots[track] for track in numbers.values() if track in slots]
            assert len(used) == len(set(used))
    assert list(assign_slots(snapshots, tracks, 5, 5).values())[:3] == [0, 1, 2]
    assert len(assign_slots(snapshots[:1], tracks[:1], 2, 2)) == 2


def test_a_slot_is_reused_as_late_as_possible() -> None:
    alone = [snapshot(number, f'goal{number}:+1') for number in (0, 51, 102, 153)]
    tracks = associate_tracks(alone)
    assert len({track for numbers in tracks for track in numbers.values()}) == 4
    assert list(assign_slots(alone, tracks, 3, 3).values()) == [0, 1, 2, 0]


def test_simultaneous_tracks_have_different_colours_while_there_are_any() -> None:
    labels = ('goal0:+1', 'goal1:+1', 'goal2:+1', 'goal3:+1')
    snapshots = [snapshot(0, *labels[:2]), snapshot(1, labels[0]), snapshot(2, labels[0], labels[2]), snapshot(3, *labels)]
    tracks = associate_tracks(snapshots)
    slots = assign_slots(snapshots, tracks, 6, 3)
    assert [slots[track] for track in tracks[2].values()] == [0, 2]
    assert len({slots[track] % 3 for track in list(tracks[3].values())[:3]}) == 3
    assert len({slots[track] for track in tracks[3].values()}) == 4


def test_tracks_are_numbered_from_0_whatever_the_classes_are_called() -> None:
    """The rows of a report's tracks are their numbers, and its recording may begin after the classes were numbered."""
    first = snapshot(0, 'goal0:+1', 'goal0:-1')
    renamed = [
        replace(each, candidates=tuple(replace(view, way=view.way + 70) for view in each.candidates))
        for each in (first, snapshot(1, 'goal0:-1', 'goal1:'))
    ]
    tracks = build_candidate_tracks(renamed)
    assert [dict(each) for each in tracks.tracks] == [{'goal0:+1': 0, 'goal0:-1': 1}, {'goal0:-1': 1, 'goal1:': 2}]
    assert list(tracks.likelihoods()) == [0, 1, 2]
