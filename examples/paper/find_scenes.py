#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the two scenes of `studies.py`: the paper gives no coordinates, so they are searched for, with seeds.

python examples/paper/find_scenes.py strategies|classes [--seeds FIRST LAST] [--refine]

For each seed the script takes a random scene (with --refine: the present one) and changes it at random while that lowers its
score: the |log| distances of effort ratios from those of the paper, and penalties for trends that are missing. It prints the end
of each search.

strategies: one class past one to three circles. J_LV / J_HC is below 1 at the first eta and above 1 from 0.94 on, and rises, for
c = 0.15; for c = 0.05 it is never above 1, and below it at the last eta; and at eta 0.94 LV passes slower than HC.
classes: two classes about the same circle, one of them between it and others. J_H1 / J_H2 is 1 up to eta 0.9, for LV and HC; at
0.9615 it is 0.33 for LV and 0.67 for HC; it falls in between; and there the other circles make the second class dearer, because
it is cluttered. For HC the distances count half: the paper stresses LV.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from itertools import product

import numpy as np
from studies import (
    CLASSES_SCENE,
    NOISE,
    PAPER_ETA,
    PAPER_RATIOS,
    SMALL_NOISE,
    STRATEGY_SCENE,
    Array,
    Method,
    PathClass,
    Scene,
    measure_solution,
)

from foc_ros import Status

GOAL_X = 0.3
ETAS = (0.6, 0.7, 0.8, 0.86, 0.9, 0.93, 0.95, PAPER_ETA, 0.965)
STRIDES = np.array([0.012, 0.012, 0.004, 0.0006])
"""Size of a change of x, y, radius and its standard deviation [m], at first."""
LOW, HIGH = np.array([0.04, -0.2, 0.012, 0.001]), np.array([0.24, 0.2, 0.04, 0.005])
ALIKE = 1.25
"""Factor within which two classes should cost the same up to eta 0.9."""
CROWDED = 1.25
"""Factor by which the other circles should make the second class dearer at PAPER_ETA."""
UNSOLVED = 3.0
"""Penalty for an eta at which a ratio is not known."""
PATIENCE = 12
"""Changes in a row that lowered nothing, after which a search ends."""
HOPELESS = 12.0
"""First score above which no search begins."""

Faults = Callable[[Scene], Iterator[float]]


def compute_log_ratio(scene: Scene, eta: float, over: tuple[PathClass, Method], under: tuple[PathClass, Method]) -> float:
    """Return the logarithm of the ratio of two efforts, NaN where one is not solved."""
    efforts = []
    for path_class, method in (over, under):
        solution = method.solve(scene, path_class, eta)
        if solution.status is not Status.SOLVED:
            return np.nan
        efforts.append(solution.effort)
    return float(np.log(efforts[0] / efforts[1]))


def strategies_scene(generator: np.random.Generator) -> Scene:
    """Return a random scene with one class, to the left of most of its circles."""
    n = int(generator.integers(1, 4))
    circles = generator.uniform((0.04, -0.06, 0.015, 0.001), (0.18, 0.04, 0.035, 0.004), (n, 4))
    return _make_scene(circles, (PathClass('left', 0.06),))


def strategies_faults(scene: Scene) -> Iterator[float]:
    """Yield penalties for the trends of studies 1, 3 and 4 that a scene lacks."""
    path_class = scene.path_classes[0]
    found: dict[tuple[float, float], float] = {}
    for noise, eta in product((SMALL_NOISE, NOISE), reversed(ETAS)):
        found[noise, eta] = compute_log_ratio(scene, eta, (path_class, Method(noise, 'lv')), (path_class, Method(noise, 'hc')))
        yield UNSOLVED if np.isnan(found[noise, eta]) else 100 * max(found[noise, eta], 0.0) if noise == SMALL_NOISE else 0.0
    rising, low = (np.array([found[noise, eta] for eta in ETAS]) for noise in (NOISE, SMALL_NOISE))
    if np.isfinite([*rising, *low]).all():
        yield 10 * np.maximum(-np.diff(rising), 0).sum() + 10 * max(rising[0] + 0.02, 0) + max(0.5 - rising[ETAS.index(0.95)], 0)
        yield 10 * max(low[-1] + 0.05, 0) + 2 * np.maximum(np.diff(low), 0).sum()
    solutions = (Method(NOISE, strategy).solve(scene, path_class, 0.94) for strategy in ('lv', 'hc'))
    slow, fast = (measure_solution(scene, each)['speed_to_obstacles'] for each in solutions)
    yield 3 * max(slow / fast - 0.75, 0)


