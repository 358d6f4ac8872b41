# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The merged scene: union over sources, motion to a stamp, and reasons not to predict from it."""

import numpy as np
import pytest

from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.scene import ObstacleSource, Scene
from foc_ros.core.types import NANOSECONDS

NOW = 50 * NANOSECONDS


def test_the_union_of_the_sources_holds_the_latest_row_of_an_id() -> None:
    cloud = make_obstacles([[0.0, 0.0], [1.0, 0.0]], 0.1, 0.01, ids=('a', 'b'))
    markers = make_obstacles([[5.0, 0.0], [2.0, 0.0]], 0.2, 0.02, ids=('b', 'c'))
    scene = Scene().with_source('cloud', ObstacleSource(cloud, NOW, 'w'))
    scene = scene.with_source('markers', ObstacleSource(markers, NOW, 'w'))
    merged = scene.obstacles(NOW)
    assert merged.ids == ('a', 'b', 'c')
    np.testing.assert_array_equal(merged.centre[:, 0], [0.0, 5.0, 2.0])
    np.testing.assert_array_equal(merged.radius, [0.1, 0.2, 0.2])
    np.testing.assert_array_equal(merged.radius_stddev, [0.01, 0.02, 0.02])
    again = scene.with_source('cloud', ObstacleSource(cloud, NOW, 'w')).obstacles(NOW)
    assert dict(zip(again.ids, again.centre[:, 0], strict=True)) == {'a': 0.0, 'b': 1.0, 'c': 2.0}


@pytest.mark.parametrize(
    ('ages', 'timeout', 'words'),
    [
        ([3.1], 2.0, 'obstacles are 3.1 s older than the hand pose (scene.timeout_s is 2)'),
        ([-3.1], 2.0, 'obstacles are 3.1 s newer than the hand pose (scene.timeout_s is 2)'),
        ([0.0, 2.5], 2.0, 'obstacles are 2.5 s older than the hand pose (scene.timeout_s is 2)'),
        ([2.0], 2.0, None),
        ([1e6], 0.0, None),
        ([None], 2.0, None),
    ],
)
def test_stale_sources_are_found_by_their_stamps(ages: list[float | None], timeout: float, words: str | None) -> None:
    scene = Scene().with_goals(np.zeros((1, 2)), 'w')
    for i, age in enumerate(ages):
        stamp = None if age is None else NOW - round(age * 1e9)
        scene = scene.with_source(str(i), ObstacleSource(make_obstacles(), stamp, 'w'))
    assert scene.not_ready_reason(NOW, timeout) == (None if words is None else ('stale', words))
