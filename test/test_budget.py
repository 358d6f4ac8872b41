"""The time limit of a prediction: classes take turns, and those without time keep their last answer with its age."""

import math
import time

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, reach

from foc_ros.core import candidates as candidates_module
from foc_ros.core.candidates import EarlierSolutions
from foc_ros.core.config import Config, replace_values
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.estimation.kalman_filter import update
from foc_ros.core.memory.memory import Memory
from foc_ros.core.ocp import working_set
from foc_ros.core.ocp.qp import clearance_qp, effort_cost
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.predictor import predict
from foc_ros.core.types import HandSample, Status, make_obstacles

OBSTACLES = make_obstacles([[0.12, 0.01], [0.2, -0.03]], [0.02, 0.02], 0.001)
GOALS = np.array([[0.3, 0.0]])
CONFIG = replace_values(Config(), {'foc.steps': 20})
PERIOD_S = 0.02
HANDS = [
    update(None, HandSample(1_000_000_000 + 20_000_000 * tick, np.array([1e-4 * tick, 0.0])), CONFIG.estimator).state
    for tick in range(20)
]


def predicted(tick: int, memory: Memory, budget_s: float | None = None, config: Config = CONFIG):
    return predict(config, HANDS[tick], OBSTACLES, GOALS, memory, deadline=NEVER if budget_s is None else Deadline(budget_s))


def statuses(prediction) -> list[Status]:
    return [outcome.solution.status for outcome in prediction.candidates]


def test_a_budget_that_is_not_reached_changes_nothing():
    (free, memory), (ample, other) = predicted(0, Memory()), predicted(0, Memory(), 60.0)
    for one, two in ((free, ample), (predicted(1, memory)[0], predicted(1, other, 60.0)[0])):
        assert one.most_likely == two.most_likely
        for a, b in zip(one.candidates, two.candidates, strict=True):
            assert (a.candidate.label, a.likelihood) == (b.candidate.label, b.likelihood)
            np.testing.assert_array_equal(a.solution.mean, b.solution.mean)


def labels(candidates) -> list[str]:
    return [each.label for each in candidates]


def test_without_any_time_the_last_answers_are_kept_with_their_age():
    before, memory = predicted(0, Memory())
    assert len(before.solved_candidates) > 1
    late, later = predicted(1, memory, -1.0)
    assert labels(late.candidates) == labels(before.candidates)
    assert late.most_likely == before.most_likely
    assert late.notes['kept'] == len(late.candidates)
    assert {each.age_s for each in late.candidates} == {PERIOD_S}
    assert all('out of time' in each.solution.message and '0.02 s ago' in each.solution.message for each in late.candidates)
    after, _ = predicted(2, later)
    assert labels(after.candidates_with_likelihood) == labels(before.candidates_with_likelihood)
    assert {each.age_s for each in after.candidates} == {0.0}
    assert max(each.solution.qp_solves for each in after.solved_candidates) <= 3, 'warm started from before the late one'


def test_an_answer_is_not_kept_for_longer_than_hold_s():
    _, memory = predicted(0, Memory())
    ages = []
    for tick in range(1, 13):
        late, memory = predicted(tick, memory, -1.0)
        ages.append(max((each.age_s for each in late.candidates if each.has_likelihood), default=None))
    allowed = int(CONFIG.likelihood.hold_s / PERIOD_S)
    assert ages[: allowed - 1] == [pytest.approx(PERIOD_S * tick) for tick in range(1, allowed)]
    assert set(ages[allowed - 1 :]) == {None}
    assert late.most_likely is None


def test_the_first_answer_has_no_likelihood_if_there_is_no_time_at_all():
    late, _ = predicted(0, Memory(), -1.0)
    assert [each.status for each in late.candidates] == [Status.DEADLINE]
    assert late.most_likely is None


def allow(monkeypatch, solves: int) -> list[object]:
    """Let the time be over after a number of solves in each prediction; return the list of the problems solved."""
    asked, real = [], candidates_module.solve_problem

    def solve(problem, start, settings, deadline):
        asked.append(problem)
        return real(problem, start, settings, NEVER)

    monkeypatch.setattr(candidates_module, 'solve_problem', solve)
    monkeypatch.setattr(Deadline, 'allows', lambda deadline, seconds=0.0: deadline.at is None or len(asked) < solves)
    return asked


