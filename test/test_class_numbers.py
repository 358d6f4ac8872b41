"""The number of a class stays while its label and its rank change, and no number is given twice."""

from __future__ import annotations

import numpy as np
from prediction_samples import outcome

from foc_ros.core.config import Config
from foc_ros.core.memory.class_numbers import NO_NUMBERS
from foc_ros.core.memory.memory import Memory
from foc_ros.core.predictor import predict
from foc_ros.core.types import Candidate, HandState, PredictedCandidate, make_obstacles
from foc_ros.reporting.views import parse_label

IDS = ('1', '12', 'post-2')
STEP_NS, HOLD_S = 20_000_000, 0.2


def candidate(label: str) -> PredictedCandidate:
    goal, sides = parse_label(label, IDS)
    solution = outcome(label).solution
    return PredictedCandidate(
        Candidate(label, int(goal[4:]), tuple(sides.items()), np.zeros((2, 2)), 0.1), solution, {}, 1.0, 0.5
    )


def number(*predictions: tuple[str, ...]) -> list[dict[str, int]]:
    """Return the number of each label, in predictions 20 ms after one another."""
    present, numbers = NO_NUMBERS, []
    for turn, labels in enumerate(predictions):
        numbered, present = present.number([candidate(each) for each in labels], turn * STEP_NS, HOLD_S)
        numbers.append({each.label: each.way for each in numbered})
    return numbers


def test_the_same_label_keeps_its_number_at_another_rank() -> None:
    assert number(('goal0:+1', 'goal0:-1'), ('goal0:-1', 'goal0:+1')) == [{'goal0:+1': 0, 'goal0:-1': 1}] * 2


def test_a_number_stays_when_obstacles_leave_the_label() -> None:
    numbers = number(('goal0:+1-12', 'goal0:-1-12'), ('goal0:-1', 'goal0:+1'), ('goal0:',))
    assert numbers[1] == {'goal0:+1': 0, 'goal0:-1': 1}
    assert numbers[2]['goal0:'] in (0, 1)


def test_other_sides_and_other_goals_have_new_numbers() -> None:
    assert number(('goal0:+1',), ('goal0:-1', 'goal1:+1')) == [{'goal0:+1': 0}, {'goal0:-1': 1, 'goal1:+1': 2}]


def test_the_class_with_most_shared_sides_goes_on() -> None:
    assert number(('goal0:', 'goal0:+1-12'), ('goal0:+1-12-post-2',))[1] == {'goal0:+1-12-post-2': 1}


def test_two_candidates_do_not_have_one_number() -> None:
    assert sorted(number(('goal0:+1',), ('goal0:+1+12', 'goal0:+1-12'))[1].values()) == [0, 1]


def test_a_class_that_is_missing_for_a_short_time_keeps_its_number() -> None:
    for gap, expected in ((9, 0), (10, 1)):
        assert number(('goal0:+1',), *([()] * gap), ('goal0:+1',))[-1] == {'goal0:+1': expected}


def test_predictions_have_numbers_that_a_new_movement_does_not_repeat() -> None:
    scene = make_obstacles([[0.15, 0.0]], 0.03, 0.001), np.array([[0.3, 0.0]])

    def made(seconds: float, memory: Memory) -> tuple[set[int], Memory]:
        hand = HandState(round(seconds * 1e9), np.array([0.01 + seconds, 0.0, 0.1, 0.0, 0.0, 0.0]), 1e-8 * np.eye(6))
        prediction, memory = predict(Config(), hand, *scene, memory)
        return {each.way for each in prediction.candidates}, memory

    first, memory = made(0.0, Memory())
    second, memory = made(0.02, memory)
    assert first == second == {0, 1}
    third, memory = made(0.04, memory.forget())
    assert third == {2, 3}
