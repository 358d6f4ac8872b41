"""What every study computes; nothing here is drawn or written.

1-2: strategies LV and HC side by side; 3-4: the ratio of their efforts over eta; 5-6: the ratio of the efforts of two ways round;
7: strategy `optimal` beside both, which the paper does not have.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from foc_ros.core.ocp.monte_carlo import MonteCarlo, monte_carlo
from foc_ros.core.types import Array, Solution, Status

from .reaching import Method, PaperScene, PathClass, solve_class
from .scenes import NOISE, SMALL_NOISE, STRATEGY_SCENE, WAYS_SCENE

PAPER_ETA = 0.9615
PAPER_RATIOS = {5: 0.33, 6: 0.67}
"""The two ratios that the paper gives in numbers, both at PAPER_ETA, by study."""
LV_DELTA, HC_DELTA = 5e-5, 1e-4
"""Steps of tau of the paper's algorithm 1, of its strategies [m^2]."""
PRINTED_GROWTH, GENTLE_GROWTH = 10.0, 1.5
"""Delta of algorithm 1: as printed, and one that ends near the values of tau and lambda that the paper reports."""
REPORTED = {'LV': (0.0009, 2.28e6), 'HC': (0.0012, 0.9e6)}
"""(tau [m^2], lambda) at eta 0.94 in the paper."""


@dataclass(frozen=True)
class Grid:
    """How finely is looked: etas of the continuous curves, of the stepped ones, of the roll-outs; roll-outs per point."""

    fine: tuple[float, ...]
    stepped: tuple[float, ...]
    rolled: tuple[float, ...]
    samples: int


def _range(first: float, last: float, step: float) -> tuple[float, ...]:
    return tuple(float(eta) for eta in np.round(np.arange(first, last + step / 2, step), 6))


FULL = Grid(
    tuple(sorted({*_range(0.7, 0.965, 0.005), PAPER_ETA})),
    tuple(sorted({*_range(0.7, 0.96, 0.01), 0.965, PAPER_ETA})),
    (0.7, 0.8, 0.86, 0.9, 0.93, 0.95, PAPER_ETA),
    20_000,
)
QUICK = Grid(
    (0.7, 0.8, 0.86, 0.9, 0.93, 0.95, PAPER_ETA, 0.965),
    (0.7, 0.86, 0.94),
    (0.7, 0.9, PAPER_ETA),
    4_000,
)
"""Enough to see the trends."""


@dataclass(frozen=True, eq=False)
class EffortCurve:
    """Solutions of one way by one method over wanted etas."""

    name: str
    etas: tuple[float, ...]
    solutions: tuple[Solution, ...]

    @property
    def efforts(self) -> Array:
        """Effort of each, NaN where it is not solved [m^2/s^6]."""
        return np.array([each.effort if each.status is Status.SOLVED else np.nan for each in self.solutions])


@dataclass(frozen=True, eq=False)
class RatioCurve:
    """Efforts of one over those of another, at the same wanted etas."""

    name: str
    over: EffortCurve
    under: EffortCurve

    @property
    def etas(self) -> Array:
        """Wanted etas."""
        return np.array(self.over.etas)

    @property
    def values(self) -> Array:
        """Ratio at each eta, NaN where one of the two is not solved."""
        return self.over.efforts / self.under.efforts

    def at(self, eta: float) -> float:
        """Return the ratio at an eta of the grid."""
        return float(self.values[self.over.etas.index(eta)])


@dataclass(frozen=True, eq=False)
class Study:
    """One of studies 1 to 6: solutions to be shown, by eta and name; ratios over eta, the continuous one first."""

    number: int
    title: str
    scene: PaperScene
    noise: float
    shown: dict[float, dict[str, Solution]]
    ratios: tuple[RatioCurve, ...] = ()


@dataclass(frozen=True, eq=False)
class OptimalStudy:
    """Study 7: efforts over eta of `optimal`, LV and HC, and roll-outs of each by name at some of the etas."""

    scene: PaperScene
    noise: float
    efforts: tuple[EffortCurve, ...]
    rolled: dict[str, dict[float, MonteCarlo]]


@dataclass(frozen=True, eq=False)
class Studies:
    """Everything that was computed; reported: the paper's own tau and lambda, tried in study 1's scene."""

    paper: tuple[Study, ...]
    optimal: OptimalStudy
    reported: dict[str, Solution]

    def __getitem__(self, number: int) -> Study:
        return self.paper[number - 1]


