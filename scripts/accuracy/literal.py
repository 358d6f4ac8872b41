"""The paper's algorithm 1 as printed, beside smaller factors and the continuous walk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from foc_ros.core.types import Array, Solution, Status
from foc_ros.reporting.drawing import LIKELIHOOD_COLOURS, class_style, new_figure

from .page import table
from .scenes import Scene, one_obstacle, random_scene

DELTAS = {'LV': 5e-5, 'HC': 1e-4}
WALKS = {'LV': 'lv', 'HC': 'hc'}
GROWTHS = (10.0, 2.0, 1.5)
MOST_STEPS = 50
"""Whole steps looked at for the first that would have been enough."""


@dataclass(frozen=True, eq=False)
class Case:
    """A scene and the eta that is wanted in it."""

    scene: Scene
    eta: float


CASES = (
    Case(one_obstacle(0.15), 0.94),
    Case(one_obstacle(0.05), 0.94),
    Case(random_scene(1, 0.1), 0.8),
    Case(random_scene(6, 0.1), 0.8),
    Case(random_scene(12, 0.1), 0.8),
)


def measure() -> list[dict[tuple[str, float | None], Solution]]:
    """Solve every case by both update rates: with every growth as printed, and (None) by the continuous walk with growth 2."""
    return [{(rate, growth): _solution(case, rate, growth) for rate in DELTAS for growth in (*GROWTHS, None)} for case in CASES]


def _solution(case: Case, rate: str, growth: float | None) -> Solution:
    if growth is None:
        return case.scene.solved(case.eta, WALKS[rate])
    return case.scene.solved(case.eta, 'algorithm1', algorithm1_delta=DELTAS[rate], algorithm1_growth=growth)


def text(measured: list[dict[tuple[str, float | None], Solution]]) -> str:
    """Return the table of where each ends."""
    head = ['scene', 'rate', 'Δ', 'ended', 'QPs', 's', 'enough', 'τ [m²]', 'λ [1/s⁶]', 'η achieved', 'effort', 'effort / walk']
    rows = []
    for case, solutions in zip(CASES, measured, strict=True):
        name = _name(case)
        for (rate, growth), each in solutions.items():
            stepped = '2, walked' if growth is None else f'{growth:g}'
            enough = '' if growth is None else _enough(case, DELTAS[rate], growth)
            cells = _cells(each, DELTAS[rate], enough, solutions[rate, None])
            rows.append(
                [name, rate, stepped, each.status.value.replace('_', ' '), str(each.iterations or each.qp_solves), *cells]
            )
            name = ''
    return table(head, rows)


def _cells(solution: Solution, delta: float, enough: str, walk: Solution) -> list[str]:
    both = solution.status is Status.SOLVED and walk.status is Status.SOLVED
    return [
        f'{solution.tau / delta:.3g}',
        enough,
        f'{solution.tau:.2e}',
        f'{solution.lam:.1e}',
        f'{solution.eta:.3f}',
        f'{solution.effort:.3g}',
        f'{solution.effort / walk.effort:.2f}' if both else '',
    ]


def _enough(case: Case, delta: float, growth: float) -> str:
    """Return the first whole s at which QPs that are left to settle meet eta."""
    for s in range(MOST_STEPS + 1):
        solution = case.scene.solved(case.eta, 'fixed', tau=delta * s, lam=growth**s)
        if solution.status is Status.SOLVED and solution.eta >= case.eta:
            return str(s)
    return f'> {MOST_STEPS}'


def _name(case: Case) -> str:
    return f'{case.scene.name}, c = {case.scene.problem(case.eta).noise[0]:g}, η {case.eta:g}'


def figure(measured: list[dict[tuple[str, float | None], Solution]]) -> Figure:
    """Draw the steps of the first case over what eta the solutions at each tau and lambda achieve."""
    case, solutions = CASES[0], measured[0]
    taus, lams = np.linspace(0.0, 4e-3, 33), np.logspace(0, 20, 41)
    levels = np.array([0.0, 0.3, 0.5, 0.7, 0.8, 0.9, case.eta, 0.97, 1.0])
    achieved = _achieved(case, taus, lams)
    with new_figure(9.6, 4.6) as made:
        panels = made.subplots(1, 2, sharey=True)
        for axes, (rate, delta) in zip(panels, DELTAS.items(), strict=True):
            drawn = axes.contourf(1e3 * taus, lams, achieved, levels, cmap=LIKELIHOOD_COLOURS, norm=BoundaryNorm(levels, 256))
            axes.contour(1e3 * taus, lams, achieved, [case.eta], colors='black', linewidths=1.6)
            _draw_steps(axes, delta, [solutions[rate, growth] for growth in GROWTHS], solutions[rate, None])
            axes.set(yscale='log', ylim=(1.0, lams[-1]), xlim=(0.0, 4.0), xlabel='τ [10⁻³ m²]')
            axes.set_title(f'{rate}: δ = {1e5 * delta:g}·10⁻⁵ m²')
        panels[0].set_ylabel('λ [1/s⁶]')
        made.colorbar(drawn, ax=panels, label='η achieved at (τ, λ)')
    return made


def _achieved(case: Case, taus: Array, lams: Array) -> Array:
    """Return the eta that `fixed` achieves on a grid, (len(lams), len(taus))."""
    return np.array([[case.scene.solved(case.eta, 'fixed', tau=tau, lam=lam).eta for tau in taus] for lam in lams])


def _draw_steps(axes: Any, delta: float, ends: Sequence[Solution], walk: Solution) -> None:
    """Draw every pair that the loop steps on, up to its end; and where the walk ends."""
    for number, (growth, end) in enumerate(zip(GROWTHS, ends, strict=True)):
        steps = np.arange(round(end.tau / delta) + 1)
        colour, _ = class_style((1, 4, 3)[number])
        label = f'Δ = {growth:g}: {end.iterations} QPs, η {end.eta:.3f}, effort {end.effort:.1e}'
        axes.plot(1e3 * delta * steps, growth ** steps.astype(float), color=colour, marker='o', markersize=3, label=label)
        axes.plot(1e3 * end.tau, end.lam, marker='s', markersize=8, color=colour, markeredgecolor='black')
    label = f'walked, Δ = 2: η {walk.eta:.3f}, effort {walk.effort:.1e}'
    axes.plot(1e3 * walk.tau, walk.lam, '*', markersize=11, color='white', markeredgecolor='black', label=label)
    axes.legend(fontsize=7.5, loc='upper right')
