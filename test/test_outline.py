# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The outline of an obstacle, against distances and the formula of Steiner for its area."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.core.obstacles.geometry import find_limits, measure_offsets, trace_obstacle
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, Shape, collect_obstacles

SHAPES = (
    Circle((0.1, 0.2), radius=0.03),
    Capsule((0.0, 0.0), (0.2, 0.1), radius=0.02),
    Box((0.3, -0.1), (0.2, 0.05), 0.4),
    Box((0.3, -0.1), (0.2, 0.05), -2.0, radius=0.01),
    Hull([(0.0, 0.0), (0.3, 0.0), (0.1, 0.2), (0.05, 0.05)], radius=0.02),
)


def measure_area(points: np.ndarray) -> float:
    (x, y), (after_x, after_y) = points.T, np.roll(points, -1, axis=0).T
    return float((x * after_y - y * after_x).sum() / 2.0)


@pytest.mark.parametrize('shape', SHAPES, ids=repr)
@pytest.mark.parametrize('growth', [0.0, 0.015])
def test_every_point_is_at_the_radius_and_the_area_is_that_of_steiner(shape: Shape, growth: float) -> None:
    obstacles = collect_obstacles([shape])
    outline, radius = trace_obstacle(obstacles, 0, growth, points=400), shape.radius + growth
    np.testing.assert_array_equal(outline[0], outline[-1])
    np.testing.assert_allclose(measure_offsets(outline, obstacles)[1], radius, atol=2e-9)
    edges = np.roll(shape.polygon, -1, axis=0) - shape.polygon
    expected = measure_area(shape.polygon) + np.hypot(*edges.T).sum() * radius + np.pi * radius**2
    assert measure_area(outline) == pytest.approx(expected, rel=1e-3)


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=12), st.floats(1e-3, 0.1))
def test_the_limits_are_those_of_the_outline(points: list[tuple[float, float]], radius: float) -> None:
    obstacles = collect_obstacles([Hull(points, radius), Circle((2.0, 2.0), radius=1.0)])
    low, high = find_limits(obstacles, np.array([0.01, 0.0]))
    outline = trace_obstacle(obstacles, 0, 0.01, points=2000)
    np.testing.assert_allclose([low[0], high[0]], [outline.min(axis=0), outline.max(axis=0)], atol=1e-6)
    np.testing.assert_array_equal([low[1], high[1]], [[1.0, 1.0], [3.0, 3.0]])
