# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Poses, collision objects and detections in messages and bags, the packages of which need not be installed; topics of bags."""

import math
import re
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest
from bag_helpers import CONFIG, messages, ns, write_by_rosbags
from message_helpers import BAGS, SECOND, STORE, both_kinds, collision_object, detection, detections, pose_array, pose_stamped
from rosbags.rosbag2 import StoragePlugin

from foc_ros import replay
from foc_ros.core.errors import LostHandError, MessageError, RecordingError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.polygons import make_box_polygon
from foc_ros.io.topics import OPTIONAL, TYPES, assign_topics
from foc_ros.ros.messages.decode_objects import ObjectTable, decode_detections
from foc_ros.ros.messages.decode_poses import MAX_GOALS, decode_goal, decode_goals, decode_hand_sample
from foc_ros.ros.messages.plane import Transform, compute_rotation

BOX, SPHERE, CYLINDER, CONE = 1, 2, 3, 4
QUARTER = {'z': math.sqrt(0.5), 'w': math.sqrt(0.5)}


def after(*given, plane='xy'):
    table = ObjectTable()
    for message in given:
        table = table.with_collision_object(message, plane)
    return table


def check_polygon(obstacles, row, centre, size, yaw):
    polygon = make_box_polygon(size, yaw)
    np.testing.assert_allclose(obstacles.centre[row], centre, atol=1e-12)
    assert obstacles.corners[row] == len(polygon)
    np.testing.assert_allclose(measure_offsets(centre + polygon, obstacles)[1][:, row], 0.0, atol=2e-9)


def test_primitives_stand_where_the_poses_of_object_and_primitive_say_and_what_is_no_shape_is_counted():
    parts = (BOX, (0.4, 0.2, 0.1), (0.5, 0, 0)), (SPHERE, (0.05,), (0, 0.3, 0)), (CYLINDER, (0.4, 0.02), (0, 0, 0))
    obstacles = after(collision_object(*parts, place=(1, 2, 3), turned=QUARTER)).obstacles(0, 0.01)
    assert obstacles.ids == ('table/0', 'table/1', 'table/2')
    check_polygon(obstacles, 0, (1.0, 2.5), (0.4, 0.2), math.pi / 2)
    check_polygon(obstacles, 1, (0.7, 2.0), (0, 0), 0)
    check_polygon(obstacles, 2, (1.0, 2.0), (0, 0), 0)
    assert obstacles.radius.tolist() == [0.0, 0.05, 0.02] and obstacles.radius_stddev.tolist() == [0.01] * 3
    lying = after(collision_object((CYLINDER, (0.4, 0.02), (0, 0, 0))), plane='xz').obstacles(0, 0.0)
    check_polygon(lying, 0, (0.0, 0.0), (0.0, 0.4), 0.0)
    assert lying.radius.tolist() == [0.02], 'a capsule'
    mesh = BAGS.make('shape_msgs/msg/Mesh')
    table = after(collision_object((CONE, (0.1, 0.1), (0, 0, 0)), (SPHERE, (0.1,), (0, 0, 0)), meshes=[mesh]))
    assert dict(table.dropped) == {'not_a_shape': 2} and table.obstacles(0, 0.0).ids == ('table/0',)


def test_objects_are_added_appended_moved_and_removed():
    ball = (SPHERE, (0.05,), (0, 0, 0))
    held = [collision_object(ball), collision_object(ball, name='cup'), collision_object(ball, ball, operation=2)]
    assert after(*held).obstacles(0, 0.0).ids == ('table/0', 'table/1', 'table/2', 'cup/0')
    assert after(*held, collision_object(ball)).obstacles(0, 0.0).ids == ('table/0', 'cup/0')
    moved = after(*held, collision_object(name='cup', place=(1, 2, 0), operation=3)).obstacles(0, 0.0)
    np.testing.assert_allclose(moved.centre[-1], [1, 2])
    assert after(*held, collision_object(operation=1)).obstacles(0, 0.0).ids == ('cup/0',)
    assert not len(after(*held, collision_object(name='', operation=1, frame_id='')).obstacles(0, 0.0))


