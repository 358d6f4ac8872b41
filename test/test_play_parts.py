"""The parts of `foc_ros play` that need neither a browser nor ROS: messages, clock, scene, tasks and views."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from session_helpers import BOX, CIRCLE, SCENE, TASKS, parse

from foc_ros.core.errors import InputError
from foc_ros.io.bags import TYPESTORE
from foc_ros.play.page_clock import PageClock
from foc_ros.play.page_messages import HandMessage, SceneMessage, TasksMessage, parse_message
from foc_ros.play.prediction_view import Slots
from foc_ros.play.predictors import describe_health
from foc_ros.play.scene import FIRST_SCENE, START, TARGET_RADIUS, PlayScene, make_box, make_circle, make_random_scene
from foc_ros.play.tasks import Phase, Tasks, make_trials, tabulate_scores
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud
from foc_ros.ros.messages.decode_poses import decode_goals
from foc_ros.ros.messages.types import RosbagsTypes

HAND = {'type': 'hand', 't': 10.0, 'x': 0.1, 'y': 0.0, 'event': 8.0}


@pytest.mark.parametrize(
    ('message', 'error'),
    [
        ('{', r'message: expected JSON, got .*\{'),
        ('[' * 20_000, 'message: expected JSON'),
        ('[]', r'message: expected an object, got \[\]'),
        ({'type': 'open', 'file': '/etc/passwd'}, "type: expected one of hand, scene, .* got 'open'"),
        ({'type': ['hand']}, 'type: expected one of'),
        (HAND | {'x': 9.0}, r'hand\.x: expected a number in \[-0\.06, 0\.38\], got 9\.0'),
        (HAND | {'x': math.nan}, r'hand\.x: expected a number in .* got nan'),
        (HAND | {'y': '0'}, r"hand\.y: expected a number in .* got '0'"),
        (HAND | {'t': -1}, r'hand\.t: expected a number in \[0, 1e\+10\], got -1'),
        (HAND | {'event': True}, r'hand\.event: expected a number'),
        (HAND | {'topic': '/x'}, "hand: expected the fields t, x, y, event, got 'topic'"),
        ({'type': 'hand', 't': 1.0}, r'hand\.x: expected a value, got none'),
        (SCENE | {'goals': []}, 'goals: expected a list of 1 to 8, got 0'),
        (SCENE | {'goals': {}}, r'goals: expected a list of 1 to 8, got \{\}'),
        (SCENE | {'obstacles': [CIRCLE] * 33}, 'obstacles: expected a list of 0 to 32, got 33'),
        (
            SCENE | {'obstacles': [CIRCLE, BOX | {'size_y': 5}]},
            r'obstacles\[1\]\.size_y: expected a number in .* 0\.3\], got 5',
        ),
        (SCENE | {'obstacles': [CIRCLE | {'kind': 'hull'}]}, "kind: expected one of circle, box, got 'hull'"),
        (SCENE | {'obstacles': [7]}, r'obstacles\[0\]: expected an object, got 7'),
        ({'type': 'shuffle', 'seed': 1.5}, r'seed: expected a whole number in \[0, 2147483647\], got 1\.5'),
        (TASKS | {'trials': 0}, r'trials: expected a whole number in \[1, 200\], got 0'),
        (TASKS | {'assistance': 'some'}, "assistance: expected one of mixed, with, without, got 'some'"),
        ({'type': 'guidance', 'on': 1}, 'on: expected true or false, got 1'),
        ({'type': 'job', 'name': '../../x'}, 'name: expected one of report, fit, compare'),
        ({'type': 'parameters', 'name': '/etc/x.yaml'}, 'name: expected one of standard, mine'),
        ({'type': 'stop', 'on': True}, "message: expected the fields none, got 'on'"),
    ],
)
def test_a_bad_message_is_refused_with_field_value_and_bound(message: Any, error: str) -> None:
    with pytest.raises(InputError, match=error):
        parse_message(message if isinstance(message, str) else json.dumps(message))


def test_a_scene_reaches_the_node_as_it_was_arranged() -> None:
    scene = parse(SCENE).scene
    assert parse({'type': 'scene', **scene.as_json()}) == SceneMessage(scene)
    messages = scene.encode(RosbagsTypes(TYPESTORE), 5)
    decoded, given = decode_point_cloud(messages['obstacles'], 'xy'), scene.tabulate()
    assert (decoded.obstacles.ids, decoded.stamp_ns, decoded.frame_id) == (given.ids, 5, 'play')
    for name in ('centre', 'radius', 'radius_stddev', 'corners', 'vertices'):
        np.testing.assert_allclose(getattr(decoded.obstacles, name), getattr(given, name), atol=1e-8)
    np.testing.assert_allclose(decode_goals(messages['goals'], 'xy')[0], [[0.3, 0.0]])


def test_clearance_is_negative_inside_an_obstacle() -> None:
    scene = PlayScene((make_circle((0.1, 0.0), 0.02), make_box((0.2, 0.0), (0.04, 0.02), 0.0)), ((0.3, 0.0),))
    for position, clearance in (((0.1, 0.03), 0.01), ((0.1, 0.015), -0.005), ((0.2, 0.012), 0.002), ((0.2, 0.004), -0.006)):
        assert scene.measure_clearance(position) == pytest.approx(clearance)
    assert PlayScene((), ((0.3, 0.0),)).measure_clearance((0.0, 0.0)) == math.inf


def test_random_scenes_leave_room_and_repeat_by_seed() -> None:
    for seed in range(50):
        scene = make_random_scene(np.random.default_rng(seed), FIRST_SCENE.goals)
        assert scene == make_random_scene(np.random.default_rng(seed), FIRST_SCENE.goals)
        assert 3 <= len(scene.obstacles) <= 5
        assert parse({'type': 'scene', **scene.as_json()}).scene == scene  # within the bounds of the page
        for point in (START, *scene.goals):
            assert scene.measure_clearance(point) > TARGET_RADIUS
    assert scene != make_random_scene(np.random.default_rng(0), FIRST_SCENE.goals)


def test_stamps_follow_the_quickest_message_and_never_step_back() -> None:
    clock, second = PageClock(), 10**9
    assert clock.stamp(1000.0, 100 * second) == 100 * second
    # this message took 50 ms less: those after it count from there
    assert clock.stamp(1060.0, 100 * second + 10_000_000) == 100 * second + 10_000_000
    assert clock.stamp(1080.0, 100 * second + 90_000_000) == 100 * second + 30_000_000
    # 20 ms later it took 40 ms less again: its stamp would step back
    assert clock.stamp(1090.0, 100 * second) is None
    assert clock.stamp(1130.0, 100 * second + 45_000_000) == 100 * second + 40_000_000
    with pytest.raises(InputError, match=r'hand\.t: expected a time after the last one, 1130\.0 ms, got 1130\.0'):
        clock.stamp(1130.0, 101 * second)
    with pytest.raises(InputError, match=r'hand\.t: expected a time before .* ms, got 9000000000'):
        clock.stamp(9e9, 101 * second)
    assert clock.stamp(1140.0, 100 * second + 60_000_000) == 100 * second + 50_000_000


def test_a_sequence_is_balanced_and_repeats_by_seed() -> None:
    settings = TasksMessage(12, 3, 'mixed', False, True)
    trials = make_trials(settings, FIRST_SCENE)
    assert trials == make_trials(settings, FIRST_SCENE) != make_trials(replace(settings, seed=4), FIRST_SCENE)
    kinds = [(each.goal, each.is_guided) for each in trials]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {(goal, on): 2 for goal in range(3) for on in (False, True)}
    assert len({each.scene for each in trials}) == 12
    assert not any(each.is_guided for each in make_trials(replace(settings, assistance='without'), FIRST_SCENE))


def test_a_trial_is_scored() -> None:
    """The hand moves along x at 0.1 m/s through a circle, and the way of number 7 is the most likely one from x = 0.1 m on."""
    scene = PlayScene((make_circle((0.15, 0.0), 0.02),), ((0.3, 0.0),))
    tasks = Tasks(TasksMessage(1, 0, 'without', False, False), scene)
    assert [tasks.follow(0.0, (0.2, 0.0)), tasks.follow(0.1, START)] == [None, Phase.WAIT]
    assert tasks.follow(0.2, (0.1, 0.0)) is Phase.RETURN
    begin = next(t for t in (0.3 + 0.01 * step for step in range(200)) if tasks.follow(t, START) is Phase.REACH)
    assert 0.4 <= begin - 0.3 <= 0.91
    t = 0.0
    while tasks.phase is Phase.REACH:
        t += 0.01
        position = (min(0.1 * t, 0.3), 0.0)
        tasks.follow(begin + t, position)
        tasks.note_most_likely(begin + t, 7 if position[0] >= 0.1 else 3)
        assert t < 10.0
    assert tasks.phase is Phase.OVER
    assert tasks.follow(begin + 9.0, START) is None
    (score,) = tasks.scores
    assert score.touched == 1
    assert score.time_s == pytest.approx(2.85, abs=0.02)  # at the edge of the goal
    assert score.path_m == pytest.approx(0.3, abs=0.02)
    assert score.ahead_s == pytest.approx(1.85, abs=0.03)
    numbers = f'{score.time_s:.2f}', '1', f'{100.0 * score.path_m:.1f}', f'{score.ahead_s:.2f}'
    assert tabulate_scores([score]) == [('without guidance', '1', *numbers)]


@pytest.mark.parametrize(
    ('message', 'words'),
    [
        ('predicting', 'predicting'),
        ('no prediction: no hand pose yet', 'no prediction: no hand pose yet'),
        ('hand_superseded 3', 'predicting; positions were passed over, because this computer is busy: 3'),
        ('busy: a; hand_late 2; predict_nothing_solved 1', 'busy: a; hand_late 2; predictions found no way: 1'),
        ('scene_hand_inside 2', 'predicting; predictions began within the margin of an obstacle: 2'),
    ],
)
def test_counters_of_the_node_are_shown_in_words(message: str, words: str) -> None:
    assert describe_health(message) == words


def test_a_class_keeps_its_slot_while_it_is_followed() -> None:
    slots = Slots()
    assert slots.assign([5, 9]) == [0, 1]
    assert slots.assign([9, 4, 5]) == [1, 2, 0]
    assert slots.assign([4]) == [2]
    assert slots.assign([4, 5]) == [2, 3]  # slot 0 is free for a short time only: the others come first
    assert slots.assign(list(range(20)))[12:] == [None] * 8


def test_a_hand_message_is_read() -> None:
    assert parse(HAND) == HandMessage(10.0, (0.1, 0.0), 8.0)
