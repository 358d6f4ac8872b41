"""Messages in other frames: refused without tf2, and transformed with it (here with a substitute for tf2)."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped  # noqa: E402
from node_helpers import GOALS, ROWS, TYPES, Bench, figures, hand_path  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.core.obstacles.rounded_polygon import measure_offsets  # noqa: E402
from foc_ros.core.obstacles.shapes import make_box_polygon  # noqa: E402

QUARTER = {'x': 0.0, 'y': 0.0, 'z': np.sqrt(0.5), 'w': np.sqrt(0.5)}


class Buffer:
    """A transform buffer with the camera at (1, 0, 0) in the world, rotated by 90 degrees to the left."""

    asked: list[tuple[str, str, int]]

    def __init__(self) -> None:
        self.asked = []

    def lookup_transform(self, target: str, source: str, time: Any) -> Any:
        self.asked.append((target, source, time.nanoseconds))
        if (target, source) != ('world', 'camera'):
            raise LookupError(f'"{source}" passed to lookupTransform does not exist')
        transform = SimpleNamespace(translation=SimpleNamespace(x=1.0, y=0.0, z=0.0), rotation=SimpleNamespace(**QUARTER))
        return SimpleNamespace(transform=transform)


@pytest.fixture
def tf2(monkeypatch: pytest.MonkeyPatch) -> None:
    module = SimpleNamespace(Buffer=Buffer, TransformListener=lambda buffer, node: SimpleNamespace(buffer=buffer, node=node))
    monkeypatch.setitem(sys.modules, 'tf2_ros', module)


@pytest.fixture
def no_tf2(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'tf2_ros', None)


def seen(bench: Bench) -> np.ndarray:
    return bench.node.pipeline.scene.obstacles(10 * SECOND).centre


@pytest.mark.usefixtures('tf2')
def test_every_input_is_transformed_into_the_working_frame(ros: Graph) -> None:
    bench = Bench(ros)
    bench.publish_scene()
    bench.move(hand_path(1))
    columns = [(name, '<f8') for name in ('x', 'y', 'z', 'radius', 'vx', 'vy', 'vz')]
    moving = obstacle_table([(0.2, 0.3, 0.4, 0.05, 1.0, 0.0, 0.0)], columns)
    bench.deliver('obstacles', cloud(TYPES, moving, 10 * SECOND, 'camera'))
    np.testing.assert_allclose(seen(bench), [[0.7, 0.2]])
    held = bench.node.pipeline.scene.sources['cloud'].obstacles
    np.testing.assert_allclose(held.velocity, [[0.0, 1.0]], atol=1e-12)
    assert held.radius.tolist() == [0.05]
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, (0.1, 0.0, 0.0), frame_id='camera'), marker(TYPES, id=9)))
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, id=77, action=2, frame_id='')))
    np.testing.assert_allclose(seen(bench)[1:], [[1.0, 0.1], [0.0, 0.0]], atol=1e-12)
    bench.deliver('goals', pose_array(TYPES, [(0.0, 0.5, 0.0)], 'camera'))
    np.testing.assert_allclose(bench.node.pipeline.scene.goals, [[0.5, 0.0]])
    bench.deliver('goal_pose', pose_stamped(TYPES, (0.0, 0.4, 0.0), SECOND, 'camera'))
    np.testing.assert_allclose(bench.node.pipeline.scene.goals, [[0.6, 0.0]])
    stamp_ns = round(10.02 * SECOND)
    bench.deliver('hand_pose', pose_stamped(TYPES, (0.0, 1.0, 0.25), stamp_ns, 'camera'))
    assert bench.node.pipeline.hand_state.stamp_ns == stamp_ns
    assert bench.node.intake.sample.height == 0.25
    assert ('world', 'camera', stamp_ns) in bench.node._transforms._buffer.asked
    assert {message.header.frame_id for message in bench.wait_for('prediction', 2)} == {'world'}


BOX = [(name, '<f8') for name in ('x', 'y', 'z', 'radius', 'size_x', 'size_y', 'yaw')]


@pytest.mark.usefixtures('tf2')
def test_boxes_are_turned(ros: Graph) -> None:
    bench = Bench(ros)
    bench.publish_scene()
    bench.move(hand_path(1))
    bench.deliver('obstacles', cloud(TYPES, obstacle_table([(0.2, 0.3, 0.4, 0.0, 0.2, 0.1, 0.3)], BOX), 10 * SECOND, 'camera'))
    turned = {'z': np.sin(0.15), 'w': np.cos(0.15)}
    cube = marker(TYPES, (0.1, 0.0, 0.0), (0.2, 0.1, 0.05), type=1, frame_id='camera', turned=turned)
    bench.deliver('obstacle_markers', marker_array(TYPES, cube))
    obstacles = bench.node.pipeline.scene.obstacles(10 * SECOND)
    np.testing.assert_allclose(obstacles.centre, [[0.7, 0.2], [1.0, 0.1]], atol=1e-12)
    expected = make_box_polygon((0.2, 0.1), 0.3 + np.pi / 2)
    for row in range(2):
        np.testing.assert_allclose(measure_offsets(obstacles.centre[row] + expected, obstacles)[1][:, row], 0.0, atol=1e-12)


@pytest.mark.usefixtures('tf2')
@pytest.mark.parametrize(
    ('columns', 'plane', 'words'),
    [
        (BOX[:-1], 'xy', 'fields: expected a field yaw, because the transform turns the boxes'),
        (BOX, 'xz', 'fields[size_x]: expected boxes that the transform leaves in the task plane, got a tilt of 1'),
    ],
)
def test_boxes_that_cannot_be_turned_are_refused(ros: Graph, columns: list[Any], plane: str, words: str) -> None:
    message = cloud(TYPES, obstacle_table([(0.2, 0.3, 0.4, 0.0, 0.2, 0.1, 0.3)[: len(columns)]], columns), 10 * SECOND, 'camera')
    transforms = Bench(ros).node._transforms
    assert transforms.transform('obstacles', message, 'world', plane) is message
    assert words in transforms.last_error


@pytest.mark.usefixtures('tf2')
def test_rows_that_are_not_finite_are_dropped_from_a_transformed_scene(ros: Graph) -> None:
    bench = Bench(ros)
    bench.publish_scene()
    bench.move(hand_path(1))
    table = obstacle_table([(0.2, 0.3, 0.0, 0.05), (np.inf, 0.0, 0.0, 0.05), (3e38, 3e38, 0.0, 0.05), (0.0, 0.0, 0.0, 0.05)])
    table['y'].view('<u4')[3] = 0x7FA00000  # a signalling NaN
    bench.deliver('obstacles', cloud(TYPES, table, 10 * SECOND, 'camera'))
    assert 'expected a number in [-10000, 10000] m' in figures(bench.health())['last refusal']
    bench.deliver('obstacles', cloud(TYPES, table[[0, 1, 3]], 10 * SECOND, 'camera'))
    np.testing.assert_allclose(seen(bench), [[0.7, 0.2]])
    assert figures(bench.health())['count obstacles_dropped_not_finite'] == '2'


@pytest.mark.usefixtures('tf2')
def test_a_frame_unknown_to_tf2_is_refused_with_both_names(ros: Graph) -> None:
    bench = Bench(ros)
    bench.publish_scene()
    bench.move(hand_path(1))
    scene = bench.node.pipeline.scene
    bench.deliver('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND, 'moon'))
    assert bench.node.pipeline.scene is scene
    assert "the working frame 'world', got 'moon'" in figures(bench.health())['last refusal']
    assert 'no transform to world: "moon" passed to lookupTransform does not exist' in bench.node._transforms.last_error


@pytest.mark.usefixtures('tf2')
def test_a_wrong_message_in_another_frame_is_refused_with_its_reason(ros: Graph) -> None:
    bench = Bench(ros)
    bench.move(hand_path(1))
    bench.deliver('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND, 'camera', data=b'abc'))
    assert 'obstacles: data: expected 16 bytes' in figures(bench.health())['last refusal']


@pytest.mark.usefixtures('no_tf2')
def test_without_tf2_other_frames_are_refused(ros: Graph) -> None:
    bench = Bench(ros)
    bench.publish_scene()
    bench.move(hand_path(2))
    bench.wait_for('prediction', 1)
    bench.deliver('goals', pose_array(TYPES, GOALS, 'camera'))
    assert "the working frame 'world', got 'camera'" in figures(bench.health())['last refusal']
