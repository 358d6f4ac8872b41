# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The third axis: heights, their variance, the obstacles that are cleared, and heights in messages in every task plane."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from message_helpers import (
    BAGS,
    SECOND,
    cloud,
    collision_object,
    detection,
    detections,
    marker,
    marker_array,
    obstacle_table,
    pose_array,
    pose_stamped,
)
from numpy.testing import assert_allclose, assert_array_equal
from prediction_samples import DT as MESSAGE_DT
from prediction_samples import STEPS as MESSAGE_STEPS
from prediction_samples import outcome, prediction
from reach_helpers import make_predictor
from scipy.spatial.transform import Rotation

import foc_ros
from foc_ros.analysis.replay import Summary, facts
from foc_ros.core.config import Config, replace_values
from foc_ros.core.errors import MessageError
from foc_ros.core.height import predict_height, reach_along_axis
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.plant.covariance import SharedCovariances
from foc_ros.core.predict import predict
from foc_ros.core.prediction import HeightTrajectory
from foc_ros.core.situation import build_problem
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState
from foc_ros.io.json_output import encode_prediction
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.decode_objects import ObjectTable, decode_detections
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, encode_outputs
from foc_ros.ros.messages.plane import Transform, lift

CONFIG = replace_values(Config(), {'foc.steps': 50, 'budget_s': 0.0, 'foc.noise_x': 0.1, 'foc.noise_y': 0.1})
STEPS, DT = CONFIG.foc.steps, 0.02
PRECISE = {'foc.endpoint_stddev': 0.0, 'duration.spread': 0.0}
"""Parameters without which the band of heights would be wider than most of these scenes."""
GOAL = np.array([[0.4, 0.0]])
START = np.array([0.1, 0.2, -0.5])


def hand_at(height):
    """Return a moving hand at the origin of the plane, whose state is known well."""
    onset = {'onset_ns': 0, 'onset_position': np.zeros(2)}
    return HandState(0, np.zeros(6), 1e-8 * np.eye(6), height, height_mean=np.array([height, 0.0, 0.0]), **onset)


def boxes(*heights, x=0.2):
    """Return circles beside each other, with their lowest and highest points."""
    centres = [[x, 0.06 * row] for row in range(len(heights))]
    return make_obstacles(centres, 0.02, heights=heights)


def predict_over(obstacles, height, goal_height, **changes):
    config = replace_values(CONFIG, PRECISE | {name.replace('__', '.'): value for name, value in changes.items()})
    return predict(config, hand_at(height), obstacles, GOAL, NO_TRACKS, goal_heights=np.array([goal_height]))[0]


@pytest.mark.parametrize(
    'changes',
    [{}, {'foc.goal_weight': 1e7}, {'duration.arrival': 'passing'}, {'foc.plant': 'damped_mass', 'foc.plant_damping': 3.0}],
    ids=str,
)
def test_it_is_the_solution_of_the_plane_without_obstacles(changes):
    config = replace_values(CONFIG, changes)
    hand = replace(hand_at(0.0), mean=np.column_stack((START, np.zeros(3))).ravel())
    problem = build_problem(config, hand, make_obstacles(), np.array([0.4, 0.0]), DT * STEPS)
    expected = solve_problem(problem, cold_start(np.zeros((STEPS + 1, 2))), config.foc)
    found = reach_along_axis(config, START, 0.4, DT)
    assert_allclose(found.mean, expected.mean, atol=1e-6)
    assert_allclose(found.covariance, expected.covariance, atol=1e-9)
    assert found.effort == pytest.approx(expected.effort, rel=1e-6)


