# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Encoding of a prediction, checked with independent readers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from message_helpers import BAGS, both_kinds, read_columns
from prediction_samples import DT, OBSTACLES, STEPS, outcome, prediction, three_ways
from scipy.spatial.transform import Rotation

from foc_ros.core.errors import FocError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.shapes import Box, Circle, collect_obstacles
from foc_ros.core.solution import Candidate, Status
from foc_ros.ros.messages.encode_prediction import OUTPUTS, encode_goal_likelihoods, encode_outputs
from foc_ros.ros.messages.plane import lift, project

NAMES = ['x', 'y', 'z', 't', 'vx', 'vy', 'vz', 'xx', 'xy', 'xz', 'yy', 'yz', 'zz', 'candidate', 'likelihood']
PAIRS = NAMES[7:13]
NAMES += ['compromised', *(f'motor_{pair}' for pair in PAIRS), 'goal', 'way', 'status']

PATH = np.linspace([0.0, 0.0], [0.3, 0.0], STEPS + 1)


def made(name, of, types=BAGS, plane='xy'):
    return encode_outputs(of, plane, types, [name])[name]


@both_kinds
@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_the_cloud_contains_every_solved_candidate(types, plane):
    ways = three_ways()
    cloud = made('prediction', ways, types, plane)
    table = read_columns(cloud)
    assert list(table) == NAMES
    rows = 2 * (STEPS + 1)
    assert (cloud.height, cloud.width, cloud.row_step, len(cloud.data)) == (1, rows, 100 * rows, 100 * rows)
    assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec, cloud.header.frame_id) == (5, 0, 'world')
    for index, each in enumerate(ways.solved_candidates):
        rows = table['candidate'] == index
        solution = each.solution
        np.testing.assert_allclose(table['t'][rows], DT * np.arange(STEPS + 1), rtol=1e-6)
        np.testing.assert_allclose(table['likelihood'][rows], each.likelihood, rtol=1e-6)
        xyz = np.stack([table[name][rows] for name in 'xyz'], axis=-1)
        np.testing.assert_allclose(xyz, lift(solution.path, 0.2, plane), rtol=1e-6, atol=1e-9)
        velocity = np.stack([table[f'v{name}'][rows] for name in 'xyz'], axis=-1)
        np.testing.assert_allclose(velocity, lift(solution.mean[:, 2:4], 0.0, plane), rtol=1e-6, atol=1e-9)
        lifted = lift(np.eye(2), 0.0, plane)
        space = lifted.T @ solution.covariance[:, :2, :2] @ lifted
        for i, j in zip(*np.triu_indices(3), strict=True):
            np.testing.assert_allclose(table['xyz'[i] + 'xyz'[j]][rows], space[:, i, j], rtol=1e-6)


@both_kinds
def test_the_likelihoods_are_a_table_with_labels(types):
    message = made('likelihoods', three_ways(), types)
    rows, columns_, stamp = message.layout.dim
    assert (stamp.label, stamp.size, stamp.stride) == ('stamp_ns:5000000000', 1, 1)
    assert (rows.label, rows.size, rows.stride) == ('goal0:+l1;goal0:-l1', 2, 8)
    assert (columns_.label, columns_.size, columns_.stride) == ('likelihood,effort,cost_ratio,eta', 4, 4)
    table = np.array(message.data).reshape(rows.size, columns_.size)
    np.testing.assert_allclose(table, [[0.7, 20.0, 1.0, 0.93], [0.3, 20.0, 2.5, 0.91]])


@both_kinds
def test_likelihoods_are_told_by_the_names_of_goals_and_classes(types):
    goals = np.array([[0.3, 0.0], [0.3, 0.1]])
    made_of = replace(three_ways(), goal_positions=goals, unknown=0.0)
    message = made('likelihoods_by_name', made_of, types)
    assert (message.header.stamp.sec, message.header.frame_id) == (5, 'world')
    by_name = {status.name: {each.key: float(each.value) for each in status.values} for status in message.status}
    assert by_name == {'goals': {'goal0': 1.0}, 'classes': {'goal0:+l1': 0.7, 'goal0:-l1': 0.3}}, 'nothing is known of goal1'
    likelihoods = encode_goal_likelihoods(made_of, types)
    assert {row: each.data for row, each in likelihoods.items()} == {0: pytest.approx(1.0)}
    half = made('likelihoods_by_name', replace(made_of, unknown=0.5), types)
    assert all({each.key: each.value for each in status.values}['unknown'] == '0.5' for status in half.status)
    assert encode_goal_likelihoods(prediction(goal_positions=goals), types) == {}


