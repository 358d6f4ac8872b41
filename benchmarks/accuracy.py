#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measure what doc/accuracy.md reports, on the scenes of the tests, and renew its figures and its blocks of numbers.

python benchmarks/accuracy.py [PART ...], with PART of reference, guarantee, bounds, curves. All of it takes an hour or two.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from foc_ros.core.obstacles.risk import RiskBound, count_events, k_of_eta
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.solution import Status
from foc_ros.core.types import Array
from foc_ros.reporting.draw import get_class_style, open_figure, save_figure

sys.path.append(str(Path(__file__).resolve().parents[1] / 'test'))
sys.path.append(str(Path(__file__).resolve().parents[1] / 'scripts'))

import reach_helpers  # type: ignore[import-not-found]
import varied_reaches  # type: ignore[import-not-found]
from page import IMAGES, ROOT, format_table, write_blocks

PAGE = ROOT / 'doc' / 'accuracy.md'
SAMPLES, REACHES, STEPS = 2000, 200, 50
SETTINGS: dict[str, dict[str, float]] = {
    **{name: {} for name in ('lv', 'hc', 'optimal', 'algorithm1, Δ = 10')},
    'algorithm1, Δ = 1.5': {'algorithm1_growth': 1.5},
    'fixed': {},
}
"""Parameters of the strategies; words after a comma tell two apart."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A reach in 1 s: its problem as a function of the wanted eta, and a guess (N + 1, 2) [m] from which it is solved."""

    problem: Callable[[float], Problem]
    guess: Array


def build_one_obstacle(noise: float) -> Scene:
    """Return a reach of 0.3 m past one obstacle near the straight line, with a radius of 30 mm ± 3 mm."""
    guess = reach_helpers.bowed((0, 0), (0.3, 0), STEPS, 0.05)
    return Scene(lambda eta: reach_helpers.one_obstacle(eta, (noise, noise), steps=STEPS), guess)


def build_random(seed: int, noise: float) -> Scene:
    """Return a reach of 0.28 to 0.45 m among one to four random obstacles."""
    obstacles, goal, amplitude = reach_helpers.random_scene(np.random.default_rng(seed))
    given = {'goal': goal, 'steps': STEPS, 'noise': (noise, noise)}
    guess = reach_helpers.bowed((0, 0), goal, STEPS, amplitude)
    return Scene(lambda eta: reach_helpers.reach(obstacles, eta=eta, **given), guess)


def format_agreement(name: str) -> str:
    """Return the table of relative differences of effort (for `fixed` among shapes: of cost) in test/reference_NAME.json."""
    has_shapes, rows = name == 'shapes', []
    head = ['obstacles', 'η', '`fixed` / IPOPT − 1'] if has_shapes else ['obstacles', 'c', 'η', '`fixed` / quadprog − 1']
    cases = json.loads((ROOT / 'test' / f'reference_{name}.json').read_text(encoding='utf-8'))
    for number, case in enumerate(cases):
        problem, guess = reach_helpers.case_problem(case), reach_helpers.case_guess(case)
        reference, least = case['fixed' if has_shapes else 'converged_qp'], case['min_effort_at_eta']
        fixed = reach_helpers.solved(problem, guess, 'fixed', tau=reference['tau'], lam=reference['lam'])
        optimal = reach_helpers.solved(problem, guess, 'optimal')
        if has_shapes:
            ratio = (fixed.costs['effort'] + fixed.costs['lambda_variance']) / reference['cost']
            cells = [', '.join(each['kind'] for each in case['obstacles'])]
        else:
            ratio = fixed.effort / reference['effort']
            cells = [str(len(problem.obstacles)), f'{problem.noise[0]:g}']
        differences = f'{ratio - 1:.0e}', f'{optimal.effort / least["ipopt_effort"] - 1:.1e}', f'{optimal.eta:.5f}'
        rows.append([str(number), *cells, f'{least["eta"]:g}', *differences])
    return format_table(['case', *head, '`optimal` / IPOPT − 1', 'η achieved'], rows)


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
        given = {'tau': reach.tau, 'lam': reach.lam} if is_fixed else settings
        solution = reach_helpers.solved(reach.problem, reach.guess, strategy, **given)
        self.statuses[solution.status] += 1
        if solution.status is not Status.SOLVED or solution.eta == 0.0:
            return
        self.guaranteed.append(solution.eta if is_fixed else reach.problem.eta)
        self.achieved.append(solution.eta)
        self.clear.append(monte_carlo(reach.problem, solution.control.T.ravel(), SAMPLES).step[0])
        self.efforts[reach.seed] = solution.effort