@pytest.mark.parametrize(
    ('message', 'words'),
    [
        (collision_object(operation=7), 'operation: expected ADD (0), REMOVE (1), APPEND (2) or MOVE (3), got 7'),
        (collision_object((BOX, (1, 1), (0, 0, 0))), 'primitives[0].dimensions: expected 3 numbers for a primitive of type 1'),
        (collision_object((BOX, (1, -1, 1), (0, 0, 0))), 'primitives[0].dimensions[1]: expected a size in [0, 10000] m, got -1'),
        (collision_object((SPHERE, (math.nan,), (0, 0, 0))), 'primitives[0].dimensions[0]: expected a size in [0, 10000] m'),
        (collision_object((BOX, (0, 0, 0), (0, 0, 0))), 'primitives[0].dimensions: expected a size > 0 m, got 0'),
        (collision_object((SPHERE, (1,), (0, 2e4, 0))), 'primitive_poses[0].position.y: expected a number from -10000'),
        (collision_object(turned={'w': math.nan}), 'pose.orientation.w: expected a finite number, got nan'),
        (collision_object((SPHERE, (1,), (0, 0, 0)), primitive_poses=[]), 'primitive_poses: expected 1, one for each primitive'),
        (collision_object(name='chair', operation=3), "id: expected an object that was added before it is moved, got 'chair'"),
        (collision_object(frame_id='base'), "header.frame_id: expected 'world', as the other objects, got 'base'"),
        (collision_object(stamp_ns=-SECOND), 'header.stamp.sec: expected at least 0, got -1'),
    ],
)  # fmt: skip
def test_a_wrong_object_is_refused(message, words):
    with pytest.raises(MessageError, match=re.escape(words)):
        after(collision_object((SPHERE, (1,), (0, 0, 0))), message)


def test_detections_are_boxes_by_id_and_those_that_are_not_finite_or_repeated_are_dropped():
    boxes = detection((1, 2, 3), (0.4, 0.2, 0.1), 'cup;1'), detection((4, 5, 6), (0.4, 0.2, 0.1), turned=QUARTER)
    found = decode_detections(detections(*boxes), 'xy')
    assert (found.stamp_ns, found.frame_id, found.dropped) == (SECOND, 'world', {})
    obstacles = found.obstacles(0, 0.01)
    assert obstacles.ids == ('cup%3B1', '1') and obstacles.radius_stddev.tolist() == [0.01, 0.01]
    check_polygon(obstacles, 0, (1.0, 2.0), (0.4, 0.2), 0.0)
    check_polygon(obstacles, 1, (4.0, 5.0), (0.4, 0.2), math.pi / 2)
    assert not len(decode_detections(detections(), 'xy').obstacles(0, 0.0))
    each = [detection((x, 0, 0), (1, 1, 1), 'a') for x in (1.0, 2.0)]
    found = decode_detections(detections(*each, detection((math.nan, 0, 0), (1, 1, 1))), 'xy')
    assert found.dropped == {'duplicate_id': 1, 'not_finite': 1} and found.obstacles(0, 0.0).centre.tolist() == [[2.0, 0.0]]


@pytest.mark.parametrize(
    ('each', 'words'),
    [
        (detection((0, 0, 0), (1, -1, 1)), 'detections[0].bbox.size.y: expected a size in [0, 10000] m, got -1'),
        (detection((0, 0, 0), (0, 0, 1)), 'detections[0].bbox.size: expected a size > 0 m along an axis of the plane'),
        (detection((2e4, 0, 0), (1, 1, 1)), 'detections[0].bbox.center.position.x: expected a number from -10000 to 10000 [m]'),
        (detection((0, 0, 0), (1, 1, 1), frame_id='base'), "detections[0].header.frame_id: expected 'world', as the array"),
    ],
)  # fmt: skip
def test_a_wrong_detection_is_refused(each, words):
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_detections(detections(each), 'xy')


