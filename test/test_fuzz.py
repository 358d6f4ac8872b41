# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Any messages in any order: no exception, no number that is not finite, and no prediction without a new pose.

FOC_ROS_FUZZ: the number of messages, 2,000 by default; a running node gets a twentieth of them.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fuzz_messages import inputs
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from message_helpers import SECOND, STORE, RosbagsTypes, cloud, obstacle_table, pose_array
from ros_helpers import graph, require_ros

from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import Pipeline
from foc_ros.io import topics
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.encode_prediction import encode_outputs

COUNT = int(os.environ.get('FOC_ROS_FUZZ', '2000'))
LENGTH = 20
TYPES = RosbagsTypes(STORE)
CONFIG = replace_values(Config(), {'foc.steps': 10, 'homotopy.max_candidates': 2, 'rate_hz': 1000.0})
THOROUGH = settings(
    max_examples=max(COUNT // LENGTH, 1), suppress_health_check=list(HealthCheck), deadline=None, derandomize=True, database=None
)
LIVE = settings(THOROUGH, max_examples=max(COUNT // LENGTH // 20, 1))


def intake_of(known: bool) -> Intake:
    """Return a new intake, without a scene or with a scene and a goal, so that poses lead to predictions."""
    intake = Intake(Pipeline(CONFIG))
    if known:
        intake.take(topics.CLOUD, cloud(TYPES, obstacle_table([(0.1, 0.05, 0.0, 0.02)]), 11 * SECOND))
        intake.take(topics.GOALS, pose_array(TYPES, [(0.3, 0.0, 0.0)]))
    return intake


def numbers(message: Any) -> Iterator[float]:
    """Yield every number of an output message; of a cloud, those of its rows."""
    if hasattr(message, 'point_step'):
        kinds = {7: '<f4', 6: '<u4'}
        rows = np.frombuffer(bytes(message.data), dtype=[(field.name, kinds[field.datatype]) for field in message.fields])
        for name in rows.dtype.names or ():
            yield from rows[name].astype(float).tolist()
        return
    if isinstance(message, (int, float)):
        yield float(message)
    elif isinstance(message, (list, tuple, np.ndarray)) or hasattr(message, 'typecode'):
        for each in message:
            yield from numbers(each)
    elif hasattr(message, '__slots__') or hasattr(message, '__dataclass_fields__'):
        names = getattr(message, '__dataclass_fields__', None) or message.get_fields_and_field_types()
        for name in names:
            if not name.startswith('__'):
                yield from numbers(getattr(message, name))


def is_finite(name: str, message: Any) -> bool:
    """Return whether all numbers are finite, but for those of what is no candidate: it has a likelihood alone."""
    if name != 'likelihoods':
        return all(map(np.isfinite, numbers(message)))
    labels, table = message.layout.dim[0].label.split(';'), np.reshape(message.data, (-1, 4))
    candidates = [label not in ('unknown', 'other') for label in labels]
    return bool(np.isfinite(table[:, 0]).all() and np.isfinite(table[: len(candidates)][candidates[: len(table)]]).all())


def test_any_messages_in_any_order() -> None:
    seen = {'predicted': 0, 'refused': 0}

    @THOROUGH
    @given(st.booleans(), st.lists(inputs(TYPES), min_size=LENGTH, max_size=LENGTH))
    def play(known: bool, messages: list[tuple[str, Any]]) -> None:
        intake = intake_of(known)
        pipeline = intake.pipeline
        for role, message in messages:
            verdict = intake.take(role, message)
            seen['refused'] += verdict is None or not verdict.is_taken
            if role != topics.HAND or verdict is None or not verdict.is_taken:
                continue
            prediction = pipeline.predict() if pipeline.is_due else None
            if prediction is None:
                continue
            seen['predicted'] += 1
            stamp = message.header.stamp
            assert prediction.stamp_ns == stamp.sec * 1_000_000_000 + stamp.nanosec
            sent = encode_outputs(prediction, 'xy', TYPES)
            assert all(is_finite(name, each) for name, each in sent.items())
            assert pipeline.predict() is None, 'predicted twice from one pose'

    play()
    assert seen['predicted'] > COUNT / 100 and seen['refused'] > COUNT / 20, 'otherwise nothing is tested'


@pytest.fixture(scope='module')
def bench() -> Iterator[Any]:
    require_ros()
    from node_helpers import Bench

    with graph() as ros:
        yield Bench(ros, foc__steps=10, rate_hz=1000.0)


def test_any_messages_through_a_live_node(bench: Any) -> None:
    from node_helpers import TYPES as LIVE_TYPES

    @LIVE
    @given(st.lists(inputs(LIVE_TYPES), min_size=LENGTH, max_size=LENGTH))
    def play(messages: list[tuple[str, Any]]) -> None:
        for role, message in messages:
            before = int(bench.node._monitor.counts['predictions'])
            bench.deliver(role, message)
            made = int(bench.node._monitor.counts['predictions']) - before
            assert made <= (role == topics.HAND), f'{made} predictions from {role}'
        for name, received in bench.received.items():
            assert all(is_finite(name, each) for each in received)
            received.clear()
        assert not bench.node._monitor.counts['internal_errors'], bench.node._monitor._error

    play()
    assert bench.health().level in (b'\x00', b'\x01')
