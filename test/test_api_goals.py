# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Goals with names and likelihoods, times between the steps, plain values, and what the API takes or refuses in one sentence."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from prediction_samples import outcome, prediction

import foc_ros
from foc_ros import Circle, Goal
from foc_ros.core.config import Config, FocConfig
from foc_ros.core.interpolation import interpolate_covariance
from foc_ros.core.solution import Status

FAST = Config(budget_s=0.0, foc={'steps': 20})
CUP = Circle((0.15, 0.01), radius=0.03, name='cup')
TWO = [Goal((0.3, -0.1), name='bowl'), (0.3, 0.1)]


@pytest.fixture(scope='module')
def predicted() -> foc_ros.Prediction:
    """Predict towards two goals, of which one has a name, past one obstacle that is given without a list."""
    predictor = foc_ros.Predictor(FAST)
    predictor.set_goals(TWO)
    predictor.set_obstacles(CUP)
    return predictor.update(0.0, (0.0, 0.0))


def test_goals_have_names_and_likelihoods(predicted: foc_ros.Prediction) -> None:
    bowl, other = predicted.goals
    assert (bowl.name, other.name) == ('bowl', 'goal1')
    np.testing.assert_array_equal(predicted.goal_positions, [bowl.position, other.position])
    for row, goal in enumerate(predicted.goals):
        shares = [each.likelihood for each in predicted if each.candidate.goal == row]
        assert goal.likelihood == pytest.approx(sum(shares))
    assert bowl.likelihood + other.likelihood + predicted.unknown + predicted.other == pytest.approx(1.0)
    words = {each.candidate.goal: each.description.partition(':')[0] for each in predicted}
    assert words == {0: 'bowl', 1: 'goal1'}, 'labels number the goals, words name them'
    assert all(each.label.startswith(f'goal{each.candidate.goal}:') for each in predicted)


def test_names_change_no_number(predicted: foc_ros.Prediction) -> None:
    plain = foc_ros.Predictor(FAST)
    plain.set_goals([(0.3, -0.1), (0.3, 0.1)])
    plain.set_obstacles([CUP])
    for one, other in zip(plain.update(0.0, (0.0, 0.0)), predicted, strict=True):
        assert (one.label, one.likelihood) == (other.label, other.likelihood)
        np.testing.assert_array_equal(one.mean, other.mean)


def test_a_goal_of_which_nothing_is_known_is_not_unlikely() -> None:
    lost = outcome('goal1:+l1', status=Status.ITERATION_LIMIT)
    lost = replace(lost, candidate=replace(lost.candidate, goal=1))
    made = prediction(outcome('goal0:+l1', 1.0), lost, goal_positions=np.array([[0.3, 0.0], [0.3, 0.1]]))
    assert [each.likelihood for each in made.goals] == [1.0, None]
    assert repr(made.goals[1]) == '<PredictedGoal goal1 at (0.3, 0.1) m, likelihood unknown>'


def test_a_prediction_is_the_sequence_of_its_candidates(predicted: foc_ros.Prediction) -> None:
    assert list(predicted) == list(predicted.candidates)
    assert len(predicted) == len(predicted.candidates) == 4
    nothing = prediction()
    assert len(nothing) == 0 and nothing, 'a prediction without candidates is one all the same'
    first = predicted.candidates[0]
    assert all(len(repr(each)) < 100 for each in (predicted, first, first.candidate, first.solution, *predicted.goals))


def test_positions_between_the_steps_are_on_the_mean_path(predicted: foc_ros.Prediction) -> None:
    for each in predicted:
        np.testing.assert_allclose(each.position_at(each.times), each.mean[:, :2], atol=1e-15)
        np.testing.assert_allclose(each.covariance_at(each.times), each.covariance[:, :2, :2], rtol=1e-12)
        assert each.position_at(0.5).shape == (2,) and each.covariance_at([0.1, 0.5]).shape == (2, 2, 2)
        begin, end, dt = each.mean[:-1], each.mean[1:], each.times[1]
        between, step = each.times[:-1] + 0.5 * dt, 1e-4
        speed = (each.position_at(between + step) - each.position_at(between - step)) / (2.0 * step)
        half_way = 0.5 * (begin + end)[:, 2:4] - dt / 8.0 * (end - begin)[:, 4:6]  # of a constant jerk
        np.testing.assert_allclose(speed, half_way, atol=1e-5)


