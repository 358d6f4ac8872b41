"""The next row and weaving are found from the sides; ways beyond the next row are equally likely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.classes.rows import Decisions, find_decisions
from foc_ros.core.config import Config, LikelihoodConfig
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import LEFT, RIGHT, HandState, make_obstacles

OBSTACLES = make_obstacles([[0.1, 0.05], [0.1, -0.05], [0.3, 0.0]], 0.01)
GOALS = np.array([[0.5, 0.02], [0.5, -0.02]])
SIDES = np.array(
    [[LEFT, LEFT, LEFT], [RIGHT, LEFT, LEFT], [RIGHT, LEFT, RIGHT], [LEFT, RIGHT, LEFT], [RIGHT, RIGHT, RIGHT]], dtype=np.int8
)
GOAL = np.array([0, 1, 0, 1, 0])
COSTS = np.array([1.0, 2.0, 3.0, 2.5, 4.0])
CONFIG = replace(LikelihoodConfig(), beta=2.0, planning_horizon_s=0.0, weaving=1.5)


def make_hand(x: float) -> HandState:
    return HandState(0, np.array([x, 0.0, 0.3, 0.0, 0.0, 0.0]), np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def test_the_next_row_is_the_first_open_one_ahead() -> None:
    found = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.0), GOALS)
    gap = found.next_gap
    assert gap[1] == gap[2] and len(set(gap.tolist())) == 4
    assert found.woven.tolist() == [0, 0, 0, 1, 0]
    beyond = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.2), GOALS)
    assert len(set(beyond.next_gap[[0, 1, 3]].tolist())) == 1
    assert beyond.next_gap[0] != beyond.next_gap[4] and not beyond.woven.any()


def test_where_all_agree_nothing_is_open() -> None:
    same, no_sides = SIDES[:1].repeat(3, axis=0), np.zeros((3, 0), dtype=np.int8)
    found = find_decisions(same, np.zeros(3, dtype=np.intp), OBSTACLES, make_hand(0.0), GOALS)
    assert not found.next_gap.any() and not found.woven.any()
    assert find_decisions(no_sides, GOAL[:3], make_obstacles(), make_hand(0.0), GOALS).next_gap.tolist() == [0, 1, 0]


def test_where_no_row_is_ahead_the_choice_of_a_goal_is_a_near_one() -> None:
    decisions = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.4), GOALS)
    assert decisions.next_gap.tolist() == GOAL.tolist()
    p = compute_likelihoods(
        np.array([1.0, 3.0]), CONFIG, decisions=Decisions(np.array([0, 1]), np.array([0, 1]), np.zeros(2, dtype=np.intp))
    )
    assert p[0] / p[1] == pytest.approx(3.0**CONFIG.beta)


def test_gaps_keep_their_weight_and_share_it_evenly() -> None:
    decisions = Decisions(np.array([0, 1, 1, 2, 3]), np.arange(5), np.zeros(5, dtype=np.intp))
    near, p = compute_likelihoods(COSTS, CONFIG), compute_likelihoods(COSTS, CONFIG, decisions=decisions)
    np.testing.assert_allclose(np.bincount(decisions.next_gap, p), np.bincount(decisions.next_gap, near))
    assert p[1] == pytest.approx(p[2])


def test_goals_of_one_way_are_compared_in_full_and_its_weight_is_their_number() -> None:
    decisions = Decisions(np.zeros(5, dtype=np.intp), np.array([0, 0, 1, 1, 2]), np.zeros(5, dtype=np.intp))
    p = compute_likelihoods(COSTS, CONFIG, decisions=decisions)
    assert p[0] / p[1] == pytest.approx((COSTS[1] / COSTS[0]) ** CONFIG.beta)
    np.testing.assert_allclose(np.bincount(decisions.way, p), [0.4, 0.4, 0.2])


def test_classes_that_pass_all_open_obstacles_alike_take_one_way() -> None:
    sides, goal = np.repeat(SIDES, 2, axis=0), np.tile([0, 1], 5)
    found = find_decisions(sides, goal, OBSTACLES, make_hand(0.0), GOALS)
    assert (found.way[::2] == found.way[1::2]).all() and len(set(found.way.tolist())) == 5


def test_weaving_costs_a_factor() -> None:
    straight = Decisions(np.arange(5), np.arange(5), np.zeros(5, dtype=np.intp))
    p, woven = (compute_likelihoods(COSTS, CONFIG, decisions=each) for each in (straight, straight._replace(woven=np.eye(5)[3])))
    assert woven[3] / woven[0] == pytest.approx(p[3] / p[0] * np.exp(-1.5))


def test_who_plans_the_whole_way_weighs_all_choices_alike() -> None:
    decisions = Decisions(np.array([0, 0, 1, 1, 1]), np.arange(5), np.array([0, 0, 0, 1, 0]))
    p = compute_likelihoods(COSTS, replace(CONFIG, planning_horizon_s=1000.0), decisions=decisions)
    weights = COSTS**-CONFIG.beta * np.exp(-CONFIG.weaving * decisions.woven)
    np.testing.assert_allclose(p, weights / weights.sum())


def test_where_no_class_can_be_solved_there_is_no_likelihood() -> None:
    config = Config().with_values({'foc.eta': 0.999, 'foc.noise_x': 2.0, 'foc.noise_y': 2.0, 'likelihood.shortfall': np.inf})
    found, _ = predict(config, make_hand(0.0), OBSTACLES, GOALS, NO_TRACKS)
    assert found.candidates and not found.candidates_with_likelihood
