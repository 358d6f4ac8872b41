"""Where the time of a tick goes: shares, measured inside of it."""

from __future__ import annotations

from typing import Any

import piqp
from measure import Stopwatch, median_ms, replaced, watched
from results import Result, Target, at_least, at_most
from scenes import Reach, clusters, tick_4x8, with_far

from foc_ros.core import predictor
from foc_ros.core.ocp import backend

from .ticking import Ticking


def piqp_share(quick: bool) -> Result:
    """Measure the time inside PIQP's setup and solve over that of the whole tick."""
    ticking, watch = Ticking(tick_4x8()), Stopwatch()
    inside, whole = [], []
    with replaced(backend, 'piqp', _Watched(watch)):
        for _ in range(4 if quick else 60):
            ticking.prepare()
            watch.seconds = 0.0
            whole.append(ticking.tick())
            inside.append(watch.seconds)
    apart = ticking.far_from_cold()
    ours_ms, inside_ms = median_ms(whole), median_ms(inside)
    return Result(
        'piqp_share',
        'a warm tick, 4 classes, 8 obstacles',
        "PIQP's setup and solve within it",
        ours_ms,
        inside_ms,
        inside_ms / ours_ms,
        'peer / ours',
        apart < 1e-4,
        f'warm and cold paths {apart:.1e} m apart (1e-4 allowed)',
        len(whole),
        at_least(0.25),
    )


class _Watched:
    """PIQP with a stopwatch around setup and solve."""

    PIQP_SOLVED = piqp.PIQP_SOLVED

    def __init__(self, watch: Stopwatch) -> None:
        self.watch = watch

    def DenseSolver(self) -> Any:  # noqa: N802  PIQP's own name
        return _WatchedSolver(self.watch)


class _WatchedSolver:
    def __init__(self, watch: Stopwatch) -> None:
        self.solver = piqp.DenseSolver()
        self.setup, self.solve = watch.around(self.solver.setup), watch.around(self.solver.solve)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.solver, name)


def search_8(quick: bool) -> Result:
    """Measure the search for ways round over the solves that follow it, 8 obstacles."""
    return _search('search_8', tick_4x8(), '8 obstacles', at_most(0.1), quick)


def search_300(quick: bool) -> Result:
    """Measure the same with 300 obstacles, of which none is left out."""
    near = tick_4x8()
    crowd = Reach(near.config, with_far(clusters((3, 2, 3)), 292, 7, nearest=0.25), near.goals, near.hands)
    return _search('search_300', crowd.changed({'scene.max_obstacles': 4096}), '300 obstacles', at_most(0.2), quick)


def _search(name: str, reach: Reach, what: str, target: Target, quick: bool) -> Result:
    ticking, searches, solves = Ticking(reach), [], []
    with watched(predictor, 'search') as search, watched(predictor, 'solve_candidates') as solve:
        for _ in range(3 if quick else 40):
            ticking.prepare()
            search.seconds = solve.seconds = 0.0
            ticking.tick()
            searches.append(search.seconds)
            solves.append(solve.seconds)
    ours_ms, peer_ms = median_ms(searches), median_ms(solves)
    complete = all(each.candidates and 'search_cut' not in each.notes for each in ticking.predictions)
    return Result(
        name,
        f'the search of a warm tick, {what}, 4 classes',
        'the solves that follow it',
        ours_ms,
        peer_ms,
        ours_ms / peer_ms,
        'ours / peer',
        complete,
        'every search ended before its bound and found ways' if complete else 'a search found nothing or ended at its bound',
        len(searches),
        target,
        {'classes_solved': ticking.classes()},
    )
