# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The studies of the paper as foc_ros solves them: scenes, solutions of one homotopy class, and ratios of efforts over eta.

1-2: strategies LV and HC side by side; 3-4: the ratio of their efforts over eta; 5-6: the ratio of the efforts of two homotopy
classes; 7: strategy `optimal` beside both, which the paper does not have. All reaches take 1 s, from rest to rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import foc_ros

Array = NDArray[np.float64]
STEPS = 50
EQUAL_M = 1e-6
"""Distances that differ by less than this are equal [m]."""
NOISE, SMALL_NOISE = 0.15, 0.05
"""c of the studies, per step: of all but the fourth, and of the fourth."""
COUNT = 7
PAPER_ETA = 0.9615
PAPER_RATIOS = {5: 0.33, 6: 0.67}
"""The two ratios that the paper gives in numbers, both at PAPER_ETA, by study."""
DELTA = {'lv': 5e-5, 'hc': 1e-4}
"""Steps of tau of the paper's algorithm 1, by strategy [m^2]."""
GROWTHS = (10.0, 1.5)
"""Delta of algorithm 1: as printed, and one that ends near the values of tau and lambda that the paper reports."""
REPORTED = {'LV': (0.0009, 2.28e6), 'HC': (0.0012, 0.9e6)}
"""(tau [m^2], lambda) at eta 0.94 in the paper."""


@dataclass(frozen=True)
class PathClass:
    """A homotopy class, by the largest offset of a path in it to the left of the straight line [m]."""

    name: str
    amplitude: float


@dataclass(frozen=True)
class Scene:
    """A reach from the origin to a goal on the x axis.

    goal_x [m]; circles: x, y, mean and standard deviation of the radius [m] of each obstacle; path_classes: those studied.
    """

    goal_x: float
    circles: tuple[tuple[float, float, float, float], ...]
    path_classes: tuple[PathClass, ...]

    @property
    def obstacles(self) -> list[foc_ros.Circle]:
        """The circles, named by their numbers."""
        return [foc_ros.Circle((x, y), r, radius_stddev=s, name=str(row)) for row, (x, y, r, s) in enumerate(self.circles)]

    def guess(self, path_class: PathClass) -> Array:
        """Return a path in a class, (N + 1, 2) [m]: a minimum-jerk movement on a half wave of a sine."""
        share = np.arange(STEPS + 1) / STEPS
        along = self.goal_x * (10 * share**3 - 15 * share**4 + 6 * share**5)
        return np.column_stack([along, path_class.amplitude * np.sin(np.pi * share)])


STRATEGY_SCENE = Scene(
    0.3,
    ((0.0883, 0.0249, 0.0263, 0.0013), (0.1051, -0.0153, 0.0184, 0.003), (0.0707, -0.0181, 0.0279, 0.0019)),
    (PathClass('left', 0.06),),
)
"""Of studies 1 to 4 and 7. The paper prints no coordinates. This scene was searched for, and shows what the paper shows:
J_LV / J_HC rises through 1 for NOISE and never exceeds it for SMALL_NOISE."""
CLASSES_SCENE = Scene(
    0.3, ((0.0976, -0.0041, 0.0191, 0.0036), (0.1692, -0.1516, 0.035, 0.0028)), (PathClass('H1', 0.06), PathClass('H2', -0.05))
)
"""Of studies 5 and 6: J_H1 / J_H2 is near 1 up to eta 0.9, and at 0.9615 near the paper's for LV and HC."""
STRATEGY_CLASS = STRATEGY_SCENE, STRATEGY_SCENE.path_classes[0]


def count_up(first: float, last: float, step: float) -> set[float]:
    """Return the numbers from the first to the last one."""
    return {float(eta) for eta in np.round(np.arange(first, last + step / 2, step), 6)}


@dataclass(frozen=True)
class Grid:
    """The resolution: etas of the continuous curves, of the stepped ones and of the roll-outs; roll-outs at each eta."""

    fine: tuple[float, ...]
    stepped: tuple[float, ...]
    rolled_out: tuple[float, ...]
    samples: int


