"""Effort over the wanted eta: curves, jumps and decreases."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from foc_ros.core.types import Array, Status
from foc_ros.reporting.draw import get_class_style, open_figure

from .page import format_table
from .scenes import Scene, build_one_obstacle, build_random

STRATEGIES = ('lv', 'hc', 'optimal')
ETAS = np.linspace(0.5, 0.9, 21)
SCENES = 6
SETTINGS = ((50, 0.05), (50, 0.1), (50, 0.15))
"""Steps N and noise c per step."""
SMALLEST_JUMP = 0.01
"""Relative rise of effort that counts as a jump if it remains after the interval of eta has been halved HALVINGS times."""
HALVINGS = 10
SMALLEST_DECREASE = 2e-3
"""Relative decrease of effort that is counted."""


@dataclass
class Curves:
    """One strategy over the scenes in which it reaches the largest eta: their number, jumps and decreases (both relative)."""

    reached: int = 0
    interrupted: int = 0
    jumps: list[float] = field(default_factory=list)
    decreases: list[float] = field(default_factory=list)

    def add(self, scene: Scene, strategy: str) -> None:
        """Solve a scene for all values of eta, if the largest one can be reached."""
        if scene.solve(ETAS[-1], strategy).status is not Status.SOLVED:
            return
        self.reached += 1
        solutions = [scene.solve(eta, strategy) for eta in ETAS]
        if any(each.status is not Status.SOLVED for each in solutions):
            self.interrupted += 1
            return
        efforts = np.log([each.effort for each in solutions])
        rises = np.diff(efforts)
        if rises.min() < -SMALLEST_DECREASE:
            self.decreases.append(float(-np.expm1(rises.min())))
        i = int(rises.argmax())
        rise = _refine_rise(scene, strategy, (ETAS[i], ETAS[i + 1]), (efforts[i], efforts[i + 1]))
        if rise > SMALLEST_JUMP:
            self.jumps.append(float(np.expm1(rise)))


def _refine_rise(scene: Scene, strategy: str, etas: tuple[float, float], efforts: tuple[float, float]) -> float:
    """Halve an interval of eta repeatedly, keep the half with the larger rise of log effort, and return the last rise."""
    for _ in range(HALVINGS):
        if efforts[1] - efforts[0] < SMALLEST_JUMP:
            break
        middle = (etas[0] + etas[1]) / 2
        effort = float(np.log(scene.solve(middle, strategy).effort))
        if effort - efforts[0] > efforts[1] - effort:
            etas, efforts = (etas[0], middle), (efforts[0], effort)
        else:
            etas, efforts = (middle, etas[1]), (effort, efforts[1])
    return efforts[1] - efforts[0]


def measure() -> dict[tuple[int, float], dict[str, Curves]]:
    """Compute the curves of all strategies in the random scenes of each setting."""
    measured = {setting: {strategy: Curves() for strategy in STRATEGIES} for setting in SETTINGS}
    for (steps, noise), curves in measured.items():
        for seed in range(SCENES):
            for strategy, each in curves.items():
                each.add(build_random(seed, noise, steps), strategy)
    return measured


def format_curves(measured: dict[tuple[int, float], dict[str, Curves]]) -> str:
    """Return the table of jumps and decreases."""
    head = ['N', 'c', 'strategy', 'reach 0.9', 'with a jump', 'median jump', 'largest']
    head += ['with a decrease', 'largest decrease', 'interrupted']
    rows = []
    for (steps, noise), curves in measured.items():
        for strategy, each in curves.items():
            jumps = [f'{100 * value:.0f} %' for value in (np.median(each.jumps), max(each.jumps))] if each.jumps else ['', '']
            decrease = f'{100 * max(each.decreases):.1f} %' if each.decreases else ''
            counts = [str(len(each.jumps)), *jumps, str(len(each.decreases)), decrease, str(each.interrupted)]
            rows.append([str(steps), f'{noise:.3g}', f'`{strategy}`', str(each.reached), *counts])
    return format_table(head, rows)


def draw() -> Figure:
    """Draw the effort over eta for one obstacle with little and with much noise, and for four obstacles."""
    scenes = {
        'one obstacle, c = 0.05': build_one_obstacle(0.05),
        'one obstacle, c = 0.15': build_one_obstacle(0.15),
        'four obstacles, c = 0.10': build_random(12, 0.1),
    }
    etas = np.linspace(0.5, 0.95, 181)
    with open_figure(9.6, 3.6) as figure:
        for axes, (name, scene) in zip(figure.subplots(1, 3), scenes.items(), strict=True):
            efforts = {strategy: _compute_efforts(scene, strategy, etas) for strategy in STRATEGIES}
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


def _compute_efforts(scene: Scene, strategy: str, etas: Array) -> Array:
    """Return the effort at each eta; NaN if eta is unreachable."""
    solutions = [scene.solve(float(eta), strategy) for eta in etas]
    return np.array([each.effort if each.status is Status.SOLVED else np.nan for each in solutions])
