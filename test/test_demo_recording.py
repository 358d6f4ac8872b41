# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The packaged recording equals the output of its script."""

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


def test_equals_a_fresh_run(recorded: list[tuple[str, int, Any]], tmp_path: Path) -> None:
    script.write_recording(tmp_path / 'fresh.mcap')
    fresh = read(tmp_path / 'fresh.mcap')
    assert [item[:2] for item in fresh] == [item[:2] for item in recorded]
    np.testing.assert_allclose(hand(fresh), hand(recorded), rtol=0, atol=1e-6)
    for (topic, _, made), (_, _, kept) in zip(fresh, recorded, strict=True):
        assert topic == '/hand_pose' or repr(made) == repr(kept)
