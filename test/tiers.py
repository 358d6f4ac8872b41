# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which tests are `long` and which are `process`: the two markers by which `make check`, `test` and `test-long` choose.

`LONG` lists the long tests. `PROCESS` lists those that start another process, or take more than half a second with all their
parameters; tests with the fixtures `ros` and `browser` have that mark, too. The lists consist of shell patterns for
'file::function'. `test_documentation.py` fails if a pattern matches no test.
"""

import re
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent

# in the order in which they begin, the longest first, so that no worker is left with one when the others have ended
LONG = (
    # the commands of the documentation, and its web site
    'test_documentation.py::test_commands_work_as_shown',
    'test_documentation_site.py::*',
    # many hands, the paper's studies, and fits of everything, with their comparison or without obstacles
    'test_guidance_safety.py::test_thousands_of_hostile_hands',
    'test_examples.py::test_*trend*',
    'test_examples.py::test_[frw]*',
    'test_play_session.py::test_a_fit_and_its_comparison',
    'test_fit.py::test_everything_is_fitted_*',
    'test_fit.py::test_without_obstacles_goals_*',
    # studies of the solver and of the search over many scenes, and long reports
    'test_solution_numbers.py::test_nothing_is_below_*',
    'test_reference_cases.py::test_classes_are_as_good_*',
    'test_homotopy.py::test_brute_force_finds_*',
    'test_shapes_in_ocp.py::test_what_is_solved_*',
    'test_shapes_in_ocp.py::test_a_mean_that_only_just_*',
    'test_shapes_in_ocp.py::test_with_the_risk_*',
    'test_tracks.py::test_*symmetric_obstacle*',
    'test_report.py::test_a_long_recording_is_thinned_out*',
    'test_report_page.py::test_a_long_recording_says_where_the_slider_stops',
    # a node under load, and a process that is stopped or killed
    'test_node_scenes.py::test_the_node_keeps_its_promises_in_a_hostile_scene',
    'test_node_predicts.py::test_ten_thousand_obstacles_at_50_hz',
    'test_node_predicts.py::test_*poses_at_1_khz*',
    'test_node_process.py::test_a_node_that_is_killed_and_started_again',
    'test_node_process.py::test_a_*work*without_an_error',
    'test_parallel.py::test_a_scheduler_that_dies_*',
    'test_parallel.py::test_a_killed_worker_*',
    'test_parallel.py::test_an_evaluation_*',
)

PROCESS = (
    # another process or a ROS graph
    'test_node_*.py::*',
    'test_parallel.py::*',
    'test_environment.py::*',
    'test_api.py::test_the_import_*',
    'test_command_line.py::test_help_imports_*',
    'test_command_line.py::test_wrong_inputs_*',
    'test_command_line.py::test_a_[fnp]*',
    'test_demo.py::*',
    'test_demo_parts.py::test_the_n*',
    'test_demo_parts.py::test_a_domain_*',
    'test_optional_packages.py::test_[apt]*',
    'test_packaging.py::test_[anrsw]*',
    'test_packaging.py::*_the_wheel',
    'test_parameters.py::test_a_node_*',
    'test_play_server.py::test_the_command_*',
    'test_play_server.py::test_without_*',
    'test_repository.py::test_every_source_*',
    'test_simulation.py::test_the_*',
    'test_examples.py::test_output_*',
    'test_examples.py::test_the_[ec]*',
    'test_notebook.py::*',
    # the strategies that seek a point of a curve, and many scenes
    'test_reference_cases.py::test_continuous_*',
    'test_reference_cases.py::test_*class*',
    'test_shapes_in_ocp.py::*',
    'test_strategies.py::*',
    'test_homotopy.py::test_candidates_stay_*',
    'test_extensions.py::test_a_qp_backend_*',
    'test_tracks.py::test_*_class_*',
    'test_tracks.py::test_a_strategy_stops_*',
    'test_guidance_safety.py::test_hostile_hands',
    'test_guidance_continuity.py::test_the_force_*',
    'test_demonstrations.py::test_*path*',
    'test_pace.py::test_a_repeated_way_*',
    'test_height.py::test_every_plane_*',
    # recordings and commands
    'test_evaluate.py::*',
    'test_fit.py::*',
    'test_fit_estimates.py::test_a_setting_that_predicts_nothing_*',
    'test_one_driver.py::*',
    'test_replay.py::*',
    'test_solve.py::*',
    'test_unusual_recordings.py::*',
    'test_bags.py::test_no_mutant_*',
    'test_fuzz.py::*',
    'test_decode_objects.py::test_a_bag_*',
    'test_parameters.py::test_every_configuration_*',
    'test_parameters.py::test_sections_apply_*',
    'test_benchmarks.py::*',
    # studies, pictures and pages
    'test_evaluation_scores.py::test_the_region_*',
    'test_fit_estimates.py::test_the_*',
    'test_draw.py::test_a_plot_survives_*',
    'test_study_pages.py::test_a_recording_*',
    'test_play_session.py::test_t*',
)


def is_listed(file: str, function: str, patterns: tuple[str, ...]) -> bool:
    return find_place(file, function, patterns) < len(patterns)


def find_place(file: str, function: str, patterns: tuple[str, ...]) -> int:
    """Return the place of the first pattern that names a test, the number of patterns if none does."""
    name = f'{file}::{function}'
    return next((place for place, pattern in enumerate(patterns) if fnmatchcase(name, pattern)), len(patterns))


def add_marks(items: list[pytest.Item]) -> None:
    """Mark the collected tests, and let the long ones begin first, in their order.

    Those of a file with fixtures of the module run in one worker, which makes these once.
    """
    for item in items:
        if not isinstance(item, pytest.Function):
            continue
        file, function = item.path.name, item.originalname
        if is_listed(file, function, LONG):
            item.add_marker(pytest.mark.long)
        if is_listed(file, function, PROCESS) or {'ros', 'browser'} & set(item.fixturenames):
            item.add_marker(pytest.mark.process)
        fixtures = [definition for found in item._fixtureinfo.name2fixturedefs.values() for definition in found]
        if any(each.scope == 'module' for each in fixtures):
            item.add_marker(pytest.mark.xdist_group(file))
    items.sort(key=lambda item: find_place(item.path.name, getattr(item, 'originalname', item.name), LONG))


def is_left_out(file: str, expression: str) -> bool:
    """Return whether a target of the Makefile chooses no test of a file by its expression, so that it need not be imported."""
    if expression == 'long':
        return not any(fnmatchcase(file, pattern.partition('::')[0]) for pattern in LONG)
    patterns = {'not long': LONG, 'not long and not process': LONG + PROCESS}.get(expression, ())
    return is_listed(file, '*', patterns)


def list_test_functions() -> set[str]:
    """Return 'file::function' of all tests of this folder."""
    files = {path.name: path.read_text(encoding='utf-8') for path in FOLDER.glob('test_*.py')}
    return {f'{file}::{name}' for file, text in files.items() for name in re.findall(r'^def (test_\w+)\(', text, re.MULTILINE)}
