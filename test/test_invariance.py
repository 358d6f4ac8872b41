# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The answer does not depend on what is no part of the problem: mirror, frame, order, duplicates, units."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, random_scene, reach, solved

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, Shape, collect_obstacles
from foc_ros.core.solution import Solution, Status

STRATEGIES = pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])
KINDS = pytest.mark.parametrize('kind', ['circles', 'shapes'])
TOLERANCES = {'circles': (1e-3, 5e-4), 'shapes': (2e-2, 4e-3)}
"""Relative difference of the effort and distance of paths [m] that the samples of the curves of `lv` and `hc` leave open."""
COUNTS = {'lv': 2, 'hc': 2, 'optimal': 5}
"""Scenes of each kind: `lv` and `hc` take many times as long."""
Scene = tuple[Obstacles, np.ndarray, np.ndarray]


def random_shapes(generator: np.random.Generator) -> list[Shape]:
    """Return one to three shapes of all kinds near the straight way."""
    made: list[Shape] = []
    for _ in range(generator.integers(1, 4)):
        centre = np.array([generator.uniform(0.09, 0.21), generator.uniform(-0.06, 0.06)])
        rest = {'radius': generator.uniform(0.008, 0.02), 'radius_stddev': generator.uniform(0.001, 0.003)}
        half = generator.uniform(-0.03, 0.03, 2)
        kinds = [
            lambda at=centre, rest=rest: Circle(at, **rest),
            lambda at=centre, rest=rest: Box(at, generator.uniform(0.01, 0.06, 2), generator.uniform(-3, 3), **rest),
            lambda at=centre, rest=rest, half=half: Capsule(at - half, at + half, **rest),
            lambda at=centre, rest=rest: Hull(at + generator.uniform(-0.03, 0.03, (5, 2)), **rest),
        ]
        made.append(kinds[generator.integers(4)]())
    return made


def make_scene(kind: str, seed: int) -> Scene:
    """Return obstacles, a goal and a guess."""
    generator = np.random.default_rng(seed)
    if kind == 'circles':
        obstacles, goal, amplitude = random_scene(generator)
    else:
        amplitude = float(generator.choice([-1, 1]) * generator.uniform(0.07, 0.13))
        obstacles, goal = collect_obstacles(random_shapes(generator)), np.array([0.3, 0.0])
    return obstacles, goal, bowed((0, 0), goal, 40, amplitude)


def solve(obstacles: Obstacles, goal, guess, strategy: str, duration=1.0, start=(0.0, 0.0), eta=0.8, **units) -> Solution:
    problem = reach(obstacles, goal=goal, start=start, steps=40, duration=duration, noise=(0.1, 0.1), eta=eta)
    return solved(problem, guess, strategy, **units)


def find_well_posed(kind: str, strategy: str) -> Iterator[tuple[int, Scene, Solution]]:
    """Yield seed, scene and solution of scenes in which rounding decides nothing.

    eta is reached with something to spare, and it does not lie in a gap of what the curve of solutions reaches: where the
    touching step changes, k jumps, and the solution beyond the jump exceeds eta.
    """
    found = 0
    for seed in range(100):
        made = make_scene(kind, seed)
        if solve(*made, strategy, eta=0.87).status is not Status.SOLVED:
            continue
        solution = solve(*made, strategy)
        assert solution.status is Status.SOLVED
        if solution.lam <= 1.0 or solution.eta < 0.8 + 1e-4:
            yield seed, made, solution
            found += 1
        if found == COUNTS[strategy]:
            return
    raise AssertionError(f'only {found} scenes are well posed')


def same(kind: str, first: Solution, second: Solution, moved=lambda path: path, unit: float = 1.0) -> None:
    """The second solution is the first one moved, with an effort in another unit."""
    effort, path = TOLERANCES[kind]
    assert second.status is Status.SOLVED
    assert second.effort == pytest.approx(first.effort * unit, rel=effort)
    assert np.abs(second.path - moved(first.path)).max() < path


def transform(obstacles: Obstacles, turn: np.ndarray, shift: float = 0.0) -> Obstacles:
    """Return obstacles turned or mirrored; of a mirrored polygon the order of the vertices turns round."""
    vertices = obstacles.vertices @ turn.T
    if np.linalg.det(turn) < 0.0:
        for row, corners in enumerate(obstacles.corners):
            vertices[row, :corners] = vertices[row, :corners][::-1].copy()
    return replace(obstacles, centre=obstacles.centre @ turn.T + shift, velocity=obstacles.velocity @ turn.T, vertices=vertices)


@STRATEGIES
@KINDS
def test_mirror_quarter_turns_shift_order_and_duplicates_do_not_matter(kind, strategy):
    """Only quarter turns: the model's noise acts along two axes, c_x|u_x| and c_y|u_y|, and has no covariance in between."""
    for seed, (obstacles, goal, guess), first in find_well_posed(kind, strategy):
        generator = np.random.default_rng(seed)
        mirror, shift = np.diag([1.0, generator.choice([-1.0, 1.0])]), generator.uniform(-5, 5)
        turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), int(generator.integers(1, 4))) @ mirror
        there, start = transform(obstacles, turn, shift), np.full(2, shift)
        second = solve(there, goal @ turn.T + shift, guess @ turn.T + shift, strategy, start=start)
        same(kind, first, second, lambda path, turn=turn, shift=shift: path @ turn.T + shift)
        rows = generator.permutation(np.tile(np.arange(len(obstacles)), 2)).tolist()
        same(kind, first, solve(obstacles.take(rows), goal, guess, strategy))


@STRATEGIES
def test_units_of_length_and_time_do_not_matter(strategy):
    """Lengths times a unit: tau and effort times its square. Times: jerk by its -3rd power, effort and lambda by its -6th."""
    for seed, (obstacles, goal, guess), first in find_well_posed('circles', strategy):
        length, duration = [(0.01, 10.0), (0.1, 0.1), (10.0, 3.0), (100.0, 0.5)][seed % 4]
        lengths = {name: getattr(obstacles, name) * length for name in ('centre', 'radius', 'radius_stddev')}
        deltas = {'lv_delta': 5e-5 * length**2, 'hc_delta': 1e-4 * length**2}
        longer = solve(replace(obstacles, **lengths), goal * length, guess * length, strategy, **deltas)
        same('circles', first, replace(longer, mean=longer.mean / length), unit=length**2)
        slower = solve(obstacles, goal, guess, strategy, duration=duration, lam=duration**-6.0)
        same('circles', first, slower, unit=duration**-6.0)