def test_the_variance_is_that_of_noisy_movements_that_are_replanned():
    """The initial error, the end point and the duration are drawn, and the movement is planned anew; motor noise is added."""
    generator, samples, spread = np.random.default_rng(4), 1500, 0.05
    config = replace_values(CONFIG, {'duration.spread': spread, 'foc.noise_x': 0.3, 'foc.noise_y': 0.3})
    root = np.diag([0.004, 0.03, 0.2])
    covariance = np.kron(root @ root, np.eye(2))
    hand = replace(hand_at(0.1), height_mean=START, covariance=covariance)
    found = predict_height(config, hand, 0.4, DT, SharedCovariances(hand, config)[DT])
    control = reach_along_axis(config, START, 0.4, DT).control[:, 0]
    A, B = np.array([[1.0, DT, DT**2 / 2], [0.0, 1.0, DT], [0.0, 0.0, 1.0]]), np.array([DT**3 / 6, DT**2 / 2, DT])
    noise = np.zeros((samples, STEPS + 1, 3))
    for step in range(STEPS):
        drawn = 0.3 * control[step] * generator.standard_normal(samples)
        noise[:, step + 1] = noise[:, step] @ A.T + drawn[:, None] * B
    times, heights = DT * np.arange(STEPS + 1), np.empty((samples, STEPS + 1))
    for row in range(samples):
        start = START + root @ generator.standard_normal(3)
        target = 0.4 + config.foc.endpoint_stddev * generator.standard_normal()
        slower = 1.0 + spread * generator.standard_normal()
        plan = reach_along_axis(config, start, target, DT * slower)
        heights[row] = np.interp(times, plan.times, plan.mean[:, 0])
    assert_allclose(found.motor_covariance[5:, 0, 0], noise[:, 5:, 0].var(axis=0), rtol=0.15)
    assert_allclose(found.covariance[5:, 0, 0], (heights + noise[..., 0])[:, 5:].var(axis=0), rtol=0.15)
    assert_allclose(found.mean[:, 0], heights.mean(axis=0), atol=3e-3)


def test_the_plane_does_not_depend_on_it():
    obstacles = make_obstacles([[0.2, 0.01]], 0.03, 0.003)
    on, off = (predict_over(obstacles, 0.1, 0.3, predict_height=each) for each in (True, False))
    assert [each.label for each in on.candidates] == [each.label for each in off.candidates]
    for with_height, without in zip(on.candidates, off.candidates, strict=True):
        assert without.height is None
        assert_allclose(with_height.height.mean[[0, -1], 0], [0.1, 0.3], atol=1e-9)
        assert_array_equal(with_height.mean, without.mean)
        assert_array_equal(with_height.covariance, without.covariance)
        assert with_height.likelihood == without.likelihood


@pytest.mark.parametrize(
    ('hand', 'goal', 'expected'),
    [
        (0.3, 0.3, (True, True, False)),  # over both
        (0.05, 0.05, (False, True, False)),  # at the height of the low one
        (0.15, 0.15, (True, True, False)),  # between them
        (0.05, 0.3, (False, False, False)),  # through the heights of both
    ],
)
def test_obstacles_above_and_below_the_hand_do_not_block(hand, goal, expected):
    prediction = predict_over(boxes((0.0, 0.1), (0.2, 0.25), (-np.inf, np.inf)), hand, goal)
    assert prediction.cleared == expected
    assert prediction.notes.get('cleared_by_height', 0) == sum(expected)
    named = {name for each in prediction.candidates for name, _ in each.candidate.sides}
    assert named.isdisjoint({str(row) for row in range(3) if expected[row]})
    assert len(prediction.obstacles) == 3 and len(prediction.blocking_obstacles) == 3 - sum(expected)


def test_it_blocks_until_the_band_clears_it():
    assert predict_over(boxes((0.0, 0.1)), 0.14, 0.14).cleared == (True,)
    assert predict_over(boxes((0.0, 0.1)), 0.14, 0.14, scene__hand_radius=0.05).cleared == (False,)
    assert predict_over(boxes((0.0, 0.1), x=0.05), 0.14, 0.14, foc__endpoint_stddev=0.03).cleared == (True,)
    assert predict_over(boxes((0.0, 0.1), x=0.38), 0.14, 0.14, foc__endpoint_stddev=0.03).cleared == (False,)
    assert predict_over(boxes((0.0, 0.1)), 0.14, 0.14, predict_height=False).cleared == (False,)


