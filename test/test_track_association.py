"""A track follows a candidate while its label changes, and never joins candidates on different sides of an obstacle."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.core.types import LEFT, RIGHT, make_obstacles
from foc_ros.reporting.snapshots import CandidateView, Snapshot, parse_label
from foc_ros.reporting.track_association import assign_slots, associate_tracks

IDS = ('1', '12', 'post-2', '+')
STEP_NS = 20_000_000


def snapshot(number: int, *labels: str, goals: tuple[tuple[float, float], ...] = ((1.0, 0.0), (1.0, 1.0))) -> Snapshot:
    obstacles = make_obstacles([[0.1 * i, 0.0] for i in range(len(IDS))], 0.01, ids=IDS)
    empty = np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, 2))
    candidates = tuple(CandidateView(label, '', False, 1.0 / len(labels), 1.0, 1.0, 0.9, np.zeros(0), *empty) for label in labels)
    return Snapshot(number * STEP_NS, obstacles, np.array(goals), candidates, labels[0] if labels else None)


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


def test_the_same_label_continues_its_track() -> None:
    assert associate_tracks([snapshot(n, 'goal0:+1', 'goal0:-1') for n in range(3)]) == [{'goal0:+1': 0, 'goal0:-1': 1}] * 3


def test_a_track_continues_when_obstacles_leave_the_label() -> None:
    tracks = associate_tracks(
        [snapshot(0, 'goal0:+1-12', 'goal0:-1-12'), snapshot(1, 'goal0:-1', 'goal0:+1'), snapshot(2, 'goal0:')]
    )
    assert tracks[1] == {'goal0:+1': 0, 'goal0:-1': 1}
    assert tracks[2] == {'goal0:': 1}


def test_other_sides_and_other_goals_begin_new_tracks() -> None:
    tracks = associate_tracks([snapshot(0, 'goal0:+1'), snapshot(1, 'goal0:-1', 'goal1:+1')])
    assert tracks == [{'goal0:+1': 0}, {'goal0:-1': 1, 'goal1:+1': 2}]


def test_the_track_with_most_shared_sides_continues() -> None:
    tracks = associate_tracks([snapshot(0, 'goal0:+12', 'goal0:+1-12'), snapshot(1, 'goal0:+1-12-post-2')])
    assert tracks[1] == {'goal0:+1-12-post-2': 1}


def test_no_track_is_split() -> None:
    tracks = associate_tracks([snapshot(0, 'goal0:+1'), snapshot(1, 'goal0:+1+12', 'goal0:+1-12')])
    assert sorted(tracks[1].values()) == [0, 1]


def test_a_track_continues_after_a_short_gap_only() -> None:
    tracks = associate_tracks([snapshot(0, 'goal0:+1'), snapshot(1), snapshot(10, 'goal0:+1'), snapshot(30, 'goal0:+1')])
    assert [numbers.get('goal0:+1') for numbers in tracks] == [0, None, 0, 1]


def test_new_goals_begin_new_tracks() -> None:
    tracks = associate_tracks([snapshot(0, 'goal0:+1'), snapshot(1, 'goal0:+1', goals=((0.0, 0.0),))])
    assert [numbers['goal0:+1'] for numbers in tracks] == [0, 1]


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
    alone = [snapshot(number, f'goal{number % 2}:+1') for number in (0, 51, 102, 153)]
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
