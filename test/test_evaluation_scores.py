# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Forecasts, their scores, regions of positions and baselines, against values computed by hand and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import TWO_CLASSES, H, make_candidates, observation, recorded

from foc_ros.analysis.evaluation.baselines import (
    UNCERTAINTY,
    Forecast,
    boltzmann_shares,
    compute_straight_costs,
    compute_straight_positions,
    forecast_published,
    forecast_uniform,
    guess_constant_velocity,
    guess_nearest_gap,
    guess_shortest_path,
    power_rule_shares,
)
from foc_ros.analysis.evaluation.observations import GAP, GOAL, PATH_CLASS, ask, find_relevant_obstacles
from foc_ros.analysis.evaluation.positions import SINGER_SETTINGS, compute_position_scores, find_denser_share, forecast_singer
from foc_ros.analysis.evaluation.report import find_gaps, make_summary, make_verdict
from foc_ros.analysis.evaluation.scores import (
    Scores,
    choose_held_out,
    compare_scores,
    compute_reliability,
    find_tenths,
    score_forecasts,
    summarise,
)
from foc_ros.analysis.evaluation.truth import HORIZONS_S, TIMES_S
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.solution import LEFT, RIGHT

L, R = LEFT, RIGHT
NO_OBSTACLES = {'centre': (), 'row': (), 'true_sides': ()}
TWO_ROWS = {'centre': [(1.0, 0.2), (1.0, -0.2), (2.0, 0.0)], 'row': (0, 0, 1)}


def test_rows_of_two_and_one_have_six_classes_the_next_row_three_gaps_and_a_weaving_way_is_one_more():
    observed = observation(make_candidates([[L, L, L], [R, L, R]]), **TWO_ROWS, true_sides=(R, L, R))
    relevant = find_relevant_obstacles(recorded(observed))
    path_class, gap = ask(PATH_CLASS, observed, relevant), ask(GAP, observed, relevant)
    assert path_class.possible == 6 and path_class.answers[path_class.truth] == (R, L, R) and path_class.given.tolist() == [0, 1]
    assert gap.possible == 3 and gap.answers[gap.truth] == (R, L)
    assert find_gaps(observed) == [1, 0], 'row by row; the right of a movement along x counts as low'
    weaving = replace(observed, truth=replace(observed.truth, sides=np.array([L, R, R], dtype=np.int8)))
    for name, count in ((PATH_CLASS, 7), (GAP, 4)):
        question = ask(name, weaving, find_relevant_obstacles(recorded(weaving)))
        assert question.possible == count, 'a way that was taken is possible, although no candidate gives it'
        uniform, ours = (rule(weaving, question, None) for rule in (forecast_uniform, forecast_published))
        assert uniform.true_probability(question) == pytest.approx(1.0 / count)
        assert 0.0 < ours.true_probability(question) < 1.0 / count


def test_the_goal_is_in_question_where_there_are_several_and_one_was_reached():
    goals = [(2.0, 0.0), (2.0, 1.0), (2.0, 2.0)]
    observed = observation(make_candidates(np.zeros((2, 0)), goal=[2, 0]), **NO_OBSTACLES, goals=goals, goal=2)
    found = ask(GOAL, observed, frozenset())
    assert (found.possible, found.truth, found.given.tolist()) == (3, 2, [2, 0])
    assert ask(GOAL, observation(TWO_CLASSES, goals=goals, goal=None), frozenset()) is None


def ask_of(observed, name=PATH_CLASS):
    return ask(name, observed, frozenset('012'))


def test_every_possible_answer_keeps_some_probability_and_all_sum_to_one():
    observed = observation(make_candidates([[L], [R]], likelihood=[0.8, 0.2]))
    forecast = Forecast.from_shares(observed.candidates.likelihood, ask_of(observed))
    np.testing.assert_allclose(forecast.probability, (1.0 - UNCERTAINTY) * np.array([0.8, 0.2]) + UNCERTAINTY / 2.0)
    np.testing.assert_allclose(forecast_uniform(observed, ask_of(observed), None).probability, [0.5, 0.5])
    np.testing.assert_allclose(Forecast.from_answer((R,), 0.6, ask_of(observed)).probability, [0.2, 0.8])
    observed = observation(make_candidates([[L, R, L], [R, L, L]], likelihood=[0.3, 0.7]), **TWO_ROWS, true_sides=(R, R, R))
    question = ask_of(observed)
    by_shares = Forecast.from_shares(observed.candidates.likelihood, question)
    # no candidate gives the true answer
    assert by_shares.true_probability(question) == pytest.approx(UNCERTAINTY / 6.0)
    for forecast in (by_shares, forecast_uniform(observed, question, None), Forecast.from_answer((R, L, L), 0.4, question)):
        assert forecast.probability.sum() + question.unlisted * forecast.each_other == pytest.approx(1.0)


