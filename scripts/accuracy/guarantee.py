"""How often what is solved stays clear, against what was promised: how conservative Cantelli's inequality is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from foc_ros.core.obstacles.chance_constraint import k_of_eta
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.types import Array, Status
from foc_ros.reporting.drawing import class_style, new_figure

from .page import table
from .scenes import feasible_reaches, solved

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
class Measured:
    """One strategy over all reaches: statuses; of the solved ones promised eta, achieved eta, share clear, effort by seed."""

    statuses: Counter[Status] = field(default_factory=Counter)
    promised: list[float] = field(default_factory=list)
    achieved: list[float] = field(default_factory=list)
    clear: list[float] = field(default_factory=list)
    efforts: dict[int, float] = field(default_factory=dict)

    @property
    def excess(self) -> Array:
        """Share clear at the worst obstacle and step, less the eta that was promised."""
        excess: Array = np.array(self.clear) - np.array(self.promised)
        return excess


def measure() -> dict[str, Measured]:
    """Solve the reaches by every strategy and roll each solution out."""
    measured = {name: Measured() for name in STRATEGIES}
    for made in feasible_reaches():
        for name, (strategy, settings) in STRATEGIES.items():
            _add(measured[name], made, strategy, settings)
    return measured


def _add(measured: Measured, made: Any, strategy: str, settings: dict[str, float]) -> None:
    fixed = strategy == 'fixed'
    solution = solved(made.problem, made.guess, strategy, **({'tau': made.tau, 'lam': made.lam} if fixed else settings))
    measured.statuses[solution.status] += 1
    if solution.status is not Status.SOLVED or solution.eta == 0.0:
        return
    measured.promised.append(solution.eta if fixed else made.problem.eta)
    measured.achieved.append(solution.eta)
    measured.clear.append(monte_carlo(made.problem, solution.control.T.ravel(), SAMPLES).step[0])
    measured.efforts[made.seed] = solution.effort


def text(measured: dict[str, Measured]) -> str:
    """Return the table of the distributions."""
    head = ['strategy', 'rolled out', 'smallest', '5 %', 'median', '95 %', 'largest', 'least share clear − Φ(k)']
    rows = []
    for name, each in measured.items():
        spread = [f'{value:.3f}' for value in np.percentile(each.excess, (0, 5, 50, 95, 100))]
        normal = np.array([NormalDist().cdf(k_of_eta(eta)) for eta in each.achieved])
        rows.append([f'`{name}`', str(len(each.clear)), *spread, f'{(np.array(each.clear) - normal).min():.4f}'])
    return table(head, rows)


def outcomes(measured: dict[str, Measured]) -> str:
    """Return the table of how the strategies ended, and what they needed beside `optimal`."""
    statuses = [status for status in Status if any(each.statuses[status] for each in measured.values())]
    best = measured['optimal'].efforts
    rows = []
    for name, each in measured.items():
        if name != 'fixed':
            ratios = [effort / best[seed] for seed, effort in each.efforts.items()]
            spread = [f'{value:.2f}' for value in np.percentile(ratios, (50, 95, 100))]
            rows.append([f'`{name}`', *(str(each.statuses[status]) for status in statuses), *spread])
    ratio = 'effort / `optimal`: '
    return table(
        ['strategy', *(status.value.replace('_', ' ') for status in statuses), ratio + 'median', '95 %', 'largest'], rows
    )


def figure(measured: dict[str, Measured]) -> Figure:
    """Draw the share clear over the promised eta, and how far it is above it by strategy."""
    with new_figure(9.6, 4.2) as made:
        left, right = made.subplots(1, 2)
        _draw_shares(left, measured)
        _draw_excess(right, measured)
    return made


def _draw_shares(axes: Any, measured: dict[str, Measured]) -> None:
    etas = np.linspace(0.0, 0.999, 200)
    for number, name in enumerate(('lv', 'hc', 'optimal')):
        each = measured[name]
        axes.plot(each.promised, each.clear, '.', markersize=4, alpha=0.7, color=class_style(number)[0], label=name)
    axes.plot(
        etas, [NormalDist().cdf(k_of_eta(eta)) for eta in etas], color='0.3', linestyle='--', label='Φ(k): a normal constraint'
    )
    axes.plot(etas, etas, color='black', label='η: Cantelli’s bound')
    axes.set(xlim=(0.59, 0.96), ylim=(0.55, 1.01), xlabel='promised η', ylabel='share clear at the worst obstacle and step')
    axes.legend(fontsize=8, loc='lower right')


def _draw_excess(axes: Any, measured: dict[str, Measured]) -> None:
    values: Sequence[Array] = [each.excess for each in measured.values()]
    drawn = axes.boxplot(values, orientation='horizontal', whis=(0, 100), widths=0.6, patch_artist=True)
    for number, box in enumerate(drawn['boxes']):
        box.set(facecolor=class_style(number)[0], alpha=0.6)
    for median in drawn['medians']:
        median.set(color='black')
    axes.axvline(0.0, color='black')
    axes.set_yticks(range(1, len(measured) + 1), list(measured))
    axes.invert_yaxis()
    axes.set(xlabel='share clear − promised η')
    axes.set_xlim(left=-0.02)
