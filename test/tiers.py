# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which tests are `long` and which are `process`: the two markers by which `make check`, `test` and `test-long` choose.

`LONG` lists the long tests. The mark `process` is derived from the code: a test has it if the test, a fixture of it or a helper
in this folder starts a process, a ROS graph or a browser. Tests that do so through the package are listed in `PROCESS`,
with others that `make check` leaves to `make test`. The
lists consist of shell patterns for 'file::function'. `test_documentation.py` fails if a pattern matches no test.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

FOLDER = Path(__file__).resolve().parent

LONG = (
    # studies of the solver over many scenes
    'test_tracks.py::test_*symmetric_obstacle*',
    'test_guarantee.py::*',
    'test_plan_recovery.py::test_recovered_*',
    'test_examples.py::test_the_slow_example_*',
    'test_guidance_safety.py::test_ten_thousand_hostile_hands',
    # all steps of a fit, of the paper's studies and of long reports
    'test_fit.py::test_without_obstacles_goals_*',
    'test_report.py::test_a_long_recording_is_thinned_out*',
    'test_paper.py::test_*trend*',
    'test_paper.py::test_files_hold_the_computed_numbers',
    'test_play_session.py::test_a_fit_and_its_comparison',
    'test_report_page.py::test_a_long_recording_says_where_the_slider_stops',
    # the commands of the documentation, and its web site
    'test_shown_commands.py::test_commands_work_as_shown',
    'test_documentation_site.py::*',
    # a node under load, and a process that is stopped or killed
    'test_parallel.py::test_a_scheduler_that_dies_ends_the_run_in_words',
    'test_demo.py::test_the_live_predictions_are_those_of_the_recording',
    'test_node_scenes.py::test_*a_flood_of_obstacles*',
    'test_node_scenes.py::test_the_node_keeps_its_promises_in_a_hostile_scene',
    'test_node_process.py::test_a_node_that_is_killed_and_started_again',
    'test_node_process.py::test_a_*work*without_an_error',
    'test_node_predicts.py::test_ten_thousand_obstacles_at_50_hz',
    'test_node_predicts.py::test_*poses_at_1_khz*',
)

PROCESS = (
    'test_parallel.py::*',
    'test_demo.py::*',
    'test_demo_*.py::test_the_node_*',
    'test_fit.py::*',
    'test_fit_*.py::test_a_setting_that_predicts_nothing_*',
    'test_evaluate.py::test_workers_do_not_matter_*',
    'test_paper.py::*',
    # seconds in one process, as a dozen programs with a picture each
    'test_strategies.py::test_a_cheap_eta_*',
    'test_strategies.py::test_effort_and_likelihood_*',
    'test_reference_cases.py::test_every_solved_candidate_*',
    'test_solution_numbers.py::test_nothing_is_below_*',
    'test_simulation.py::test_the_command_*',
    'test_replay_guidance.py::*',
    'test_one_driver.py::*',
    'test_notebook.py::*',
    'test_plan_recovery.py::*',
    'test_evaluate.py::test_in_order_*',
    'test_measure_predictions.py::*',
    'test_demonstrations.py::test_a_pooled_path_*',
    'test_examples.py::test_the_example_runs_and_makes_a_figure',
)

STARTERS = {'subprocess', 'reserve_domain', 'chromium', 'worker_tasks'}
"""Names whose use in a test, a fixture or a helper means that a process, a ROS graph or a browser is started."""


def is_listed(file: str, function: str, patterns: tuple[str, ...]) -> bool:
    """Return whether one of the patterns matches a test function."""
    return any(fnmatchcase(f'{file}::{function}', pattern) for pattern in patterns)


def starts_process(item: pytest.Function) -> bool:
    """Return whether the code of a test, of its fixtures or of the helpers that they call contains one of `STARTERS`."""
    fixtures = [definition.func for found in item._fixtureinfo.name2fixturedefs.values() for definition in found]
    seen: set[Callable[..., Any]] = set()
    return any(uses_starter(inspect.unwrap(function), seen) for function in (item.function, *fixtures))


def uses_starter(function: Any, seen: set[Callable[..., Any]]) -> bool:
    """Return whether a function, or a function or class of this folder that it refers to, contains one of `STARTERS`."""
    code = getattr(function, '__code__', None)
    if code is None or function in seen:
        return False
    seen.add(function)
    names = set(find_names(code))
    if names & STARTERS:
        return True
    for value in map(function.__globals__.get, names):
        parts = vars(value).values() if inspect.isclass(value) else (value,)
        for part in (inspect.unwrap(part) for part in parts if inspect.isfunction(part)):
            if Path(part.__code__.co_filename).parent == FOLDER and uses_starter(part, seen):
                return True
    return False


def find_names(code: CodeType) -> Iterator[str]:
    """Yield the names that a code object and the code objects nested in it refer to."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from find_names(constant)


def add_marks(items: list[pytest.Item]) -> None:
    """Mark the collected tests."""
    for item in items:
        if not isinstance(item, pytest.Function):
            continue
        file, function = item.path.name, item.originalname
        if is_listed(file, function, LONG):
            item.add_marker(pytest.mark.long)
        if is_listed(file, function, PROCESS) or starts_process(item):
            item.add_marker(pytest.mark.process)


def list_test_functions() -> set[tuple[str, str]]:
    """Return the file and name of all test functions of this folder."""
    found = set()
    for path in FOLDER.glob('test_*.py'):
        tree = ast.parse(path.read_text(encoding='utf-8'))
        found |= {
            (path.name, node.name) for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name[:5] == 'test_'
        }
    return found
