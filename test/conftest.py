"""What all tests share: a private ROS graph, and that where ROS is required, a test that skips for want of it fails."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings
from message_helpers import message_types
from ros_helpers import Graph, graph, prepare_environment

from foc_ros.ros.messages.types import MessageTypes

prepare_environment()

# The same examples in every run, and no time limit: a busy machine is no failure.
settings.register_profile('seeded', derandomize=True, deadline=None)
settings.load_profile('seeded')

REQUIRE_ROS = os.environ.get('FOC_ROS_REQUIRE_ROS') == '1'
# Skips that remain skips: they want data that does not come with the sources, or a browser where none is demanded.
ALLOWED = ('Skipped: optional data', 'Skipped: optional browser')


def _fail_if_skipped(report: pytest.TestReport | pytest.CollectReport) -> None:
    if not (REQUIRE_ROS and report.skipped) or hasattr(report, 'wasxfail'):
        return
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
    if not reason.startswith(ALLOWED):
        report.outcome = 'failed'
        report.longrepr = f'FOC_ROS_REQUIRE_ROS=1, but: {reason}'


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    report = yield
    _fail_if_skipped(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report():
    report = yield
    _fail_if_skipped(report)
    return report


@pytest.fixture
def ros() -> Iterator[Graph]:
    """A private ROS graph: own context, domain and executor."""
    with graph() as made:
        yield made


@pytest.fixture
def types(request: pytest.FixtureRequest) -> MessageTypes:
    """Message classes of the kind that the test is parametrised with (`message_helpers.both_kinds`)."""
    return message_types(request.param)
