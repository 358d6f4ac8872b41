"""Lines over time follow a way while its label changes, and never join two ways that go round an obstacle differently."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.core.types import make_obstacles
from foc_ros.reporting.snapshots import CandidateView, Snapshot
from foc_ros.reporting.track_association import associate_tracks, sides_of, slots

IDS = ('1', '12', 'post-2', '+')
STEP_NS = 20_000_000


def moment(number: int, *labels: str, goals: tuple[tuple[float, float], ...] = ((1.0, 0.0), (1.0, 1.0))) -> Snapshot:
    obstacles = make_obstacles([[0.1 * i, 0.0] for i in range(len(IDS))], 0.01, ids=IDS)
    nothing = np.zeros(0)
    ways = tuple(
        CandidateView(label, 1.0 / len(labels), 1.0, 1.0, 0.9, nothing, np.zeros((0, 2)), nothing, np.zeros((0, 2, 2)))
        for label in labels
    )
    return Snapshot(number * STEP_NS, obstacles, np.array(goals), ways, labels[0] if labels else None)


@pytest.mark.parametrize(
    ('label', 'goal', 'sides'),
    [
        ('goal0:', 'goal0', {}),
        ('goal1:+1-12', 'goal1', {'1': '+', '12': '-'}),
        ('goal0:+12-1', 'goal0', {'12': '+', '1': '-'}),
        ('goal0:-post-2+1', 'goal0', {'post-2': '-', '1': '+'}),
        ('goal0:++-1', 'goal0', {'+': '+', '1': '-'}),
    ],
)
def test_labels_are_taken_apart(label: str, goal: str, sides: dict[str, str]) -> None:
    assert sides_of(label, IDS) == (goal, sides)
    assert goal + ':' + ''.join(side + name for name, side in sides.items()) == label


def test_same_label_same_line() -> None:
    assert associate_tracks([moment(n, 'goal0:+1', 'goal0:-1') for n in range(3)]) == [{'goal0:+1': 0, 'goal0:-1': 1}] * 3


def test_line_goes_on_when_obstacles_drop_out() -> None:
    lines = associate_tracks([moment(0, 'goal0:+1-12', 'goal0:-1-12'), moment(1, 'goal0:-1', 'goal0:+1'), moment(2, 'goal0:')])
    assert lines[1] == {'goal0:+1': 0, 'goal0:-1': 1}
    assert lines[2] == {'goal0:': 1}


def test_other_sides_and_other_goals_are_other_lines() -> None:
    lines = associate_tracks([moment(0, 'goal0:+1'), moment(1, 'goal0:-1', 'goal1:+1')])
    assert lines == [{'goal0:+1': 0}, {'goal0:-1': 1, 'goal1:+1': 2}]


def test_most_shared_sides_win() -> None:
    lines = associate_tracks([moment(0, 'goal0:+12', 'goal0:+1-12'), moment(1, 'goal0:+1-12-post-2')])
    assert lines[1] == {'goal0:+1-12-post-2': 1}


def test_no_line_splits() -> None:
    lines = associate_tracks([moment(0, 'goal0:+1'), moment(1, 'goal0:+1+12', 'goal0:+1-12')])
    assert sorted(lines[1].values()) == [0, 1]


def test_a_short_absence_is_bridged_a_long_one_not() -> None:
    lines = associate_tracks([moment(0, 'goal0:+1'), moment(1), moment(10, 'goal0:+1'), moment(30, 'goal0:+1')])
    assert [numbers.get('goal0:+1') for numbers in lines] == [0, None, 0, 1]


def test_other_goals_begin_anew() -> None:
    lines = associate_tracks([moment(0, 'goal0:+1'), moment(1, 'goal0:+1', goals=((0.0, 0.0),))])
    assert [numbers['goal0:+1'] for numbers in lines] == [0, 1]


def test_lines_of_one_time_have_different_slots() -> None:
    """Also with fewer slots than lines, where the least likely of those that begin together go without."""
    labels = ('goal0:+1', 'goal0:-1', 'goal1:+1', 'goal1:-1', 'goal1:-12')
    moments = [moment(number, *labels[number % 3 : number % 3 + 3]) for number in range(12)]
    lines = associate_tracks(moments)
    for count in (2, 3, 5):
        given = slots(moments, lines, count, count)
        assert set(given.values()) == set(range(count))
        for numbers in lines:
            used = [given[line] for line in numbers.values() if line in given]
            assert len(used) == len(set(used))
    assert list(slots(moments, lines, 5, 5).values())[:3] == [0, 1, 2]
    assert len(slots(moments[:1], lines[:1], 2, 2)) == 2


def test_a_slot_rests_before_another_line_takes_it() -> None:
    alone = [moment(number, f'goal{number % 2}:+1') for number in (0, 51, 102, 153)]
    lines = associate_tracks(alone)
    assert len({line for numbers in lines for line in numbers.values()}) == 4
    assert list(slots(alone, lines, 3, 3).values()) == [0, 1, 2, 0]


def test_lines_of_one_time_share_no_colour_while_there_are_others() -> None:
    labels = ('goal0:+1', 'goal1:+1', 'goal2:+1', 'goal3:+1')
    moments = [moment(0, *labels[:2]), moment(1, labels[0]), moment(2, labels[0], labels[2]), moment(3, *labels)]
    lines = associate_tracks(moments)
    given = slots(moments, lines, 6, 3)
    assert [given[line] for line in lines[2].values()] == [0, 2]
    assert len({given[line] % 3 for line in list(lines[3].values())[:3]}) == 3
    assert len({given[line] for line in lines[3].values()}) == 4
