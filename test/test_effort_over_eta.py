# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Effort over the wanted eta: it is continuous and does not fall.

Continuity is tested at the usual setting, N = 50 and c = 0.15, in four random scenes of one circle and in six reference cases.
In each of the random scenes, every strategy reaches HIGH and needs at least 2 % more effort for it than for LOW.
"""

import numpy as np
import pytest
from reach_helpers import bowed, case_guess, case_problem, random_scene, reach, reference_cases, solved

from foc_ros.core.solution import Solution, Status

STRATEGIES = ('lv', 'hc', 'optimal')
EVERY = pytest.mark.parametrize('strategy', STRATEGIES)
LOW, HIGH = 0.5, 0.9
SEEDS = (0, 1, 2, 9)
STEPS = 50
NOISE = 0.15
SLIGHT = 1e-5
"""Relative decrease of effort that counts as none, because eta is met to 1e-5 only."""
SAMPLED = 'lv and hc look at samples of a curve, each as exact as a likelihood asks'
JUMPS = {
    '9-lv': SAMPLED,
    'case5-lv': SAMPLED,
    'case0-lv': 'k falls for a while along the penalty path, and effort rises by 4 %',
    'case0-hc': 'k falls for a while along the penalty path, and effort rises by 22 %',
}
"""Known exceptions among the reference cases."""


def expect_failure(request: pytest.FixtureRequest, known: dict[str, str]) -> None:
    """Mark a known exception. It may pass: rounding decides between two minima."""
    if request.node.callspec.id in known:
        request.applymarker(pytest.mark.xfail(reason=known[request.node.callspec.id], strict=False))


def solve_for_etas(seed: int, strategy: str, etas: np.ndarray) -> list[Solution]:
    obstacles, goal, amplitude = random_scene(np.random.default_rng(seed), obstacles=1)
    guess = bowed((0, 0), goal, STEPS, amplitude)
    problems = [reach(obstacles, goal=goal, steps=STEPS, noise=(NOISE, NOISE), eta=float(eta)) for eta in etas]
    return [solved(problem, guess, strategy) for problem in problems]


def is_continuous(efforts: np.ndarray, half: float) -> bool:
    """Return whether log efforts (99,) do not fall, and their largest rise is about `half` of that between every second value."""
    return bool(np.diff(efforts).min() > -SLIGHT and np.diff(efforts).max() < half * np.diff(efforts[::2]).max() + SLIGHT)


@EVERY
@pytest.mark.parametrize('seed', SEEDS)
def test_effort_is_continuous_and_does_not_fall(seed, strategy, request):
    """With half the distance between the values of eta, the largest rise is about half as large."""
    expect_failure(request, JUMPS)
    solutions = solve_for_etas(seed, strategy, np.linspace(LOW, HIGH, 99))
    assert {each.status for each in solutions} == {Status.SOLVED}
    fine = np.log([each.effort for each in solutions])
    assert fine[-1] - fine[0] > np.log(1.02)
    assert is_continuous(fine, 0.6)


@EVERY
@pytest.mark.parametrize('case', reference_cases()[:6])
def test_effort_is_continuous_in_the_reference_cases(case, strategy, request):
    """Some cases end so steeply that with half the distance the largest rise is still two thirds as large."""
    expect_failure(request, JUMPS)
    solutions = [solved(case_problem(case, float(eta)), case_guess(case), strategy) for eta in np.linspace(LOW, HIGH, 99)]
    assert {each.status for each in solutions} == {Status.SOLVED}
    assert is_continuous(np.log([each.effort for each in solutions]), 0.7)


@EVERY
@pytest.mark.parametrize('case', reference_cases()[:6])
def test_effort_does_not_fall_with_eta(case, strategy):
    etas = np.linspace(LOW, 0.95, 12 if strategy == 'optimal' else 6)
    solutions = [solved(case_problem(case, float(eta)), case_guess(case), strategy) for eta in etas]
    reached = [each.status is Status.SOLVED for each in solutions]
    assert reached == sorted(reached, reverse=True), 'an unreachable eta is below a reachable one'
    assert sum(reached) >= 0.75 * len(etas)
    efforts = np.log([each.effort for each in solutions if each.status is Status.SOLVED])
    assert np.diff(efforts).min() > -1e-4
