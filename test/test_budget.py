"""The time limit of a prediction: unsolved candidates are reported as out of time, with their age, never as unlikely."""

import numpy as np
import pytest

from foc_ros.core.candidates import EarlierSolutions
from foc_ros.core.config import Config, replace_values
from foc_ros.core.deadline import OutOfTimeError
from foc_ros.core.estimation.kalman_filter import update
from foc_ros.core.memory import Memory
from foc_ros.core.predictor import predict
from foc_ros.core.types import HandSample, Status, make_obstacles

OBSTACLES = make_obstacles([[0.12, 0.01], [0.2, -0.03]], [0.02, 0.02], 0.001)
GOALS = np.array([[0.3, 0.0]])
CONFIG = replace_values(Config(), {'foc.steps': 20})
HANDS = [
    update(None, HandSample(1_000_000_000 + 20_000_000 * tick, np.array([1e-4 * tick, 0.0])), CONFIG.estimator).state
    for tick in range(3)
]


def predicted(tick: int, memory: Memory, budget_s: float = 0.0):
    return predict(replace_values(CONFIG, {'budget_s': budget_s}), HANDS[tick], OBSTACLES, GOALS, memory)


def statuses(prediction) -> list[Status]:
    return [outcome.solution.status for outcome in prediction.candidates]


def test_a_budget_that_is_not_reached_changes_nothing():
    (free, memory), (ample, other) = predicted(0, Memory()), predicted(0, Memory(), 60.0)
    for one, two in ((free, ample), (predicted(1, memory)[0], predicted(1, other, 60.0)[0])):
        assert one.most_likely == two.most_likely
        for a, b in zip(one.candidates, two.candidates, strict=True):
            assert (a.candidate.label, a.likelihood) == (b.candidate.label, b.likelihood)
            np.testing.assert_array_equal(a.solution.mean, b.solution.mean)


def test_without_any_time_the_prediction_is_empty_and_the_memory_stays():
    before, memory = predicted(0, Memory())
    assert len(before.solved_candidates) > 1
    late, memory = predicted(1, memory, 1e-9)
    assert set(statuses(late)) == {Status.DEADLINE}
    assert late.most_likely is None
    assert all(np.isfinite(outcome.solution.mean).all() for outcome in late.candidates)
    messages = {each.candidate.label: each.solution.message for each in late.candidates}
    assert all('out of time' in message for message in messages.values())
    assert all('last solved 0.02 s ago' in messages[each.candidate.label] for each in before.solved_candidates)
    after, _ = predicted(2, memory)
    assert [each.candidate.label for each in after.solved_candidates] == [
        each.candidate.label for each in before.solved_candidates
    ]
    assert max(each.solution.qp_solves for each in after.solved_candidates) <= 3, (
        'warm started from the prediction before the late one'
    )


def test_a_candidate_that_was_never_solved_says_so():
    assert 'never solved yet' in predicted(0, Memory(), 1e-9)[0].candidates[0].solution.message


@pytest.mark.parametrize('turned', [False, True])
def test_the_most_likely_candidate_of_the_last_prediction_is_solved_first(monkeypatch, turned):
    before, memory = predicted(0, Memory())
    wanted = before.solved_candidates[-1 if turned else 0].candidate.label
    likelihoods = {each.candidate.label: float(each.candidate.label == wanted) for each in before.candidates}
    memory = Memory(
        memory.most_likely, memory.candidates, EarlierSolutions(memory.earlier.solutions, likelihoods), memory.solved_ns
    )
    asked = []

    def solve_with_time_for_one(problem, start, settings, deadline):
        asked.append(problem)
        if len(asked) > 1:
            monkeypatch.setattr('foc_ros.core.deadline.Deadline.check', out_of_time)
        return real(problem, start, settings, deadline)

    def out_of_time(_):
        raise OutOfTimeError

    from foc_ros.core import candidates as candidates

    real = candidates.solve_problem
    monkeypatch.setattr(candidates, 'solve_problem', solve_with_time_for_one)
    late, _ = predicted(1, memory, 60.0)
    assert [each.candidate.label for each in late.solved_candidates] == [wanted]
    assert late.solved_candidates[0].likelihood == 1.0, 'likelihoods are of what was solved; the others are unknown'
    assert statuses(late)[1:] == [Status.DEADLINE] * (len(late.candidates) - 1)
