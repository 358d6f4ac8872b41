"""One homotopy class with three obstacles, solved from the initial guess or from the solution of the previous tick."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from measurement import GAIN, Agreement, Result, Target, Timing, at_least, compute_median_ms, time_in_turn
from scenes import build_guess, build_problem

from foc_ros.core.config import FocConfig
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import ReachingQP, clearance_qp, effort_cost
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start, warm_start
from foc_ros.core.ocp.working_set import WorkingSet, solve
from foc_ros.core.types import Solution, Status

GUESS = build_guess()
DELTA, GROWTH, XI = 5e-5, 1.5, 1.0
LV = FocConfig(strategy='lv', lv_delta=DELTA, growth=GROWTH)
OPTIMAL = FocConfig(strategy='optimal')


def _solve_cold(settings: FocConfig, problem: Problem | None = None) -> Solution:
    """Solve from the guess. The problem is built anew by default, so that the time includes what it caches."""
    return solve_problem(build_problem() if problem is None else problem, cold_start(GUESS), settings)


def _time(
    ours: tuple[str, Callable[[], object]], peer: tuple[str, Callable[[], object]], repetitions: int
) -> tuple[Timing, Timing]:
    """Time both sides, each given by its description and its task, in turn."""
    times = time_in_turn({'ours': ours[1], 'peer': peer[1]}, repetitions)
    return Timing(ours[0], compute_median_ms(times['ours'])), Timing(peer[0], compute_median_ms(times['peer']))


def measure_against_piqp(is_quick: bool) -> Result:
    """Compare with algorithm 1 as printed, each QP dense and solved by PIQP."""
    return _measure_against_naive('piqp', at_least(40.0), is_quick)


def measure_against_daqp(is_quick: bool) -> Result:
    """Compare with algorithm 1 as printed, each QP dense and solved by DAQP."""
    return _measure_against_naive('daqp', None, is_quick)


def _measure_against_naive(solver: str, target: Target | None, is_quick: bool) -> Result:
    from peers.naive import NaiveSolution, run_algorithm1

    def solve_naive() -> NaiveSolution | None:
        return run_algorithm1(build_problem(), GUESS[1:], solver, (DELTA, GROWTH, XI))

    repetitions = 3 if is_quick else 25
    timings = _time(
        ('lv, Delta 1.5, from the guess', lambda: _solve_cold(LV)),
        (f'algorithm 1 with Delta 1.5, each QP full and dense by {solver}', solve_naive),
        repetitions,
    )
    naive, ours = solve_naive(), _solve_cold(LV)
    if naive is None:
        raise RuntimeError(f'{solver} found no solution')
    same = _solve_cold(replace(LV, strategy='fixed', tau=naive.tau, lam=naive.lam))
    distance = float(np.abs(same.path[1:] - naive.positions).max())
    agreement = Agreement(
        ours.status is Status.SOLVED and distance < 1e-4 and ours.effort <= naive.effort * (1 + 1e-4),
        f'at the tau and lambda where the peer ends, paths differ by {distance:.1e} m (1e-4 allowed); effort {ours.effort:.0f}, '
        f'and {naive.effort:.0f} of the peer, which overshoots',
    )
    return Result(*timings, GAIN, agreement, repetitions, target, {'qps_ours': ours.qp_solves, 'qps_peer': naive.qps})


def measure_against_ipopt(is_quick: bool) -> Result:
    """Compare strategy `optimal` with IPOPT on the un-linearised problem."""
    from peers.ipopt import build_fastest_ipopt

    repetitions = 2 if is_quick else 15
    peer = build_fastest_ipopt(build_problem(), GUESS[1:])
    start = peer.build_start(GUESS[1:])
    timings = _time(
        ('optimal, from the guess', lambda: _solve_cold(OPTIMAL)),
        ('IPOPT on the un-linearised problem, built beforehand', lambda: peer.solve(start)),
        repetitions,
    )
    converged, effort, _ = peer.solve(start)
    ours = _solve_cold(OPTIMAL)
    excess = ours.effort / effort - 1
    agreement = Agreement(
        converged and ours.status is Status.SOLVED and abs(excess) < 0.02,
        f'effort differs by {100 * excess:+.4f} % from that of IPOPT (2 % allowed)',
    )
    details = {'qps_ours': ours.qp_solves, 'ipopt_iterations': peer.iterations}
    return Result(*timings, GAIN, agreement, repetitions, at_least(60.0), details)


def measure_against_fatrop(is_quick: bool) -> Result:
    """Compare strategy `optimal` with Fatrop on the un-linearised problem, both from the guess."""
    from peers.fatrop import Fatrop, build_fastest_fatrop

    repetitions, problem = (2 if is_quick else 15), build_problem()
    start = Fatrop(problem).build_start(GUESS[1:])
    peer = build_fastest_fatrop(problem, start, problem.initial_mean)
    timings = _time(
        ('optimal, from the guess', lambda: _solve_cold(OPTIMAL)),
        ('Fatrop on the un-linearised problem, built beforehand', lambda: peer.solve(start)),
        repetitions,
    )
    converged, effort, _ = peer.solve(start)
    agreement = _compare_efforts(_solve_cold(OPTIMAL), effort if converged else np.inf)
    return Result(*timings, GAIN, agreement, repetitions, at_least(15.0), {'fatrop_iterations': peer.iterations})


def measure_warm_against_fatrop(is_quick: bool) -> Result:
    """Compare the next tick at 100 Hz of strategy `optimal` with Fatrop, each from its own solution of 10 ms ago."""
    from peers.fatrop import Fatrop, build_fastest_fatrop

    repetitions, problem, moved = (2 if is_quick else 15), build_problem(), _move_hand()
    cold = Fatrop(problem)
    last, before = cold.solve(cold.build_start(GUESS[1:]))[2], _solve_cold(OPTIMAL, problem)
    peer = build_fastest_fatrop(problem, last, moved.initial_mean)

    def solve_warm() -> Solution:
        now = replace(moved)
        return solve_problem(now, warm_start(before, now), OPTIMAL)

    timings = _time(
        ('optimal, from the solution of 10 ms ago', solve_warm),
        ('Fatrop, from the solution of 10 ms ago, built beforehand', lambda: peer.solve(last, moved.initial_mean)),
        repetitions,
    )
    converged, effort, _ = peer.solve(last, moved.initial_mean)
    agreement = _compare_efforts(solve_warm(), effort if converged else np.inf)
    return Result(*timings, GAIN, agreement, repetitions, at_least(10.0), {'fatrop_iterations': peer.iterations})


def _compare_efforts(ours: Solution, effort: float) -> Agreement:
    """Compare the effort of a solution with that of Fatrop, infinite where it did not converge."""
    excess = ours.effort / effort - 1
    holds = ours.status is Status.SOLVED and abs(excess) < 0.02
    return Agreement(holds, f'effort differs by {100 * excess:+.4f} % from that of Fatrop (2 % allowed)')


def _move_hand() -> Problem:
    """Return the problem of the next tick at 100 Hz, at which the hand has begun to move."""
    return build_problem(initial_mean=np.array([1e-4, 1e-4, 0.01, 0.004, 0.0, 0.0]))


def measure_warm_start(is_quick: bool) -> Result:
    """Compare the next tick at 100 Hz, warm-started, with the same tick from the guess."""
    repetitions = 4 if is_quick else 40
    before, moved = _solve_cold(LV), _move_hand()

    def solve_warm() -> Solution:
        problem = replace(moved)
        return solve_problem(problem, warm_start(before, problem), LV)

    timings = _time(
        ('lv, from the solution of 10 ms ago', solve_warm),
        ('lv, from the guess', lambda: _solve_cold(LV, replace(moved))),
        repetitions,
    )
    warm, cold = solve_warm(), _solve_cold(LV, moved)
    distance = float(np.abs(warm.path - cold.path).max())
    agreement = Agreement(
        distance < 1e-5,
        f'paths differ by {distance:.1e} m (1e-5 allowed, as k is found to 1e-5), efforts are {warm.effort:.0f} '
        f'and {cold.effort:.0f}',
    )
    details = {'qps_warm': warm.qp_solves, 'qps_cold': cold.qp_solves}
    return Result(*timings, GAIN, agreement, repetitions, at_least(4.0), details)


def measure_against_cvxpy(is_quick: bool) -> Result:
    """Compare one QP at the guess with the same QP in CVXPY."""
    from peers.cvxpy_qp import CvxpyQP

    repetitions, problem = (3 if is_quick else 25), build_problem()

    def build_qp() -> ReachingQP:
        return clearance_qp(problem, effort_cost(problem, 1e3), GUESS[1:], 1e-4)

    peer = CvxpyQP(build_qp())
    timings = _time(
        ('one QP at the guess, built and solved', lambda: solve(build_qp(), WorkingSet())),
        ('CVXPY with parameters and Clarabel, compiled beforehand', lambda: peer.solve(build_qp())),
        repetitions,
    )
    answer = solve(build_qp(), WorkingSet())
    if answer is None:
        raise RuntimeError('the QP at the guess is infeasible')
    distance = float(np.abs(problem.positions(answer.control) - problem.positions(peer.solve(build_qp()))).max())
    agreement = Agreement(distance < 1e-6, f'positions differ by {distance:.1e} m (1e-6 allowed)')
    return Result(*timings, GAIN, agreement, repetitions)


def measure_against_annealing(is_quick: bool) -> Result:
    """Compare with simulated annealing over via points."""
    from peers.annealing import Annealing

    repetitions, iterations = (1, 100) if is_quick else (3, 1000)
    peer = Annealing(build_problem(), GUESS[1:])
    timings = _time(
        ('optimal, from the guess', lambda: _solve_cold(OPTIMAL)),
        (f'dual_annealing over two via points, {iterations} iterations', lambda: peer.solve(iterations, 1)),
        repetitions,
    )
    effort, share, _ = peer.solve(iterations, 1)
    ours = _solve_cold(OPTIMAL)
    agreement = Agreement(
        ours.status is Status.SOLVED and (share < 1 - 1e-6 or effort > 0.999 * ours.effort),
        f'annealing found {effort / ours.effort:.2f} times our effort at {share:.3f} of the wanted k (it may not be better)',
    )
    return Result(*timings, GAIN, agreement, repetitions)