@pytest.mark.parametrize('topic', ['/collision_objects', '/other'])
def test_a_bag_with_them_is_replayed_by_its_own_definitions(tmp_path, topic):
    items = [each for each in messages(seconds=0.2) if each[0] != '/obstacles']
    for seconds in (-0.1, 0.1):
        where = {'stamp_ns': ns(seconds)}
        box = detections(detection((0.15, 0, 0), (0.06, 0.04, 0.1), 'box'), **where)
        if topic == '/collision_objects':
            box = collision_object((BOX, (0.06, 0.04, 0.1), (0.15, 0, 0)), name='box', **where)
        items.append((topic, ns(seconds), box))
    ordered = sorted(items, key=lambda item: item[1])
    write_by_rosbags(tmp_path / 'bag', ordered, STORE, version=9, storage_plugin=StoragePlugin.MCAP)
    predictions = list(replay(tmp_path / 'bag', CONFIG))
    assert len(predictions) == 10
    name = 'box/0' if topic == '/collision_objects' else 'box'
    assert all(each.obstacles.ids == (name,) and each.obstacles.corners.tolist() == [4] for each in predictions)
    assert {each.label for each in predictions[0].candidates} == {f'goal0:+{name}', f'goal0:-{name}'}


def test_both_inputs_are_transformed():
    found = Transform(compute_rotation(SimpleNamespace(x=0.0, y=0.0, **QUARTER)), np.array([1.0, 0.0, 0.0]))
    given = detections(detection((0.5, 0, 0), (0.4, 0.2, 0.1), frame_id='camera'), frame_id='camera')
    array = decode_detections(given, 'xy', lambda _: ('world', found))
    thing = collision_object((BOX, (0.4, 0.2, 0.1), (0, 0, 0)), place=(0.5, 0, 0), frame_id='camera')
    table = ObjectTable().with_collision_object(thing, 'xy', lambda _: ('world', found))
    assert (array.frame_id, table.frame_id) == ('world', 'world')
    for obstacles in (array.obstacles(0, 0.0), table.obstacles(0, 0.0)):
        check_polygon(obstacles, 0, (1.0, 0.5), (0.4, 0.2), math.pi / 2)


@pytest.mark.parametrize('role', OPTIONAL)
def test_the_node_receives_them_or_names_the_package_that_is_missing_for_a_published_topic(role, ros):
    from node_helpers import Bench
    from std_msgs.msg import String

    from foc_ros.ros.endpoints import find_missing_packages

    package, node, said = TYPES[role].partition('/')[0], Bench(ros).node, []
    is_installed = find_spec(package) is not None
    assert find_missing_packages().get(role) == (None if is_installed else package)
    assert (role in node._inputs) == is_installed
    node._loggers[role] = SimpleNamespace(error=lambda text, **_: said.append(text))
    node._publish_health()
    assert said == []
    if not is_installed:
        node.create_publisher(String, role, 1)
        node._publish_health()
        assert said == [f'{role} is published, but cannot be received: the package {package} is not installed']


@both_kinds
def test_a_hand_pose_becomes_a_sample_whatever_its_orientation(types):
    sample = decode_hand_sample(pose_stamped(types, (0.1, 0.2, 0.3), 5 * SECOND + 7, 'base', x=math.nan, y=7.0), 'xz')
    assert (sample.stamp_ns, sample.frame_id) == (5 * SECOND + 7, 'base')
    assert (*sample.position, sample.height) == (0.1, 0.3, 0.2)
    assert not sample.position.flags.writeable