FULL = Grid(
    tuple(sorted(count_up(0.7, 0.965, 0.005) | {PAPER_ETA})),
    tuple(sorted(count_up(0.7, 0.96, 0.01) | {0.965, PAPER_ETA})),
    (0.7, 0.8, 0.86, 0.9, 0.93, 0.95, PAPER_ETA),
    20_000,
)
QUICK = Grid((0.7, 0.86, 0.9, 0.95, PAPER_ETA, 0.965), (0.7, 0.86, 0.94), (0.7, 0.9, PAPER_ETA), 4_000)
"""Enough to see the trends."""


@dataclass(frozen=True)
class Method:
    """How a class is solved: noise c per step, strategy, and further parameters where they are not the defaults."""

    noise: float
    strategy: str
    settings: tuple[tuple[str, float], ...] = ()

    def solve(self, scene: Scene, path_class: PathClass, eta: float) -> foc_ros.Solution:
        """Solve a class from its guess, so that no study depends on the order of its solutions. eta is a condition, as there."""
        values: dict[str, Any] = {'foc.steps': STEPS, 'foc.noise_x': self.noise, 'foc.noise_y': self.noise}
        config = foc_ros.Config().with_values(values | {'likelihood.shortfall': np.inf} | dict(self.settings))
        guess = scene.guess(path_class)
        return foc_ros.solve((0.0, 0.0), (scene.goal_x, 0.0), scene.obstacles, eta, self.strategy, config=config, guess=guess)


@dataclass(frozen=True, eq=False)
class EffortCurve:
    """Solutions of one class by one method over wanted etas."""

    name: str
    etas: tuple[float, ...]
    solutions: tuple[foc_ros.Solution, ...]

    @property
    def efforts(self) -> Array:
        """Effort of each solution, NaN where it is not solved [m^2/s^6]."""
        return np.array([each.effort if each.status is foc_ros.Status.SOLVED else np.nan for each in self.solutions])


@dataclass(frozen=True, eq=False)
class RatioCurve:
    """The ratio of two efforts at the same wanted etas."""

    name: str
    numerator: EffortCurve
    denominator: EffortCurve

    @property
    def etas(self) -> Array:
        """Wanted etas."""
        return np.array(self.numerator.etas)

    @property
    def values(self) -> Array:
        """Ratio at each eta, NaN where one of the two is not solved."""
        return self.numerator.efforts / self.denominator.efforts

    def at(self, eta: float) -> float:
        """Return the ratio at an eta of the grid."""
        return float(self.values[self.numerator.etas.index(eta)])


@dataclass(frozen=True, eq=False)
class Study:
    """One study: solutions by eta and name; ratios over eta, the continuous one first; efforts and roll-outs: of study 7."""

    number: int
    title: str
    scene: Scene
    noise: float
    solutions: Mapping[float, Mapping[str, foc_ros.Solution]] = field(default_factory=dict)
    ratios: tuple[RatioCurve, ...] = ()
    efforts: tuple[EffortCurve, ...] = ()
    rolled_out: Mapping[str, Mapping[float, foc_ros.MonteCarlo]] = field(default_factory=dict)


Studies = Mapping[int, Study]
"""All studies by number."""
Compared = Mapping[str, tuple[PathClass, str]]
"""Homotopy class and strategy of each effort in a ratio, by name: numerator, then denominator."""


def compute_studies(grid: Grid = FULL) -> Iterator[Study]:
    """Compute study after study."""
    scene, path_class = STRATEGY_CLASS
    strategies = {'LV': (path_class, 'lv'), 'HC': (path_class, 'hc')}
    for number, etas in ((1, (0.94,)), (2, (0.86, 0.95))):
        yield Study(number, f'strategies LV and HC, c = {NOISE:g}', scene, NOISE, _solve_at(etas, scene, strategies))
    for number, noise in ((3, NOISE), (4, SMALL_NOISE)):
        title = f'effort of LV over that of HC, c = {noise:g}'
        yield Study(number, title, scene, noise, ratios=_compute_ratios(scene, noise, strategies, grid))
    for number, strategy in ((5, 'lv'), (6, 'hc')):
        classes = {each.name: (each, strategy) for each in CLASSES_SCENE.path_classes}
        title = f'two homotopy classes, strategy {strategy.upper()}, c = {NOISE:g}'
        solutions = _solve_at((0.9, 0.965), CLASSES_SCENE, classes)
        yield Study(number, title, CLASSES_SCENE, NOISE, solutions, _compute_ratios(CLASSES_SCENE, NOISE, classes, grid))
    efforts = tuple(
        _solve_curve(name, scene, path_class, Method(NOISE, strategy), grid.fine)
        for name, strategy in (('LV', 'lv'), ('HC', 'hc'), ('optimal', 'optimal'))
    )
    rolled_out = {
        curve.name: {
            eta: foc_ros.monte_carlo(solution, grid.samples)
            for eta, solution in zip(curve.etas, curve.solutions, strict=True)
            if eta in grid.rolled_out and solution.status is foc_ros.Status.SOLVED
        }
        for curve in efforts
    }
    title = f'strategy optimal beside LV and HC, c = {NOISE:g}'
    yield Study(COUNT, title, scene, NOISE, efforts=efforts, rolled_out=rolled_out)


