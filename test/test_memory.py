"""The memory between predictions: solutions by label, under changed labels, and after a deadline."""

import math
from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core import candidates as outcomes
from foc_ros.core.candidates import EarlierSolutions
from foc_ros.core.config import Config, replace_values
from foc_ros.core.deadline import Deadline, OutOfTimeError
from foc_ros.core.estimation.kalman_filter import update
from foc_ros.core.memory.memory import RETRY_AFTER, Memory
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.predictor import predict
from foc_ros.core.types import LEFT, RIGHT, Candidate, HandSample, HandState, Status, make_obstacles

CONFIG = replace_values(Config(), {'foc.steps': 20, 'likelihood.smoothing_s': 0.0})


def way(sides: dict[str, int], goal: int = 0) -> Candidate:
    label = f'goal{goal}:' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides.items())
    return Candidate(label, goal, tuple(sides.items()), np.zeros((2, 2)), 0.1)


OVER_BOTH, BETWEEN = way({'a': LEFT, 'b': LEFT}), way({'a': LEFT, 'b': RIGHT})


@pytest.fixture
def memory() -> Memory:
    solutions = {one.label: object() for one in (OVER_BOTH, BETWEEN)}
    return Memory(None, (OVER_BOTH, BETWEEN), EarlierSolutions(solutions, {OVER_BOTH.label: 0.2, BETWEEN.label: 0.8}))


@pytest.mark.parametrize(
    ('now', 'before'),
    [
        pytest.param(BETWEEN, BETWEEN, id='the same name'),
        pytest.param(way({'b': LEFT}), OVER_BOTH, id='an obstacle passed'),
        pytest.param(way({'b': RIGHT}), BETWEEN, id='an obstacle passed on the other way'),
        pytest.param(way({'a': LEFT, 'b': RIGHT, 'c': LEFT}), BETWEEN, id='an obstacle come into reach'),
        pytest.param(way({'a': LEFT}), BETWEEN, id='the likelier of two that were told apart by what is passed'),
        pytest.param(way({'a': RIGHT}), None, id='another side'),
        pytest.param(way({'a': LEFT, 'c': LEFT}), None, id='one obstacle for another'),
        pytest.param(way({'b': LEFT}, goal=1), None, id='another goal'),
    ],
)
def test_a_candidate_is_found_by_its_present_or_its_earlier_label(memory, now, before):
    found = memory.find_earlier([now]).solutions.get(now.label)
    assert found is (None if before is None else memory.earlier.solutions[before.label])


def reaching(x: float, memory: Memory, config: Config = CONFIG):
    """Predict for a hand at (x, 0) that moves, among two obstacles of which it passes the first at x = 0.1."""
    obstacles = make_obstacles([[0.1, 0.04], [0.2, -0.01]], 0.02, 0.001)
    state = None
    for tick in range(40):
        place = np.array([x - 0.004 * (39 - tick), 0.0])
        stamp_ns = 1_000_000_000 + round(x / 0.4 * 1e9) + 10_000_000 * tick
        state = update(state, HandSample(stamp_ns, place), CONFIG.estimator).state
    return predict(config, state, obstacles, np.array([[0.3, 0.0]]), memory)


def test_when_an_obstacle_is_passed_the_candidates_keep_their_solutions():
    _, memory = reaching(0.099, Memory())
    warm, _ = reaching(0.101, memory)
    cold, _ = reaching(0.101, Memory())
    labels = {outcome.candidate.label for outcome in warm.solved_candidates}
    assert labels.isdisjoint(memory.earlier.solutions), 'all names are new ones'
    assert labels == {outcome.candidate.label for outcome in cold.solved_candidates}
    for one in warm.solved_candidates:
        other = next(each for each in cold.solved_candidates if each.candidate.label == one.candidate.label)
        assert one.solution.qp_solves < other.solution.qp_solves
        np.testing.assert_allclose(one.solution.path, other.solution.path, atol=1e-4)


def test_a_candidate_stopped_by_the_deadline_continues_from_there(monkeypatch):
    config = replace_values(CONFIG, {'likelihood.shortfall': math.inf})
    looks = []

    def stop_after_a_few(*_):
        looks.append(1)
        if len(looks) > 4:
            raise OutOfTimeError

    with monkeypatch.context() as patch:
        patch.setattr(Deadline, 'check', stop_after_a_few)
        late, memory = reaching(0.0, Memory(), config)
    assert {outcome.solution.status for outcome in late.candidates} == {Status.DEADLINE}
    assert memory.earlier.solutions, 'the first candidate had some time'
    assert all(solution.multipliers for solution in memory.earlier.solutions.values())
    after, _ = reaching(0.0, memory, config)
    assert set(memory.earlier.solutions) <= {outcome.candidate.label for outcome in after.candidates_with_likelihood}


def test_an_unreachable_candidate_is_followed_and_restarted_at_intervals(monkeypatch):
    starts = []
    monkeypatch.setattr(outcomes, 'solve_problem', lambda *given: starts.append(given[1].lam is None) or solve_problem(*given))
    config = replace_values(CONFIG, {'foc.eta': 0.999, 'foc.noise_x': 1.0, 'foc.noise_y': 1.0, 'likelihood.shortfall': math.inf})
    memory, begun = Memory(), []
    for tick in range(2 * RETRY_AFTER + 3):
        state = HandState(10_000_000 * tick, np.zeros(6), np.zeros((6, 6)))
        starts.clear()
        prediction, memory = predict(config, state, make_obstacles([[0.15, 0.0]], 0.03, 0.003), np.array([[0.3, 0.0]]), memory)
        assert {outcome.solution.status for outcome in prediction.candidates} == {Status.ETA_UNREACHABLE}
        begun.append(any(starts))
    assert [tick for tick, restarted in enumerate(begun) if restarted] == [0, RETRY_AFTER + 1, 2 * RETRY_AFTER + 2]


def test_a_class_whose_safety_factor_had_no_time_to_rise_keeps_its_turn():
    state = HandState(0, np.zeros(6), np.zeros((6, 6)))
    prediction, memory = predict(CONFIG, state, make_obstacles([[0.15, 0.0]], 0.03, 0.003), np.array([[0.3, 0.0]]), Memory())
    complete, waiting = prediction.candidates
    waiting = replace(waiting, solution=replace(waiting.solution, is_complete=False))
    earlier, _ = memory.remember([complete.candidate, waiting.candidate], [complete, waiting], memory.earlier, {}, 20_000_000)
    assert earlier.turns == {complete.label: (20_000_000, 20_000_000), waiting.label: (20_000_000, 0)}
    assert [earlier.sort_by_turn(each) for each in ([complete, waiting], [waiting, complete])] == [[1, 0], [0, 1]]