def test_an_obstacle_is_cleared_on_the_way_to_every_goal_or_blocks():
    goals, table = np.array([[0.4, 0.0], [0.4, 0.2]]), boxes((0.0, 0.1), x=0.35)
    config = replace_values(CONFIG, PRECISE)
    for heights, expected in (((0.3, 0.3), True), ((0.3, 0.05), False)):
        prediction = predict(config, hand_at(0.3), table, goals, NO_TRACKS, goal_heights=np.array(heights))[0]
        assert prediction.cleared == (expected,)
        assert {each.height.mean[-1, 0].round(9) for each in prediction.candidates} == set(heights)


def test_a_predictor_with_heights_predicts_and_clears():
    low, post = foc_ros.Circle((0.2, 0.0), 0.03, heights=(0.0, 0.1), name='low'), foc_ros.Circle((0.2, 0.1), 0.03, name='post')
    predictor = make_predictor(CONFIG, (0.4, 0.0, 0.25), [low, post])
    for tick in range(20):
        t = 0.01 * tick
        prediction = predictor.update(t, (t**2, 0.0, 0.3 - 0.1 * t**2))
    assert prediction.cleared == (True, False)
    assert prediction.blocking_obstacles.ids == ('post',)
    height = prediction.candidates[0].height
    assert height.mean.shape == (STEPS + 1, 3) and height.covariance.shape == (STEPS + 1, 3, 3)
    assert height.mean[0, 1] == pytest.approx(-0.2 * t, rel=0.2)
    for position, words in (((0.1, 0.0), 'x, y and the height, because the goals have heights'), ((0.1, 0.0, float('nan')), '')):
        with pytest.raises(foc_ros.SceneError, match=rf'^position: expected {words}'):
            predictor.update(1.0, position)


CUBE, SPHERE, CYLINDER = 1, 2, 3
UPRIGHT = (CYLINDER, 0.3), (SPHERE, 0.3), (CYLINDER, 0.0)
PLANES = {'xy': [0, 1, 2], 'xz': [0, 2, 1], 'yz': [2, 0, 1]}
"""For each plane, the place of x, y and z among the two axes of the plane and the height."""
UNKNOWN = [-np.inf, np.inf]
COLUMNS = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'size_z', 'vx', 'vy', 'vz')]
MESSAGE_CONFIG = replace_values(Config(), {'budget_s': 0.0, 'foc.steps': 20, 'foc.endpoint_stddev': 0.0})


def in_space(point, plane):
    """Return x, y, z of a point that is given by its position in the plane and its height."""
    return [point[place] for place in PLANES[plane]]


def table(*rows):
    return obstacle_table([(*row, *(0.0,) * (len(COLUMNS) - len(row))) for row in rows], COLUMNS)


@pytest.mark.parametrize('plane', PLANES)
def test_the_size_of_a_row_gives_its_heights(plane):
    rows = [(*in_space((0.1, 0.0, 0.5), plane), 0.02, size) for size in (0.2, 0.0)]
    climbing = (*rows[0][:4], 0.2, *in_space((0.0, 0.0, 0.1), plane))
    passing = (*rows[0][:4], 0.2, *in_space((0.1, 0.0, 0.0), plane))
    obstacles = decode_point_cloud(cloud(BAGS, table(*rows, climbing, passing)), plane).obstacles
    assert_allclose(obstacles.heights, [[0.4, 0.6], UNKNOWN, UNKNOWN, [0.4, 0.6]], rtol=1e-6)
    assert obstacles.corners.tolist() == [1] * 4


def test_a_wrong_size_is_refused_and_one_that_is_not_finite_is_dropped():
    with pytest.raises(MessageError, match=r'size_z\[1\]: expected a number in \[0, 10000\] m, got -0.1'):
        decode_point_cloud(cloud(BAGS, table((0, 0, 0, 0.1, 0.1), (1, 0, 0, 0.1, -0.1))), 'xy')
    decoded = decode_point_cloud(cloud(BAGS, table((0, 0, 0, 0.1, np.nan), (1, 0, 0, 0.1, 0.1))), 'xy')
    assert decoded.obstacles.ids == ('1',) and decoded.dropped == {'not_finite': 1}


