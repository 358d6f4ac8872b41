"""`solve`: one scene from a file, every class or the one of a guess, as the paper poses it."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from foc_ros.core.candidates import rank_candidates, solve_candidates
from foc_ros.core.dynamics.replanning import triple_integrator_error_map
from foc_ros.core.errors import InputError
from foc_ros.core.estimation.duration import is_passing
from foc_ros.core.homotopy import path_sides, search
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.predictor import build_problem
from foc_ros.core.types import LEFT, Array, Candidate, PredictedCandidate
from foc_ros.io.json_output import candidate_answer, solution_account, table
from foc_ros.io.scene_file import SceneFile, load_scene
from foc_ros.io.terminal import show_table

MOST_SAMPLES = 10_000_000
COLUMNS = {
    'label': '{}',
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
"""What is shown of an answer, and how."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('scene', type=Path, metavar='SCENE', help='YAML or JSON file')
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    parser.add_argument('--monte-carlo', type=int, metavar='N', help='estimate the avoidance from N noisy movements')
    parser.add_argument('--plot', type=Path, metavar='FILE', help='draw the ways found (PNG, PDF or SVG)')


def run(arguments: argparse.Namespace) -> int:
    """Solve the scene; 3 where no candidate could be solved."""
    samples = arguments.monte_carlo
    if samples is not None and not 1 <= samples <= MOST_SAMPLES:
        raise InputError('--monte-carlo', f'a number in [1, {MOST_SAMPLES}]', samples)
    scene = load_scene(arguments.scene)
    problems = scene_problems(scene)
    outcomes = solve_scene(scene, problems)
    answers = [_answer(outcome, problems[outcome.candidate.goal], samples) for outcome in outcomes]
    if arguments.plot is not None:
        from foc_ros.reporting.plots import plot_outcomes

        plot_outcomes(arguments.plot, scene.obstacles, scene.goals, outcomes)
    if arguments.json:
        print(json.dumps({'candidates': answers}, allow_nan=False))
    else:
        _show(answers)
    if any(outcome.is_solved for outcome in outcomes):
        return 0
    print(f'foc_ros solve: {_why_not(outcomes)}', file=sys.stderr)
    return 3


def scene_problems(scene: SceneFile) -> list[Problem]:
    """Return the problem of every goal: noise per step as the file says; the start is as uncertain to the operator as to us."""
    made = [build_problem(scene.config, scene.hand, scene.obstacles, goal, scene.duration_s) for goal in scene.goals]
    steps = scene.config.foc.steps
    error_map = triple_integrator_error_map(scene.duration_s / steps, steps, is_passing(scene.config.duration))
    covariance = scene.hand.covariance
    return [replace(problem, noise=scene.noise, initial_covariance=covariance, error_map=error_map) for problem in made]


def solve_scene(scene: SceneFile, problems: Sequence[Problem]) -> list[PredictedCandidate]:
    """Solve the class of the guess, or those that are found; solved ones first, most likely first."""
    config = scene.config
    if scene.guess is not None:
        candidates: tuple[Candidate, ...] = (_guessed(scene, scene.guess),)
    else:
        durations = [scene.duration_s] * len(scene.goals)
        candidates = search(
            scene.hand.mean, scene.goals, scene.obstacles, config.homotopy, durations, config.foc.steps
        ).candidates
    outcomes = solve_candidates(candidates, [problems[each.goal] for each in candidates], config.foc, config.likelihood)
    return rank_candidates(outcomes, config.likelihood, scene.obstacles)


def _guessed(scene: SceneFile, guess: Array) -> Candidate:
    sides = tuple(sorted(path_sides(guess, scene.obstacles).items()))
    label = 'goal0:' + ''.join(('+' if side == LEFT else '-') + identity for identity, side in sides)
    return Candidate(label, 0, sides, guess, 0.0)


def _answer(outcome: PredictedCandidate, problem: Problem, samples: int | None) -> dict[str, Any]:
    solution = outcome.solution
    answer = candidate_answer(outcome)
    answer |= {'solve_ms': 1e3 * solution.solve_s, 'velocity': table(solution.mean[:, 2:4])} | solution_account(solution)
    if samples is not None:
        estimate = monte_carlo(problem, solution.control.T.ravel(), samples)
        for name, (share, low, high) in (('mc_step', estimate.step), ('mc_path', estimate.path)):
            answer |= {name: share, f'{name}_interval': [low, high]}
    return answer


def _show(answers: Sequence[dict[str, Any]]) -> None:
    shown = [name for name in COLUMNS if any(name in answer for answer in answers)]
    rows = [['-' if answer[name] is None else COLUMNS[name].format(answer[name]) for name in shown] for answer in answers]
    show_table(shown, rows)


def _why_not(outcomes: Sequence[PredictedCandidate]) -> str:
    if not outcomes:
        return 'no way round was found between the start and any goal'
    return 'no candidate could be solved: ' + '; '.join(f'{each.candidate.label}: {each.solution.message}' for each in outcomes)