def make_scores(confidence, right, recording=None, progress=None, left_s=None):
    zeros = np.zeros(len(confidence))
    recording, progress, left_s = (zeros if each is None else np.array(each) for each in (recording, progress, left_s))
    right = np.array(right, dtype=float)
    return Scores(recording.astype(int), progress, left_s, zeros + 2.0, zeros, np.array(confidence), right, zeros)


def test_a_forecast_is_scored_by_likelihood_confidence_brier_and_correctness():
    observed = observation(make_candidates([[L], [R]], likelihood=[0.8, 0.2]), progress=0.5, approach=0.6)
    question, p = ask_of(observed), (1.0 - UNCERTAINTY) * 0.8 + UNCERTAINTY / 2.0
    forecasts = Forecast.from_shares(observed.candidates.likelihood, question), forecast_uniform(observed, question, None)
    found = score_forecasts((0, observed, question, each) for each in forecasts)
    np.testing.assert_allclose(found.log_likelihood, np.log([p, 0.5]))
    np.testing.assert_allclose(found.confidence, [p, 0.5])
    np.testing.assert_allclose(found.correct, [1.0, 0.5])
    np.testing.assert_allclose(found.brier, [2.0 * (1.0 - p) ** 2, 0.5])
    assert found.progress.tolist() == found.left_s.tolist() == [0.5, 0.5]
    gap = ask(GAP, observed, frozenset('0'))
    assert score_forecasts([(0, observed, gap, forecast_uniform(observed, gap, None))]).progress.tolist() == [0.6]


def test_the_calibration_error_is_the_distance_of_confidence_and_share_correct():
    found = make_scores([0.95, 0.95, 0.95, 0.95, 0.55, 0.55], [1, 1, 1, 0, 0, 0])
    assert summarise(found)['expected_calibration_error'] == pytest.approx((4 * 0.2 + 2 * 0.55) / 6)
    assert [each['count'] for each in compute_reliability(found)] == [0, 0, 0, 0, 0, 2, 0, 0, 0, 4]
    assert summarise(make_scores([0.75] * 4, [1, 1, 1, 0]))['expected_calibration_error'] == pytest.approx(0.0)


def test_the_interval_of_a_bin_is_that_of_a_bootstrap_over_recordings():
    one = compute_reliability(make_scores([0.95] * 40, [1, 0] * 20, [0] * 40))[9]
    assert one['interval'] == [0.5, 0.5]
    two = compute_reliability(make_scores([0.95] * 40, [1] * 20 + [0] * 20, [0] * 20 + [1] * 20))[9]
    assert two['interval'] == [0.0, 1.0]
    many = compute_reliability(make_scores([0.95] * 400, [1, 0] * 200, range(400)))[9]
    # the binomial interval of a share of a half of 400
    np.testing.assert_allclose(many['interval'], [0.451, 0.549], atol=0.006)
    assert compute_reliability(make_scores([0.95], [1]))[0]['interval'] is None


def test_a_comparison_counts_recordings_and_names_the_tenths_that_are_worse():
    ours = make_scores([0.5] * 40, [1] * 40, range(40), [0.05] * 20 + [0.95] * 20)
    change = np.where(np.arange(40) < 20, 0.1, -0.5)
    found = compare_scores(ours, ours._replace(log_likelihood=change), is_share=False)
    assert found['difference'] == pytest.approx(0.2) and found['worse_tenths'] == [1]
    assert 0.0 < found['interval'][0] < 0.2 < found['interval'][1]
    assert compare_scores(ours, ours._replace(correct=np.zeros(40)), is_share=True)['difference'] == 1.0
    one = ours._replace(recording=np.full(40, 3.0))
    assert compare_scores(one, one._replace(log_likelihood=change), is_share=False)['interval'] is None


