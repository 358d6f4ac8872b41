# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scene files: every field is read, and errors name field, value and bound."""

import json
import re
from typing import Any

import numpy as np
import pytest

from foc_ros.core.config import Config
from foc_ros.core.errors import FocWarning, RecordingError, SceneError
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, collect_obstacles
from foc_ros.io.scene_file import load_scene, parse_scene

SCENE: dict[str, Any] = {
    'start': [0.0, 0.1],
    'goal': [0.3, 0.0],
    'start_velocity': [0.2, 0.0],
    'start_acceleration': [0.0, -1.0],
    'start_stddev': 0.002,
    'duration_s': 0.8,
    'steps': 40,
    'noise': [0.15, 0.1],
    'eta': 0.95,
    'strategy': 'fixed',
    'tau': 0.0012,
    'lambda': 1e6,
    'max_candidates': 3,
    'obstacles': [
        {'x': 0.1, 'y': 0.0, 'radius': 0.03, 'radius_stddev': 0.003, 'id': 'cup'},
        {'x': 0.2, 'y': 0.1, 'radius': 0.02},
    ],
}


def without(*names):
    return {name: value for name, value in SCENE.items() if name not in names}


def test_every_field_is_read():
    scene = parse_scene(SCENE)
    assert scene.hand.mean.tolist() == [0.0, 0.1, 0.2, 0.0, 0.0, -1.0]
    assert np.allclose(np.diag(scene.hand.covariance), [4e-6, 4e-6, 0, 0, 0, 0])
    assert scene.goals.tolist() == [[0.3, 0.0]] and scene.duration_s == 0.8 and scene.noise.tolist() == [0.15, 0.1]
    foc = scene.config.foc
    assert (foc.steps, foc.eta, foc.strategy, foc.tau, foc.lam) == (40, 0.95, 'fixed', 0.0012, 1e6)
    assert scene.config.homotopy.max_candidates == 3
    obstacles = scene.obstacles
    assert obstacles.ids == ('cup', '1') and obstacles.centre.tolist() == [[0.1, 0.0], [0.2, 0.1]]
    assert obstacles.radius.tolist() == [0.03, 0.02] and obstacles.radius_stddev.tolist() == [0.003, 0.0]
    assert scene.guess is None


def test_a_missing_field_has_the_default_of_its_parameter():
    scene = parse_scene({'start': [0, 0], 'goals': [[0.3, 0], [0.3, 0.1]]})
    assert scene.config.foc == Config().foc and scene.config.homotopy == Config().homotopy
    assert scene.duration_s == Config().duration.fixed_s
    assert len(scene.obstacles) == 0 and not scene.hand.covariance.any() and not scene.hand.mean.any()
    assert scene.goals.tolist() == [[0.3, 0.0], [0.3, 0.1]]


def test_goals_have_names_and_may_be_obstacles():
    goals = [{'position': [0.1, 0.0], 'name': 'tea', 'object': 'cup'}, {'position': [0.2, 0.1], 'object': 1}, [0.3, 0.0]]
    scene = parse_scene({**without('goal'), 'goals': goals})
    assert scene.goals.tolist() == [[0.1, 0.0], [0.2, 0.1], [0.3, 0.0]]
    assert scene.goal_names == ('tea', 'goal1', 'goal2') and scene.goal_objects == ('cup', '1', None)


def test_boxes_capsules_and_hulls_are_read():
    corners = [[0.1, 1.0], [0.3, 1.0], [0.2, 1.2]]
    given = [
        {'x': 1, 'y': 2, 'size': [0.4, 0.2], 'yaw': 0.5, 'id': 'tray'},
        {'x': 3, 'y': 4, 'size': [0, 0.2], 'radius': 0.01, 'radius_stddev': 0.002},
        {'points': [*corners, [0.2, 1.1]], 'radius': 0.01},
        {'points': [[4, 1], [4, 2]], 'radius': 0.01},
        {'x': 5, 'y': 6, 'radius': 0.02},
    ]
    obstacles = parse_scene({**SCENE, 'obstacles': given}).obstacles
    boxes = Box((1, 2), (0.4, 0.2), 0.5, name='tray'), Box((3, 4), (0, 0.2), radius=0.01, radius_stddev=0.002)
    hulls = Hull(corners, radius=0.01), Capsule((4, 1), (4, 2), 0.01)
    expected = collect_obstacles([*boxes, *hulls, Circle((5, 6), radius=0.02)])
    for name, values in vars(expected).items():
        np.testing.assert_array_equal(getattr(obstacles, name), values, err_msg=name)