@both_kinds
def test_the_path_is_the_most_likely_one_with_stamps_in_the_future(types):
    ways = three_ways()
    message = made('path', ways, types, 'xz')
    stamps = [pose.header.stamp.sec * 10**9 + pose.header.stamp.nanosec for pose in message.poses]
    assert stamps == [5_000_000_000 + 50_000_000 * i for i in range(STEPS + 1)]
    points = [(pose.pose.position.x, pose.pose.position.y, pose.pose.position.z) for pose in message.poses]
    np.testing.assert_array_equal(points, lift(ways.solved_candidates[0].solution.path, 0.2, 'xz'))
    assert {pose.header.frame_id for pose in message.poses} == {'world'} == {message.header.frame_id}
    assert {pose.pose.orientation.w for pose in message.poses} == {1.0}


def test_the_candidate_called_most_likely_is_first_even_if_another_is_likelier_and_keeps_goal_and_number():
    one, other = outcome('goal1:+l1', 0.2, 0.1), outcome('goal0:-l1', 0.8, -0.1)
    one = replace(one, candidate=replace(one.candidate, goal=1), way=7)
    table = read_columns(made('prediction', prediction(replace(other, way=3), one)))
    assert table['way'].tolist() == [3] * (STEPS + 1) + [7] * (STEPS + 1)
    assert table['goal'].tolist() == [0] * (STEPS + 1) + [1] * (STEPS + 1)
    ways = prediction(outcome('a', 0.52, 0.1), outcome('b', 0.48, -0.1), most_likely='b')
    assert made('likelihoods', ways).layout.dim[0].label == 'b;a'
    table = read_columns(made('prediction', ways))
    np.testing.assert_allclose(table['likelihood'][table['candidate'] == 0], 0.48, rtol=1e-6)
    assert made('path', ways).poses[2].pose.position.y < 0


@both_kinds
@pytest.mark.parametrize('outcomes', [(), (outcome(status=Status.INFEASIBLE),)])
def test_nothing_solved_is_an_empty_answer(types, outcomes):
    messages = encode_outputs(prediction(*outcomes), 'xy', types)
    assert (messages['prediction'].width, len(messages['prediction'].data)) == (0, 0)
    assert [field.name for field in messages['prediction'].fields] == NAMES
    assert (messages['likelihoods'].layout.dim[0].size, len(messages['likelihoods'].data)) == (0, 0)
    assert not len(messages['path'].poses)
    assert messages['path'].header.stamp.sec == 5


@pytest.mark.parametrize('value', [np.nan, np.inf, 1e31])
@pytest.mark.parametrize('where', ['mean', 'covariance', 'effort', 'eta'])
def test_a_number_that_is_not_finite_is_not_encoded(value, where):
    good = getattr(outcome().solution, where)
    bad = np.array(good)
    bad.flat[-1] = value
    ways = prediction(outcome('bad', **{where: bad if np.ndim(good) else value}))
    for name in OUTPUTS:
        with pytest.raises(FocError, match='candidate bad: the solution holds a number that is not finite'):
            made(name, ways)


@both_kinds
def test_markers_show_every_candidate_and_obstacle(types):
    markers = made('markers', three_ways(), types).markers
    assert (markers[0].action, markers[0].ns) == (3, '')
    by_name: dict[str, list[Any]] = {}
    for each in markers[1:]:
        assert (each.header.stamp.sec, each.header.frame_id, each.lifetime.sec) == (5, 'world', 1)
        by_name.setdefault(each.ns, []).append(each)
    names = ['label', 'legend', 'motor_noise', 'obstacle', 'obstacle_deviation', 'obstacle_name', 'path', 'total_uncertainty']
    assert sorted(by_name) == names
    assert all(len({each.id for each in group}) == len(group) for group in by_name.values())
    assert len(by_name['motor_noise']) == 2 * len(by_name['total_uncertainty']), (
        'the total uncertainty is that of the most likely path'
    )
    assert [each.text.replace('\n', ' ') for each in by_name['label']] == [
        '70 %, left of 1',
        '30 %, right of 1',
        f'- %, left of 1, infeasible: as wanted; remedy: {Status.INFEASIBLE.remedy}',
    ]
    grey = by_name['path'][2].color
    assert grey.r == grey.g == grey.b
    assert [each.scale.x for each in by_name['obstacle']] == pytest.approx([0.06, 0.04])
    assert [each.scale.x for each in by_name['obstacle_deviation']] == pytest.approx([0.07, 0.04])