def studies(grid: Grid = FULL) -> Iterator[Study | OptimalStudy]:
    """Compute study after study."""
    yield _strategies_shown(1, f'strategies LV and HC, c = {NOISE:g}', (0.94,))
    yield _strategies_shown(2, f'strategies LV and HC, c = {NOISE:g}', (0.86, 0.95))
    yield _strategies_compared(3, NOISE, grid)
    yield _strategies_compared(4, SMALL_NOISE, grid)
    yield _ways_compared(5, 'LV', 'lv', LV_DELTA, grid)
    yield _ways_compared(6, 'HC', 'hc', HC_DELTA, grid)
    yield _optimal_beside(grid)


COUNT = 7


def collect_studies(computed: Iterable[Study | OptimalStudy]) -> Studies:
    """Return all studies together."""
    each = list(computed)
    paper = tuple(one for one in each if isinstance(one, Study))
    last = next(one for one in each if isinstance(one, OptimalStudy))
    return Studies(paper, last, _reported())


def _strategies_shown(number: int, title: str, etas: tuple[float, ...]) -> Study:
    scene = STRATEGY_SCENE
    methods = {'LV': Method(NOISE, 'lv'), 'HC': Method(NOISE, 'hc')}
    shown = {eta: {name: solve_class(scene, scene.ways[0], method, eta) for name, method in methods.items()} for eta in etas}
    return Study(number, title, scene, NOISE, shown)


def _strategies_compared(number: int, noise: float, grid: Grid) -> Study:
    scene, way = STRATEGY_SCENE, STRATEGY_SCENE.ways[0]
    continuous = RatioCurve(
        'continuous',
        _curve('LV', scene, way, Method(noise, 'lv'), grid.fine),
        _curve('HC', scene, way, Method(noise, 'hc'), grid.fine),
    )
    stepped = [
        RatioCurve(
            _stepped_name(growth),
            _curve('LV', scene, way, _stepping(noise, LV_DELTA, growth), grid.stepped),
            _curve('HC', scene, way, _stepping(noise, HC_DELTA, growth), grid.stepped),
        )
        for growth in (PRINTED_GROWTH, GENTLE_GROWTH)
    ]
    return Study(number, f'effort of LV over that of HC, c = {noise:g}', scene, noise, {}, (continuous, *stepped))


def _ways_compared(number: int, name: str, strategy: str, delta: float, grid: Grid) -> Study:
    scene = WAYS_SCENE
    methods = {
        'continuous': (Method(NOISE, strategy), grid.fine),
        **{_stepped_name(growth): (_stepping(NOISE, delta, growth), grid.stepped) for growth in (PRINTED_GROWTH, GENTLE_GROWTH)},
    }
    shown = {eta: {way.name: solve_class(scene, way, Method(NOISE, strategy), eta) for way in scene.ways} for eta in (0.9, 0.965)}
    ratios = tuple(
        RatioCurve(label, *(_curve(way.name, scene, way, method, etas) for way in scene.ways))
        for label, (method, etas) in methods.items()
    )
    return Study(number, f'two ways round, strategy {name}, c = {NOISE:g}', scene, NOISE, shown, ratios)


def _optimal_beside(grid: Grid) -> OptimalStudy:
    scene, way = STRATEGY_SCENE, STRATEGY_SCENE.ways[0]
    methods = {name: Method(NOISE, strategy) for name, strategy in (('LV', 'lv'), ('HC', 'hc'), ('optimal', 'optimal'))}
    efforts = tuple(_curve(name, scene, way, method, grid.fine) for name, method in methods.items())
    rolled: dict[str, dict[float, MonteCarlo]] = {}
    for curve in efforts:
        found = {eta: each for eta, each in zip(curve.etas, curve.solutions, strict=True) if each.status is Status.SOLVED}
        rolled[curve.name] = {
            eta: monte_carlo(scene.problem(NOISE, eta), found[eta].control.T.ravel(), grid.samples)
            for eta in grid.rolled
            if eta in found
        }
    return OptimalStudy(scene, NOISE, efforts, rolled)


def _reported() -> dict[str, Solution]:
    scene, way = STRATEGY_SCENE, STRATEGY_SCENE.ways[0]
    return {
        name: solve_class(scene, way, Method(NOISE, 'fixed', (('tau', tau), ('lam', lam))), 0.94)
        for name, (tau, lam) in REPORTED.items()
    }


def _curve(name: str, scene: PaperScene, way: PathClass, method: Method, etas: tuple[float, ...]) -> EffortCurve:
    return EffortCurve(name, etas, tuple(solve_class(scene, way, method, eta) for eta in etas))


def _stepping(noise: float, delta: float, growth: float) -> Method:
    return Method(noise, 'algorithm1', (('algorithm1_delta', delta), ('algorithm1_growth', growth)))


def _stepped_name(growth: float) -> str:
    return f'algorithm 1, Δ = {growth:g}'