@pytest.mark.parametrize(
    ('interval', 'words'),
    [
        ([0.1, 0.3], 'foc is better than uniform (+0.2 nat, worse in tenths 1 to 3, 5).'),
        ([-0.1, 0.3], 'foc is not distinguishable from uniform (+0.2 nat, worse in tenths 1 to 3, 5).'),
        ([-0.4, -0.1], 'foc is worse than uniform (+0.2 nat, worse in tenths 1 to 3, 5).'),
        (None, 'foc is by one recording not distinguishable from uniform (+0.2 nat).'),
    ],
)
def test_the_verdict_is_by_the_interval(interval, words):
    errors = {'likelihood-weighted': 0.04, 'most likely': 0.03, 'constant velocity': 0.05, 'straight minimum jerk': 0.0401}
    answer = {
        'recordings': 20,
        'comparisons': {PATH_CLASS: {'uniform': {'difference': 0.2, 'interval': interval, 'worse_tenths': [1, 2, 3, 5]}}},
        'positions': {
            'displacement_m': {name: {'final': {'0.5': each}} for name, each in errors.items()},
            'inside_all': {'0.9': {'0.5': 0.7}},
        },
    }
    assert make_verdict(answer) == [
        f'Paths: {words}',
        'Positions 0.5 s ahead: 40 mm away on average, better than constant velocity (50 mm), '
        'like straight minimum jerk (40 mm).',
        'Uncertainty: the region of 90 % holds 70 % of the true positions 0.5 s ahead, so it is too narrow.',
    ]


def test_the_summary_names_the_best_simple_predictors_and_what_the_recordings_tell():
    scores = {'foc': (0.8, 0.5), 'nearest gap': (0.7, 0.2), 'Boltzmann': (0.6, 0.4), 'uniform': (0.5, 0.25)}
    by_name = {name: {'right': right, 'log_likelihood': np.log(chance)} for name, (right, chance) in scores.items()}
    intervals = {'nearest gap': [0.1, 0.3], 'Boltzmann': [-0.1, 0.3], 'uniform': [0.1, 0.3]}
    answer = {
        'recordings': 6,
        'predictions': 40,
        'questions': {PATH_CLASS: by_name},
        'comparisons': {PATH_CLASS: {name: {'interval': each} for name, each in intervals.items()}},
        'positions': {
            'displacement_m': {'likelihood-weighted': {'final': {'0.5': 0.0314}}, 'constant velocity': {'final': {'0.5': 0.05}}},
            'inside_all': {'0.9': {'0.5': 0.87}},
        },
    }
    assert make_summary(answer) == [
        'foc predicted 6 recordings, at 40 moments on the way.',
        'The likeliest path past the obstacles was the one that the hand took in 80 % of them; with the best simple predictor, '
        'nearest gap, in 70 %. The true one had a probability of 50 % (geometric mean); the best simple predictor, Boltzmann, '
        'gives it 40 %, a guess among equals 25 %.',
        'By this probability, foc is better than nearest gap; not distinguishable from Boltzmann.',
        '0.5 s ahead, the predicted position was 31 mm from the true one on average; that of constant velocity 50 mm.',
        'The region that should hold 90 % of the true positions then held 87 %.',
    ]
    told = ' '.join(make_summary(answer | {'recordings': 5}))
    assert 'foc is' not in told and '6 recordings are needed to tell differences between predictors from chance.' in told


@pytest.mark.parametrize(
    ('share', 'recordings', 'words'),
    [
        (1.0, 2, 'may be chance with 2 recordings'),
        (1.0, 34, 'may be chance with 34 recordings'),
        (1.0, 35, 'too wide'),
        (0.6, 1, 'may be chance with 1 recording.'),
        (0.7, 20, 'too narrow'),
        (0.86, 5, 'about right'),
    ],
)
def test_a_region_is_called_too_wide_or_narrow_only_where_chance_does_not_explain_it(share, recordings, words):
    positions = {'displacement_m': {'likelihood-weighted': {'final': {}}}, 'inside_all': {'0.9': {'0.5': share}}}
    (sentence,) = make_verdict({'comparisons': {}, 'positions': positions, 'recordings': recordings})
    assert words in sentence


def test_a_summary_counts_by_tenths_which_include_their_lower_bound():
    found = summarise(make_scores([0.5] * 4, [1, 0, 1, 1], None, [0.05, 0.06, 0.95, 1.0], [1.0, 0.9, 0.2, 0.0]))
    assert [each['predictions'] for each in found['by_tenth']] == [2, 0, 0, 0, 0, 0, 0, 0, 0, 2]
    assert found['by_tenth'][0]['right'] == 0.5 and found['by_tenth'][1]['right'] is None
    assert found['right_from_half_way'] == 1.0
    assert (found['leads_for_good_from'], found['leads_for_good_before_s']) == (0.95, 0.2)
    assert found['gain'] == pytest.approx(np.log(2.0))
    assert find_tenths(np.array([0.0, 0.1, 0.3, 0.7, 0.99, 1.0])).tolist() == [0, 1, 3, 7, 9, 9]


