"""Effort over the wanted eta: curves, and how often they jump."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from foc_ros.core.types import Array, Status
from foc_ros.reporting.drawing import class_style, new_figure

from .page import table
from .scenes import Scene, one_obstacle, random_scene

STRATEGIES = ('lv', 'hc', 'optimal')
ETAS = np.linspace(0.5, 0.9, 21)
SCENES = 60
SETTINGS = ((50, 0.05), (50, 0.1), (50, 0.15))
"""Steps N and noise c per step."""
NOTICED = 0.01
"""Relative rise of the effort that is called a jump, where it is left of a rise that was halved HALVINGS times."""
HALVINGS = 10
SLIGHT = 2e-3
"""Relative decrease that counts as one."""


@dataclass
class Curves:
    """One strategy over the scenes that reach the largest eta: how many, jumps [relative] and decreases of each that has one."""

    reached: int = 0
    interrupted: int = 0
    jumps: list[float] = field(default_factory=list)
    falls: list[float] = field(default_factory=list)

    def add(self, scene: Scene, strategy: str) -> None:
        """Follow the effort of a scene from the largest eta down."""
        if scene.solved(ETAS[-1], strategy).status is not Status.SOLVED:
            return
        self.reached += 1
        solutions = [scene.solved(eta, strategy) for eta in ETAS]
        if any(each.status is not Status.SOLVED for each in solutions):
            self.interrupted += 1
            return
        efforts = np.log([each.effort for each in solutions])
        rises = np.diff(efforts)
        if rises.min() < -SLIGHT:
            self.falls.append(float(-np.expm1(rises.min())))
        place = int(rises.argmax())
        left = _left_over(scene, strategy, (ETAS[place], ETAS[place + 1]), (efforts[place], efforts[place + 1]))
        if left > NOTICED:
            self.jumps.append(float(np.expm1(left)))


def _left_over(scene: Scene, strategy: str, etas: tuple[float, float], efforts: tuple[float, float]) -> float:
    """Halve an interval of eta again and again towards the largest rise of log effort in it, and return what is left of it."""
    for _ in range(HALVINGS):
        if efforts[1] - efforts[0] < NOTICED:
            break
        middle = (etas[0] + etas[1]) / 2
        effort = float(np.log(scene.solved(middle, strategy).effort))
        if effort - efforts[0] > efforts[1] - effort:
            etas, efforts = (etas[0], middle), (efforts[0], effort)
        else:
            etas, efforts = (middle, etas[1]), (effort, efforts[1])
    return efforts[1] - efforts[0]


def measure() -> dict[tuple[int, float], dict[str, Curves]]:
    """Follow every strategy over the random scenes of every setting."""
    measured = {setting: {strategy: Curves() for strategy in STRATEGIES} for setting in SETTINGS}
    for (steps, noise), curves in measured.items():
        for seed in range(SCENES):
            for strategy, each in curves.items():
                each.add(random_scene(seed, noise, steps), strategy)
    return measured


def text(measured: dict[tuple[int, float], dict[str, Curves]]) -> str:
    """Return the table of jumps and decreases."""
    head = ['N', 'c', 'strategy', 'reach 0.9', 'with a jump', 'median jump', 'largest', 'cheaper for more', 'by', 'interrupted']
    rows = []
    for (steps, noise), curves in measured.items():
        for strategy, each in curves.items():
            jumps = [f'{100 * value:.0f} %' for value in (np.median(each.jumps), max(each.jumps))] if each.jumps else ['', '']
            fall = f'{100 * max(each.falls):.1f} %' if each.falls else ''
            counts = [str(len(each.jumps)), *jumps, str(len(each.falls)), fall, str(each.interrupted)]
            rows.append([str(steps), f'{noise:.3g}', f'`{strategy}`', str(each.reached), *counts])
    return table(head, rows)


def figure() -> Figure:
    """Draw the effort over eta: one obstacle with little and with much noise, and four obstacles."""
    scenes = {
        'one obstacle, c = 0.05': one_obstacle(0.05),
        'one obstacle, c = 0.15': one_obstacle(0.15),
        'four obstacles, c = 0.10': random_scene(12, 0.1),
    }
    etas = np.linspace(0.5, 0.95, 181)
    with new_figure(9.6, 3.6) as made:
        for axes, (name, scene) in zip(made.subplots(1, 3), scenes.items(), strict=True):
            efforts = {strategy: _efforts(scene, strategy, etas) for strategy in STRATEGIES}
            for number, strategy in enumerate(STRATEGIES):
                relative = efforts[strategy] / efforts['optimal'][0]
                axes.plot(etas, relative, color=class_style(number)[0], label=strategy, linewidth=1.6)
            axes.set(xlabel='wanted η', yscale='log', title=name)
            ticks = (1.0, 1.1, 1.2, 1.3) if axes.get_ylim()[1] < 1.5 else (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0)
            axes.set_yticks([tick for tick in ticks if tick < axes.get_ylim()[1]], minor=False)
            axes.yaxis.set_major_formatter('{x:g}')
            axes.yaxis.set_minor_locator(NullLocator())
        made.axes[0].set_ylabel('effort / least effort at η = 0.5')
        made.axes[0].legend(fontsize=8)
    return made


def _efforts(scene: Scene, strategy: str, etas: Array) -> Array:
    """Return the effort at every eta; NaN where it is out of reach."""
    solutions = [scene.solved(float(eta), strategy) for eta in etas]
    return np.array([each.effort if each.status is Status.SOLVED else np.nan for each in solutions])