@both_kinds
@pytest.mark.parametrize('turn', [(0, 0, 0, 0), (0, 0, 0, 1e-3), (9, 9, 9, 9), (math.nan, 0, 0, 1), (math.inf, 0, 0, 0)])
def test_the_position_0_without_an_orientation_means_no_data(types, turn):
    for turned in ({'w': 1.0}, *({'y': 0.6 * size, 'w': 0.8 * size} for size in (1.0, -1.0, 0.95))):
        assert decode_hand_sample(pose_stamped(types, (0.0, 0.0, 0.0), **turned), 'xy').height == 0.0
    with pytest.raises(LostHandError, match='the tracker has lost the hand'):
        decode_hand_sample(pose_stamped(types, (0.0, 0.0, 0.0), **dict(zip('xyzw', turn, strict=True))), 'xy')


@both_kinds
@pytest.mark.parametrize('axis', [0, 1, 2])
@pytest.mark.parametrize(
    ('value', 'words'),
    [
        (math.nan, r'expected a finite number \[m\], got nan'),
        (math.inf, r'expected a finite number \[m\], got inf'),
        (-math.inf, r'expected a finite number \[m\], got -inf'),
        (1.1e4, r'expected a number from -10000 to 10000 \[m\], got 11000'),
    ],
)
def test_a_coordinate_that_is_not_finite_or_too_large_is_refused(types, axis, value, words):
    name, position = f'position.{"xyz"[axis]}', [0.0, 0.0, 0.0]
    position[axis] = value
    for decode in (decode_hand_sample, decode_goal):
        with pytest.raises(MessageError, match=f'pose.{name}: {words}') as caught:
            decode(pose_stamped(types, position), 'xy')
        assert caught.value.field == f'pose.{name}'
    with pytest.raises(MessageError, match=rf'poses\[1\].{name}: {words}'):
        decode_goals(pose_array(types, [(0, 0, 0), position]), 'xy')


@both_kinds
@pytest.mark.parametrize(
    ('sec', 'nanosec', 'words'),
    [
        (0, 0, r'header\.stamp: expected a time after 0, got 0 s'),
        (-1, 5, r'header\.stamp\.sec: expected at least 0, got -1'),
        (1, SECOND, r'header\.stamp\.nanosec: expected below 1000000000, got 1000000000'),
    ],
)
def test_a_wrong_stamp_is_refused(types, sec, nanosec, words):
    message = pose_stamped(types, (0, 0, 0))
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    with pytest.raises(MessageError, match=words):
        decode_hand_sample(message, 'xy')


def test_a_number_that_is_not_finite_is_named_as_it_was_sent_whatever_a_transform_makes_of_it():
    turned = Transform(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))
    with pytest.raises(MessageError, match=r'poses\[1\]\.position\.y: expected a finite number'):
        decode_goals(pose_array(BAGS, [(0, 0, 0), (0.1, math.nan, 0)]), 'xy', lambda _: ('base', turned))


@both_kinds
def test_goals_keep_their_order_and_need_no_stamp(types):
    goals, frame_id, heights = decode_goal(pose_stamped(types, (1.0, 2.0, 3.0), 0, 'base'), 'yz')
    assert (frame_id, goals.tolist(), heights.tolist()) == ('base', [[2.0, 3.0]], [1.0])
    goals, frame_id, heights = decode_goals(pose_array(types, [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]), 'xy')
    assert (frame_id, goals.tolist(), heights.tolist()) == ('world', [[1.0, 2.0], [4.0, 5.0]], [3.0, 6.0])
    assert decode_goals(pose_array(types, []), 'xy')[0].shape == (0, 2)


def test_too_many_goals_are_refused():
    assert len(decode_goals(pose_array(BAGS, [(0, 0, 0)] * MAX_GOALS), 'xy')[0]) == MAX_GOALS
    with pytest.raises(MessageError, match=f'poses: expected at most {MAX_GOALS} goals, got {MAX_GOALS + 1}'):
        decode_goals(pose_array(BAGS, [(0, 0, 0)] * (MAX_GOALS + 1)), 'xy')


