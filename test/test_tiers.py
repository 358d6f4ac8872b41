# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The marks by which `make check`, `make test` and `make test-long` choose."""

import subprocess

import pytest
from tiers import LONG, PROCESS, is_listed, list_test_functions, starts_process

from foc_ros.ros.isolated_node import reserve_domain


def start() -> None:
    subprocess.run(['true'], check=True)


@pytest.fixture
def domain() -> int:
    with reserve_domain() as number:
        return number


def test_every_pattern_matches_a_test() -> None:
    functions = list_test_functions()
    stale = [pattern for pattern in LONG + PROCESS if not any(is_listed(*each, (pattern,)) for each in functions)]
    assert stale == []


def test_a_test_that_calls_a_starting_helper_is_marked(request: pytest.FixtureRequest) -> None:
    assert starts_process(request.node)
    _ = start


def test_a_test_with_a_starting_fixture_is_marked(request: pytest.FixtureRequest, domain: int) -> None:
    assert starts_process(request.node)


def test_other_tests_are_not_marked(request: pytest.FixtureRequest) -> None:
    assert not starts_process(request.node)