@pytest.mark.parametrize('name', ['scene.yaml', 'scene.yml', 'scene.json', 'scene'])
def test_yaml_and_json_give_the_same_scene(tmp_path, name):
    (tmp_path / name).write_text(json.dumps(SCENE, indent='\t' if name.endswith('json') else None), 'utf-8')
    scene = load_scene(tmp_path / name)
    assert scene.config.foc.lam == 1e6 and scene.obstacles.ids == ('cup', '1')


CAPSULE = {'start': [0.1, 0.1], 'end': [0.1, 0.2], 'radius': 0.01}
ROUND = [[2 + np.cos(turn), 2 + np.sin(turn)] for turn in np.linspace(0, 2 * np.pi, 18)[:17]]


def obstacle(count=1, **fields):
    return {**SCENE, 'obstacles': count * [{'x': 1, 'y': 1, 'radius': 0.1, **fields}]}


@pytest.mark.parametrize(
    ('given', 'message'),
    [
        ({'goal': [300, 0]}, r'goal: 300 m away, to be reached in 0.8 s: lengths are in metres, and times in seconds'),
        (obstacle(size=[0.1, 0.1], yaw=45), r'obstacles\[0\].yaw: 45 is more than a turn: angles are in radians'),
    ],
)
def test_units_that_are_probably_not_meant_are_told(given, message):
    with pytest.warns(FocWarning, match=message):
        parse_scene({**SCENE, **given})


@pytest.mark.parametrize(
    ('scene', 'message'),
    [
        ([], r'scene: expected a mapping of fields, got \[\]'),
        ({**SCENE, 'etta': 0.9}, r'etta: expected a known field \(did you mean eta\?\), got 0\.9'),
        (without('start'), 'start: expected a value, got nothing'),
        ({**SCENE, 'start': 0.1}, 'start: expected a list, got 0.1'),
        ({**SCENE, 'start': [0.1, 'a']}, r"start\[1\]: expected a number, got 'a'"),
        ({**SCENE, 'start': [0.1, float('nan')]}, r'start\[1\]: expected a finite number, got nan'),
        ({**SCENE, 'start_stddev': -0.1}, 'start_stddev: expected a number >= 0, got -0.1'),
        (without('goal'), 'goal: expected either goal or goals, got neither'),
        ({**SCENE, 'goals': [[0, 0]]}, 'goal: expected either goal or goals, got both'),
        ({**without('goal'), 'goals': []}, r'goals: expected a list of at least 1, got \[\]'),
        ({**without('goal'), 'goals': [[0, 0], [1e5, 0]]}, r'goals\[1\]\[0\]: expected a number <= 10000, got 100000.0'),
        ({**SCENE, 'eta': 1.0}, r'eta: expected a number in \[0, 0.999\], got 1.0'),
        ({**SCENE, 'steps': 2}, r'steps: expected a number in \[5, 400\], got 2'),
        ({**SCENE, 'steps': 40.5}, 'steps: expected a whole number.*, got 40.5'),
        ({**SCENE, 'duration_s': 0}, 'duration_s: expected a number in .* s, got 0'),
        ({**SCENE, 'noise': [0.1, -0.1]}, r'noise: expected a number in \[0, 2\].*, got -0.1'),
        ({**SCENE, 'strategy': 'best'}, "strategy: expected one of lv, hc, optimal, algorithm1, fixed, got 'best'"),
        ({**SCENE, 'strategy': 'lv'}, 'tau: expected to be given with strategy fixed only, got strategy lv'),
        ({**SCENE, 'obstacles': [{'x': 1, 'y': 1}]}, r'obstacles\[0\].radius: expected a value, got nothing'),
        (obstacle(radius=-1), r'obstacles\[0\].radius: expected a number >= 0, got -1'),
        (obstacle(size=[0, 0], radius=0), r'obstacles\[0\].radius: expected a number > 0 m for a box without any size, got 0'),
        (obstacle(yaw=1), r'obstacles\[0\].yaw: expected a known field: x, y, radius, .*, got 1'),
        (obstacle(points=[[0, 0]]), r'obstacles\[0\].x: expected a known field: points, radius, .*, got 1'),
        ({**SCENE, 'obstacles': [{'points': []}]}, r'obstacles\[0\].points: expected finite numbers of shape \(n, 2\), got \[\]'),
        ({**SCENE, 'obstacles': [{'points': ROUND}]}, r'obstacles\[0\].points: expected a hull of at most 16 corners, got 17'),
        ({**SCENE, 'hand_radius': -1}, r'hand_radius: expected a number in \[0, 1\] m, got -1'),
        ({**SCENE, 'obstacles': [CAPSULE]}, r'obstacles\[0\]: expected x, .*, or points: two for a capsule, .*, got .*start.*'),
        (obstacle(r=1), r'obstacles\[0\]\.r: expected a known field: x, .*, got 1'),
        (obstacle(2, id=3), "obstacles: expected a different name for each obstacle, got '3' twice"),
        (obstacle(id='a;b'), r"obstacles\[0\].id: expected a whole number, or a name .*, got 'a;b'"),
        ({**SCENE, 'start': [0.1, 0.02]}, r'start: expected a point outside obstacle cup, of radius 0.03 m, got .*, 0.02 m from'),
        ({**SCENE, 'goal': [0.2, 0.1], 'start': [0.1, 0.02]}, 'start: expected a point outside obstacle cup'),
        ({**SCENE, 'goal': {'position': [1, 1], 'object': 'mug'}}, r"goals\[0\].object: expected the id .*, got 'mug'"),
        ({**SCENE, 'goal': {'position': [1, 1], 'nam': 'a'}}, r"goal.nam: expected .*\(did you mean name\?\), got 'a'"),
        ({**without('goal'), 'goals': 2 * [{'position': [1, 1], 'name': 'a'}]}, "goals: .* a different name .*, got 'a' twice"),
        ({**SCENE, 'obstacles': 20_001 * [{}]}, 'obstacles: expected a list of at most 20000, got one of 20001'),
        ({**without('goal'), 'goals': 257 * [[0, 0]]}, 'goals: expected a list of at most 256, got one of 257'),
        ({**SCENE, 'guess': 10_001 * [[0, 0]]}, 'guess: expected a list of at most 10000, got one of 10001'),
        ({**SCENE, 'guess': {'amplitude': 'big'}}, "guess.amplitude: expected a number, got 'big'"),
        ({**SCENE, 'guess': [[0, 0], [0]]}, r'guess\[1\]\[1\]: expected a value, got nothing'),
        ({**without('goal'), 'goals': [[1, 0], [1, 1]], 'guess': {'amplitude': 0}}, 'guess: expected one goal, .*, got 2 goals'),
        ({'start': [0, 0], 'goal': [0, 0], 'guess': {'amplitude': 0.1}}, 'guess: expected a goal away from the start, got both'),
    ],
)  # fmt: skip
def test_a_wrong_field_is_named(scene, message):
    with pytest.raises(SceneError, match=f'^{message}'):
        parse_scene(scene)