def measure_guarantee() -> dict[str, Outcomes]:
    """Solve all reaches by each strategy and simulate the solutions."""
    measured = {name: Outcomes() for name in SETTINGS}
    for reach in varied_reaches.feasible_reaches(REACHES, tries=3 * REACHES):
        for name, settings in SETTINGS.items():
            measured[name].add(reach, name.partition(',')[0], settings)
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


def draw_guarantee(measured: dict[str, Outcomes]) -> Figure:
    """Draw the share clear over the guaranteed eta, and the excess of each strategy."""
    etas = np.linspace(0.0, 0.999, 200)
    with open_figure(9.6, 4.2) as figure:
        shares, excess = figure.subplots(1, 2)
        for number, name in enumerate(STRATEGIES):
            look = {'markersize': 4, 'alpha': 0.7, 'color': get_class_style(number)[0], 'label': name}
            shares.plot(measured[name].guaranteed, measured[name].clear, '.', **look)
        normal = [NormalDist().cdf(k_of_eta(eta)) for eta in etas]
        shares.plot(etas, normal, color='0.3', linestyle='--', label='Φ(k): a normal constraint')
        shares.plot(etas, etas, color='black', label='η: Cantelli’s bound')
        shares.set(xlim=(0.59, 0.96), ylim=(0.55, 1.01), xlabel='guaranteed η')
        shares.set_ylabel('share clear at the worst obstacle and step')
        shares.legend(fontsize=8, loc='lower right')
        values = [each.excess for each in measured.values()]
        drawn = excess.boxplot(values, orientation='horizontal', whis=(0, 100), widths=0.6, patch_artist=True)
        for number, (box, median) in enumerate(zip(drawn['boxes'], drawn['medians'], strict=True)):
            box.set(facecolor=get_class_style(number)[0], alpha=0.6)
            median.set(color='black')
        excess.axvline(0.0, color='black')
        excess.set_yticks(range(1, len(measured) + 1), list(measured))
        excess.invert_yaxis()
        excess.set(xlabel='share clear − guaranteed η')
        excess.set_xlim(left=-0.02)
    return figure


ETA, SCENES = 0.977, 8
NOISES = (0.05, 0.15)
STRATEGIES = ('lv', 'hc', 'optimal')
CHOICES = (('gaussian', 'step'), ('gaussian', 'path'), ('cantelli', 'step'), ('cantelli', 'path'))


@dataclass(frozen=True)
class Choice:
    """Efforts of the solved scenes by number, the wanted safety factors, and shares of clear roll-outs: step and path."""

    efforts: dict[int, float]
    factors: list[float]
    clear: list[tuple[float, float]]


def measure_bounds() -> dict[tuple[float, str, str, str], Choice]:
    """Solve every scene by every strategy with each noise, bound and risk."""
    each = ((noise, *choice, strategy) for noise, choice, strategy in product(NOISES, CHOICES, STRATEGIES))
    return {given: _measure_choice(*given) for given in each}


def _measure_choice(noise: float, bound: str, risk: str, strategy: str) -> Choice:
    measured = Choice({}, [], [])
    for number in range(SCENES):
        scene = build_random(number, noise)
        problem = scene.problem(ETA)
        problem = replace(problem, risk=RiskBound(bound, count_events(risk, len(problem.obstacles), STEPS)))
        solution = reach_helpers.solved(problem, scene.guess, strategy)
        measured.factors.append(problem.wanted_k)
        if solution.status is Status.SOLVED:
            estimate = monte_carlo(problem, solution.control.T.ravel(), SAMPLES)
            measured.efforts[number] = solution.effort
            measured.clear.append((estimate.step[0], estimate.path[0]))
    return measured


