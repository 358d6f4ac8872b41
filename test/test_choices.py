"""How far ahead an operator plans, and how precisely, is learnt: causally, equally for equal input, until a reset, in bounds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foc_ros.core.classes.rows import Decisions
from foc_ros.core.config import Config, LikelihoodConfig, replace_values
from foc_ros.core.learning.choices import FACTORS, HORIZONS, OWN_SPREAD, Choice, Preferences
from foc_ros.core.likelihood import compute_likelihoods, compute_lookahead_share
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import LEFT, NANOSECONDS, RIGHT, HandSample, HandState, make_obstacles
from foc_ros.ros.parameters import load_parameter_file, write_parameter_file

LIKELIHOOD = Config().likelihood
OBSTACLES = make_obstacles([[0.1, 0.0], [0.2, 0.0]], 0.02, 0.001)
GOALS = np.array([[0.3, 0.0]])
CLASSES = [(LEFT, LEFT), (LEFT, RIGHT), (RIGHT, LEFT), (RIGHT, RIGHT)]
STEP_NS = NANOSECONDS // 10
TIME_S = 3.0
"""Time to go of all classes [s]."""
CONFIG = replace_values(Config(), {'rate_hz': 10.0, 'foc.steps': 15, 'estimator.position_stddev': 1e-4})


def choose(
    costs: list[float],
    stamp_ns: int,
    goals: np.ndarray = GOALS,
    goal: tuple[int, ...] = (0, 0, 0, 0),
    onset_ns: int | None = None,
) -> Choice:
    """Return a choice between the four classes about two obstacles in a row of one each."""
    sides = tuple(dict(zip(OBSTACLES.ids, each, strict=True)) for each in CLASSES)
    decisions = Decisions(np.array([0, 0, 1, 1]), np.arange(4), np.zeros(4, dtype=np.intp))
    made = stamp_ns, onset_ns, OBSTACLES, goals
    return Choice(*made, np.array(goal), sides, np.array(costs), np.zeros(4), None, decisions, TIME_S, None)


def move(preferences: Preferences, sides: tuple[int, int], costs: list[float], start_s: float = 1.0) -> Preferences:
    """Follow a movement that passes both obstacles on given sides, with a choice at every state, and the rest after it."""
    start_ns = int(start_s * NANOSECONDS)
    for row, x in enumerate(np.linspace(0.0, 0.3, 13)):
        y = np.interp(x, [0.0, 0.1, 0.2, 0.3], [0.0, *(0.05 if each == LEFT else -0.05 for each in sides), 0.0])
        mean = np.array([x, y, 0.3, 0.0, 0.0, 0.0])
        hand = HandState(start_ns + row * STEP_NS, mean, np.eye(6), onset_ns=start_ns, onset_position=np.zeros(2))
        preferences = preferences.follow(hand, LIKELIHOOD).add(choose(costs, hand.stamp_ns, onset_ns=start_ns))
    return preferences.follow(HandState(start_ns + 14 * STEP_NS, np.zeros(6), np.eye(6)), LIKELIHOOD)


FIRST_IS_CHEAP, FIRST_AND_LAST_ARE_CHEAP = [1.0, 1.0, 3.0, 3.0], [1.0, 3.0, 3.0, 9.0]


def follow_movements(sides: list[tuple[int, int]], costs: list[float]) -> Preferences:
    """Return the preferences after movements in turn, each of them past both obstacles on given sides."""
    preferences = Preferences()
    for number, each in enumerate(sides):
        preferences = move(preferences, each, costs, 10.0 * number + 1.0)
    return preferences


def test_who_leaves_far_choices_open_looks_ahead_and_who_follows_the_costs_there_plans() -> None:
    near_only = follow_movements([(LEFT, LEFT), (LEFT, RIGHT)] * 10, FIRST_AND_LAST_ARE_CHEAP)
    throughout = follow_movements([(LEFT, LEFT)] * 20, FIRST_AND_LAST_ARE_CHEAP)
    shares = [compute_lookahead_share(TIME_S, each.adapt(LIKELIHOOD)) for each in (near_only, throughout)]
    assert compute_lookahead_share(TIME_S, LIKELIHOOD) == 0.5 and shares[0] > 0.9 and shares[1] < 0.05
    assert near_only.adapt(LIKELIHOOD).planning_horizon_s < TIME_S < throughout.adapt(LIKELIHOOD).planning_horizon_s


def test_precision_follows_choices_and_all_exponents_follow_it() -> None:
    precise, careless = (follow_movements(each, FIRST_IS_CHEAP) for each in ([(LEFT, LEFT)] * 20, CLASSES * 5))
    assert careless.find_mean(LIKELIHOOD)[0] < 0.6 < 1.5 < precise.find_mean(LIKELIHOOD)[0]
    factor, horizon_s, spread = precise.find_mean(LIKELIHOOD)
    adapted = precise.adapt(LIKELIHOOD)
    for name in ('beta', 'shortfall', 'beta_beyond'):
        assert getattr(adapted, name) == pytest.approx(factor * getattr(LIKELIHOOD, name))
    assert (adapted.planning_horizon_s, adapted.planning_spread) == (horizon_s, spread)
    assert OWN_SPREAD < spread < LIKELIHOOD.planning_spread


@pytest.mark.parametrize(('horizon_s', 'spread'), [(0.0, 0.3), (2.0, OWN_SPREAD), (2.0, 0.1)])
def test_a_horizon_that_is_known_is_not_learnt(horizon_s: float, spread: float) -> None:
    known = replace(LIKELIHOOD, planning_horizon_s=horizon_s, planning_spread=spread)
    preferences = follow_movements([(LEFT, LEFT), (LEFT, RIGHT)] * 3, FIRST_AND_LAST_ARE_CHEAP)
    against = replace(preferences, scores=-1e4 * np.abs(np.log(HORIZONS[-1] / HORIZONS))[:, None] * np.ones(len(FACTORS)))
    for each in (preferences, against):
        assert each.find_mean(known)[1:] == pytest.approx((horizon_s, spread), rel=1e-6)


def test_the_score_is_the_likelihood_of_the_classes_that_agree() -> None:
    choice, agrees = choose([1.0, 2.0, 4.0, 8.0], 0), np.array([False, True, False, False])
    found = choice.score(agrees, LIKELIHOOD)
    for row, horizon in enumerate(HORIZONS):
        for column, factor in enumerate(FACTORS):
            scaled = replace(
                LIKELIHOOD,
                planning_horizon_s=horizon * LIKELIHOOD.planning_horizon_s,
                planning_spread=OWN_SPREAD,
                beta=factor * LIKELIHOOD.beta,
                beta_beyond=factor * LIKELIHOOD.beta_beyond,
                shortfall=factor * LIKELIHOOD.shortfall,
            )
            shares = compute_likelihoods(choice.costs, scaled, None, choice.shortfalls, choice.decisions, TIME_S)
            assert found[row, column] == pytest.approx(np.log(0.99 * shares[1] + 0.01 / 4))


def test_a_movement_counts_from_its_end_on_and_rest_and_interruptions_do_not() -> None:
    judged = move(Preferences(), (LEFT, LEFT), [1.0, 2.0, 4.0, 8.0])
    assert judged.movements == 1 and not judged.choices
    hand = HandState(0, np.zeros(6), np.eye(6))
    resting = Preferences().follow(hand, LIKELIHOOD).add(choose([1.0, 2.0, 4.0, 8.0], 0))
    assert resting.choices and resting.follow(replace(hand, stamp_ns=STEP_NS), LIKELIHOOD).movements == 0
    assert not resting.interrupt().states and not resting.interrupt().choices
    assert Preferences().add(choose([1.0, 2.0, 4.0, 8.0], 0)).choices == ()
    assert Preferences().adapt(LIKELIHOOD) is LIKELIHOOD


def test_a_prediction_counts_for_the_movement_in_which_it_began() -> None:
    costs, rest = [1.0, 2.0, 4.0, 8.0], HandState(0, np.zeros(6), np.eye(6))
    early, last = choose(costs, 0), choose(costs, STEP_NS // 10)
    moving = replace(rest, stamp_ns=STEP_NS, onset_ns=STEP_NS, onset_position=np.zeros(2))
    begun = Preferences().follow(rest, LIKELIHOOD).add(early).follow(moving, LIKELIHOOD)
    assert begun.add(last).choices == (last,), 'a prediction at rest that ends in the movement replaces the one before it'
    now = choose(costs, STEP_NS, onset_ns=STEP_NS)
    assert begun.add(last).add(now).choices == (last, now)
    ended = begun.follow(replace(rest, stamp_ns=2 * STEP_NS), LIKELIHOOD)
    assert ended.add(now).choices == (), 'a prediction of the movement before comes too late'


def test_the_goal_that_is_reached_counts_and_an_unclear_one_does_not() -> None:
    goals, states = np.array([[0.3, 0.1], [0.3, -0.1]]), [HandState(0, np.zeros(6), np.eye(6))]
    choice = choose([1.0] * 4, 0, goals, (0, 1, 0, 1))
    for end, expected in (((0.3, 0.09), [True, False, True, False]), ((0.3, 0.0), [True] * 4)):
        ends = HandState(1, np.array([*end, 0, 0, 0, 0]), np.eye(6))
        beyond_obstacles = replace(choice, obstacles=make_obstacles([[9.0, 9.0]], 0.02, 0.001), sides=({},) * 4)
        assert beyond_obstacles.find_agreeing([*states, ends]).tolist() == expected


def test_exponents_stay_within_the_bounds_of_the_parameters() -> None:
    extreme = LikelihoodConfig(beta=100.0, beta_beyond=100.0, shortfall=np.inf)
    scores = np.where(FACTORS[-1] == FACTORS, 0.0, -1e3) * np.ones((len(HORIZONS), 1))
    adapted = Preferences(movements=1, scores=scores).adapt(extreme)
    assert (adapted.beta, adapted.beta_beyond, adapted.shortfall) == (100.0, 100.0, np.inf)


@pytest.mark.parametrize('costs', [[0.0] * 4, [1e300, 1.0, 1e-300, 0.0]])
def test_extreme_costs_give_finite_factors(costs: list[float]) -> None:
    preferences = move(move(Preferences(), (RIGHT, LEFT), costs), (LEFT, LEFT), costs, 11.0)
    assert preferences.movements == 2
    assert np.isfinite(preferences.scores).all() and np.isfinite(preferences.find_mean(LIKELIHOOD)).all()


def reach(pipeline: Pipeline, aside: float, start_s: float) -> None:
    """Pass a reach past one obstacle through a pipeline that predicts, with rests before and after it."""
    pipeline.set_obstacles('cloud', make_obstacles([[0.15, 0.0]], 0.03, 0.001), int(start_s * NANOSECONDS), 'world')
    pipeline.set_goals(np.array([[0.3, 0.0]]), 'world')
    for t in np.arange(0.0, 1.6, 0.05):
        s = np.clip((t - 0.3) / 0.8, 0.0, 1.0)
        x = 0.3 * (10 * s**3 - 15 * s**4 + 6 * s**5)
        stamp_ns = int((start_s + t) * NANOSECONDS)
        pipeline.add_hand_sample(HandSample(stamp_ns, np.array([x, aside * np.sin(np.pi * x / 0.3)]), 0.0, 'world'))
        if pipeline.is_due:
            pipeline.predict()


def make_operator(config: Config) -> Pipeline:
    """Return a pipeline after three reaches."""
    pipeline = Pipeline(config)
    for number in range(3):
        reach(pipeline, 0.06, 1.0 + 10.0 * number)
    return pipeline


def test_equal_messages_give_equal_factors_and_a_reset_forgets_them() -> None:
    one, other = make_operator(CONFIG), make_operator(CONFIG)
    assert one.learnt.preferences.movements >= 2 and one.learnt.preferences.find_mean(CONFIG.likelihood)[0] != 1.0
    np.testing.assert_array_equal(one.learnt.preferences.scores, other.learnt.preferences.scores)
    assert one.adapted_config.likelihood == one.learnt.preferences.adapt(CONFIG.likelihood) != CONFIG.likelihood
    one.reset()
    assert one.learnt.preferences.movements == 0 and one.adapted_config is CONFIG


def test_it_can_be_switched_off_and_new_parameters_begin_anew() -> None:
    off = replace_values(CONFIG, {f'{each}.adaptation': 'none' for each in ('likelihood', 'duration', 'covariance')})
    pipeline = make_operator(off)
    assert (
        pipeline.learnt.preferences.movements == 0 and not pipeline.learnt.preferences.choices and pipeline.adapted_config is off
    )
    pipeline = make_operator(CONFIG)
    pipeline.reconfigure(replace_values(CONFIG, {'rate_hz': 20.0}))
    assert pipeline.learnt.preferences.movements >= 2
    pipeline.reconfigure(replace_values(CONFIG, {'likelihood.beta': 3.0}))
    assert pipeline.learnt.preferences.movements == 0


def test_what_was_learnt_is_exported_and_imported_as_a_parameter_file(tmp_path: Path) -> None:
    adapted = make_operator(CONFIG).adapted_config
    write_parameter_file('--operator', tmp_path / 'operator.yaml', adapted)
    assert load_parameter_file(tmp_path / 'operator.yaml') == adapted