@pytest.mark.parametrize('row', [0, -1])
def test_the_most_likely_candidate_of_the_last_prediction_is_solved_first(monkeypatch, row):
    before, memory = predicted(0, Memory())
    wanted = before.solved_candidates[row].label
    likelihoods = {each.label: float(each.label == wanted) for each in before.candidates}
    earlier = EarlierSolutions(memory.earlier.solutions, likelihoods, memory.earlier.turns)
    memory = Memory(memory.most_likely, memory.candidates, earlier, past=memory.past)
    allow(monkeypatch, 1)
    late, _ = predicted(1, memory, 60.0)
    assert [each.label for each in late.candidates if each.age_s == 0.0] == [wanted]
    assert labels(late.candidates) == labels(before.candidates), 'the others keep their answers'


def test_candidates_take_turns(monkeypatch):
    """With time for two solves in each prediction, the most likely class is always solved, and the others one after the other."""
    before, memory = predicted(0, Memory())
    count = len(before.candidates)
    asked, fresh = allow(monkeypatch, 2), []
    for tick in range(1, 2 * count - 1):
        asked.clear()
        late, memory = predicted(tick, memory, 60.0)
        fresh.append({each.label for each in late.candidates if not each.age_s})
        assert labels(late.candidates) == labels(before.candidates)
    assert all(before.most_likely in each and len(each) == 2 for each in fresh)
    turns = [next(iter(each - {before.most_likely})) for each in fresh]
    assert len(set(turns[: count - 1])) == count - 1
    assert turns[: count - 1] == turns[count - 1 :]


def test_a_solve_that_takes_longer_than_one_prediction_ends_in_a_later_one(monkeypatch):
    """With time for few looks at the clock in each prediction, the answer is found nevertheless."""
    looks, config = [], replace_values(CONFIG, {'likelihood.shortfall': math.inf})

    def stop_after_a_few(*_):
        looks.append(1)
        if len(looks) > 4:
            raise OutOfTimeError

    monkeypatch.setattr(Deadline, 'check', stop_after_a_few)
    memory = Memory()
    for tick in range(12):
        looks.clear()
        prediction, memory = predicted(tick, memory, config=config)
        if prediction.candidates_with_likelihood:
            break
    assert tick > 0, 'the scene is no test'
    assert prediction.candidates_with_likelihood


def test_a_step_longer_than_the_time_left_is_not_begun(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, 'perf_counter', lambda: now[0])
    deadline = Deadline(10.0)
    for now[0] in (1.0, 4.0, 7.0):
        deadline.check()
    assert deadline.allows(3.0)
    assert not deadline.allows(3.1)
    now[0] = 7.5
    assert not deadline.has_passed
    assert not deadline.allows(), 'a step took three seconds'
    with pytest.raises(OutOfTimeError):
        deadline.check()


def test_a_qp_that_would_last_too_long_is_not_begun(monkeypatch):
    problem = one_obstacle(0.9)
    qp = clearance_qp(problem, effort_cost(problem, 0.0), bowed((0, 0), (0.3, 0), problem.horizon.steps, 0.05)[1:], 0.0)
    assert working_set.solve(qp, working_set.WorkingSet(), Deadline(60.0)) is not None
    monkeypatch.setattr(working_set, 'estimate_time', lambda *_: 61.0)
    with pytest.raises(OutOfTimeError):
        working_set.solve(qp, working_set.WorkingSet(), Deadline(60.0))


@pytest.mark.parametrize('strategy', ['lv', 'optimal'])
def test_a_class_without_a_path_is_told_though_there_is_no_time_to_show_one(strategy, monkeypatch):
    """Two circles close the way. The QPs contradict each other at once; the elastic one is not begun."""
    problem = reach(make_obstacles([[0.15, 0.05], [0.15, -0.04]], [0.06, 0.06], 0.001), steps=20)
    start, settings = cold_start(bowed((0, 0), (0.3, 0), 20, 0.0)), replace_values(Config(), {'foc.strategy': strategy}).foc
    shown = solve_problem(problem, start, settings)
    monkeypatch.setattr('foc_ros.core.ocp.strategies.solve', _raise_out_of_time)
    late = solve_problem(problem, start, settings, Deadline(60.0))
    assert late.status is shown.status is Status.INFEASIBLE
    assert 'violates them least' in shown.message
    assert 'ignores them' in late.message
    assert late.violation > shown.violation > 0.0


def _raise_out_of_time(*_, **__):
    raise OutOfTimeError
