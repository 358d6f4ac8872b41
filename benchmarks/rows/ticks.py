"""Whole predictions of several classes, warm, compared with one IPOPT solve or with each other."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from measurement import COST, GAIN, Agreement, Result, Target, Timing, at_least, at_most, compute_median_ms, replace_attribute
from scenes import Reach, add_far_obstacles, build_4x8, build_8x16

from foc_ros.core import predictor
from foc_ros.core.candidates import solve_candidates
from foc_ros.core.config import FocConfig
from foc_ros.core.memory.memory import Memory
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.predictor import predict
from foc_ros.core.types import Candidate, PredictedCandidate

from .tick_sequence import TickSequence, time_ticks_in_turn

WARM_TOLERANCE = 1e-4
"""Largest distance between warm and cold paths [m]. k is found to 1e-5, but at a high effort a path moves by more."""


def measure_4_classes(is_quick: bool) -> Result:
    """Compare a tick of 4 classes among 8 obstacles with IPOPT."""
    return _measure_against_ipopt(build_4x8(), '4 classes, 8 obstacles', at_least(50.0), is_quick)


def measure_8_classes(is_quick: bool) -> Result:
    """Compare a tick of 8 classes among 16 obstacles with IPOPT."""
    return _measure_against_ipopt(build_8x16(), '8 classes, 16 obstacles', at_least(40.0), is_quick)


def _measure_against_ipopt(reach: Reach, scene: str, target: Target, is_quick: bool) -> Result:
    from peers.ipopt import build_fastest_ipopt

    repetitions, sequence = (2 if is_quick else 8), TickSequence(reach)
    candidate, problem = _find_most_likely(reach)
    peer = build_fastest_ipopt(problem, candidate.guess[1:])
    start = peer.build_start(candidate.guess[1:])
    converged, effort, _ = peer.solve(start)
    ticks, solves = [], []
    for _ in range(repetitions):
        ticks += [sequence.tick() for _ in range(4)]
        began = time.perf_counter()
        peer.solve(start)
        solves.append(time.perf_counter() - began)
    excess = solve_problem(problem, cold_start(candidate.guess), FocConfig(strategy='optimal')).effort / effort - 1
    distance = sequence.compute_distance_to_cold()
    agreement = Agreement(
        converged and abs(excess) < 0.02 and distance < WARM_TOLERANCE,
        f'effort of strategy optimal in that class differs by {100 * excess:+.4f} % from that of IPOPT (2 % allowed); '
        f'warm and cold paths differ by {distance:.1e} m ({WARM_TOLERANCE:g} allowed)',
    )
    details = {
        'classes_solved': sequence.describe_classes(),
        'slowest_ms': 1e3 * max(ticks),
        'ipopt_iterations': peer.iterations,
    }
    return Result(
        Timing(f'a warm tick, {scene}', compute_median_ms(ticks)),
        Timing('one IPOPT solve of the most likely class, un-linearised, built beforehand', compute_median_ms(solves)),
        GAIN,
        agreement,
        repetitions,
        target,
        details,
    )


def _find_most_likely(reach: Reach) -> tuple[Candidate, Problem]:
    """Return the most likely candidate of the first tick and the problem that the predictor solves for it."""
    solved: dict[str, Problem] = {}

    def solve_and_record(candidates: Sequence[Candidate], problems: Sequence[Problem], *rest: Any) -> list[PredictedCandidate]:
        solved.update({each.label: problem for each, problem in zip(candidates, problems, strict=True)})
        return solve_candidates(candidates, problems, *rest)

    with replace_attribute(predictor, 'solve_candidates', solve_and_record):
        prediction, _ = predict(reach.config, reach.hands[0], reach.obstacles, reach.goals, Memory())
    candidate = prediction.solved_candidates[0].candidate
    return candidate, solved[candidate.label]


def measure_far_obstacles(is_quick: bool) -> Result:
    """Measure the cost of 248 obstacles that are far from every class."""
    near = build_4x8()
    far = add_far_obstacles(near, 248, 5)
    sequences = {
        'near': TickSequence(near),
        'far': TickSequence(far),
        'unlimited': TickSequence(far.change_config({'scene.max_obstacles': 4096})),
    }
    times = time_ticks_in_turn(sequences, 5 if is_quick else 60)
    near_ms, far_ms, unlimited_ms = (compute_median_ms(times[name]) for name in sequences)
    pairs = zip(*(sequences[name].predictions[-1].solved_candidates for name in ('near', 'far')), strict=True)
    distance = max(float(np.abs(one.solution.path - other.solution.path).max()) for one, other in pairs)
    return Result(
        Timing('a warm tick, 8 near and 248 far obstacles', far_ms),
        Timing('the same with the 8 near ones alone', near_ms),
        COST,
        Agreement(distance < WARM_TOLERANCE, f'paths differ by {distance:.1e} m ({WARM_TOLERANCE:g} allowed)'),
        len(times['near']),
        at_most(1.5),
        {'ratio_without_scene.max_obstacles': unlimited_ms / near_ms},
    )


def measure_200_steps(is_quick: bool) -> Result:
    """Measure the cost of four times as many steps."""
    coarse = build_4x8()
    sequences = {'coarse': TickSequence(coarse), 'fine': TickSequence(coarse.change_config({'foc.steps': 200}))}
    times = time_ticks_in_turn(sequences, 2 if is_quick else 30)
    paths = [sequence.predictions[-1].solved_candidates[0].solution.path for sequence in sequences.values()]
    distance = float(np.abs(paths[0] - paths[1][::4]).max())
    agreement = Agreement(
        distance < 5e-3,
        f'the most likely paths differ by {1e3 * distance:.2g} mm (5 mm allowed, as obstacles are checked four times as often)',
    )
    return Result(
        Timing('a warm tick, N = 200', compute_median_ms(times['fine'])),
        Timing('the same, N = 50', compute_median_ms(times['coarse'])),
        COST,
        agreement,
        len(times['fine']),
        at_most(5.0),
        {'classes_solved': sequences['fine'].describe_classes()},
    )