def format_costs(measured: dict[tuple[float, str, str, str], Choice]) -> str:
    """Return the table; efforts are relative to those of the Gaussian bound for each step, where both are solved."""
    head = ['c', 'bound', 'risk', 'k', *(f'`{name}`: solved | effort' for name in STRATEGIES), 'least share clear: step', 'path']
    head = [cell for each in head for cell in each.split(' | ')]
    rows = []
    for noise, (bound, risk) in product(NOISES, CHOICES):
        outcomes = [measured[noise, bound, risk, name] for name in STRATEGIES]
        factors = sorted(outcomes[0].factors)
        cells = [f'{noise:g}', bound, risk, f'{factors[0]:.2f}' + (f' to {factors[-1]:.2f}' if factors[-1] > factors[0] else '')]
        for name, each in zip(STRATEGIES, outcomes, strict=True):
            cells += [f'{len(each.efforts)}', _format_ratio(each, measured[noise, *CHOICES[0], name])]
        clear = np.array([shares for each in outcomes for shares in each.clear]).reshape(-1, 2)
        rows.append([*cells, *([f'{share:.3f}' for share in clear.min(axis=0)] if len(clear) else ['', ''])])
    return format_table(head, rows)


def _format_ratio(outcome: Choice, base: Choice) -> str:
    ratios = [effort / base.efforts[number] for number, effort in outcome.efforts.items() if number in base.efforts]
    return f'{np.median(ratios):.2f}' if ratios else ''


def draw_curves() -> Figure:
    """Draw effort over the wanted eta in three scenes."""
    scenes = {
        'one obstacle, c = 0.05': build_one_obstacle(0.05),
        'one obstacle, c = 0.15': build_one_obstacle(0.15),
        'four obstacles, c = 0.10': build_random(12, 0.1),
    }
    etas = np.linspace(0.5, 0.95, 181)
    with open_figure(9.6, 3.6) as figure:
        for axes, (name, scene) in zip(figure.subplots(1, 3), scenes.items(), strict=True):
            efforts = {}
            for strategy in STRATEGIES:
                solutions = [reach_helpers.solved(scene.problem(eta), scene.guess, strategy) for eta in etas.tolist()]
                efforts[strategy] = np.array([each.effort if each.status is Status.SOLVED else np.nan for each in solutions])
            for number, strategy in enumerate(STRATEGIES):
                relative = efforts[strategy] / efforts['optimal'][0]
                axes.plot(etas, relative, color=get_class_style(number)[0], label=strategy, linewidth=1.6)
            axes.set(xlabel='wanted η', yscale='log', title=name)
            ticks = (1.0, 1.1, 1.2, 1.3) if axes.get_ylim()[1] < 1.5 else (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0)
            axes.set_yticks([tick for tick in ticks if tick < axes.get_ylim()[1]], minor=False)
            axes.yaxis.set_major_formatter('{x:g}')
            axes.yaxis.set_minor_locator(NullLocator())
        figure.axes[0].set_ylabel('effort / least effort at η = 0.5')
        figure.axes[0].legend(fontsize=8)
    return figure


def measure_clear() -> dict[str, str]:
    """Return what solved movements keep, and how solves end."""
    outcomes = measure_guarantee()
    save_figure(draw_guarantee(outcomes), IMAGES / 'guarantee.png')
    return {'guarantee': format_excess(outcomes), 'outcomes': format_statuses(outcomes)}


def measure_curves() -> dict[str, str]:
    """Draw effort over eta."""
    save_figure(draw_curves(), IMAGES / 'effort_over_eta.png')
    return {}


PARTS: dict[str, Callable[[], dict[str, str]]] = {
    'reference': lambda: {'reference': format_agreement('cases'), 'shapes': format_agreement('shapes')},
    'guarantee': measure_clear,
    'bounds': lambda: {'bounds': format_costs(measure_bounds())},
    'curves': measure_curves,
}


def main() -> None:
    """Measure one part after the other, and write its figure and its blocks."""
    parser = argparse.ArgumentParser(description='Measure what doc/accuracy.md reports.')
    parser.add_argument('parts', nargs='*', metavar='PART', help=f'some of {", ".join(PARTS)}; all if none is named')
    chosen = parser.parse_args().parts or list(PARTS)
    if unknown := set(chosen) - set(PARTS):
        parser.error(f'no part is named {", ".join(sorted(unknown))}')
    for name in chosen:
        write_blocks(PARTS[name](), PAGE)


if __name__ == '__main__':
    main()