def test_a_held_out_recording_gets_the_setting_that_is_best_for_the_others():
    table = np.array([[0.0, -1.0, -3.0], [-5.0, 0.0, -3.0], [-9.0, -9.0, -1.0]])
    assert choose_held_out(table).tolist() == [2, 2, 1]
    assert choose_held_out(table[1:2]).tolist() == [1], 'a single one has no others'


def test_displacements_are_averaged_up_to_the_horizon_and_ellipses_cover_what_is_inside():
    away = np.column_stack([8.0 * np.array(TIMES_S), np.zeros(len(TIMES_S))])
    away[-1] = np.nan
    scores = compute_position_scores([recorded(observation(TWO_CLASSES, positions=away))])
    likely = scores['displacement_m']['most likely']
    assert likely['final'] == {'0.25': pytest.approx(2.0), '0.5': pytest.approx(4.0), '1': None}
    assert likely['average']['0.5'] == pytest.approx(2.5)
    # with unit covariance, 90 % lie within 2.15 and 50 % within 1.18
    assert scores['inside'] == {'0.5': {'0.25': 0.0, '0.5': 0.0, '1': None}, '0.9': {'0.25': 1.0, '0.5': 0.0, '1': None}}
    assert scores['displacement_m']['constant velocity']['final']['0.5'] == pytest.approx(3.5)
    # two equal candidates of unit covariance, both at the origin
    flat = np.log(2 * np.pi)
    assert scores['nlpd']['foc'] == {'0.25': pytest.approx(flat + 2.0), '0.5': pytest.approx(flat + 8.0), '1': None}
    assert scores['nlpd']['Singer Kalman']['0.5'] > 0.0
    ended = observation(TWO_CLASSES, positions=np.full((H, 2), np.nan))
    both = compute_position_scores([recorded(observation(TWO_CLASSES, positions=away), ended)])
    assert str(both['displacement_m']) == str(scores['displacement_m']), 'a movement that has ended does not count'


@pytest.mark.parametrize('apart', [0.0, 1.5, 10.0])
def test_the_region_holds_its_share_of_samples(apart):
    draws, count = np.random.default_rng(5), 2000
    likelihood = np.array([0.6, 0.3, 0.1])
    mean = apart * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    covariance = np.array([np.diag([1.0, 1.0]), [[2.0, 0.9], [0.9, 0.5]], np.diag([0.1, 0.1])])
    component, noise = draws.choice(3, count, p=likelihood), draws.standard_normal((count, 2))
    positions = mean[component] + np.einsum('nij,nj->ni', np.linalg.cholesky(covariance)[component], noise)
    means, covariances = (np.repeat(each[:, None], count, axis=1) for each in (mean, covariance))
    found = find_denser_share(likelihood, means, covariances, positions)
    for level in (0.5, 0.9):
        assert np.mean(found < level) == pytest.approx(level, abs=0.03)


def test_a_position_in_a_less_likely_class_is_in_the_region_and_not_in_the_ellipse_of_the_likeliest():
    two = make_candidates([[LEFT], [RIGHT]], likelihood=[0.6, 0.4])
    two = replace(two, mean=np.stack([np.zeros((H, 2)), np.full((H, 2), [10.0, 0.0])]))
    true = np.full((H, 2), [11.6, 0.0])
    true[-1] = np.nan
    scores = compute_position_scores([recorded(observation(two, positions=true, true_sides=(RIGHT,)))])
    assert scores['inside']['0.9'] == {'0.25': 0.0, '0.5': 0.0, '1': None}
    assert scores['inside_taken']['0.9'] == {'0.25': 1.0, '0.5': 1.0, '1': None}
    assert scores['inside_all']['0.9'] == {'0.25': 1.0, '0.5': 1.0, '1': None}
    assert scores['inside_all']['0.5'] == {'0.25': 0.0, '0.5': 0.0, '1': None}


