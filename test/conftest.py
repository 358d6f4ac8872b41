# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What all tests share: their marks, a private ROS graph, and failure instead of a skip where ROS is required."""

import math
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser_helpers import chromium
from hypothesis import settings
from message_helpers import message_types
from ros_helpers import Graph, graph, prepare_environment
from tiers import add_marks, is_left_out

from foc_ros.io import terminal
from foc_ros.ros.messages.types import MessageTypes

prepare_environment()

# A shell starts a job in the background with SIGINT ignored, and its processes inherit this: a test that sends it would wait.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Every run uses the same examples, without a time limit, because a test must not fail on a busy machine.
settings.register_profile('seeded', derandomize=True, deadline=None)
settings.load_profile('seeded')

# The same for the lines of progress that a command prints after some seconds without a terminal.
terminal.QUIET_S = math.inf

REQUIRE_ROS = os.environ.get('FOC_ROS_REQUIRE_ROS') == '1'
# Tests that may be skipped even then: they need data that is not part of the sources, a browser that is not required, or
# message packages that the node does without.
ALLOWED = ('Skipped: optional data', 'Skipped: optional browser', 'Skipped: optional message package')


def pytest_configure(config: pytest.Config) -> None:
    """Know the mark of xdist where it is not installed, too."""
    config.addinivalue_line('markers', 'xdist_group(name): the tests of a group run in one worker')


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the files of other tiers."""
    return (collection_path.suffix == '.py' and is_left_out(collection_path.name, config.option.markexpr)) or None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests before pytest selects them by `-m`."""
    add_marks(items)


def _fail_if_skipped(report: Any) -> Any:
    if REQUIRE_ROS and report.skipped and not hasattr(report, 'wasxfail'):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        if not reason.startswith(ALLOWED):
            report.outcome, report.longrepr = 'failed', f'FOC_ROS_REQUIRE_ROS=1, but: {reason}'
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    """Let a skipped test fail where ROS is required; so does the next hook for a whole file."""
    return _fail_if_skipped((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report():
    return _fail_if_skipped((yield))


@pytest.fixture
def ros() -> Iterator[Graph]:
    """Yield a ROS graph with a context, a domain and an executor of its own."""
    with graph() as created:
        yield created


class Clock:
    """A clock that stands still until a test sets `now_s`."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Return the clock by which the nodes of a test judge silence and age, however busy the machine is."""
    from foc_ros.ros import node

    made = Clock()
    monkeypatch.setattr(node, 'monotonic', made)
    return made


@pytest.fixture
def types(request: pytest.FixtureRequest) -> MessageTypes:
    """Return the message classes of the kind that the test is parametrised with (`message_helpers.both_kinds`)."""
    return message_types(request.param)


@pytest.fixture
def registries(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget what a test registers at its end."""
    from foc_ros.core.registry import LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES

    for registry in (STRATEGIES, PLANTS, LIKELIHOOD_RULES, QP_BACKENDS):
        monkeypatch.setattr(registry, '_parts', dict(registry._parts))


@pytest.fixture(scope='module')
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Yield a headless Chromium for the tests of a file."""
    with chromium(tmp_path_factory.mktemp('profile')) as opened:
        yield opened
