"""Shares of a tick: how much of its time PIQP and the search take."""

from __future__ import annotations

from typing import Any

import piqp
from measurement import (
    COST,
    GAIN,
    Agreement,
    Result,
    Stopwatch,
    Target,
    Timing,
    at_least,
    at_most,
    compute_median_ms,
    replace_attribute,
    time_calls,
)
from scenes import Reach, add_far_obstacles, build_4x8

from foc_ros.core import predictor
from foc_ros.core.ocp import backend

from .tick_sequence import TickSequence


def measure_piqp(is_quick: bool) -> Result:
    """Measure the time inside PIQP's setup and solve over that of the whole tick."""
    sequence, stopwatch = TickSequence(build_4x8()), Stopwatch()
    inside, whole = [], []
    with replace_attribute(backend, 'piqp', _TimedPiqp(stopwatch)):
        for _ in range(4 if is_quick else 60):
            sequence.prepare()
            stopwatch.seconds = 0.0
            whole.append(sequence.tick())
            inside.append(stopwatch.seconds)
    distance = sequence.compute_distance_to_cold()
    return Result(
        Timing('a warm tick, 4 classes, 8 obstacles', compute_median_ms(whole)),
        Timing('setup and solve of PIQP within it', compute_median_ms(inside)),
        GAIN,
        Agreement(distance < 1e-4, f'warm and cold paths differ by {distance:.1e} m (1e-4 allowed)'),
        len(whole),
        at_least(0.25),
    )


class _TimedPiqp:
    """Module `piqp` with a stopwatch around setup and solve."""

    PIQP_SOLVED = piqp.PIQP_SOLVED

    def __init__(self, stopwatch: Stopwatch) -> None:
        self.stopwatch = stopwatch

    def DenseSolver(self) -> Any:  # noqa: N802  PIQP's own name
        return _TimedSolver(self.stopwatch)


class _TimedSolver:
    def __init__(self, stopwatch: Stopwatch) -> None:
        self.solver = piqp.DenseSolver()
        self.setup, self.solve = stopwatch.wrap(self.solver.setup), stopwatch.wrap(self.solver.solve)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.solver, name)


def measure_search_of_8(is_quick: bool) -> Result:
    """Compare the class search among 8 obstacles with the solves that follow it."""
    return _measure_search(build_4x8(), '8 obstacles', at_most(0.1), is_quick)


def measure_search_of_300(is_quick: bool) -> Result:
    """Compare the class search among 300 obstacles, none of which is left out, with the solves that follow it."""
    crowd = add_far_obstacles(build_4x8(), 292, 7, nearest=0.25).change_config({'scene.max_obstacles': 4096})
    return _measure_search(crowd, '300 obstacles', at_most(0.2), is_quick)


def _measure_search(reach: Reach, scene: str, target: Target, is_quick: bool) -> Result:
    sequence, searches, solves = TickSequence(reach), [], []
    with time_calls(predictor, 'search') as search, time_calls(predictor, 'solve_candidates') as solve:
        for _ in range(3 if is_quick else 40):
            sequence.prepare()
            search.seconds = solve.seconds = 0.0
            sequence.tick()
            searches.append(search.seconds)
            solves.append(solve.seconds)
    is_complete = all(each.candidates and 'search_cut' not in each.notes for each in sequence.predictions)
    agreement = Agreement(
        is_complete,
        'every search found classes within its limits'
        if is_complete
        else 'a search found no class or ended at one of its limits',
    )
    return Result(
        Timing(f'the search of a warm tick, {scene}, 4 classes', compute_median_ms(searches)),
        Timing('the solves that follow it', compute_median_ms(solves)),
        COST,
        agreement,
        len(searches),
        target,
        {'classes_solved': sequence.describe_classes()},
    )