def classes_scene(generator: np.random.Generator) -> Scene:
    """Return a random scene: H1 passes the first circle on the left, H2 on the right, between it and the others."""
    x, y, radius = generator.uniform((0.06, -0.006, 0.015), (0.15, -0.001, 0.03))
    others = []
    for _ in range(int(generator.integers(1, 3))):
        wide, gap, ahead = generator.uniform((0.012, 0.07, -0.05), (0.036, 0.13, 0.08))
        below = np.sqrt(max((radius + wide + gap) ** 2 - ahead**2, 0.0))
        others.append((x + ahead, y - below, wide, generator.uniform(0.001, 0.004)))
    circles = np.array([(x, y, radius, generator.uniform(0.001, 0.004)), *others])
    return _make_scene(circles, (PathClass('H1', 0.06), PathClass('H2', -0.05)))


def classes_faults(scene: Scene) -> Iterator[float]:
    """Yield penalties for the trends of studies 5 and 6 that a scene lacks."""
    first, second = scene.path_classes
    found: dict[tuple[str, float], float] = {}
    for eta, (strategy, number, weight) in product((PAPER_ETA, *ETAS), (('lv', 5, 1.0), ('hc', 6, 0.5))):
        if (strategy, eta) in found:
            continue
        ratio = compute_log_ratio(scene, eta, (first, Method(NOISE, strategy)), (second, Method(NOISE, strategy)))
        found[strategy, eta] = ratio
        if np.isnan(ratio):
            yield UNSOLVED
        elif eta <= 0.9:
            yield weight * abs(ratio) + 10 * max(abs(ratio) - np.log(ALIKE), 0.0)
        elif eta == PAPER_ETA:
            yield 2 * weight * abs(ratio - np.log(PAPER_RATIOS[number]))
    for strategy, weight in (('lv', 1.0), ('hc', 0.5)):
        yield 4 * weight * max(np.log(CROWDED) - compute_crowding(scene, second, Method(NOISE, strategy)), 0.0)
    for strategy in ('lv', 'hc'):
        late = np.array([found[strategy, eta] for eta in ETAS if eta >= 0.9])
        yield 2 * float(np.maximum(np.diff(late), 0).sum()) if np.isfinite(late).all() else 0.0


def compute_crowding(scene: Scene, path_class: PathClass, method: Method) -> float:
    """Return the logarithm of the factor of the circles after the first on the effort of a class at PAPER_ETA; 0 if unsolved."""
    alone = Scene(scene.goal_x, scene.circles[:1], (path_class,))
    efforts = [method.solve(each, path_class, PAPER_ETA) for each in (scene, alone)]
    solved = all(each.status is Status.SOLVED for each in efforts)
    return float(np.log(efforts[0].effort / efforts[1].effort)) if solved else 0.0


def sum_up(faults: Iterable[float], bound: float) -> float:
    """Return the sum, or a partial sum that is beyond a bound."""
    total = 0.0
    for fault in faults:
        total += float(fault)
        if total >= bound:
            break
    return total


def improve(scene: Scene, faults: Faults, generator: np.random.Generator) -> tuple[float, Scene]:
    """Change a scene at random as long as that lowers its score."""
    best, failures = sum_up(faults(scene), HOPELESS), 0
    while failures < PATIENCE and best < HOPELESS:
        stride = STRIDES * 0.88**failures
        changed = _make_scene(
            np.array(scene.circles) + stride * generator.normal(size=(len(scene.circles), 4)), scene.path_classes
        )
        other = sum_up(faults(changed), best)
        best, scene, failures = (other, changed, 0) if other < best else (best, scene, failures + 1)
    return best, scene


def _make_scene(circles: Array, ways: tuple[PathClass, ...]) -> Scene:
    held = np.clip(circles, LOW, HIGH)
    return Scene(GOAL_X, tuple((x, y, radius, stddev) for x, y, radius, stddev in held.round(4).tolist()), ways)


SEARCHES = {
    'strategies': (strategies_scene, strategies_faults, STRATEGY_SCENE),
    'classes': (classes_scene, classes_faults, CLASSES_SCENE),
}

if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Find scenes that show what the paper shows.')
    parser.add_argument('what', choices=sorted(SEARCHES))
    parser.add_argument('--seeds', nargs=2, type=int, default=(0, 40), metavar=('FIRST', 'LAST'))
    parser.add_argument('--refine', action='store_true', help='begin with the present scene')
    arguments = parser.parse_args()
    make, faults, present = SEARCHES[arguments.what]
    for seed in range(*arguments.seeds):
        generator = np.random.default_rng(seed)
        best, scene = improve(present if arguments.refine else make(generator), faults, generator)
        print(f'{best:.3f} seed {seed}: {scene.circles}', flush=True)