@pytest.mark.parametrize(
    ('velocity', 'side'), [((1.0, 0.6), L), ((1.0, -0.6), R), ((1.0, 0.1), R), ((0.0, 0.2), L), ((-0.5, 0.2), L)]
)
def test_constant_velocity_passes_the_obstacle_on_its_line_or_on_the_side_to_which_it_turns(velocity, side):
    observed = observation(TWO_CLASSES, centre=[(1.0, 0.3)], hand=(0.0, 0.0, *velocity, 0.0, 0.0))
    assert guess_constant_velocity(observed, ask_of(observed)) == (side,)


def test_towards_goals_constant_velocity_takes_the_direction_and_the_nearest_is_the_nearest():
    candidates, goals = make_candidates(np.zeros((3, 0)), goal=[0, 1, 2]), [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
    observed = observation(candidates, **NO_OBSTACLES, goals=goals, hand=(0.0, 0.0, 0.9, 1.0, 0.0, 0.0))
    assert guess_constant_velocity(observed, ask_of(observed, GOAL)) == (2,)
    assert guess_nearest_gap(replace(observed, hand=np.array([0.1, 0.4, 1.0, 0.0, 0.0, 0.0])), ask_of(observed, GOAL)) == (1,)
    assert guess_shortest_path(observed, ask_of(observed, GOAL)) == (0,)


def test_boltzmann_weighs_differences_and_the_power_rule_ratios_of_effort():
    observed = observation(make_candidates([[L], [R]], cost_to_go=[1.0, 3.0]))
    np.testing.assert_allclose(boltzmann_shares(observed, np.log(2.0)), [0.8, 0.2])
    np.testing.assert_allclose(power_rule_shares(observed, LikelihoodConfig(beta=2.0)), [0.9, 0.1])


def reaching(hand=(0.0,) * 6):
    """Return an observation of a hand that needs 2 s to each of two goals."""
    candidates = replace(make_candidates(np.zeros((2, 0)), goal=[0, 1]), time_s=np.array([2.0, 2.0]))
    return observation(candidates, **NO_OBSTACLES, goals=[(1.0, 0.0), (0.0, 2.0)], hand=hand)


def test_straight_minimum_jerk_has_the_known_effort_and_path_from_rest_and_the_effort_of_its_own_jerk_from_any_state():
    np.testing.assert_allclose(compute_straight_costs(reaching()), [720.0 / 2.0**5, 720.0 * 4.0 / 2.0**5])
    s = np.array([0.5, 1.0])
    expected = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    np.testing.assert_allclose(compute_straight_positions(reaching(), 0, 2.0 * s)[:, 0], expected)
    np.testing.assert_allclose(compute_straight_positions(reaching(), 0, np.array([5.0])), [[1.0, 0.0]])
    observed = reaching((0.2, -0.1, 0.5, 0.3, -1.0, 2.0))
    t = np.linspace(0.0, 2.0, 4001)
    for goal in (0, 1):
        path = compute_straight_positions(observed, goal, t)
        jerk = np.gradient(np.gradient(np.gradient(path, t, axis=0), t, axis=0), t, axis=0)[5:-5]
        assert (jerk**2).sum() * t[1] == pytest.approx(compute_straight_costs(observed)[goal], rel=0.02)
        np.testing.assert_allclose(path[-1], observed.goals[goal], atol=1e-9)
        np.testing.assert_allclose((path[1] - path[0]) / t[1], [0.5, 0.3], atol=1e-2)


AHEAD = np.array(HORIZONS_S)


def test_a_steady_motion_is_continued_and_a_forecast_knows_nothing_of_later_samples():
    stamps_ns = np.arange(0, 2_000_000_000, 20_000_000)
    positions = np.outer(stamps_ns / 1e9, [0.3, -0.1])
    mean, variance = forecast_singer(stamps_ns, positions, stamps_ns[[20, 99]], AHEAD)
    expected = positions[99] + AHEAD[:, None] * [0.3, -0.1]
    np.testing.assert_allclose(mean[1], np.tile(expected, (len(SINGER_SETTINGS), 1, 1)), atol=2e-3)
    assert mean.shape == (2, len(SINGER_SETTINGS), 3, 2) and (np.diff(variance, axis=2) > 0.0).all()
    later = np.where(np.arange(100)[:, None] > 50, 1.0, positions)
    for one, two in zip(*(forecast_singer(stamps_ns, each, stamps_ns[:51], AHEAD) for each in (positions, later)), strict=True):
        np.testing.assert_array_equal(one, two)
