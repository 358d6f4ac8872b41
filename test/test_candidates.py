"""Which of two answers counts: that of a way followed from the tick before, or that from its own guess."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, solved

from foc_ros.core import candidates as outcomes
from foc_ros.core.candidates import EarlierSolutions, solve_candidates
from foc_ros.core.config import FocConfig
from foc_ros.core.types import LEFT, Candidate, Status

GUESS = bowed((0.0, 0.0), (0.3, 0.0), 50, 0.06)
WAY = Candidate('goal0:+0', 0, (('0', LEFT),), GUESS, 0.33)


@pytest.mark.parametrize(
    ('before', 'warm', 'counts'),
    [
        (Status.SOLVED, 1000.0, 'warm'),
        (Status.ETA_UNREACHABLE, 1000.0, 'cold'),
        (Status.ETA_UNREACHABLE, 0.5, 'warm'),
        (Status.DEADLINE, 1000.0, 'warm'),
    ],
)
def test_a_way_that_comes_into_reach_counts_by_its_cheaper_answer(monkeypatch, before, warm, counts):
    """It may come from far along the curve, past the first place where k is the wanted one; what was solved is only followed."""
    problem = one_obstacle()
    cold = solved(problem, GUESS)
    answers = {'cold': cold, 'warm': replace(cold, effort=warm * cold.effort)}
    monkeypatch.setattr(outcomes, 'solve_problem', lambda _, start, *rest: answers['cold' if start.lam is None else 'warm'])
    earlier = EarlierSolutions({WAY.label: replace(cold, status=before)}, {})
    (outcome,) = solve_candidates([WAY], [problem], FocConfig(), earlier=earlier)
    assert outcome.solution is answers[counts]
    np.testing.assert_allclose(outcome.cost, answers[counts].effort * cold.dt)
