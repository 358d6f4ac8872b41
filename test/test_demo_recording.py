"""The packaged recording equals the output of its script, is small, and can be read by other tools."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / 'scripts'))
script = importlib.import_module('recordings')

PACKAGED = ROOT / 'foc_ros' / 'recordings' / 'reaching.mcap'


def read(file: Path) -> list[tuple[str, int, Any]]:
    with AnyReader([file]) as reader:
        out = [
            (connection.topic, log_ns, reader.deserialize(data, connection.msgtype))
            for connection, log_ns, data in reader.messages()
        ]
        assert len(out) == sum(connection.msgcount for connection in reader.connections)
    return out


@pytest.fixture(scope='module')
def recorded() -> list[tuple[str, int, Any]]:
    return read(PACKAGED)


def hand(recorded: list[tuple[str, int, Any]]) -> np.ndarray:
    poses = [
        (m.header.stamp.sec * 10**9 + m.header.stamp.nanosec, m.pose.position)
        for topic, _, m in recorded
        if topic == '/hand_pose'
    ]
    return np.array([[(stamp - poses[0][0]) * 1e-9, p.x, p.y, p.z] for stamp, p in poses])


def test_size() -> None:
    assert PACKAGED.stat().st_size < 1_000_000


def test_equals_a_fresh_run(recorded: list[tuple[str, int, Any]], tmp_path: Path) -> None:
    script.write_recording(tmp_path / 'fresh.mcap')
    fresh = read(tmp_path / 'fresh.mcap')
    assert [item[:2] for item in fresh] == [item[:2] for item in recorded]
    np.testing.assert_allclose(hand(fresh), hand(recorded), rtol=0, atol=1e-6)
    for (topic, _, made), (_, _, kept) in zip(fresh, recorded, strict=True):
        assert topic == '/hand_pose' or repr(made) == repr(kept)


def test_reads_with_mcap_and_its_ros2_decoder() -> None:
    mcap_reader = pytest.importorskip('mcap.reader')
    decoder = pytest.importorskip('mcap_ros2.decoder')
    with PACKAGED.open('rb') as stream:
        reader = mcap_reader.make_reader(stream, decoder_factories=[decoder.DecoderFactory()])
        kinds = {channel.topic: schema.name for schema, channel, _, _ in reader.iter_decoded_messages()}
    assert kinds == {
        '/hand_pose': 'geometry_msgs/msg/PoseStamped',
        '/obstacles': 'sensor_msgs/msg/PointCloud2',
        '/goals': 'geometry_msgs/msg/PoseArray',
    }


def test_rates_length_and_frame(recorded: list[tuple[str, int, Any]]) -> None:
    times = hand(recorded)[:, 0]
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)
    assert 18.0 < times[-1] < 30.0
    clouds = [log_ns for topic, log_ns, _ in recorded if topic == '/obstacles']
    np.testing.assert_allclose(np.diff(clouds), 0.2e9)
    assert {message.header.frame_id for _, _, message in recorded} == {'world'}
    assert [topic for topic, _, _ in recorded[:3]] == ['/goals', '/obstacles', '/hand_pose']


def test_movements_are_reaches_without_collision(recorded: list[tuple[str, int, Any]]) -> None:
    track, rows = hand(recorded), np.array(script.OBSTACLES)
    away = track[:, None, 1:3] - rows[:, :2]
    across = np.stack([-np.sin(rows[:, 8]), np.cos(rows[:, 8])], axis=1)
    along = np.stack([np.cos(rows[:, 8]), np.sin(rows[:, 8])], axis=1)
    own = np.stack([(away * along).sum(axis=2), (away * across).sum(axis=2)], axis=2)
    clearance = np.linalg.norm(np.maximum(np.abs(own) - rows[:, 6:8] / 2, 0.0), axis=2) - rows[:, 3]
    assert clearance.min() > 0.008
    starts = np.cumsum([0.0, *(r.rest_s + r.duration_s for r in script.REACHES)])
    for reach, start, end in zip(script.REACHES, starts, starts[1:], strict=False):
        before, after = (track[np.searchsorted(track[:, 0], t - 0.005), 1:3] for t in (start + reach.rest_s, end))
        assert 0.3 < np.linalg.norm(after - before) < 0.4
        assert np.linalg.norm(after - (script.FAR if reach.outward else script.NEAR)[reach.target]) < 0.02
        assert 0.9 <= reach.duration_s <= 1.4


def test_noise_has_the_given_size(recorded: list[tuple[str, int, Any]]) -> None:
    intended, _ = script.reference()
    truth = script.moved(intended, np.random.default_rng(script.SEED))
    sensor = hand(recorded)[:, 1:3] - truth
    assert sensor.std() == pytest.approx(script.SENSOR_NOISE_M, rel=0.05)
    deviation = np.linalg.norm(truth - intended[:, 0], axis=1)
    assert 0.002 < deviation.max() < 0.02


def test_minimum_jerk_without_via_points_is_the_known_quintic() -> None:
    movement = script.minimum_jerk(np.array([[0.0, 0.0], [0.3, -0.1]]), 1.2)
    s = np.linspace(0.0, 1.0, 25)
    expected = np.outer(10 * s**3 - 15 * s**4 + 6 * s**5, [0.3, -0.1])
    np.testing.assert_allclose(movement(1.2 * s), expected, atol=1e-12)


def test_passing_times_are_optimal() -> None:
    """The cost is minimal at the passing time of a via point (Flash and Hogan 1985)."""
    from scipy.interpolate import make_interp_spline

    points = np.array([[0.0, 0.0], [0.12, 0.1], [0.35, 0.0]])
    grid = np.linspace(0.0, 1.0, 501)
    best = np.mean(script.minimum_jerk(points, 1.0)(grid, nu=3) ** 2)
    rest = [(1, np.zeros(2)), (2, np.zeros(2))]
    others = [
        np.mean(make_interp_spline([0, t, 1], points, k=5, bc_type=(rest, rest))(grid, nu=3) ** 2)
        for t in np.linspace(0.2, 0.8, 61)
    ]
    assert best <= min(others) * (1 + 1e-9)
    assert best > 0.98 * min(others)
