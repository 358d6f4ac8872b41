"""Continuity: shares follow a filter, answers are kept and fade, renamed classes stay the same, durations change gradually."""

import numpy as np
import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.estimation.duration import CHANGE_S, limit_change
from foc_ros.core.memory.continuity import Past, carry_over, interpolate_rest, make_continuous
from foc_ros.core.memory.memory import Memory
from foc_ros.core.predictor import predict
from foc_ros.core.types import LEFT, RIGHT, Candidate, HandState, PredictedCandidate, make_obstacles

CONFIG = replace_values(Config(), {'foc.steps': 20})
GOALS = np.array([[0.3, 0.0]])
MOVING = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])


def predict_at(tick: int, centre, memory: Memory, config: Config = CONFIG, goals=GOALS, radius: float = 0.02):
    stamp_ns = 20_000_000 * tick
    hand = HandState(stamp_ns, MOVING, np.zeros((6, 6)), onset_ns=stamp_ns, onset_position=np.zeros(2))
    return predict(config, hand, make_obstacles(centre, radius, 0.001), goals, memory)


def way(sides: dict[str, int], goal: int = 0) -> Candidate:
    label = f'goal{goal}:' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides.items())
    return Candidate(label, goal, tuple(sides.items()), np.zeros((2, 2)), 0.1)


def find_likelihoods(prediction) -> dict[str, float]:
    return {each.label: each.likelihood for each in prediction.candidates}


def test_likelihoods_follow_a_filter_of_the_stated_time_constant():
    """After a step of the scene the difference decays as exp(-t / smoothing_s), whatever the period of the predictions."""
    config = replace_values(CONFIG, {'likelihood.smoothing_s': 0.1})
    sharp = replace_values(CONFIG, {'likelihood.smoothing_s': 0.0})
    first, after = (find_likelihoods(predict_at(0, [[0.15, y]], Memory(), sharp)[0]) for y in (-0.015, 0.015))
    for ticks in ((5, 10), (1, 2, 3, 7, 10)):
        _, memory = predict_at(0, [[0.15, -0.015]], Memory(), config)
        for tick in ticks:
            prediction, memory = predict_at(tick, [[0.15, 0.015]], memory, config)
        found, rest = find_likelihoods(prediction), np.exp(-0.2 / 0.1)
        assert sum(found.values()) == pytest.approx(1.0)
        for label, share in found.items():
            assert share == pytest.approx(rest * first[label] + (1.0 - rest) * after[label], abs=5e-3)
            assert abs(first[label] - after[label]) > 0.05, 'the scene is no test'


def test_a_class_that_is_not_followed_any_more_fades_out():
    """There is room for one class: the one that loses its place is shown for less than hold_s, with its age, and fades."""
    config = replace_values(CONFIG, {'homotopy.max_candidates': 1, 'likelihood.beta': 1.0, 'likelihood.shortfall': 3.0})
    before, memory = predict_at(0, [[0.15, 0.03]], Memory(), config, radius=0.05)
    lost, shares = before.most_likely, []
    for tick in range(1, 13):
        prediction, memory = predict_at(tick, [[0.15, -0.03]], memory, config, radius=0.05)
        shares.append(find_likelihoods(prediction).get(lost))
        assert sum(find_likelihoods(prediction).values()) == pytest.approx(1.0)
        ages = [each.age_s for each in prediction.candidates if each.label == lost]
        assert ages == ([] if tick >= 10 else [pytest.approx(0.02 * tick)])
        assert prediction.notes.get('kept', 0) == len(ages)
    assert shares[9:] == [None] * 3
    assert shares[:9] == sorted(shares[:9], reverse=True)
    assert shares[8] < 0.1
    assert np.abs(np.diff([1.0, *shares[:9], 0.0])).max() < 0.25


def test_nothing_is_kept_for_a_goal_that_is_another_one():
    _, memory = predict_at(0, [[0.15, 0.004]], Memory())
    prediction, _ = predict_at(1, [[0.15, 0.004]], memory, goals=np.array([[0.3, 0.2]]))
    fresh, _ = predict_at(1, [[0.15, 0.004]], Memory(), goals=np.array([[0.3, 0.2]]))
    assert not any(each.age_s for each in prediction.candidates)
    assert find_likelihoods(prediction) == pytest.approx(find_likelihoods(fresh), abs=1e-6)


def test_the_rest_of_an_answer_is_where_the_answer_was_at_that_time():
    rng = np.random.default_rng(3)
    mean, covariance = rng.normal(size=(21, 6)), rng.normal(size=(21, 6, 6))
    means, covariances = (interpolate_rest(each, 10.0) for each in (mean, covariance))
    np.testing.assert_allclose(means[::2], mean[10:], atol=1e-12)
    np.testing.assert_allclose(covariances[1::2], (covariance[10:-1] + covariance[11:]) / 2, atol=1e-12)


def test_a_renamed_class_keeps_what_it_had():
    over, under = way({'a': LEFT}), way({'a': RIGHT})
    shares = {over.label: 0.7, under.label: 0.3}
    now = {way({'a': LEFT, 'b': LEFT}): 0.6, way({'a': LEFT, 'b': RIGHT}): 0.1, way({'a': RIGHT, 'b': RIGHT}): 0.3}
    assert carry_over([over, under], shares, now) == pytest.approx({'goal0:+a+b': 0.7, 'goal0:-a-b': 0.3})
    assert carry_over([over, under], shares, {way({}): 1.0}) == {'goal0:': 1.0}
    assert carry_over([over, under], shares, {over: 0.5, way({'c': LEFT}, goal=1): 0.5}) == {over.label: 1.0}
    assert carry_over([over, under], shares, {way({}, goal=1): 1.0}) == {}


def test_the_most_likely_class_stays_when_it_is_renamed():
    over, under = way({'a': LEFT}), way({'a': RIGHT})
    past = Past(0, GOALS, (1.0,), (over, under), {over.label: 0.5, under.label: 0.5})
    now = {way({'a': LEFT, 'b': LEFT}): 0.3, way({'a': LEFT, 'b': RIGHT}): 0.2, way({'a': RIGHT, 'b': LEFT}): 0.5}
    assert past.find_renamed(over.label, now) == 'goal0:+a+b'
    assert past.find_renamed(under.label, now) == 'goal0:-a+b'
    assert past.find_renamed('goal9:', now) == 'goal9:'


def test_without_a_past_likelihoods_are_as_they_are():
    prediction, _ = predict_at(0, [[0.15, 0.004]], Memory())
    given = [PredictedCandidate(each.candidate, each.solution, each.sides, each.cost, 0.5) for each in prediction.candidates]
    assert [each.likelihood for each in make_continuous(given, Past(), 0, CONFIG.likelihood)] == [0.5] * len(given)


@pytest.mark.parametrize('elapsed_s', [0.005, 0.02, 0.1])
def test_the_time_to_go_changes_gradually_and_never_slower_than_time(elapsed_s):
    factor = np.exp(elapsed_s / CHANGE_S)
    assert limit_change(4.8, 2.2, elapsed_s) == pytest.approx(2.2 * factor)
    assert limit_change(0.3, 2.2, elapsed_s) == pytest.approx(2.2 / factor)
    assert limit_change(2.2 - elapsed_s, 2.2, elapsed_s) == 2.2 - elapsed_s
    assert limit_change(0.2 - elapsed_s, 0.2, elapsed_s) == 0.2 - elapsed_s, 'the end of a movement'
    assert limit_change(4.8, 2.2, np.inf) == 4.8
