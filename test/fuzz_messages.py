# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hypothesis strategies for input messages: mostly plausible, often wrong, sometimes nonsense."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from message_helpers import cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped

from foc_ros.io import topics
from foc_ros.ros.messages.types import MessageTypes

EXTREMES = (float('nan'), float('inf'), float('-inf'), 1e4, -1e4, 1e30, -1e30, 1e-300, 0.0, -0.0)
PLACES = st.floats(-0.5, 0.5)
NUMBERS = st.one_of(PLACES, PLACES, PLACES, st.sampled_from(EXTREMES), st.floats())
FLOAT32 = st.one_of(PLACES, PLACES, st.sampled_from(EXTREMES[:7]), st.floats(width=32)).map(np.float32)
SECOND = 1_000_000_000
MOVING = st.integers(10 * SECOND, 13 * SECOND)
STAMPS = st.one_of(MOVING, MOVING, st.integers(-SECOND, (2**31 - 1) * SECOND), st.just(0))
FRAMES = st.sampled_from(['world'] * 6 + ['camera', ''])
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
LAYOUTS = (
    [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('radius', '<f4')],
    [('x', '>f4'), ('y', '>f4'), ('z', '>f4'), ('radius', '>f4')],
    [('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('radius', '<f8'), ('radius_stddev', '<f4'), ('id', '<u4')],
    [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('radius', '<f4'), ('vx', '<f4'), ('vy', '<f4'), ('vz', '<f4')],
    [('x', '<f4'), ('y', '<f4'), ('z', '<i4'), ('radius', '<f4')],
    [('x', '<f4'), ('y', '<f4'), ('intensity', '<f4')],
)
DAMAGES = st.sampled_from(
    [{}] * 8
    + [{'data': b''}, {'data': b'abc'}, {'width': 0}, {'width': 2**32 - 1}, {'height': 7}, {'point_step': 0}]
    + [{'point_step': 2**32 - 1}, {'row_step': 1}, {'fields': []}, {'is_bigendian': True}, {'height': 2**16, 'width': 2**16}]
)


@st.composite
def clouds(draw: st.DrawFn, types: MessageTypes) -> Any:
    layout = draw(st.sampled_from(LAYOUTS))
    rows = draw(st.lists(st.tuples(*[FLOAT32] * 4), max_size=4))
    table = obstacle_table([], layout) if not rows else np.zeros(len(rows), dtype=layout)
    with np.errstate(all='ignore'):
        for i, row in enumerate(rows):
            for name, value in zip((layout[0][0], layout[1][0], layout[2][0], layout[-1][0]), row, strict=True):
                table[name][i] = value if table.dtype[name].kind == 'f' else 7
    if 'radius' in (table.dtype.names or ()) and draw(st.booleans()):
        table['radius'] = 0.02
    return cloud(types, table, draw(STAMPS), draw(FRAMES), **draw(DAMAGES))


@st.composite
def markers(draw: st.DrawFn, types: MessageTypes) -> Any:
    made = [
        marker(
            types,
            draw(POINTS),
            draw(st.one_of(st.just((0.04, 0.04, 0.04)), POINTS)),
            ns=draw(st.sampled_from(['a', 'b;c', ''])),
            id=draw(st.integers(-2, 2)),
            type=draw(st.sampled_from([2, 2, 3, 1, 9, 77])),
            action=draw(st.sampled_from([0, 0, 0, 2, 3, 1, -4])),
            lifetime=draw(st.sampled_from([0, 0, 0.1, 3, -1])),
            stamp_ns=draw(STAMPS),
            frame_id=draw(FRAMES),
        )
        for _ in range(draw(st.integers(0, 3)))
    ]
    return marker_array(types, *made)


def inputs(types: MessageTypes) -> st.SearchStrategy[tuple[str, Any]]:
    """Return the strategy of (topic, message); most messages are hand poses."""
    hands = st.builds(lambda *given: (topics.HAND, pose_stamped(types, *given)), POINTS, STAMPS, FRAMES)
    steady = st.builds(lambda at, stamp: (topics.HAND, pose_stamped(types, at, stamp)), st.tuples(*[PLACES] * 3), STAMPS)
    return st.one_of(
        steady,
        hands,
        st.builds(lambda *given: (topics.GOAL, pose_stamped(types, *given)), POINTS, STAMPS, FRAMES),
        st.builds(lambda *given: (topics.GOALS, pose_array(types, *given)), st.lists(POINTS, max_size=3), FRAMES),
        clouds(types).map(lambda message: (topics.CLOUD, message)),
        markers(types).map(lambda message: (topics.MARKERS, message)),
    )
