"""The node in its own process publishes the predictions of a replay when a bag's raw messages are sent over DDS."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_helpers import CONFIG, TYPES, messages, write_bag, write_parameters
from ros_helpers import Graph

from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config, replace_values
from foc_ros.io.bags import BagReader, Item
from foc_ros.ros.messages.encode_prediction import encode_outputs

ROOT = Path(__file__).parents[1]
SECONDS = 0.3
CONFIGS = {
    'fixed': CONFIG,
    'lv': replace_values(Config(), {'foc.eta': 0.3, 'foc.steps': 30, 'foc.noise_x': 0.02, 'foc.noise_y': 0.02}),
}


@contextmanager
def node_process(ros: Graph, parameters: str) -> Iterator[subprocess.Popen[str]]:
    """Run the node until the end of the block; it must still run then, and stop without an error."""
    reliable = [f'qos_overrides./{name}.subscription.reliability:=reliable' for name in ('hand_pose', 'obstacles')]
    command = [
        sys.executable,
        '-m',
        'foc_ros',
        'node',
        '--ros-args',
        '--params-file',
        parameters,
        *(word for each in reliable for word in ('-p', each)),
        '-p',
        'scene.timeout_s:=0.0',
        '-p',
        'budget_s:=0.0',
    ]
    process = subprocess.Popen(
        command, cwd=ROOT, env=ros.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        yield process
        assert process.poll() is None, process.communicate()[0]
    finally:
        process.terminate()
        output = process.communicate(timeout=20)[0]
    assert process.returncode == 0, output


def play(ros: Graph, items: list[Item], parameters: str) -> tuple[list[Any], list[Any]]:
    """Publish the raw messages, the scene first; return the clouds and likelihoods that the node publishes.

    Each hand pose is sent after the prediction of the one before, so that a slow machine is slower and drops nothing.
    """
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseArray, PoseStamped
    from sensor_msgs.msg import PointCloud2
    from std_msgs.msg import Float64MultiArray

    player = ros.node('player')
    clouds = ros.collect(player, PointCloud2, '/foc/prediction')
    likelihoods = ros.collect(player, Float64MultiArray, '/foc/likelihoods')
    # subscriptions are announced in order: a node whose diagnostics are received knows the two subscriptions above
    health = ros.collect(player, DiagnosticArray, '/diagnostics')
    types = {'hand_pose': PoseStamped, 'obstacles': PointCloud2, 'goals': PoseArray}
    publishers = {role: player.create_publisher(kind, role, 100) for role, kind in types.items()}
    with node_process(ros, parameters) as process:

        def wait(condition: Any, what: str) -> None:
            ros.spin_until(lambda: process.poll() is not None or condition(), what)
            assert process.poll() is None, process.communicate()[0]

        def heard(count: int) -> bool:
            return len(clouds) >= count <= len(likelihoods)

        def scene_known() -> bool:
            values = {each.key: each.value for each in health[-1].status[0].values} if health else {}
            return values.get('goals') == '1' == values.get('obstacles of cloud')

        wait(lambda: all(each.get_subscription_count() for each in publishers.values()), 'the subscriptions of the node')
        first = next(place for place, item in enumerate(items) if item.role == 'hand_pose')
        for item in items[:first]:
            publishers[item.role].publish(bytes(item.raw))
        wait(scene_known, 'the node to know the scene')
        for item in items[first:]:
            publishers[item.role].publish(bytes(item.raw))
            if item.role == 'hand_pose':
                awaited = len(clouds) + 1
                wait(partial(heard, awaited), f'prediction {awaited}')
    return clouds, likelihoods


def replayed(bag: Path, config: Config) -> list[dict[str, Any]]:
    """Return the messages of each prediction of a replay."""
    replay = Replay(config)
    with BagReader(bag) as reader:
        return [
            encode_outputs(step.prediction, step.scene.obstacles(step.prediction.stamp_ns), 'xy', TYPES)
            for step in replay.steps(reader)
            if step.prediction is not None
        ]


def table(cloud: Any) -> np.ndarray:
    kind = np.dtype([(field.name, {7: '<f4', 6: '<u4'}[field.datatype]) for field in cloud.fields])
    return np.frombuffer(bytes(cloud.data), dtype=kind)


@pytest.mark.parametrize('strategy', CONFIGS)
def test_the_node_publishes_what_replay_computes(ros: Graph, tmp_path: Path, strategy: str) -> None:
    config = CONFIGS[strategy]
    bag = write_bag(tmp_path / 'reach', messages(seconds=SECONDS))
    with BagReader(bag) as reader:
        items = list(reader)
    clouds, likelihoods = play(ros, items, write_parameters(tmp_path, config))
    expected = replayed(bag, config)
    assert len(clouds) == len(likelihoods) == len(expected) == sum(item.role == 'hand_pose' for item in items)
    assert max(len(table(each['prediction'])) for each in expected) == 2 * (config.foc.steps + 1)
    for cloud, likelihood, both in zip(clouds, likelihoods, expected, strict=True):
        assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec, cloud.header.frame_id) == (
            both['prediction'].header.stamp.sec,
            both['prediction'].header.stamp.nanosec,
            both['prediction'].header.frame_id,
        )
        labels = [dimension.label for dimension in both['likelihoods'].layout.dim]
        assert [dimension.label for dimension in likelihood.layout.dim] == labels
        assert np.allclose(likelihood.data, both['likelihoods'].data, rtol=1e-9, atol=1e-9)
        live, computed = table(cloud), table(both['prediction'])
        assert live.dtype == computed.dtype and np.array_equal(live['candidate'], computed['candidate'])
        for name in ('x', 'y', 'z', 't', 'likelihood'):
            assert np.allclose(live[name], computed[name], rtol=0, atol=1e-6), name
