"""Fixtures for all tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import ros_helpers

ros_helpers.prepare_environment()


@pytest.fixture
def ros() -> Iterator[ros_helpers.Graph]:
    """A private ROS graph; skipped where ROS is missing."""
    with ros_helpers.graph() as graph:
        yield graph
