# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A scene from a file: its solved candidates as plain values, and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.prediction import Prediction
from foc_ros.core.reach import build_scene_problems, solve_scene
from foc_ros.core.scene import ReachingScene
from foc_ros.io.json_output import encode_candidate, encode_goals, encode_solution

COLUMNS = {
    'description': '{}',
    'status': '{}',
    'likelihood': '{:.3f}',
    'effort': '{:.6g}',
    'cost': '{:.6g}',
    'eta': '{:.4f}',
    'tau': '{:.4g}',
    'lambda': '{:.4g}',
    'qp_solves': '{}',
    'mc_step': '{:.4f}',
    'mc_path': '{:.4f}',
}


def solve_to_values(scene: ReachingScene, samples: int | None) -> tuple[Prediction, dict[str, Any]]:
    """Return the answer to a scene, and the same as plain values. samples: of roll-outs for each candidate, None for none."""
    problems = build_scene_problems(scene)
    candidates = solve_scene(scene, problems)
    encoded = [encode_candidate(each) | encode_solution(each.solution) for each in candidates]
    for values, each in zip(encoded, candidates, strict=True) if samples is not None else ():
        estimate = monte_carlo(problems[each.candidate.goal], each.solution.control.T.ravel(), samples or 0)
        for name, (share, low, high) in (('mc_step', estimate.step), ('mc_path', estimate.path)):
            values |= {name: share, f'{name}_interval': [low, high]}
    prediction = Prediction(
        0,
        '',
        0.0,
        tuple(candidates),
        next((each.label for each in candidates if each.has_likelihood), None),
        solve_s=sum(each.solution.solve_s for each in candidates),
        obstacles=scene.obstacles,
        goal_positions=scene.goals,
        goal_names=scene.goal_names,
    )
    return prediction, {'goals': encode_goals(prediction), 'candidates': encoded}


def make_table(encoded: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Return columns and rows of a table of candidates."""
    shown = [name for name in COLUMNS if any(name in each for each in encoded)]
    return shown, [['-' if each[name] is None else COLUMNS[name].format(each[name]) for name in shown] for each in encoded]


def describe_rest(prediction: Prediction) -> list[str]:
    """Return lines below the table: the time of all classes, why some are not solved, and goals without a class."""
    reached = {each.candidate.goal for each in prediction}
    return [
        f'{len(prediction)} class{"es" * (len(prediction) > 1)} solved in {1e3 * prediction.solve_s:.1f} ms',
        *(f'{each.description}: {each.reason}' for each in prediction if not each.is_solved),
        *(f'{goal.name}: no path to it was found' for row, goal in enumerate(prediction.goals) if row not in reached),
    ]