def test_covariances_between_the_steps_are_those_of_the_motor_noise() -> None:
    """The noises of the controls add up: with the response R of the position, its variance is the sum of R^2 c^2 U^2."""
    solution = foc_ros.solve((0, 0), (0.3, 0), CUP, config=FAST)
    times = np.linspace(0.0, 20.0, 333)
    since = times[:, None] - np.arange(20)
    # the position after a jerk of 1 m/s^3 that lasts for one step of dt, which began `since` steps ago
    inside, after = np.clip(since, 0.0, 1.0), np.clip(since - 1.0, 0.0, None)
    response = solution.dt**3 * (inside**3 / 6 + inside**2 / 2 * after + inside * after**2 / 2)
    exact = (response**2) @ (0.05**2 * (0.02 / solution.dt) * solution.control**2)
    found = interpolate_covariance(solution.covariance, solution.dt, times * solution.dt)
    np.testing.assert_allclose(found[:, [0, 1], [0, 1]], exact, atol=1e-5 * exact.max())


def test_no_covariance_between_the_steps_is_less_than_none(predicted: foc_ros.Prediction) -> None:
    with_plant = foc_ros.solve_classes((0, 0), (0.3, 0), CUP, config=Config(foc={'plant': 'damped_mass', 'steps': 20}))
    for each in (*predicted, *foc_ros.solve_classes((0, 0), (0.3, 0), CUP, config=FAST), *with_plant):
        found = each.covariance_at(np.linspace(0.0, each.times[-1], 997))
        assert np.linalg.eigvalsh(found).min() >= -1e-9 * np.abs(each.covariance).max()


@pytest.mark.parametrize('t', [-0.1, 99.0, float('nan'), 'now', None, [0.1, 99.0]])
def test_no_position_is_told_beyond_the_prediction(predicted: foc_ros.Prediction, t: Any) -> None:
    for ask in (predicted.candidates[0].position_at, predicted.candidates[0].covariance_at):
        with pytest.raises(foc_ros.InputError, match=r'^t: expected seconds from now in \[0, 1\.\d+\], .*, got'):
            ask(t)


def test_plain_values_are_those_of_the_prediction(predicted: foc_ros.Prediction) -> None:
    read = json.loads(json.dumps(predicted.to_dict(), allow_nan=False))
    assert [each['name'] for each in read['goals']] == ['bowl', 'goal1']
    assert [each['likelihood'] for each in read['goals']] == [each.likelihood for each in predicted.goals]
    assert [each['label'] for each in read['candidates']] == [each.label for each in predicted]
    np.testing.assert_array_equal(read['candidates'][0]['mean'], predicted.candidates[0].mean[:, :2])


def test_the_table_has_a_row_for_each_step_of_each_candidate(predicted: foc_ros.Prediction) -> None:
    rows = predicted.to_records()
    assert len(rows) == 4 * 21 and len({tuple(row) for row in rows}) == 1
    assert all(isinstance(value, (str, int, float)) for value in rows[0].values())
    best = [row for row in rows if row['label'] == predicted.most_likely]
    np.testing.assert_array_equal([(row['x_m'], row['y_m']) for row in best], predicted.candidates[0].mean[:, :2])
    np.testing.assert_array_equal([row['xy_m2'] for row in best], predicted.candidates[0].covariance[:, 0, 1])
    assert {row['goal'] for row in rows} == {'bowl', 'goal1'}


def test_a_group_of_parameters_is_given_as_a_whole_or_by_its_values() -> None:
    assert Config(foc=FocConfig(eta=0.95)) == Config(foc={'eta': 0.95}) == Config().with_values({'foc.eta': 0.95})
    assert isinstance(Config(foc={'eta': 0}).foc.eta, float), 'a whole number becomes the type of the parameter'
    groups = [item.name for item in fields(Config) if 'bound' not in item.metadata]
    assert groups == [type(getattr(Config(), name)).__name__.removesuffix('Config').lower() for name in groups]


