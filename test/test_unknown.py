# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No probability without knowledge: what fails keeps a share, and what is not followed is unknown."""

from dataclasses import replace

import numpy as np
import pytest
from bag_helpers import TYPES

from foc_ros.core import candidates
from foc_ros.core.config import Config, replace_values
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.solution import Status
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState
from foc_ros.io.json_output import encode_prediction
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_markers

CONFIG = replace_values(Config(), {'foc.steps': 20, 'likelihood.other_goal': 0.0, 'homotopy.max_detour': 100.0})
HAND = HandState(0, np.zeros(6), np.zeros((6, 6)), frame_id='world')
ROW = make_obstacles([[0.15, 0.04], [0.15, -0.045]], 0.025, 0.001)
GOALS = np.array([[0.3, 0.0]])


def ask(config=CONFIG, goals=GOALS, obstacles=ROW):
    return predict(config, HAND, obstacles, goals, NO_TRACKS)[0]


def let_fail(monkeypatch, number, status):
    solve = candidates.solve_problems

    def fail(*given):
        return [replace(each, status=status) if row == number else each for row, each in enumerate(solve(*given))]

    monkeypatch.setattr(candidates, 'solve_problems', fail)


def total(prediction):
    return sum(each.likelihood for each in prediction.candidates) + prediction.unknown + prediction.other


@pytest.mark.parametrize(('number', 'status'), [(0, Status.LEFT_CLASS), (1, Status.ITERATION_LIMIT), (2, Status.INFEASIBLE)])
def test_a_class_that_the_search_sees_and_the_solver_fails_in_keeps_a_share(monkeypatch, status, number):
    known = {each.way: each for each in ask().candidates}
    let_fail(monkeypatch, number, status)
    found = ask()
    (failed,) = [each for each in found.candidates if 'estimated from the path' in each.solution.message]
    assert failed.way == number and failed.status is Status.ESTIMATED and len(found.candidates) == 4
    # classes that are so unlikely that they go on in the next prediction are estimated too
    assert found.notes['estimated'] == sum(each.status is Status.ESTIMATED for each in found.candidates)
    assert 0.25 < failed.likelihood / known[number].likelihood < 4.0
    assert total(found) == pytest.approx(1.0)
    np.testing.assert_allclose(failed.mean[0], HAND.mean, atol=1e-12)
    np.testing.assert_allclose(failed.mean[-1, :2], GOALS[0], atol=1e-9)


@pytest.mark.parametrize('horizon_s', [1000.0, 0.0])
def test_what_is_seen_and_not_followed_is_unknown(horizon_s):
    """The share of the classes that are not followed is about what they have where they are, by the same rule."""
    config = replace_values(CONFIG, {'likelihood.planning_horizon_s': horizon_s})
    whole, one = ask(config), ask(replace_values(config, {'homotopy.max_candidates': 1}))
    assert whole.unknown == 0.0 and len(whole.candidates) == 4 and len(one.candidates) == 1
    followed = next(each for each in whole.candidates if each.label == one.most_likely)
    assert one.unknown == pytest.approx(1.0 - followed.likelihood, abs=0.15)
    assert one.candidates[0].likelihood == pytest.approx(1.0 - one.unknown)


def test_goals_that_are_not_followed_are_unknown():
    angles = np.linspace(-0.7, 0.7, 80)
    found = ask(
        replace_values(CONFIG, {'foc.steps': 5}), 0.3 * np.column_stack([np.cos(angles), np.sin(angles)]), make_obstacles()
    )
    assert len(found.candidates) == 64
    assert found.unknown == pytest.approx(16.0 / 80.0, abs=0.02) and total(found) == pytest.approx(1.0)


def test_where_nothing_is_solved_all_is_unknown():
    hard = replace_values(CONFIG, {'foc.eta': 0.999, 'foc.noise_x': 2.0, 'foc.noise_y': 2.0, 'likelihood.shortfall': np.inf})
    found = ask(hard)
    assert found.unknown == 1.0 and found.most_likely is None and total(found) == 1.0


def test_the_unknown_share_is_published():
    whole, one = ask(), ask(replace_values(CONFIG, {'homotopy.max_candidates': 1}))
    table = encode_likelihoods(one, TYPES)
    assert table.layout.dim[0].label == f'{one.candidates[0].label};unknown'
    rows = np.asarray(table.data).reshape(-1, 4)
    assert rows[:, 0].sum() == pytest.approx(1.0) and np.isnan(rows[1, 1:]).all() and rows[1, 0] == one.unknown
    assert 'unknown' not in encode_likelihoods(whole, TYPES).layout.dim[0].label
    texts = [each.text for each in encode_markers(one, 'xy', TYPES).markers]
    assert any(text.endswith(f'{100 * one.unknown:.0f} % unknown') for text in texts)
    assert encode_prediction(one)['unknown'] == one.unknown


def test_a_class_that_the_search_misses_keeps_its_answer_for_a_moment():
    one = replace_values(CONFIG, {'homotopy.max_candidates': 1})
    whole, tracks = predict(CONFIG, HAND, ROW, GOALS, NO_TRACKS)
    ages = []
    for tick in range(1, 13):
        prediction, tracks = predict(one, replace(HAND, stamp_ns=20_000_000 * tick), ROW, GOALS, tracks)
        ages.append({each.label: each.age_s for each in prediction.candidates if each.age_s})
        assert total(prediction) == pytest.approx(1.0)
        assert all(np.hypot(*each.mean[0, :2]) < 1e-9 for each in prediction.candidates)
    lost = {each.label for each in whole.candidates} - {whole.most_likely}
    for tick, found in enumerate(ages, 1):
        assert found == ({label: pytest.approx(0.02 * tick) for label in lost} if tick <= 10 else {})