def solve_reported() -> dict[str, foc_ros.Solution]:
    """Solve the scene of study 1 with the tau and lambda that the paper reports."""
    return {
        name: Method(NOISE, 'fixed', (('foc.tau', tau), ('foc.lam', lam))).solve(*STRATEGY_CLASS, 0.94)
        for name, (tau, lam) in REPORTED.items()
    }


def measure_solution(scene: Scene, solution: foc_ros.Solution) -> dict[str, float]:
    """Return the numbers by which solutions are compared, by name.

    clearance: least distance of the mean path from the mean edge of an obstacle [m]; path_length: of the mean path [m];
    largest_stddev: root of the largest sum over the axes of the position's variance [m]; speed_to_obstacles: mean speed up to
    where the mean is nearest to the edge of an obstacle [m/s].
    """
    speed, circles = compute_speed(solution), np.array(scene.circles)
    distance = (np.linalg.norm(solution.path[:, None] - circles[:, :2], axis=-1) - circles[:, 2]).min(axis=1)
    nearest = np.flatnonzero(distance < distance.min() + EQUAL_M)[-1]  # the mean often touches a circle at two steps
    return {
        'effort': solution.effort,
        'eta': solution.eta,
        'tau': solution.tau,
        'lambda': solution.lam,
        'clearance': float(distance.min()),
        'path_length': float(np.linalg.norm(np.diff(solution.path, axis=0), axis=1).sum()),
        'largest_stddev': float(np.sqrt(solution.covariance[:, 0, 0] + solution.covariance[:, 1, 1]).max()),
        'peak_speed': float(speed.max()),
        'speed_to_obstacles': float(speed[: nearest + 1].mean()),
    }


def compute_speed(solution: foc_ros.Solution) -> Array:
    """Return the speed of the mean, (N + 1,) [m/s]."""
    return np.asarray(np.linalg.norm(solution.mean[:, 2:4], axis=1))


def _solve_at(etas: tuple[float, ...], scene: Scene, compared: Compared) -> dict[float, dict[str, foc_ros.Solution]]:
    return {
        eta: {name: _solve(Method(NOISE, strategy), scene, each, eta) for name, (each, strategy) in compared.items()}
        for eta in etas
    }


def _compute_ratios(scene: Scene, noise: float, compared: Compared, grid: Grid) -> tuple[RatioCurve, ...]:
    """Return the ratios of the efforts of two, by the continuous strategies and by the stepping of algorithm 1."""

    def solve_all(label: str, etas: tuple[float, ...], growth: float | None = None) -> RatioCurve:
        curves = []
        for name, (path_class, strategy) in compared.items():
            stepping = (('foc.lv_delta', DELTA[strategy]), ('foc.algorithm1_growth', growth or 0.0))
            method = Method(noise, strategy) if growth is None else Method(noise, 'algorithm1', stepping)
            curves.append(_solve_curve(name, scene, path_class, method, etas))
        return RatioCurve(label, *curves)

    continuous = solve_all('continuous', grid.fine)
    return (continuous, *(solve_all(f'algorithm 1, Δ = {growth:g}', grid.stepped, growth) for growth in GROWTHS))


def _solve_curve(name: str, scene: Scene, path_class: PathClass, method: Method, etas: tuple[float, ...]) -> EffortCurve:
    return EffortCurve(name, etas, tuple(_solve(method, scene, path_class, eta) for eta in etas))


@cache
def _solve(method: Method, scene: Scene, path_class: PathClass, eta: float) -> foc_ros.Solution:
    """Solve once what several studies show."""
    return method.solve(scene, path_class, eta)
