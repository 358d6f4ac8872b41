"""Whole predictions of several classes, warm, against one IPOPT solve or against each other."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from measure import median_ms, replaced
from results import Result, Target, at_least, at_most
from scenes import Reach, with_far
from scenes import tick_4x8 as four_classes
from scenes import tick_8x16 as eight_classes

from foc_ros.core import predictor
from foc_ros.core.candidates import solve_candidates
from foc_ros.core.config import FocConfig
from foc_ros.core.memory import Memory
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.warm_start import cold_start
from foc_ros.core.predictor import predict
from foc_ros.core.types import Candidate, PredictedCandidate

from .ticking import Ticking, alternating

WARM_TOLERANCE = 1e-4
"""Largest distance between warm and cold paths [m]: k is found to 1e-5, and where effort is high a path moves more than that."""


def tick_4x8(quick: bool) -> Result:
    """Measure 4 classes among 8 obstacles."""
    return _against_ipopt('tick_4x8', four_classes(), '4 classes, 8 obstacles', at_least(50.0), quick)


def tick_8x16(quick: bool) -> Result:
    """Measure 8 classes among 16 obstacles."""
    return _against_ipopt('tick_8x16', eight_classes(), '8 classes, 16 obstacles', at_least(40.0), quick)


def _against_ipopt(name: str, reach: Reach, what: str, target: Target, quick: bool) -> Result:
    from peers.ipopt import best_ipopt

    repetitions, ticking = (2 if quick else 8), Ticking(reach)
    candidate, problem = _asked(reach)
    peer = best_ipopt(problem, candidate.guess[1:])
    start = peer.start(candidate.guess[1:])
    converged, effort, _ = peer.solve(start)
    ticks, solves = [], []
    for _ in range(repetitions):
        ticks += [ticking.tick() for _ in range(4)]
        began = time.perf_counter()
        peer.solve(start)
        solves.append(time.perf_counter() - began)
    least = solve_problem(problem, cold_start(candidate.guess), FocConfig(strategy='optimal')).effort
    apart = ticking.far_from_cold()
    ours_ms, peer_ms = median_ms(ticks), median_ms(solves)
    return Result(
        name,
        f'a warm tick, {what}',
        'one IPOPT solve of the most likely class, un-linearised, built beforehand',
        ours_ms,
        peer_ms,
        peer_ms / ours_ms,
        'peer / ours',
        converged and abs(least / effort - 1) < 0.02 and apart < WARM_TOLERANCE,
        f"strategy optimal in that class: effort {100 * (least / effort - 1):+.4f} % of IPOPT's (2 % allowed); "
        f'warm and cold paths {apart:.1e} m apart ({WARM_TOLERANCE:g} allowed)',
        repetitions,
        target,
        {'classes_solved': ticking.classes(), 'slowest_ms': 1e3 * max(ticks), 'ipopt_iterations': peer.iterations},
    )


def _asked(reach: Reach) -> tuple[Candidate, Problem]:
    """Return the most likely class of the first tick and the problem that the predictor solves for it."""
    asked: dict[str, Problem] = {}

    def listening(candidates: Sequence[Candidate], problems: Sequence[Problem], *rest: Any) -> list[PredictedCandidate]:
        asked.update({each.label: problem for each, problem in zip(candidates, problems, strict=True)})
        return solve_candidates(candidates, problems, *rest)

    with replaced(predictor, 'solve_candidates', listening):
        prediction, _ = predict(reach.config, reach.hands[0], reach.obstacles, reach.goals, Memory())
    candidate = prediction.solved_candidates[0].candidate
    return candidate, asked[candidate.label]


def far_obstacles(quick: bool) -> Result:
    """Measure what 248 obstacles far from every way cost."""
    near = four_classes()
    far = Reach(near.config, with_far(near.obstacles, 248, 5), near.goals, near.hands)
    uncut = far.changed({'scene.max_obstacles': 4096})
    tickings = {'near': Ticking(near), 'far': Ticking(far), 'uncut': Ticking(uncut)}
    times = alternating(tickings, 5 if quick else 60)
    near_ms, far_ms, uncut_ms = (median_ms(times[name]) for name in tickings)
    apart = _apart(tickings['near'], tickings['far'])
    return Result(
        'far_obstacles',
        'a warm tick, 8 near and 248 far obstacles',
        'the same with the 8 near ones alone',
        far_ms,
        near_ms,
        far_ms / near_ms,
        'ours / peer',
        apart < WARM_TOLERANCE,
        f'paths {apart:.1e} m apart ({WARM_TOLERANCE:g} allowed)',
        len(times['near']),
        at_most(1.5),
        {'ratio_without_scene.max_obstacles': uncut_ms / near_ms},
    )


def steps_200(quick: bool) -> Result:
    """Measure what four times as many steps cost."""
    coarse = four_classes()
    tickings = {'coarse': Ticking(coarse), 'fine': Ticking(coarse.changed({'foc.steps': 200}))}
    times = alternating(tickings, 2 if quick else 30)
    coarse_ms, fine_ms = median_ms(times['coarse']), median_ms(times['fine'])
    best = [tickings[name].predictions[-1].solved_candidates[0].solution.path for name in tickings]
    apart = float(np.abs(best[0] - best[1][::4]).max())
    return Result(
        'steps_200',
        'a warm tick, N = 200',
        'the same, N = 50',
        fine_ms,
        coarse_ms,
        fine_ms / coarse_ms,
        'ours / peer',
        apart < 5e-3,
        f'most likely paths {1e3 * apart:.2g} mm apart (5 mm allowed: the obstacles are looked at four times as often)',
        len(times['fine']),
        at_most(5.0),
        {'classes_solved': tickings['fine'].classes()},
    )


def _apart(one: Ticking, other: Ticking) -> float:
    """Return how far the paths of two last predictions are apart [m], class by class in the order of their likelihoods."""
    pairs = zip(one.predictions[-1].solved_candidates, other.predictions[-1].solved_candidates, strict=True)
    return max(float(np.abs(a.solution.path - b.solution.path).max()) for a, b in pairs)
