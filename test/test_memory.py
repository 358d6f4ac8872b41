"""The memory between predictions: solutions by label, under changed labels, and which of them are no start."""

from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.estimation.kalman_filter import update
from foc_ros.core.memory.continuity import Past
from foc_ros.core.memory.memory import Memory
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
    return Memory(None, (OVER_BOTH, BETWEEN), solutions, Past(likelihoods={OVER_BOTH.label: 0.2, BETWEEN.label: 0.8}))


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
    found = memory.find_earlier([now], {0, 1}).get(now.label)
    assert found is (None if before is None else memory.solutions[before.label])
    assert not memory.find_earlier([now], {1}), 'the goal is another one'


def reaching(x: float, memory: Memory):
    """Predict for a hand at (x, 0) that moves, among two obstacles of which it passes the first at x = 0.1."""
    obstacles = make_obstacles([[0.1, 0.04], [0.2, -0.01]], 0.02, 0.001)
    state = None
    for tick in range(40):
        place = np.array([x - 0.004 * (39 - tick), 0.0])
        stamp_ns = 1_000_000_000 + round(x / 0.4 * 1e9) + 10_000_000 * tick
        state = update(state, HandSample(stamp_ns, place), CONFIG.estimator).state
    return predict(CONFIG, state, obstacles, np.array([[0.3, 0.0]]), memory)


def test_when_an_obstacle_is_passed_the_candidates_keep_their_solutions():
    _, memory = reaching(0.099, Memory())
    warm, _ = reaching(0.101, memory)
    cold, _ = reaching(0.101, Memory())
    labels = {outcome.candidate.label for outcome in warm.solved_candidates}
    assert labels.isdisjoint(memory.solutions), 'all names are new ones'
    assert labels == {outcome.candidate.label for outcome in cold.solved_candidates}
    for one in warm.solved_candidates:
        other = next(each for each in cold.solved_candidates if each.candidate.label == one.candidate.label)
        assert one.solution.qp_solves < other.solution.qp_solves
        np.testing.assert_allclose(one.solution.path, other.solution.path, atol=1e-4)


def test_an_earlier_solution_on_another_side_is_no_start():
    """An obstacle jumps over the earlier paths: both classes are solved from their guesses, and none leaves its class."""
    hand, goals = HandState(0, np.zeros(6), np.zeros((6, 6))), np.array([[0.3, 0.0]])
    _, memory = predict(CONFIG, hand, make_obstacles([[0.15, -0.02]], 0.02, 0.001), goals, Memory())
    later, jumped = replace(hand, stamp_ns=20_000_000), make_obstacles([[0.15, 0.02]], 0.02, 0.001)
    warm, cold = (predict(CONFIG, later, jumped, goals, each)[0] for each in (memory, Memory()))
    assert {each.label: each.status for each in warm.candidates} == {'goal0:+0': Status.SOLVED, 'goal0:-0': Status.SOLVED}
    for one, other in zip(warm.candidates, cold.candidates, strict=True):
        assert (one.label, one.cost) == (other.label, pytest.approx(other.cost, rel=1e-5))
