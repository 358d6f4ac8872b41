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


def test_a_safety_factor_that_had_no_time_to_rise_rises_later():
    """The effort rises with k, so that a search that may not try a larger one ends with less of both."""
    problem = replace(one_obstacle(), preference=SafetyPreference(1.0, 100.0, 0.0, 0.02))
    late = Deadline(0.0)
    least = solved(problem, GUESS)
    low = replace(least, safety_factor=0.5 * least.safety_factor, status=Status.COMPROMISED)
    earlier = EarlierSolutions({CANDIDATE.label: low})
    given = [CANDIDATE], [problem], FocConfig(), outcomes.EFFORT_ONLY, earlier
    (waiting,), (risen,) = solve_candidates(*given, NEVER, late), solve_candidates(*given)
    assert waiting.status is Status.COMPROMISED
    assert not waiting.solution.is_complete
    assert risen.status is Status.SOLVED
    assert risen.solution.is_complete
    assert waiting.solution.effort < risen.solution.effort
    assert solve_candidates(*given[:4], EarlierSolutions({CANDIDATE.label: waiting.solution}))[0].status is Status.SOLVED
