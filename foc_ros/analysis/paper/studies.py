"""The computations of every study, without drawing or writing.

1-2: strategies LV and HC side by side; 3-4: the ratio of their efforts over eta; 5-6: the ratio of the efforts of two homotopy
classes; 7: strategy `optimal` beside both, which the paper does not have.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.ocp.monte_carlo import MonteCarlo, monte_carlo
from foc_ros.core.types import Array, Solution, Status

from .reaching import Method, PaperScene, PathClass, solve_class
from .scenes import CLASSES_SCENE, NOISE, SMALL_NOISE, STRATEGY_SCENE

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
Compared = dict[str, tuple[PathClass, str]]
"""Homotopy class and strategy of each effort in a ratio, by name: numerator, then denominator."""
STRATEGY_CLASS = STRATEGY_SCENE, STRATEGY_SCENE.path_classes[0]
"""Scene and homotopy class in which strategies are compared."""


def _range(first: float, last: float, step: float) -> tuple[float, ...]:
    return tuple(float(eta) for eta in np.round(np.arange(first, last + step / 2, step), 6))


@dataclass(frozen=True)
class Grid:
    """The resolution: etas of the continuous curves, of the stepped ones and of the roll-outs; roll-outs at each eta."""

    fine: tuple[float, ...]
    stepped: tuple[float, ...]
    rolled_out: tuple[float, ...]
    samples: int


FULL = Grid(
    tuple(sorted({*_range(0.7, 0.965, 0.005), PAPER_ETA})),
    tuple(sorted({*_range(0.7, 0.96, 0.01), 0.965, PAPER_ETA})),
    (0.7, 0.8, 0.86, 0.9, 0.93, 0.95, PAPER_ETA),
    20_000,
)
QUICK = Grid((0.7, 0.8, 0.86, 0.9, 0.93, 0.95, PAPER_ETA, 0.965), (0.7, 0.86, 0.94), (0.7, 0.9, PAPER_ETA), 4_000)
"""Enough to see the trends."""


@dataclass(frozen=True, eq=False)
class EffortCurve:
    """Solutions of one class by one method over wanted etas."""

    name: str
    etas: tuple[float, ...]
    solutions: tuple[Solution, ...]

    @property
    def efforts(self) -> Array:
        """Effort of each solution, NaN where it is not solved [m^2/s^6]."""
        return np.array([each.effort if each.status is Status.SOLVED else np.nan for each in self.solutions])


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
    """One study: solutions by eta and name; ratios over eta, the continuous one first.

    efforts over eta, and roll-outs by name at some of the etas: of study 7.
    """

    number: int
    title: str
    scene: PaperScene
    noise: float
    solutions: dict[float, dict[str, Solution]] = field(default_factory=dict)
    ratios: tuple[RatioCurve, ...] = ()
    efforts: tuple[EffortCurve, ...] = ()
    rolled_out: dict[str, dict[float, MonteCarlo]] = field(default_factory=dict)


Studies = dict[int, Study]
"""All studies by number."""


def compute_studies(grid: Grid = FULL) -> Iterator[Study]:
    """Compute study after study."""
    scene, path_class = STRATEGY_CLASS
    strategies = {'LV': (path_class, 'lv'), 'HC': (path_class, 'hc')}
    for number, etas in ((1, (0.94,)), (2, (0.86, 0.95))):
        yield Study(number, f'strategies LV and HC, c = {NOISE:g}', scene, NOISE, _solve_at(etas, scene, NOISE, strategies))
    for number, noise in ((3, NOISE), (4, SMALL_NOISE)):
        title = f'effort of LV over that of HC, c = {noise:g}'
        yield Study(number, title, scene, noise, ratios=_compute_ratios(scene, noise, strategies, grid))
    for number, strategy in ((5, 'lv'), (6, 'hc')):
        classes = {each.name: (each, strategy) for each in CLASSES_SCENE.path_classes}
        title = f'two homotopy classes, strategy {strategy.upper()}, c = {NOISE:g}'
        solutions = _solve_at((0.9, 0.965), CLASSES_SCENE, NOISE, classes)
        yield Study(number, title, CLASSES_SCENE, NOISE, solutions, _compute_ratios(CLASSES_SCENE, NOISE, classes, grid))
    yield _compare_optimal(grid)


def solve_reported() -> dict[str, Solution]:
    """Solve the scene of study 1 with the tau and lambda that the paper reports."""
    return {
        name: solve_class(*STRATEGY_CLASS, Method(NOISE, 'fixed', (('tau', tau), ('lam', lam))), 0.94)
        for name, (tau, lam) in REPORTED.items()
    }


def _solve_at(etas: tuple[float, ...], scene: PaperScene, noise: float, compared: Compared) -> dict[float, dict[str, Solution]]:
    return {
        eta: {name: solve_class(scene, each, Method(noise, strategy), eta) for name, (each, strategy) in compared.items()}
        for eta in etas
    }


def _compute_ratios(scene: PaperScene, noise: float, compared: Compared, grid: Grid) -> tuple[RatioCurve, ...]:
    """Return the ratios of the efforts of two, by the continuous strategies and by stepping."""
    methods = {name: _make_methods(strategy, noise, grid) for name, (_, strategy) in compared.items()}
    return tuple(
        RatioCurve(label, *(_solve_curve(name, scene, compared[name][0], *methods[name][label]) for name in compared))
        for label in next(iter(methods.values()))
    )


def _compare_optimal(grid: Grid) -> Study:
    efforts = tuple(
        _solve_curve(name, *STRATEGY_CLASS, Method(NOISE, strategy), grid.fine)
        for name, strategy in (('LV', 'lv'), ('HC', 'hc'), ('optimal', 'optimal'))
    )
    rolled_out = {
        curve.name: {
            eta: monte_carlo(STRATEGY_SCENE.make_problem(NOISE, eta), solution.control.T.ravel(), grid.samples)
            for eta, solution in zip(curve.etas, curve.solutions, strict=True)
            if eta in grid.rolled_out and solution.status is Status.SOLVED
        }
        for curve in efforts
    }
    title = f'strategy optimal beside LV and HC, c = {NOISE:g}'
    return Study(7, title, STRATEGY_SCENE, NOISE, efforts=efforts, rolled_out=rolled_out)


def _make_methods(strategy: str, noise: float, grid: Grid) -> dict[str, tuple[Method, tuple[float, ...]]]:
    """Return the continuous strategy and its stepping by algorithm 1, with the etas of each, by name."""
    delta = ('algorithm1_delta', DELTA[strategy])
    return {'continuous': (Method(noise, strategy), grid.fine)} | {
        f'algorithm 1, Δ = {growth:g}': (Method(noise, 'algorithm1', (delta, ('algorithm1_growth', growth))), grid.stepped)
        for growth in GROWTHS
    }


def _solve_curve(name: str, scene: PaperScene, path_class: PathClass, method: Method, etas: tuple[float, ...]) -> EffortCurve:
    return EffortCurve(name, etas, tuple(solve_class(scene, path_class, method, eta) for eta in etas))
