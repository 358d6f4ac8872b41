"""One class with three obstacles, from the guess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measure import interleaved, median_ms
from results import Result, Target, at_least
from scenes import guess_left, one_class

from foc_ros.core.config import FocConfig
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import ReachingQP, clearance_qp, effort_cost
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.warm_start import cold_start, warm_start
from foc_ros.core.ocp.working_set import WorkingSet, solve
from foc_ros.core.types import Solution, Status

GUESS = guess_left()
DELTA, GROWTH, XI = 5e-5, 1.5, 1.0
LV = FocConfig(strategy='lv', lv_delta=DELTA, growth=GROWTH)
OPTIMAL = FocConfig(strategy='optimal')
GAIN = 'peer / ours'


def _solved(settings: FocConfig, problem: Problem | None = None) -> Solution:
    """Solve from the guess, the problem built anew: what it caches counts."""
    return solve_problem(one_class() if problem is None else problem, cold_start(GUESS), settings)


def cold_vs_naive_piqp(quick: bool) -> Result:
    """Compare with the literal stepping loop on full dense PIQP."""
    return _against_naive('cold_vs_naive_piqp', 'piqp', at_least(40.0), quick)


def naive_daqp(quick: bool) -> Result:
    """Compare with the same loop on DAQP, for the record."""
    return _against_naive('cold_vs_naive_daqp', 'daqp', None, quick)


def _against_naive(name: str, solver: str, target: Target | None, quick: bool) -> Result:
    from peers.naive import stepping

    repetitions = 3 if quick else 25
    problem = one_class()
    tasks = {
        'ours': lambda: _solved(LV),
        'peer': lambda: stepping(one_class(), GUESS[1:], solver, DELTA, GROWTH, XI),
    }
    times = interleaved(tasks, repetitions)
    stepped, ours = stepping(problem, GUESS[1:], solver, DELTA, GROWTH, XI), _solved(LV)
    if stepped is None:
        raise RuntimeError(f'{solver} has no answer')
    same = _solved(replace(LV, strategy='fixed', tau=stepped.tau, lam=stepped.lam))
    apart = float(np.abs(same.path[1:] - stepped.positions).max())
    close = ours.status is Status.SOLVED and apart < 1e-4 and ours.effort <= stepped.effort * (1 + 1e-4)
    return Result(
        name,
        'lv, Delta 1.5, from the guess',
        f'algorithm 1 stepping by Delta 1.5, each QP full and dense by {solver}',
        *_medians(times),
        GAIN,
        close,
        f'at the tau and lambda where the loop ends: paths {apart:.1e} m apart (1e-4 allowed); effort {ours.effort:.0f}, '
        f'of the loop, which overshoots, {stepped.effort:.0f}',
        repetitions,
        target,
        {'qps_ours': ours.qp_solves, 'qps_peer': stepped.qps},
    )


def cold_vs_ipopt(quick: bool) -> Result:
    """Compare strategy optimal with IPOPT on the problem as it is."""
    from peers.ipopt import best_ipopt

    repetitions = 2 if quick else 15
    peer = best_ipopt(one_class(), GUESS[1:])
    start = peer.start(GUESS[1:])
    times = interleaved({'ours': lambda: _solved(OPTIMAL), 'peer': lambda: peer.solve(start)}, repetitions)
    converged, effort, _ = peer.solve(start)
    ours = _solved(OPTIMAL)
    excess = ours.effort / effort - 1
    return Result(
        'cold_vs_ipopt',
        'optimal, from the guess',
        'IPOPT on the un-linearised problem, built beforehand',
        *_medians(times),
        GAIN,
        converged and ours.status is Status.SOLVED and abs(excess) < 0.02,
        f"effort {100 * excess:+.4f} % of IPOPT's (2 % allowed)",
        repetitions,
        at_least(60.0),
        {'qps_ours': ours.qp_solves, 'ipopt_iterations': peer.iterations},
    )


def warm_vs_cold(quick: bool) -> Result:
    """Measure the next tick at 100 Hz of the same class against the same one from the guess."""
    repetitions = 4 if quick else 40
    before = _solved(LV)
    moved = one_class(initial_mean=np.concatenate((before.mean[0, :2] + 1e-4, [0.01, 0.004], np.zeros(2))))

    def next_tick() -> Solution:
        problem = replace(moved)
        return solve_problem(problem, warm_start(before, problem), LV)

    times = interleaved({'ours': next_tick, 'peer': lambda: _solved(LV, replace(moved))}, repetitions)
    warmed, fresh = next_tick(), _solved(LV, moved)
    apart = float(np.abs(warmed.path - fresh.path).max())
    return Result(
        'warm_vs_cold',
        'lv, from the solution of 10 ms ago',
        'lv, from the guess',
        *_medians(times),
        GAIN,
        apart < 1e-5,
        f'paths {apart:.1e} m apart (1e-5 allowed: k is found to 1e-5), efforts {warmed.effort:.0f} and {fresh.effort:.0f}',
        repetitions,
        at_least(4.0),
        {'qps_warm': warmed.qp_solves, 'qps_cold': fresh.qp_solves},
    )


def cvxpy_qp(quick: bool) -> Result:
    """Compare one QP, at the guess, with CVXPY, for the record."""
    from peers.cvxpy_qp import CvxpyQP

    repetitions, problem = (3 if quick else 25), one_class()

    def qp() -> ReachingQP:
        return clearance_qp(problem, effort_cost(problem, 1e3), GUESS[1:], 1e-4)

    peer = CvxpyQP(qp())
    times = interleaved({'ours': lambda: solve(qp(), WorkingSet()), 'peer': lambda: peer.solve(qp())}, repetitions)
    answer = solve(qp(), WorkingSet())
    if answer is None:
        raise RuntimeError('the QP at the guess is infeasible')
    apart = float(np.abs(problem.positions(answer.control) - problem.positions(peer.solve(qp()))).max())
    return Result(
        'one_qp_vs_cvxpy',
        'one QP at the guess, built and solved',
        'CVXPY with parameters and Clarabel, compiled beforehand',
        *_medians(times),
        GAIN,
        apart < 1e-6,
        f'positions {apart:.1e} m apart (1e-6 allowed)',
        repetitions,
    )


def annealing(quick: bool) -> Result:
    """Compare with simulated annealing over via points, for the record."""
    from peers.annealing import Annealing

    repetitions, iterations = (1, 100) if quick else (3, 1000)
    peer = Annealing(one_class(), GUESS[1:])
    times = interleaved({'ours': lambda: _solved(OPTIMAL), 'peer': lambda: peer.solve(iterations, 1)}, repetitions)
    effort, share, _ = peer.solve(iterations, 1)
    ours = _solved(OPTIMAL)
    return Result(
        'cold_vs_annealing',
        'optimal, from the guess',
        f'dual_annealing over two via points, {iterations} iterations',
        *_medians(times),
        GAIN,
        ours.status is Status.SOLVED and (share < 1 - 1e-6 or effort > 0.999 * ours.effort),
        f'it found {effort / ours.effort:.2f} times our effort at {share:.3f} of the wanted k (nothing better than ours allowed)',
        repetitions,
    )


def _medians(times: dict[str, list[float]]) -> tuple[float, float, float]:
    """Return ours, the peer's [ms], and their ratio."""
    ours, peer = median_ms(times['ours']), median_ms(times['peer'])
    return ours, peer, peer / ours
