# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parts of `foc_ros play` that need neither a browser nor a session: messages, clock, scene, tasks and the predictor."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from play_helpers import until
from report_samples import START_NS, prediction
from session_helpers import BOX, CIRCLE, SCENE, TASKS, parse

from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.io.bags import TYPESTORE
from foc_ros.play.messages import PageClock, parse_message
from foc_ros.play.predictor import Predictor, State
from foc_ros.play.scene import FIRST_SCENE, START
from foc_ros.play.tasks import Phase, Tasks, tabulate_scores
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud
from foc_ros.ros.messages.decode_poses import decode_goals
from foc_ros.ros.messages.encode_inputs import encode_hand_pose
from foc_ros.ros.messages.types import RosbagsTypes

TYPES, NOW_NS = RosbagsTypes(TYPESTORE), 10**15
HAND = {'type': 'hand', 't': 10.0, 'x': 0.1, 'y': 0.0, 'event': 8.0}


@pytest.mark.parametrize(
    ('message', 'error'),
    [
        ('{', r"message: expected JSON, got '\{'"),
        ('[' * 20_000, 'message: expected JSON'),
        ('[]', r'message: expected .*, got \[\]'),
        ({'type': 'open', 'file': '/etc/passwd'}, "message: expected .* 'hand', 'scene', .* got .*'open'"),
        (HAND | {'x': 9.0}, r'hand\.x: expected a number <= 0\.38, got 9\.0'),
        (HAND | {'x': math.nan}, r'hand\.x: expected a finite number, got nan'),
        (HAND | {'y': '0'}, r"hand\.y: expected a number, got '0'"),
        (HAND | {'t': -1}, r'hand\.t: expected a number >= 0, got -1'),
        (HAND | {'event': True}, r'hand\.event: expected a number, got True'),
        (HAND | {'topic': '/x'}, r"hand\.topic: expected no such field, got '/x'"),
        ({'type': 'hand', 't': 1.0}, r'hand\.x: expected a value, got nothing'),
        (SCENE | {'goals': []}, r'scene\.goals: expected a list of at least 1, got \[\]'),
        (SCENE | {'goals': {}}, r'scene\.goals: expected a list, got \{\}'),
        (SCENE | {'obstacles': [CIRCLE] * 33}, r'scene\.obstacles: expected a list of at most 32, got '),
        (SCENE | {'obstacles': [CIRCLE, BOX | {'size_y': 5}]}, r'obstacles\[1\]\.box\.size_y: expected a number <= 0\.3, got 5'),
        (SCENE | {'obstacles': [CIRCLE | {'kind': 'hull'}]}, r"obstacles\[0\]: expected .* 'circle', 'box'"),
        (SCENE | {'obstacles': [7]}, r'obstacles\[0\]: expected .*, got 7'),
        ({'type': 'shuffle', 'seed': 1.5}, r'shuffle\.seed: expected a valid integer, got 1\.5'),
        (TASKS | {'trials': 0}, r'tasks\.trials: expected a number >= 1, got 0'),
        (TASKS | {'assistance': 'some'}, r"tasks\.assistance: expected 'mixed', 'with' or 'without', got 'some'"),
        ({'type': 'guidance', 'on': 1}, r'guidance\.on: expected a valid boolean, got 1'),
        ({'type': 'job', 'name': '../../x'}, r"job\.name: expected 'report', 'fit' or 'compare'"),
        ({'type': 'parameters', 'name': '/etc/x.yaml'}, r"parameters\.name: expected 'standard' or 'mine'"),
        ({'type': 'stop', 'on': True}, r'stop\.on: expected no such field, got True'),
    ],
)
def test_a_bad_message_is_refused_with_field_value_and_bound(message, error):
    with pytest.raises(InputError, match=error):
        parse_message(message if isinstance(message, str) else json.dumps(message))


def test_a_scene_reaches_the_node_as_it_was_arranged():
    scene = parse(SCENE)
    assert parse(scene.model_dump()) == scene
    messages = scene.encode(TYPES, 5)
    decoded, given = decode_point_cloud(messages['obstacles'], 'xy'), scene.tabulate()
    assert (decoded.obstacles.ids, decoded.stamp_ns, decoded.frame_id) == (given.ids, 5, 'play')
    for name in ('centre', 'radius', 'radius_stddev', 'corners', 'vertices'):
        np.testing.assert_allclose(getattr(decoded.obstacles, name), getattr(given, name), atol=1e-8)
    np.testing.assert_allclose(decode_goals(messages['goals'], 'xy')[0], [[0.3, 0.0]])


def test_stamps_follow_the_quickest_message_and_never_step_back():
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


def test_a_trial_is_scored():
    """The hand moves along x at 0.1 m/s through a circle, and the way of number 7 is the most likely one from x = 0.1 m on."""
    scene = parse(SCENE | {'obstacles': [CIRCLE | {'x': 0.15}]})
    tasks = Tasks(parse(TASKS | {'trials': 1, 'assistance': 'without'}), scene)
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


def test_the_state_is_well_only_while_predictions_succeed():
    """It fails where the pipeline fails, no path is found, all paths are from before, or the thread is gone."""
    predictor = Predictor(Config(budget_s=0.0), lambda _: None)
    assert predictor.check().level == 'failing', 'not started'
    predictor.start()
    try:
        assert (predictor.check().level, 'hand' in predictor.check().text) == ('waiting', True)
        for role, message in FIRST_SCENE.encode(TYPES, NOW_NS).items():
            predictor.send(role, message)
        predictor.send('hand_pose', encode_hand_pose(TYPES, NOW_NS, 'play', (0.0, 0.0, 0.0)))
        until(lambda: predictor.check() == State('well', 'predicting'), 'predictions', 20)
        made = prediction(START_NS, np.zeros(2))
        lost = replace(made, candidates=made.candidates[-1:])
        held = replace(made, candidates=tuple(replace(each, age_s=0.1) for each in made.candidates[:3]))
        for recent, level, words in (
            ([made], 'well', 'predicting'),
            ([made, lost], 'failing', 'no path to any goal can be found'),
            ([held] * 11 + [made] * 9, 'failing', 'this computer is too busy'),
            ([held] * 10 + [made] * 10, 'well', 'predicting'),
        ):
            predictor._recent.clear()
            predictor._recent.extend(recent)
            assert predictor.check().level == level and predictor.check().text.startswith(words)
        predictor._note_error(ValueError('x'))
        assert predictor.check() == State('failing', 'internal error: x')
    finally:
        predictor.stop()
    assert predictor.check().text.startswith('predictions have ended')