@pytest.mark.parametrize(
    ('name', 'text', 'message'),
    [
        ('s.yaml', 'start: [0, 0', 'not a YAML file'),
        ('s.yaml', 'start: [0, 0]\nstart: [1, 1]\n', 'the key start is given twice'),
        ('s.yaml', '!!python/object/apply:os.getcwd []', 'not a YAML file: tags (!name) and aliases (*name) are not supported'),
        ('s.json', '{"start": [0, 0]', 'not a JSON file'),
        ('s.json', '{"start": [0, 0], "start": [1, 1]}', 'the key start is given twice'),
        ('s.json', '[' * 100_000, 'expected fewer mappings and lists within each other'),
        ('s.yaml', '[' * 1000, 'expected fewer mappings and lists within each other'),
        ('s.yaml', 'start: &a [0, 0]\ngoal: *a', 'tags (!name) and aliases (*name) are not supported'),
        ('s.yaml', '\x00', 'not a YAML file'),
    ],
)
def test_a_file_that_cannot_be_parsed_is_refused(tmp_path, name, text, message):
    (tmp_path / name).write_text(text, 'utf-8')
    with pytest.raises(RecordingError, match=f'^{re.escape(str(tmp_path / name))}: .*{re.escape(message)}|{re.escape(message)}'):
        load_scene(tmp_path / name)


@pytest.mark.parametrize('name', ['s.json', 's.yaml'])
@pytest.mark.parametrize('number', ['9' * 25, '-' + '9' * 400, '9' * 4000, '1e400'])
@pytest.mark.parametrize('field', ['steps', 'duration_s'])
def test_a_number_beyond_all_floats_is_refused_with_field_value_and_bound(tmp_path, name, number, field):
    (tmp_path / name).write_text(f'{{"start": [0, 0], "goal": [1, 0], "{field}": {number}}}', 'utf-8')
    with pytest.raises(
        SceneError, match=rf"^{field}: expected a .*number in \[.*\].*, got '?-?(9999|1e400|1.0e\+400|inf|a whole number of)"
    ) as caught:
        load_scene(tmp_path / name)
    assert len(str(caught.value)) < 300