@pytest.mark.parametrize('plane', PLANES)
def test_markers_say_their_heights(plane):
    place = in_space((0.1, 0.0, 0.5), plane)
    turned = {'x': np.sin(np.pi / 8), 'w': np.cos(np.pi / 8)} if plane == 'xy' else {'w': 1.0}
    kinds = (CUBE, (0.2, 0.2, 0.2), turned), *((kind, (0.1, 0.1, size), {'w': 1.0}) for kind, size in UPRIGHT)
    markers = (marker(BAGS, place, size, type=kind, id=i, turned=by) for i, (kind, size, by) in enumerate(kinds))
    half = 0.1 * np.sqrt(2.0) if plane == 'xy' else 0.1
    obstacles = ObjectTable().with_markers(marker_array(BAGS, *markers), SECOND, plane).obstacles(SECOND, 0.0)
    assert_allclose(obstacles.heights, [[0.5 - half, 0.5 + half], [0.35, 0.65], UNKNOWN, UNKNOWN], rtol=1e-12)
    assert ObjectTable().obstacles(SECOND, 0.0).heights.shape == (0, 2)


def test_objects_and_detections_say_their_heights():
    tilted = {'x': np.sin(np.pi / 8), 'w': np.cos(np.pi / 8)}
    parts = (1, (0.4, 0.2, 0.1), (0, 0, 0.5)), (2, (0.05,), (0, 0, 0.5)), (3, (0.4, 0.02), (0, 0, 0.5))
    heights = ObjectTable().with_collision_object(collision_object(*parts), 'xy').obstacles(0, 0.0).heights
    assert_allclose(heights, [[0.45, 0.55], UNKNOWN, [0.3, 0.7]])
    leaning = ObjectTable().with_collision_object(collision_object((3, (0.4, 0.02), (0, 0, 0)), turned=tilted), 'xy')
    half = (0.2 + 0.02) * np.sqrt(0.5)
    assert_allclose(leaning.obstacles(0, 0.0).heights, [[-half, half]])
    found = decode_detections(detections(detection((0, 0, 0.5), (0.2, 0.3, 0.4))), 'xy').obstacles(0, 0.0)
    assert_allclose(found.heights, [[0.3, 0.7]])
    assert decode_detections(detections(), 'xy').obstacles(0, 0.0).heights.shape == (0, 2)


def test_a_transform_moves_heights_and_must_not_tilt_them():
    message = cloud(BAGS, table((0.1, 0.0, 0.5, 0.02, 0.2)), frame_id='camera')

    def decode_turned(angle, z):
        """Decode it in a frame that is turned about the x axis, and shifted along z."""
        turn = Rotation.from_rotvec([angle, 0.0, 0.0]).as_matrix()
        return decode_point_cloud(message, 'xy', lambda _: ('world', Transform(turn, np.array([0.0, 0.0, z])))).obstacles

    for angle, middle in ((0.0, 1.5), (np.pi, 0.5)):
        assert_allclose(decode_turned(angle, 1.0).heights, [[middle - 0.1, middle + 0.1]], rtol=1e-6)
    with pytest.raises(MessageError, match=r'fields\[size_z\]: expected boxes that the transform leaves in the task plane'):
        decode_turned(0.1, 0.0)


@cache
def predict_in(plane):
    """Return the last prediction for a hand that goes down between a high, a low and a tall obstacle."""
    intake = Intake(Pipeline(replace_values(MESSAGE_CONFIG, {'plane': plane})))
    rows = ((0.2, 0.0, 0.5), 0.02, 0.2), ((0.2, 0.06, 0.1), 0.02, 0.04), ((0.2, -0.06, 0.3), 0.02, 0.0)
    intake.take('goals', pose_array(BAGS, [in_space((0.4, 0.0, 0.2), plane)]))
    scene = table(*((*in_space(place, plane), radius, size) for place, radius, size in rows))
    intake.take('obstacles', cloud(BAGS, scene))
    for tick in range(20):
        t = 0.02 * tick
        intake.take('hand_pose', pose_stamped(BAGS, in_space((t**2, 0.0, 0.25 - 0.1 * t**2), plane), round((1 + t) * SECOND)))
        made = intake.pipeline.predict()
    assert made is not None
    return made


