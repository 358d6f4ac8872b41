# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which tests are `long` and which are `process`: the two markers by which `make check`, `test` and `test-long` choose.

`LONG` lists the long tests. The mark `process` is derived from the code: a test has it if the test, a fixture of it or a helper
in this folder starts a process, a ROS graph or a browser. Tests that do so through the package are listed in `PROCESS`, and those
that take more than half a second, with all their parameters, in `SLOW`: both have the mark, too, so that `make check` is quick.
The lists consist of shell patterns for 'file::function'. `test_documentation.py` fails if a pattern matches no test.
"""

import inspect
import re
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
    'test_guidance_safety.py::test_ten_thousand_hostile_hands',
    # a fit and its comparison or without obstacles, the paper's studies and long reports
    'test_play_session.py::test_a_fit_and_its_comparison',
    'test_fit.py::test_without_obstacles_goals_*',
    'test_report.py::test_a_long_recording_is_thinned_out*',
    'test_paper.py::test_*trend*',
    'test_paper.py::test_files_hold_the_computed_numbers',
    'test_report_page.py::test_a_long_recording_says_where_the_slider_stops',
    # the commands of the documentation, and its web site
    'test_shown_commands.py::test_commands_work_as_shown',
    'test_documentation_site.py::*',
    # a node under load, and a process that is stopped or killed
    'test_parallel.py::test_a_scheduler_that_dies_ends_the_run_in_words',
    'test_node_scenes.py::test_*a_flood_of_obstacles*',
    'test_node_scenes.py::test_the_node_keeps_its_promises_in_a_hostile_scene',
    'test_node_process.py::test_a_node_that_is_killed_and_started_again',
    'test_node_process.py::test_a_*work*without_an_error',
    'test_node_predicts.py::test_ten_thousand_obstacles_at_50_hz',
    'test_node_predicts.py::test_*poses_at_1_khz*',
)

PROCESS = (
    'test_node_*.py::*',
    'test_parallel.py::*',
    'test_demo.py::*',
    'test_demo_parts.py::test_the_node_*',
    'test_fit.py::*',
    'test_fit_search.py::test_a_setting_that_predicts_nothing_*',
    'test_simulation.py::test_the_command_*',
    'test_paper.py::*',
    'test_notebook.py::*',
    'test_evaluate.py::*',
)

SLOW = (
    # the strategies that seek a point of a curve, and many scenes
    'test_reference_cases.py::test_continuous_*',
    'test_reference_cases.py::test_*class*',
    'test_shapes_in_ocp.py::*',
    'test_strategies.py::*',
    'test_solution_numbers.py::test_nothing_is_below_*',
    'test_solution_numbers.py::test_an_infeasible_*',
    'test_homotopy_shapes.py::test_brute_force_finds_*',
    'test_homotopy_shapes.py::test_candidates_stay_*',
    'test_gradients.py::test_*corner*',
    'test_extensions.py::test_a_qp_backend_*',
    'test_tracks.py::test_*_class_*',
    'test_tracks.py::test_a_strategy_stops_*',
    'test_guidance_safety.py::test_hostile_hands',
    'test_demonstrations.py::test_*path*',
    'test_pace.py::test_a_repeated_way_*',
    'test_height_messages.py::test_every_plane_*',
    # recordings and commands
    'test_one_driver.py::*',
    'test_replay.py::*',
    'test_solve.py::*',
    'test_pipeline.py::test_a_replay_*',
    'test_unusual_recordings.py::*',
    'test_bags.py::test_no_mutant_*',
    'test_fuzz*.py::*',
    'test_decode_objects.py::test_a_bag_*',
    'test_parameters.py::test_every_configuration_*',
    'test_parameters.py::test_sections_apply_*',
    'test_command_line.py::test_the_output_*',
    'test_benchmarks.py::*',
    # studies, pictures and pages
    'test_box_scenes.py::*',
    'test_evaluation_scores.py::test_the_region_*',
    'test_fit_*.py::test_the_*',
    'test_plan_recovery.py::*',
    'test_draw.py::test_a_plot_survives_*',
    'test_study_pages.py::test_a_recording_*',
    'test_play_session.py::test_t*',
    'test_examples.py::test_the_example_runs_*',
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
    """Mark the collected tests; those of a file with fixtures of the module run in one worker, which makes these once."""
    for item in items:
        if not isinstance(item, pytest.Function):
            continue
        file, function = item.path.name, item.originalname
        if is_listed(file, function, LONG):
            item.add_marker(pytest.mark.long)
        if is_listed(file, function, PROCESS + SLOW) or starts_process(item):
            item.add_marker(pytest.mark.process)
        fixtures = [definition for found in item._fixtureinfo.name2fixturedefs.values() for definition in found]
        if any(each.scope == 'module' for each in fixtures):
            item.add_marker(pytest.mark.xdist_group(file))


def is_left_out(file: str, expression: str) -> bool:
    """Return whether a target of the Makefile chooses no test of a file by its expression, so that it need not be imported."""
    if expression == 'long':
        return not any(fnmatchcase(file, pattern.partition('::')[0]) for pattern in LONG)
    patterns = {'not long': LONG, 'not long and not process': LONG + PROCESS + SLOW}.get(expression, ())
    return is_listed(file, '*', patterns)


def list_test_functions() -> set[str]:
    """Return 'file::function' of all tests of this folder."""
    files = {path.name: path.read_text(encoding='utf-8') for path in FOLDER.glob('test_*.py')}
    return {f'{file}::{name}' for file, text in files.items() for name in re.findall(r'^def (test_\w+)\(', text, re.MULTILINE)}