POSE, CLOUD, MARKERS, POSES = (
    'geometry_msgs/msg/PoseStamped',
    'sensor_msgs/msg/PointCloud2',
    'visualization_msgs/msg/MarkerArray',
    'geometry_msgs/msg/PoseArray',
)
PLAIN = {'/hand_pose': POSE, '/obstacles': CLOUD, '/goals': POSES}
PSM = {'/PSM1/measured_cp': POSE, '/PSM1/setpoint_cp': POSE, '/a/obstacle_markers': MARKERS, '/goal_pose': POSE}
OTHERS = {'/tool': POSE, '/scene': CLOUD, '/targets': POSES, '/camera': 'sensor_msgs/msg/Image'}
OUTPUTS = {'/hand_pose': POSE, '/shapes': MARKERS, '/goals': POSES, '/foc/prediction': CLOUD, '/foc/markers': MARKERS}
TWO_ARMS = {'/r/measured_cp': POSE, '/l/measured_cp': POSE, '/obstacles': CLOUD, '/goals': POSES}
CHOOSE = 'several topics could be'


@pytest.mark.parametrize(
    ('topics', 'expected'),
    [
        (PLAIN, {'hand_pose': '/hand_pose', 'obstacles': '/obstacles', 'goals': '/goals'}),
        (PSM, {'hand_pose': '/PSM1/measured_cp', 'obstacle_markers': '/a/obstacle_markers', 'goal_pose': '/goal_pose'}),
        (OTHERS, {'hand_pose': '/tool', 'obstacles': '/scene', 'goals': '/targets'}),
        ({**PLAIN, '/left/measured_cp': POSE, '/right/measured_cp': POSE}, {'hand_pose': '/hand_pose'}),
        ({**PLAIN, '/obstacle_markers': MARKERS}, {'obstacles': '/obstacles', 'obstacle_markers': '/obstacle_markers'}),
        ({'/hand_pose': POSE, '/obstacles': MARKERS, '/goals': POSES}, {'obstacle_markers': '/obstacles'}),
        (OUTPUTS, {'obstacle_markers': '/shapes'}),
    ],
)
def test_topics_are_found(topics, expected):
    roles = assign_topics(topics)
    assert {role: roles[role] for role in expected} == expected
    assert len(set(roles.values())) == len(roles)


@pytest.mark.parametrize(
    ('topics', 'chosen', 'message'),
    [
        ({'/obstacles': CLOUD, '/goals': POSES}, None, f'no topic for hand_pose ({POSE}); the recording has /goals'),
        ({'/hand_pose': POSE, '/goals': POSES}, None, f'no topic for obstacles ({CLOUD}) or obstacle_markers'),
        ({'/hand_pose': POSE, '/obstacles': CLOUD}, None, f'no topic for goals ({POSES}) or goal_pose'),
        ({}, None, 'the recording has no topics'),
        (TWO_ARMS, None, f'{CHOOSE} hand_pose: /l/measured_cp, /r/measured_cp; choose with --remap hand_pose:=TOPIC'),
        ({'/hand_pose': POSE, '/a': CLOUD, '/b': MARKERS, '/goals': POSES}, None, f'{CHOOSE} obstacles: /a, /b'),
        (PLAIN, {'hand': '/hand_pose'}, "no input is named 'hand': expected one of hand_pose, obstacles"),
        (PLAIN, {'hand_pose': '/other'}, 'topic /other chosen for hand_pose is not in the recording, which has'),
        (PLAIN, {'goals': '/obstacles'}, f'topic /obstacles chosen for goals: expected type {POSES}, got {CLOUD}'),
    ],
)
def test_a_wrong_choice_of_topics_is_refused(topics, chosen, message):
    with pytest.raises(RecordingError, match=re.escape(message)):
        assign_topics(topics, chosen)
