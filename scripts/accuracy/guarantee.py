"""How often solved movements stay clear of the obstacles, compared with the guaranteed eta."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from foc_ros.core.obstacles.risk import k_of_eta
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.types import Array, Status
from foc_ros.reporting.draw import get_class_style, open_figure

from .page import format_table
from .scenes import build_varied, solve

SAMPLES = 2000
STRATEGIES: dict[str, tuple[str, dict[str, float]]] = {
    'lv': ('lv', {}),
    'hc': ('hc', {}),
    'optimal': ('optimal', {}),
    'algorithm1, Δ = 10': ('algorithm1', {}),
    'algorithm1, Δ = 1.5': ('algorithm1', {'algorithm1_growth': 1.5}),
    'fixed': ('fixed', {}),
}


@dataclass
class Outcomes:
    """Results of one strategy over all reaches.

    The lists have one entry for each solved reach: the guaranteed and the achieved eta, and the share of simulated movements that
    stay clear. `efforts` are by seed.
    """

    statuses: Counter[Status] = field(default_factory=Counter)
    guaranteed: list[float] = field(default_factory=list)
    achieved: list[float] = field(default_factory=list)
    clear: list[float] = field(default_factory=list)
    efforts: dict[int, float] = field(default_factory=dict)

    @property
    def excess(self) -> Array:
        """Share clear at the worst obstacle and step, minus the guaranteed eta."""
        excess: Array = np.array(self.clear) - np.array(self.guaranteed)
        return excess

    def add(self, reach: Any, strategy: str, settings: dict[str, float]) -> None:
        """Solve a reach and simulate the solution."""
        is_fixed = strategy == 'fixed'
        solution = solve(reach.problem, reach.guess, strategy, **({'tau': reach.tau, 'lam': reach.lam} if is_fixed else settings))
        self.statuses[solution.status] += 1
        if solution.status is not Status.SOLVED or solution.eta == 0.0:
            return
        self.guaranteed.append(solution.eta if is_fixed else reach.problem.eta)
        self.achieved.append(solution.eta)
        self.clear.append(monte_carlo(reach.problem, solution.control.T.ravel(), SAMPLES).step[0])
        self.efforts[reach.seed] = solution.effort


def measure() -> dict[str, Outcomes]:
    """Solve all reaches by each strategy and simulate the solutions."""
    measured = {name: Outcomes() for name in STRATEGIES}
    for reach in build_varied():
        for name, (strategy, settings) in STRATEGIES.items():
            measured[name].add(reach, strategy, settings)
    return measured


def format_excess(measured: dict[str, Outcomes]) -> str:
    """Return the table of the distributions of the excess."""
    head = ['strategy', 'rolled out', 'smallest', '5 %', 'median', '95 %', 'largest', 'least share clear − Φ(k)']
    rows = []
    for name, each in measured.items():
        percentiles = [f'{value:.3f}' for value in np.percentile(each.excess, (0, 5, 50, 95, 100))]
        normal = np.array([NormalDist().cdf(k_of_eta(eta)) for eta in each.achieved])
        rows.append([f'`{name}`', str(len(each.clear)), *percentiles, f'{(np.array(each.clear) - normal).min():.4f}'])
    return format_table(head, rows)


def format_statuses(measured: dict[str, Outcomes]) -> str:
    """Return the table of the statuses, and of the effort relative to that of `optimal`."""
    statuses = [status for status in Status if any(each.statuses[status] for each in measured.values())]
    least = measured['optimal'].efforts
    rows = []
    for name, each in measured.items():
        if name != 'fixed':
            ratios = [effort / least[seed] for seed, effort in each.efforts.items()]
            percentiles = [f'{value:.2f}' for value in np.percentile(ratios, (50, 95, 100))]
            rows.append([f'`{name}`', *(str(each.statuses[status]) for status in statuses), *percentiles])
    words = [status.value.replace('_', ' ') for status in statuses]
    return format_table(['strategy', *words, 'effort / `optimal`: median', '95 %', 'largest'], rows)


def draw(measured: dict[str, Outcomes]) -> Figure:
    """Draw the share clear over the guaranteed eta, and the excess of each strategy."""
    with open_figure(9.6, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        _draw_shares(left, measured)
        _draw_excess(right, measured)
    return figure


def _draw_shares(axes: Any, measured: dict[str, Outcomes]) -> None:
    etas = np.linspace(0.0, 0.999, 200)
    for number, name in enumerate(('lv', 'hc', 'optimal')):
        each = measured[name]
        axes.plot(each.guaranteed, each.clear, '.', markersize=4, alpha=0.7, color=get_class_style(number)[0], label=name)
    normal = [NormalDist().cdf(k_of_eta(eta)) for eta in etas]
    axes.plot(etas, normal, color='0.3', linestyle='--', label='Φ(k): a normal constraint')
    axes.plot(etas, etas, color='black', label='η: Cantelli’s bound')
    axes.set(xlim=(0.59, 0.96), ylim=(0.55, 1.01), xlabel='guaranteed η', ylabel='share clear at the worst obstacle and step')
    axes.legend(fontsize=8, loc='lower right')


def _draw_excess(axes: Any, measured: dict[str, Outcomes]) -> None:
    values = [each.excess for each in measured.values()]
    drawn = axes.boxplot(values, orientation='horizontal', whis=(0, 100), widths=0.6, patch_artist=True)
    for number, box in enumerate(drawn['boxes']):
        box.set(facecolor=get_class_style(number)[0], alpha=0.6)
    for median in drawn['medians']:
        median.set(color='black')
    axes.axvline(0.0, color='black')
    axes.set_yticks(range(1, len(measured) + 1), list(measured))
    axes.invert_yaxis()
    axes.set(xlabel='share clear − guaranteed η')
    axes.set_xlim(left=-0.02)
