"""What the meaning of eta costs: bound and risk, in classes that are solved and in effort, over random scenes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from foc_ros.core.obstacles.risk import RiskBound, count_events
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.types import Status

from .page import format_table
from .scenes import build_random, solve

ETA = 0.977
SCENES, SAMPLES, STEPS = 8, 2000, 50
NOISES = (0.05, 0.15)
STRATEGIES = ('lv', 'hc', 'optimal')
CHOICES = (('gaussian', 'step'), ('gaussian', 'path'), ('cantelli', 'step'), ('cantelli', 'path'))


@dataclass(frozen=True)
class Outcome:
    """Efforts of the solved scenes by number, the wanted safety factors, and shares of clear roll-outs: step and path."""

    efforts: dict[int, float]
    factors: list[float]
    clear: list[tuple[float, float]]


def measure() -> dict[tuple[float, str, str, str], Outcome]:
    """Solve every scene by every strategy with each noise, bound and risk."""
    return {
        (noise, bound, risk, strategy): _measure_choice(noise, bound, risk, strategy)
        for noise in NOISES
        for bound, risk in CHOICES
        for strategy in STRATEGIES
    }


def _measure_choice(noise: float, bound: str, risk: str, strategy: str) -> Outcome:
    measured = Outcome({}, [], [])
    for number in range(SCENES):
        scene = build_random(number, noise)
        problem = scene.problem(ETA)
        problem = replace(problem, risk=RiskBound(bound, count_events(risk, len(problem.obstacles), STEPS)))
        solution = solve(problem, scene.guess, strategy)
        measured.factors.append(problem.wanted_k)
        if solution.status is Status.SOLVED:
            estimate = monte_carlo(problem, solution.control.T.ravel(), SAMPLES)
            measured.efforts[number] = solution.effort
            measured.clear.append((estimate.step[0], estimate.path[0]))
    return measured


def format_costs(measured: dict[tuple[float, str, str, str], Outcome]) -> str:
    """Return the table; efforts are relative to those of the Gaussian bound for each step, where both are solved."""
    head = ['c', 'bound', 'risk', 'k', *(f'`{name}`: solved | effort' for name in STRATEGIES), 'least share clear: step', 'path']
    head = [cell for each in head for cell in each.split(' | ')]
    rows = []
    for noise in NOISES:
        for bound, risk in CHOICES:
            outcomes = [measured[noise, bound, risk, name] for name in STRATEGIES]
            factors = sorted(outcomes[0].factors)
            span = f'{factors[0]:.2f}' + (f' to {factors[-1]:.2f}' if factors[-1] > factors[0] else '')
            cells = [
                cell
                for name, each in zip(STRATEGIES, outcomes, strict=True)
                for cell in (f'{len(each.efforts)}', _format_ratio(each, measured[noise, *CHOICES[0], name]))
            ]
            clear = np.array([shares for each in outcomes for shares in each.clear]).reshape(-1, 2)
            least = [f'{share:.3f}' for share in clear.min(axis=0)] if len(clear) else ['', '']
            rows.append([f'{noise:g}', bound, risk, span, *cells, *least])
    return format_table(head, rows)


def _format_ratio(outcome: Outcome, base: Outcome) -> str:
    ratios = [effort / base.efforts[number] for number, effort in outcome.efforts.items() if number in base.efforts]
    return f'{np.median(ratios):.2f}' if ratios else ''
