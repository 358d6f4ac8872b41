#!/usr/bin/env python3
"""Make the picture of doc/model.md: a contact between two steps, and effort over eta with and without sliding contacts.

python scripts/make_contact_picture.py [FILE]
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from foc_ros.core.config import FocConfig
from foc_ros.core.dynamics.plants import build_triple_integrator_horizon
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start, warm_start
from foc_ros.core.types import Array, Solution, Status, make_obstacles
from foc_ros.io.scene_file import guess_path
from foc_ros.reporting.drawing import get_class_style, open_figure
from foc_ros.reporting.plots import save_figure

PICTURE = Path(__file__).resolve().parents[1] / 'doc' / 'images' / 'contacts.png'
STEPS, DURATION_S = 50, 1.0
GOAL = np.array([0.3, 0.0])
CENTRE, RADIUS, RADIUS_STDDEV = (0.12, 0.0), 0.03, 0.003
NOISE, ETA = 0.15, 0.89
ETAS = np.linspace(0.8, 0.95, 61)
STRIDE = 0.05
"""Distance in s between two points of the curve with rows at the steps."""
LAST_S = 27.0


def one_obstacle(eta: float) -> Problem:
    """Return a reach of 0.3 m past one circle."""
    horizon = build_triple_integrator_horizon(DURATION_S / STEPS, STEPS)
    obstacles = make_obstacles([CENTRE], RADIUS, RADIUS_STDDEV)
    return rest_to_goal(horizon, np.zeros(6), GOAL, obstacles, np.full(2, NOISE), eta)


def solve_sliding(eta: float) -> Solution:
    """Return the solution of `lv`, whose contacts slide."""
    return solve_problem(one_obstacle(eta), cold_start(guess_path(np.zeros(2), GOAL, STEPS, 0.05)), FocConfig(strategy='lv'))


def follow_with_rows_at_steps() -> tuple[Array, Array]:
    """Return eta and effort along the curve of `lv` where the constraint holds at the steps only, as in `fixed`."""
    problem, settings = one_obstacle(ETA), FocConfig(strategy='fixed')
    start, etas, efforts = cold_start(guess_path(np.zeros(2), GOAL, STEPS, 0.05)), [], []
    for s in np.arange(0.0, LAST_S, STRIDE):
        penalties = replace(settings, tau=settings.lv_delta * s, lam=settings.growth**s)
        solution = solve_problem(problem, start, penalties)
        if solution.status is not Status.SOLVED:
            break
        start = warm_start(solution, problem)
        etas.append(solution.eta)
        efforts.append(solution.effort)
    return np.array(etas), np.array(efforts)


def interpolate(solution: Solution, times: Array) -> Array:
    """Return the mean (k, 2) [m] at times in steps: the cubic through positions and velocities at the steps."""
    step = np.minimum(times.astype(int), STEPS - 1)
    a = (times - step)[:, None]
    position, velocity = solution.mean[:, :2], solution.mean[:, 2:4] * solution.dt
    weights = 2 * a**3 - 3 * a**2 + 1, a**3 - 2 * a**2 + a, 3 * a**2 - 2 * a**3, a**3 - a**2
    parts = position[step], velocity[step], position[step + 1], velocity[step + 1]
    mean: Array = sum(weight * part for weight, part in zip(weights, parts, strict=True))
    return mean


def draw_circle(axes: Any, kept: float) -> None:
    """Draw the obstacle and the circle that the mean has to keep clear of."""
    axes.add_patch(Circle((float(CENTRE[0]), float(CENTRE[1])), RADIUS, facecolor='0.75', edgecolor='0.4'))
    axes.add_patch(Circle((float(CENTRE[0]), float(CENTRE[1])), kept, facecolor='none', edgecolor='0.4', linestyle='--'))


def make_figure() -> Figure:
    """Return the picture: the mean against the circle, a close-up of the contact, effort over eta."""
    solution = solve_sliding(ETA)
    _, time, multiplier = max(solution.multipliers, key=lambda contact: contact[2])
    kept = float(np.sqrt(RADIUS**2 + RADIUS_STDDEV**2 + solution.tau))
    blue, orange = get_class_style(0)[0], get_class_style(1)[0]
    fine = interpolate(solution, np.linspace(0.0, STEPS, 20 * STEPS + 1))
    contact = interpolate(solution, np.array([time]))[0]
    normal = (contact - CENTRE) / np.linalg.norm(contact - CENTRE)
    with open_figure(10.0, 3.4) as figure:
        overview, close_up, curves = figure.subplots(1, 3, width_ratios=(1.35, 1.0, 1.15))
        for axes in (overview, close_up):
            draw_circle(axes, kept)
            axes.plot(*fine.T, color=blue, linewidth=1.6)
            axes.plot(*solution.path.T, color=blue, marker='o', markersize=3.5, linestyle='none')
            axes.plot(*contact, color=orange, marker='D', markersize=7, zorder=5)
        overview.annotate(
            '', contact + 0.035 * normal, contact, arrowprops={'arrowstyle': '->', 'color': orange, 'linewidth': 1.8}
        )
        overview.annotate(f'y = {multiplier:,.0f} m/s⁶', contact + 0.037 * normal, color=orange, fontsize=8, ha='center')
        overview.plot(*GOAL, marker='*', markersize=12, color='black', markerfacecolor='white')
        overview.set(title='The mean touches the circle', xlabel='x [m]', ylabel='y [m]')
        overview.set(xlim=(-0.01, 0.31), ylim=(-0.07, 0.17))
        overview.set_aspect('equal')
        before, after = solution.path[int(time)], solution.path[int(time) + 1]
        half = 1.2 * float(np.linalg.norm(after - before))
        for point, number in ((before, int(time)), (after, int(time) + 1)):
            close_up.annotate(f'step {number}', point, xytext=(0, 10), textcoords='offset points', fontsize=8, ha='center')
        close_up.annotate(f's = {time:.2f}', contact, xytext=(0, -18), textcoords='offset points', fontsize=8, ha='center')
        close_up.set(title='Close-up of the contact', xticks=(), yticks=())
        close_up.set(xlim=contact[0] + half * np.array([-1, 1]), ylim=contact[1] + half * np.array([-1.0, 1.0]))
        close_up.set_aspect('equal')
        etas, efforts = follow_with_rows_at_steps()
        shown = etas > ETAS[0]
        curves.plot(
            etas[shown], efforts[shown], color=orange, marker='.', markersize=3, linestyle='none', label='rows at the steps'
        )
        sliding = [solve_sliding(float(eta)).effort for eta in ETAS]
        curves.plot(ETAS, sliding, color=blue, linewidth=1.8, label='sliding contacts (lv)')
        curves.set(title='Effort over η', xlabel='η', ylabel='effort [m²/s⁶]', yscale='log', xlim=(ETAS[0], ETAS[-1]))
        curves.set_yticks([5e3, 1e4, 2e4, 4e4], ['5 000', '10 000', '20 000', '40 000'])
        curves.minorticks_off()
        curves.legend(fontsize=8, loc='upper left')
    return figure


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Make the picture of doc/model.md.')
    parser.add_argument('file', nargs='?', type=Path, default=PICTURE)
    file = parser.parse_args().file
    file.parent.mkdir(parents=True, exist_ok=True)
    save_figure(make_figure(), file)
