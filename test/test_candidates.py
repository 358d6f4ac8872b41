"""The choice between two solutions: one from the previous solution, one from the own guess of the candidate."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, solved

from foc_ros.core import candidates as outcomes
from foc_ros.core.candidates import EarlierSolutions, solve_candidates
from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.safety_preference import SafetyPreference
from foc_ros.core.types import LEFT, Candidate, Status

GUESS = bowed((0.0, 0.0), (0.3, 0.0), 50, 0.06)
CANDIDATE = Candidate('goal0:+0', 0, (('0', LEFT),), GUESS, 0.33)


@pytest.mark.parametrize(
    ('before', 'warm', 'counts'),
    [
        (Status.SOLVED, 1000.0, 'warm'),
        (Status.ETA_UNREACHABLE, 1000.0, 'cold'),
        (Status.ETA_UNREACHABLE, 0.5, 'warm'),
        (Status.DEADLINE, 1000.0, 'warm'),
    ],
)
def test_a_candidate_that_becomes_reachable_takes_its_cheaper_solution(monkeypatch, before, warm, counts):
    """The warm solution may lie far along the penalty path, beyond the first point with the wanted k."""
    problem = one_obstacle()
    cold = solved(problem, GUESS)
    solutions = {'cold': cold, 'warm': replace(cold, effort=warm * cold.effort)}
    monkeypatch.setattr(outcomes, 'solve_problem', lambda _, start, *rest: solutions['cold' if start.lam is None else 'warm'])
    earlier = EarlierSolutions({CANDIDATE.label: replace(cold, status=before)}, {})
    (outcome,) = solve_candidates([CANDIDATE], [problem], FocConfig(), earlier=earlier)
    assert outcome.solution is solutions[counts]
    np.testing.assert_allclose(outcome.cost, solutions[counts].effort * cold.dt)


def test_the_first_safety_factors_rise_and_those_without_time_do_so_later():
    """The effort rises with k."""
    problem = replace(one_obstacle(), preference=SafetyPreference(1.0, 100.0, 0.0, 0.02))
    least = solved(problem, GUESS)
    low = replace(least, safety_factor=0.5 * least.safety_factor, status=Status.COMPROMISED)
    three = [replace(CANDIDATE, label=f'goal{goal}:+0', goal=goal) for goal in range(3)]
    solutions, likelihoods = {each.label: low for each in three}, {CANDIDATE.label: 1.0}
    given = three, 3 * [problem], FocConfig(), outcomes.EFFORT_ONLY, EarlierSolutions(solutions, likelihoods)
    *risen, waiting = solve_candidates(*given, NEVER, Deadline(0.0))
    assert waiting.status is Status.COMPROMISED
    assert not waiting.solution.is_complete
    for each in risen:
        assert each.solution.is_complete
        assert waiting.solution.safety_factor < each.solution.safety_factor
        assert waiting.solution.effort < each.solution.effort
    assert [each.status for each in solve_candidates(*given)] == 3 * [Status.SOLVED]