def test_a_compromised_candidate_takes_part_and_says_so():
    ways = prediction(outcome('a', 0.7), outcome('b', 0.3, eta=0.62, status=Status.COMPROMISED))
    table = read_columns(made('prediction', ways))
    assert set(table['candidate'][table['compromised'] == 1]) == {1}
    assert table['status'][:: STEPS + 1].tolist() == [0, 1]
    late = prediction(*(outcome(status.value, 0.3, status=status) for status in (Status.ESTIMATED, Status.DEADLINE)))
    table = read_columns(made('prediction', late))
    assert table['status'][:: STEPS + 1].tolist() == [2, 3] and table['compromised'].all()
    assert made('likelihoods', ways).layout.dim[0].label == 'a;b'
    texts = [each.text for each in made('markers', ways).markers if each.ns == 'label']
    assert texts[1] == '30 %, left of 1,\ncompromised: eta 0.620'
    unlikely = made('markers', prediction(outcome('a', 0.995), outcome('b', 0.005))).markers
    assert [sum(each.ns == name for each in unlikely) for name in ('path', 'label')] == [2, 1]


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_what_the_labels_name_is_named_where_it_is(plane):
    two = outcome('goal0:+l1', 0.7), replace(outcome('goal1:-l2', 0.3, -0.1), candidate=Candidate('goal1:-l2', 1, (), PATH, 0.3))
    goals = np.array([[0.3, 0.0], [0.3, 0.1]])
    markers = made('markers', prediction(*two, goal_positions=goals), plane=plane).markers
    found = {name: {each.text: each.pose.position for each in markers if each.ns == name} for name in ('goal', 'obstacle_name')}
    assert list(found['goal']) == ['goal0', 'goal1'] and list(found['obstacle_name']) == ['1']
    (place,), (height,) = project([[getattr(found['obstacle_name']['1'], axis) for axis in 'xyz']], plane)
    np.testing.assert_allclose(place, OBSTACLES.centre[OBSTACLES.ids.index('1')], atol=1e-12)
    towards_viewer = -1.0 if plane == 'xz' else 1.0
    assert towards_viewer * (height - three_ways().height) > 0.01, 'the text is above the obstacle'


def test_a_label_has_short_lines_and_parts_no_side_from_its_obstacle():
    sides = tuple((f'cup{i}', 1) for i in range(4))
    long = replace(outcome('goal0:+cup0+cup1'), candidate=Candidate('goal0:+cup0+cup1', 0, sides, PATH, 0.3))
    (text,) = [each.text for each in made('markers', prediction(long)).markers if each.ns == 'label']
    assert text == '60 %, left of cup0, cup1,\ncup2, cup3'
    many = replace(long, candidate=replace(long.candidate, sides=4 * sides))
    (text,) = [each.text for each in made('markers', prediction(many)).markers if each.ns == 'label']
    assert text == '60 %, left of cup0, cup1,\ncup2, cup3, cup0, cup1,\ncup2, cup3, c...', 'words, also of a class that is long'


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_an_ellipse_has_the_axes_of_the_covariance(plane):
    names, lifted = ('motor_noise', 'total_uncertainty'), lift(np.eye(2), 0.0, plane)
    ellipses = [each for each in made('markers', three_ways(), plane=plane).markers if each.ns in names]
    assert ellipses
    for each in ellipses:
        turn = each.pose.orientation
        axes = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()[:, :2]
        drawn = axes @ np.diag([each.scale.x / 2, each.scale.y / 2]) ** 2 @ axes.T
        np.testing.assert_allclose(drawn, lifted.T @ [[4e-6, 1e-6], [1e-6, 9e-6]] @ lifted, atol=1e-12)


@both_kinds
@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_a_box_is_drawn_as_triangles_that_cover_it(types, plane):
    shapes = collect_obstacles([Box((0.1, 0.0), (0.1, 0.04), 0.5, radius_stddev=0.01), Circle((0.2, 0.1), 0.02)])
    markers = encode_outputs(replace(three_ways(), obstacles=shapes), plane, types, ['markers'])['markers'].markers
    for name, radius in (('obstacle', 0.0), ('obstacle_deviation', 0.01)):
        box, disc = (each for each in markers if each.ns == name)
        assert (box.type, disc.type, box.id, disc.id) == (11, 3, 0, 1)
        assert (box.scale.x, box.scale.y, box.scale.z, box.pose.orientation.w) == (1.0, 1.0, 1.0, 1.0)
        places, heights = project([(each.x, each.y, each.z) for each in box.points], plane)
        assert len(places) % 3 == 0 and set(heights) == {three_ways().height}
        np.testing.assert_allclose(measure_offsets(places, shapes)[1][:, 0].max(), radius, atol=2e-9)
        first, second = places[1::3] - places[::3], places[2::3] - places[::3]
        area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum() / 2.0
        assert area == pytest.approx(0.1 * 0.04 + 2 * 0.14 * radius + np.pi * radius**2, rel=1e-2)


def test_the_nearest_of_many_obstacles_are_drawn():
    crowd = make_obstacles([[0.01 * i, 0.0] for i in range(1000, 0, -1)], 0.001)
    markers = encode_outputs(replace(three_ways(), obstacles=crowd), 'xy', BAGS, ['markers'])['markers'].markers
    drawn = [each.pose.position.x for each in markers if each.ns == 'obstacle']
    assert sorted(drawn) == pytest.approx([0.01 * i for i in range(1, 129)])