@pytest.mark.parametrize(
    ('create', 'text'),
    [
        (lambda: FocConfig(eta=2), r'foc\.eta: expected a number in \[0, 0\.999\], got 2'),
        (lambda: Config(foc={'eta': 2}), r'foc\.eta: expected a number in \[0, 0\.999\], got 2'),
        (lambda: Config(foc={'zeta': 2}), r'foc\.zeta: expected a known parameter .*foc\.eta.*, got 2'),
        (lambda: Config(foc=0.95), r'foc: expected a FocConfig, or a mapping of its parameters to their values, got 0\.95'),
        (lambda: Config(duration=FocConfig()), 'duration: expected a DurationConfig, or a mapping'),
        (lambda: Config(rate_hz='fast'), r"rate_hz: expected a finite number in \[0\.1, 1000\] Hz, got 'fast'"),
        (lambda: Circle((0, 0), center=(0, 0), radius=0.1), r'obstacle\.center: expected one centre, got two'),
        (lambda: foc_ros.Predictor().set_obstacles(None), 'obstacles: expected a list of Circle'),
        (lambda: foc_ros.Predictor().set_goals(Goal((0, 0), name='')), r"goal\.name: expected a text that is not empty, got ''"),
        (lambda: Goal((0, 0, 0, 0)), r'goal\.position: expected two numbers \[m\] in the task plane, or three with the height'),
        (lambda: foc_ros.Predictor().set_goals([(0, 0), (0, 0, 1)]), 'goals: expected a height for all goals or for none'),
        (
            lambda: foc_ros.Predictor().set_goals([Goal((0, 0), 'a'), Goal((1, 0), 'a')]),
            "a different name for each goal, got 'a'",
        ),
        (lambda: foc_ros.Predictor().set_goals({'bowl': (0, 0)}), 'goals: expected positions or Goals, got'),
        (lambda: foc_ros.solve((0, 0), (0.3, 0, 0.1)), r'goal: expected two numbers \[m\] in the task plane: only a Predictor'),
        (lambda: foc_ros.solve((0, 0), TWO), 'goal: expected one goal; solve_classes takes several'),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_sentence(create: Any, text: str) -> None:
    with pytest.raises(foc_ros.InputError, match=text):
        create()


def test_all_wrong_parameters_are_named_at_once() -> None:
    with pytest.raises(foc_ros.ParameterError, match=r'foc\.steps') as caught:
        Config(foc={'steps': 1, 'eta': 2})
    assert [each.partition(':')[0] for each in caught.value.__notes__] == ['foc.eta']


@pytest.mark.parametrize('goals', [(0.3, 0.0), np.array([0.3, 0.0]), Goal((0.3, 0.0)), [(0.3, 0.0)], iter([(0.3, 0.0)])])
def test_one_goal_needs_no_list(goals: Any) -> None:
    predictor = foc_ros.Predictor(FAST)
    predictor.set_goals(goals)
    assert [each.name for each in predictor.update(0.0, (0.0, 0.0)).goals] == ['goal0']


def test_three_numbers_are_one_goal_with_a_height() -> None:
    predictor = foc_ros.Predictor(FAST)
    predictor.set_goals((0.3, 0.0, 0.1))
    with pytest.raises(foc_ros.InputError, match=r'^position: expected x, y and the height, because the goals have heights'):
        predictor.update(0.0, (0.0, 0.0))
    height = predictor.update(0.0, (0.0, 0.0, 0.0)).candidates[0].height
    assert height is not None and height.mean[-1, 0] == pytest.approx(0.1, abs=1e-3)


def test_both_spellings_of_the_centre_are_taken() -> None:
    assert Circle(center=(0.1, 0.2), radius=0.01) == Circle((0.1, 0.2), 0.01)
    assert foc_ros.Box(center=(0.1, 0.2), size=(0.1, 0.1)) == foc_ros.Box((0.1, 0.2), (0.1, 0.1))
