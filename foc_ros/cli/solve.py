"""`solve`: solves one scene from a file, either all homotopy classes found or the class of a given guess."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from typing import Any

from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.predict import build_scene_problems, solve_scene
from foc_ros.core.types import PredictedCandidate
from foc_ros.io.json_output import encode_candidate, encode_solution
from foc_ros.io.terminal import show_table, show_text

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
    'solve_ms': '{:.2f}',
    'mc_step': '{:.4f}',
    'mc_path': '{:.4f}',
}
"""Columns of the table and the formats of their values."""


def run(arguments: argparse.Namespace) -> int:
    """Solve the scene; return 3 if no candidate could be solved."""
    samples = arguments.monte_carlo
    scene = arguments.problem
    problems = build_scene_problems(scene)
    candidates = solve_scene(scene, problems)
    encoded = [_encode(each, problems[each.candidate.goal], samples) for each in candidates]
    if arguments.plot is not None:
        from foc_ros.reporting.draw import plot_outcomes

        plot_outcomes(arguments.plot, scene.obstacles, scene.goals, candidates, scene.hand.mean[:2])
    if arguments.json:
        print(json.dumps({'candidates': encoded}, allow_nan=False))
    else:
        _show(encoded)
    if any(each.has_likelihood for each in candidates):
        for each in candidates if not arguments.json else ():
            if not each.is_solved:
                show_text(f'{each.description}: {each.reason}')
        return 0
    reasons = '; '.join(f'{each.description}: {each.reason}' for each in candidates)
    reason = f'no candidate could be solved: {reasons}' if reasons else 'no path was found between the start and any goal'
    print(f'foc_ros solve: {reason}', file=sys.stderr)
    return 3


def _encode(candidate: PredictedCandidate, problem: Problem, samples: int | None) -> dict[str, Any]:
    encoded = encode_candidate(candidate) | encode_solution(candidate.solution)
    if samples is not None:
        estimate = monte_carlo(problem, candidate.solution.control.T.ravel(), samples)
        for name, (share, low, high) in (('mc_step', estimate.step), ('mc_path', estimate.path)):
            encoded |= {name: share, f'{name}_interval': [low, high]}
    return encoded


def _show(candidates: Sequence[dict[str, Any]]) -> None:
    columns = [name for name in COLUMNS if any(name in each for each in candidates)]
    rows = [['-' if each[name] is None else COLUMNS[name].format(each[name]) for name in columns] for each in candidates]
    show_table(columns, rows)
