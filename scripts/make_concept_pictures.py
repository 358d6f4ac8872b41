#!/usr/bin/env python3
"""Make the pictures of doc/concepts.md: noise, surrogate, strategies, classes, likelihood; all solved by the program.

python scripts/make_concept_pictures.py [DIRECTORY]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from foc_ros.core.config import FocConfig, LikelihoodConfig
from foc_ros.core.dynamics.noise import scale_noise, stack_noise
from foc_ros.core.dynamics.plants import build_triple_integrator_horizon
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.obstacles.shapes import collect_obstacles
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.scene_solver import build_scene_problems, solve_scene
from foc_ros.core.types import Array, Obstacles, Solution, make_obstacles
from foc_ros.io.scene_file import guess_path, load_scene
from foc_ros.reporting.drawing import draw_candidates, draw_scene, draw_tag, get_class_style, make_stddev_ellipse, open_figure
from foc_ros.reporting.plots import compute_bounds, number_labels, save_figure
from foc_ros.reporting.snapshots import build_candidate_views

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'examples' / 'paper'))
from studies import NOISE as PAPER_NOISE
from studies import STRATEGY_CLASS, Method

PICTURES = Path(__file__).resolve().parents[1] / 'doc' / 'images'
SCENE = Path(__file__).resolve().parents[1] / 'doc' / 'examples' / 'scene.yaml'
STEPS, GOAL = 50, np.array([0.3, 0.0])
NOISE, REFERENCE_S = 0.1, 0.02
"""Noise coefficient c, and the step [s] that it holds for."""
NOTHING = make_obstacles()
CIRCLE = make_obstacles([[0.15, -0.01]], 0.03, 0.003)
SLANTED = np.array([0.3, 0.12])
"""A goal that needs effort on both axes."""
SAMPLES = 20_000


def reach(
    seconds: float, obstacles: Obstacles, eta: float = 0.9, strategy: str = 'optimal', goal: Array = GOAL
) -> tuple[Problem, Solution]:
    """Return a reach from rest to rest at a goal, past the obstacles on the left, and its problem."""
    horizon = build_triple_integrator_horizon(seconds / STEPS, STEPS)
    c = scale_noise(np.full(2, NOISE), REFERENCE_S, horizon.dt)
    problem = rest_to_goal(horizon, np.zeros(6), goal, obstacles, c, eta)
    return problem, solve_problem(problem, cold_start(guess_path(np.zeros(2), goal, STEPS, 0.05)), FocConfig(strategy=strategy))


def rolled(problem: Problem, solution: Solution, count: int) -> Array:
    """Return noisy movements under the control of a solution, (count, N, 2) [m]."""
    control = solution.control.T.ravel()
    draws = np.random.default_rng(0).standard_normal((count, control.size))
    noise = stack_noise(problem.noise, STEPS) * np.abs(control) * draws
    movements: Array = problem.positions(control) + np.einsum('atu,su->sta', problem.horizon.position, noise)
    return movements


def noise() -> Figure:
    """Return the picture of a quick and a slow reach: noise grows with effort."""
    with open_figure(8.6, 3.4) as figure:
        paths, spread = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
        for number, (seconds, shift) in enumerate(((0.5, 0.05), (1.2, -0.05))):
            colour, _ = get_class_style(number)
            problem, solution = reach(seconds, NOTHING, goal=SLANTED)
            up = np.array([0.0, shift])
            for movement in rolled(problem, solution, 30):
                paths.plot(*(movement + up).T, color=colour, linewidth=0.5, alpha=0.35)
            paths.plot(*(solution.path + up).T, color=colour, linewidth=2.2)
            for row in range(5, STEPS + 1, 5):
                _ellipse(paths, solution, row, colour, up)
            paths.annotate(f'in {seconds:g} s', (0.0, shift), xytext=(-4, 16), textcoords='offset points', color=colour)
            deviation = 1e3 * np.sqrt(solution.covariance[:, 0, 0])
            spread.plot(solution.times, deviation, color=colour, linewidth=2.2, label=f'in {seconds:g} s')
        paths.set(xlabel='x [m]', ylabel='y [m]')
        paths.set_aspect('equal', adjustable='datalim')
        spread.set(xlabel='time [s]', ylabel='standard deviation of x [mm]', ylim=(0.0, None))
        spread.legend(frameon=False)
    return figure


def surrogate() -> Figure:
    """Return paths for more and more eta, and how often noisy movements really stay clear."""
    with open_figure(8.6, 3.4) as figure:
        paths, shares = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
        draw_scene(paths, CIRCLE, GOAL[None], (-0.02, 0.32, -0.07, 0.12), named=False)
        for number, eta in enumerate((0.5, 0.8, 0.95)):
            colour, dash = get_class_style(number)
            _, solution = reach(1.0, CIRCLE, eta)
            paths.plot(*solution.path.T, color=colour, linestyle=dash, linewidth=2.0, label=f'η = {eta:g}')
            _ellipse(paths, solution, STEPS // 2, colour)
        paths.legend(frameon=False, loc='upper left', ncols=3)
        etas = np.array([0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95])
        clear = [_clear(eta) for eta in etas]
        shares.plot(etas, clear, marker='o', color=get_class_style(2)[0], label='share of movements\nclear at the worst step')
        shares.plot((0.5, 1.0), (0.5, 1.0), color='0.4', linestyle='--', label='what was asked for')
        shares.set(xlabel='wanted η', ylabel='share', ylim=(0.48, 1.02))
        shares.legend(frameon=False, loc='lower right')
    return figure


def strategies() -> Figure:
    """Return the same scene by three strategies: paths and speeds."""
    with open_figure(8.6, 3.4) as figure:
        paths, speeds = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
        obstacles = collect_obstacles(STRATEGY_CLASS[0].obstacles)
        draw_scene(paths, obstacles, GOAL[None], (-0.02, 0.32, -0.06, 0.14), named=False)
        for number, name in enumerate(('lv', 'hc', 'optimal')):
            colour, dash = get_class_style(number)
            solution = Method(PAPER_NOISE, name).solve(*STRATEGY_CLASS, 0.94)
            paths.plot(*solution.path.T, color=colour, linestyle=dash, linewidth=2.0)
            for row in range(5, STEPS, 8):
                _ellipse(paths, solution, row, colour)
            speed = np.linalg.norm(solution.mean[:, 2:4], axis=1)
            speeds.plot(solution.times, speed, color=colour, linewidth=2.0, label=f'{name}, effort {solution.effort:,.0f}')
        speeds.set(xlabel='time [s]', ylabel='speed [m/s]', ylim=(0.0, 1.5))
        speeds.legend(frameon=False, loc='upper left', fontsize=8)
    return figure


def classes() -> Figure:
    """Return the solved candidates of the scene of the examples."""
    scene = load_scene(SCENE)
    candidates = build_candidate_views(solve_scene(scene, build_scene_problems(scene)))
    with open_figure(7.4, 5.6) as figure:
        axes = figure.subplots()
        draw_scene(axes, scene.obstacles, scene.goals, compute_bounds(scene.obstacles, scene.goals, candidates))
        draw_candidates(axes, candidates, number_labels(candidates))
        axes.plot(*scene.hand.mean[:2], marker='o', color='black')
    return figure


def likelihood() -> Figure:
    """Return the picture of likelihoods over cost ratios for three values of beta."""
    costs = np.array([1.0, 1.3, 2.0, 4.0])
    with open_figure(8.6, 3.2) as figure:
        shares, pair = figure.subplots(1, 2)
        for number, beta in enumerate((0.5, 1.0, 2.0)):
            colour, dash = get_class_style(number)
            config = LikelihoodConfig(beta=beta)
            places = np.arange(len(costs)) + 0.27 * (number - 1)
            shares.bar(places, compute_likelihoods(costs, config), 0.25, color=colour, label=f'β = {beta:g}')
            ratios = np.geomspace(1.0, 10.0, 60)
            first = [compute_likelihoods(np.array([1.0, ratio]), config)[0] for ratio in ratios]
            pair.plot(ratios, first, color=colour, linestyle=dash, linewidth=2.0)
            draw_tag(pair, (ratios[40], first[40]), f'{beta:g}', colour)
        shares.set_xticks(range(len(costs)), [f'{cost:g}' for cost in costs])
        shares.set(xlabel='cost of a candidate relative to the cheapest', ylabel='likelihood')
        shares.legend(frameon=False)
        pair.set(xscale='log', xlabel='cost ratio of two candidates', ylabel='likelihood of the cheaper one', ylim=(0.48, 1.02))
        pair.set_xticks([1, 2, 5, 10], ['1', '2', '5', '10'])
        pair.minorticks_off()
    return figure


PARTS: dict[str, Callable[[], Figure]] = {
    'noise': noise,
    'surrogate': surrogate,
    'strategies': strategies,
    'classes': classes,
    'likelihood': likelihood,
}


def _clear(eta: float) -> float:
    problem, solution = reach(1.0, CIRCLE, eta)
    return monte_carlo(problem, solution.control.T.ravel(), SAMPLES).step[0]


def _ellipse(axes: Any, solution: Solution, row: int, colour: str, shift: Array | float = 0.0) -> None:
    ellipse = make_stddev_ellipse(solution.path[row] + shift, solution.covariance[row, :2, :2])
    ellipse.set(facecolor='none', edgecolor=colour, linewidth=0.9, alpha=0.8, zorder=3)
    axes.add_patch(ellipse)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Make the pictures of doc/concepts.md.')
    parser.add_argument('directory', nargs='?', type=Path, default=PICTURES)
    directory = parser.parse_args().directory
    directory.mkdir(parents=True, exist_ok=True)
    for name, made in PARTS.items():
        save_figure(made(), directory / f'concept_{name}.png')
