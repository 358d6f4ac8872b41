"""The paper's algorithm 1 as printed, compared with smaller factors Delta and with the continuation of `lv` and `hc`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from foc_ros.core.types import Array, Solution, Status
from foc_ros.reporting.draw import get_class_style, open_figure

from .page import format_table
from .scenes import Scene, build_one_obstacle, build_random

DELTAS = {'LV': 5e-5, 'HC': 1e-4}
CONTINUATIONS = {'LV': 'lv', 'HC': 'hc'}
GROWTHS = (10.0, 2.0, 1.5)
MAX_STEPS = 50
"""Largest number of steps in tau and lambda that is checked for the first sufficient one."""

Solutions = dict[tuple[str, float | None], Solution]
"""Solutions by update rate and growth; growth None stands for the continuation."""


@dataclass(frozen=True, eq=False)
class Case:
    """A scene and its wanted eta."""

    scene: Scene
    eta: float


CASES = (
    Case(build_one_obstacle(0.15), 0.94),
    Case(build_one_obstacle(0.05), 0.94),
    Case(build_random(1, 0.1), 0.8),
    Case(build_random(6, 0.1), 0.8),
    Case(build_random(12, 0.1), 0.8),
)


def measure() -> list[Solutions]:
    """Solve each case with both update rates, by algorithm 1 with each growth and by the continuation with growth 2."""
    return [{(rate, growth): _solve(case, rate, growth) for rate in DELTAS for growth in (*GROWTHS, None)} for case in CASES]


def _solve(case: Case, rate: str, growth: float | None) -> Solution:
    if growth is None:
        return case.scene.solve(case.eta, CONTINUATIONS[rate])
    return case.scene.solve(case.eta, 'algorithm1', algorithm1_delta=DELTAS[rate], algorithm1_growth=growth)


def format_ends(measured: list[Solutions]) -> str:
    """Return the table of where each loop ends."""
    head = ['scene', 'rate', 'Δ', 'ended', 'QPs', 's', 'sufficient s']
    head += ['τ [m²]', 'λ [1/s⁶]', 'η achieved', 'effort', 'relative effort']
    rows = []
    for case, solutions in zip(CASES, measured, strict=True):
        name = f'{case.scene.name}, c = {case.scene.problem(case.eta).noise[0]:g}, η {case.eta:g}'
        for (rate, growth), each in solutions.items():
            factor = '2, continuation' if growth is None else f'{growth:g}'
            sufficient = '' if growth is None else _find_first_sufficient(case, DELTAS[rate], growth)
            cells = _format_cells(each, DELTAS[rate], sufficient, solutions[rate, None])
            rows.append([name, rate, factor, each.status.value.replace('_', ' '), str(each.iterations or each.qp_solves), *cells])
            name = ''
    return format_table(head, rows)


def _format_cells(solution: Solution, delta: float, sufficient: str, continuation: Solution) -> list[str]:
    are_solved = solution.status is Status.SOLVED and continuation.status is Status.SOLVED
    return [
        f'{solution.tau / delta:.3g}',
        sufficient,
        f'{solution.tau:.2e}',
        f'{solution.lam:.1e}',
        f'{solution.eta:.3f}',
        f'{solution.effort:.3g}',
        f'{solution.effort / continuation.effort:.2f}' if are_solved else '',
    ]


def _find_first_sufficient(case: Case, delta: float, growth: float) -> str:
    """Return the first number of steps at which the converged QPs meet eta."""
    for s in range(MAX_STEPS + 1):
        solution = case.scene.solve(case.eta, 'fixed', tau=delta * s, lam=growth**s)
        if solution.status is Status.SOLVED and solution.eta >= case.eta:
            return str(s)
    return f'> {MAX_STEPS}'


def draw(measured: list[Solutions]) -> Figure:
    """Draw the steps of the first case over the eta that is achieved at each tau and lambda."""
    case, solutions = CASES[0], measured[0]
    taus, lams = np.linspace(0.0, 4e-3, 33), np.logspace(0, 20, 41)
    contours = np.array([0.0, 0.3, 0.5, 0.7, 0.8, 0.9, case.eta, 0.97, 1.0])
    achieved = _compute_achieved_eta(case, taus, lams)
    with open_figure(9.6, 4.6) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (rate, delta) in zip(panels, DELTAS.items(), strict=True):
            drawn = axes.contourf(1e3 * taus, lams, achieved, contours, cmap='viridis_r', norm=BoundaryNorm(contours, 256))
            axes.contour(1e3 * taus, lams, achieved, [case.eta], colors='black', linewidths=1.6)
            _draw_steps(axes, delta, [solutions[rate, growth] for growth in GROWTHS], solutions[rate, None])
            axes.set(yscale='log', ylim=(1.0, lams[-1]), xlim=(0.0, 4.0), xlabel='τ [10⁻³ m²]')
            axes.set_title(f'{rate}: δ = {1e5 * delta:g}·10⁻⁵ m²')
        panels[0].set_ylabel('λ [1/s⁶]')
        figure.colorbar(drawn, ax=panels, label='η achieved at (τ, λ)')
    return figure


def _compute_achieved_eta(case: Case, taus: Array, lams: Array) -> Array:
    """Return the eta that `fixed` achieves on a grid, (len(lams), len(taus))."""
    return np.array([[case.scene.solve(case.eta, 'fixed', tau=tau, lam=lam).eta for tau in taus] for lam in lams])


def _draw_steps(axes: Any, delta: float, ends: Sequence[Solution], continuation: Solution) -> None:
    """Draw all pairs of tau and lambda on which algorithm 1 steps until its end, and the end of the continuation."""
    for number, (growth, end) in enumerate(zip(GROWTHS, ends, strict=True)):
        steps = np.arange(round(end.tau / delta) + 1)
        colour, _ = get_class_style((1, 4, 3)[number])
        label = f'Δ = {growth:g}: {end.iterations} QPs, η {end.eta:.3f}, effort {end.effort:.1e}'
        axes.plot(1e3 * delta * steps, growth ** steps.astype(float), color=colour, marker='o', markersize=3, label=label)
        axes.plot(1e3 * end.tau, end.lam, marker='s', markersize=8, color=colour, markeredgecolor='black')
    label = f'continuation, Δ = 2: η {continuation.eta:.3f}, effort {continuation.effort:.1e}'
    axes.plot(1e3 * continuation.tau, continuation.lam, '*', markersize=11, color='white', markeredgecolor='black', label=label)
    axes.legend(fontsize=7.5, loc='upper right')