@pytest.mark.parametrize('plane', PLANES)
def test_every_plane_has_the_same_heights(plane):
    expected, made = predict_in('xy'), predict_in(plane)
    assert made.cleared == expected.cleared == (True, True, False)
    for one, other in zip(made.candidates, expected.candidates, strict=True):
        assert one.height is not None and other.height is not None
        assert_allclose(one.mean, other.mean, atol=1e-9)
        assert_allclose(one.height.mean, other.height.mean, atol=1e-12)
        assert_allclose(one.height.covariance, other.height.covariance, atol=1e-12)
    rows = np.frombuffer(encode_outputs(made, plane, BAGS, ['prediction'])['prediction'].data, CLOUD_ROW)
    normal = next(axis for axis in 'xyz' if axis not in plane)
    first = made.candidates[0].height
    assert first is not None
    names = normal, f'v{normal}', 2 * normal, f'motor_{2 * normal}'
    columns = *first.mean[:, :2].T, first.covariance[:, 0, 0], first.motor_covariance[:, 0, 0]
    for name, column in zip(names, columns, strict=True):
        assert_allclose(rows[name][rows['candidate'] == 0], column, rtol=1e-6, atol=1e-9)
    for axis in plane:
        assert_array_equal(rows[''.join(sorted(axis + normal))], 0.0)


def sample():
    """Return a prediction by hand, with a height that rises."""
    share, covariance = np.linspace(0.0, 1.0, MESSAGE_STEPS + 1), np.zeros((MESSAGE_STEPS + 1, 3, 3))
    covariance[:, 0, 0] = (0.03 * share) ** 2
    mean = np.column_stack((0.2 + 0.2 * share, np.ones_like(share), np.zeros_like(share)))
    return prediction(replace(outcome(), height=HeightTrajectory(mean, covariance, covariance / 9.0)))


@pytest.mark.parametrize('plane', PLANES)
def test_path_and_markers_rise(plane):
    given = sample()
    (candidate,) = given.candidates
    assert candidate.height is not None
    heights = candidate.height.mean[:, 0]
    messages = encode_outputs(given, plane, BAGS)
    points = [[getattr(each.pose.position, axis) for axis in 'xyz'] for each in messages['path'].poses]
    assert_allclose(points, lift(candidate.solution.path, heights, plane))
    assert len(messages['path'].poses) == len(np.arange(0.0, MESSAGE_STEPS * MESSAGE_DT + MESSAGE_DT / 2, MESSAGE_DT))
    drawn = {name: [each for each in messages['markers'].markers if each.ns == name] for name in ('path', 'total_uncertainty')}
    normal = next(axis for axis in 'xyz' if axis not in plane)
    curve = [getattr(point, normal) for point in drawn['path'][0].points]
    assert_allclose(curve, np.linspace(0.2, 0.4, len(curve)))
    ellipses = drawn['total_uncertainty']
    assert_allclose([getattr(each.pose.position, normal) for each in ellipses], heights[1:])
    assert_allclose([each.scale.z for each in ellipses], 2.0 * candidate.height.stddev[1:])


def test_json_has_the_height_where_it_is_predicted():
    (encoded,), (without,) = (encode_prediction(each)['candidates'] for each in (sample(), prediction(outcome())))
    assert_allclose(encoded['height'], np.linspace(0.2, 0.4, MESSAGE_STEPS + 1))
    assert_allclose(encoded['height_velocity'], 1.0)
    assert_allclose(encoded['height_stddev'], np.linspace(0.0, 0.03, MESSAGE_STEPS + 1))
    assert not {name for name in without if name.startswith('height')}
    summary = Summary()
    summary.counts.update(samples=3, predictions=2, solved=2, cleared_by_height=5)
    assert facts(summary.answer({}, 1.0))['obstacles cleared by height'] == '5 over all predictions'
