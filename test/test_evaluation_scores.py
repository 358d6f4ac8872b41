"""Forecasts and their scores, against values found by hand."""

from __future__ import annotations

import numpy as np
import pytest
from evaluation_samples import TWO_WAYS, observation, recorded, ways

from foc_ros.analysis.evaluation.forecasts import DOUBT, of_guess, of_shares, published, uniform
from foc_ros.analysis.evaluation.heldout import chosen
from foc_ros.analysis.evaluation.observations import TIMES_S
from foc_ros.analysis.evaluation.positions import position_scores
from foc_ros.analysis.evaluation.questions import GAP, GOAL, WAY, question, relevant
from foc_ros.analysis.evaluation.scores import Judged, calibration_error, judge, leads_from, reliability, summary, tenth
from foc_ros.core.types import LEFT, RIGHT

L, R = LEFT, RIGHT
TWO_ROWS = {'centre': [(1.0, 0.2), (1.0, -0.2), (2.0, 0.0)], 'row': (0, 0, 1)}


def test_with_rows_of_two_and_one_six_ways_are_open_and_three_gaps_of_the_next_row() -> None:
    seen = observation(ways([[L, L, L], [R, L, R]]), **TWO_ROWS, true_sides=(R, L, R))
    matters = relevant(recorded(seen))
    way, gap = question(WAY, seen, matters), question(GAP, seen, matters)
    assert way.open == 6 and way.answers[way.truth] == (R, L, R) and way.given.tolist() == [0, 1]
    assert gap.open == 3 and gap.answers[gap.truth] == (R, L)


def test_what_lies_behind_or_concerns_nobody_is_not_asked_about() -> None:
    seen = observation(ways([[L, L, L], [R, L, R]]), **TWO_ROWS, true_sides=(R, L, R), ahead=[False, False, True])
    assert question(WAY, seen, frozenset('012')).answers == ((L,), (R,))
    assert question(WAY, seen, frozenset('01')) is None
    assert question(GOAL, seen, frozenset()) is None


def test_an_answer_that_weaves_through_a_row_is_not_open() -> None:
    seen = observation(ways([[L, R, L], [R, L, L]]), **TWO_ROWS, true_sides=(R, R, R))
    found = question(WAY, seen, frozenset('012'))
    assert dict(zip(found.answers, found.is_open.tolist(), strict=True)) == {
        (L, R, L): False,
        (R, L, L): True,
        (R, R, R): True,
    }
    assert found.unlisted == 4


def test_a_goal_is_asked_for_where_there_are_several_and_one_was_reached() -> None:
    goals = [(2.0, 0.0), (2.0, 1.0), (2.0, 2.0)]
    seen = observation(ways(np.zeros((2, 0)), goal=[2, 0]), centre=(), row=(), true_sides=(), goals=goals, goal=2)
    found = question(GOAL, seen, frozenset())
    assert (found.open, found.truth, found.given.tolist()) == (3, 2, [2, 0])
    assert question(GOAL, observation(TWO_WAYS, goals=goals, goal=None), frozenset()) is None


def ask(seen):
    return question(WAY, seen, frozenset('012'))


def test_probabilities_leave_a_doubt_to_every_open_answer() -> None:
    seen = observation(ways([[L], [R]], likelihood=[0.8, 0.2]))
    forecast = of_shares(published(seen), ask(seen))
    np.testing.assert_allclose(forecast.probability, (1.0 - DOUBT) * np.array([0.8, 0.2]) + DOUBT / 2.0)
    np.testing.assert_allclose(uniform(ask(seen)).probability, [0.5, 0.5])
    np.testing.assert_allclose(of_guess((R,), 0.6, ask(seen)).probability, [0.2, 0.8])


def test_what_came_true_and_was_not_listed_has_the_doubt_alone() -> None:
    seen = observation(ways([[L, L, L], [R, L, R]]), **TWO_ROWS, true_sides=(L, L, R))
    assert of_shares(published(seen), ask(seen)).true(ask(seen)) == pytest.approx(DOUBT / 6.0)


def test_an_unsolved_candidate_counts_as_the_average_of_the_solved_ones() -> None:
    seen = observation(
        ways([[L, L, L], [R, L, R], [R, L, L]], solved=[True, True, False], likelihood=[0.9, 0.1, 0.0]), **TWO_ROWS
    )
    np.testing.assert_allclose(published(seen), [0.6, 1.0 / 15.0, 1.0 / 3.0])


def test_forecasts_sum_to_one() -> None:
    seen = observation(ways([[L, R, L], [R, L, L]], likelihood=[0.3, 0.7]), **TWO_ROWS, true_sides=(R, R, R))
    for forecast in (of_shares(published(seen), ask(seen)), uniform(ask(seen)), of_guess((R, L, L), 0.4, ask(seen))):
        assert forecast.probability.sum() + ask(seen).unlisted * forecast.each_other == pytest.approx(1.0)


def judged(confidence, right, recording=None, progress=None) -> Judged:
    m = len(confidence)
    zeros = np.zeros(m)
    recording = zeros.astype(int) if recording is None else np.array(recording)
    progress = zeros if progress is None else np.array(progress)
    return Judged(recording, progress, zeros + 2.0, zeros, np.array(confidence), np.array(right, dtype=float), zeros)


def test_a_judgement_has_likelihood_confidence_brier_and_whether_it_was_right() -> None:
    seen = observation(ways([[L], [R]], likelihood=[0.8, 0.2]))
    p = (1.0 - DOUBT) * 0.8 + DOUBT / 2.0
    found = judge([(0, 0.5, ask(seen), of_shares(published(seen), ask(seen))), (0, 0.6, ask(seen), uniform(ask(seen)))])
    np.testing.assert_allclose(found.log_likelihood, np.log([p, 0.5]))
    np.testing.assert_allclose(found.confidence, [p, 0.5])
    np.testing.assert_allclose(found.right, [1.0, 0.5])
    np.testing.assert_allclose(found.brier, [2.0 * (1.0 - p) ** 2, 0.5])


def test_the_calibration_error_is_the_gap_between_said_and_seen_by_bins() -> None:
    found = judged([0.95, 0.95, 0.95, 0.95, 0.55, 0.55], [1, 1, 1, 0, 0, 0])
    assert calibration_error(found) == pytest.approx((4 * 0.2 + 2 * 0.55) / 6)
    assert [each['count'] for each in reliability(found)] == [0, 0, 0, 0, 0, 2, 0, 0, 0, 4]
    assert calibration_error(judged([0.75] * 4, [1, 1, 1, 0])) == pytest.approx(0.0)


def test_tenths_hold_their_lower_bound() -> None:
    assert tenth(np.array([0.0, 0.1, 0.3, 0.7, 0.99, 1.0])).tolist() == [0, 1, 3, 7, 9, 9]


def test_the_final_lead_begins_after_the_last_wrong_one() -> None:
    found = judged([0.5] * 6, [1, 0, 1, 1, 0, 0], [0, 0, 0, 1, 1, 1], [0.1, 0.4, 0.6, 0.2, 0.5, 0.9])
    assert leads_from(found) == {0: 0.6, 1: 1.0}


def test_a_summary_counts_by_tenths() -> None:
    found = summary(judged([0.5] * 4, [1, 0, 1, 1], progress=[0.05, 0.06, 0.95, 1.0]))
    assert [each['predictions'] for each in found['by_tenth']] == [2, 0, 0, 0, 0, 0, 0, 0, 0, 2]
    assert found['by_tenth'][0]['right'] == 0.5 and found['by_tenth'][1]['right'] is None
    assert found['right_from_half_way'] == 1.0
    assert found['gain'] == pytest.approx(np.log(2.0))


def test_held_out_a_recording_is_judged_by_what_is_best_for_the_others() -> None:
    table = np.array([[0.0, -1.0, -3.0], [-5.0, 0.0, -3.0], [-9.0, -9.0, -1.0]])
    assert chosen(table, ['a', 'b', 'c']).tolist() == [2, 2, 1]
    assert chosen(table, ['a', 'b', 'b']).tolist() == [2, 0, 0]
    assert chosen(table, ['a', 'a', 'a']).tolist() == [2, 2, 2]


def test_displacements_are_averaged_up_to_the_horizon_and_ellipses_hold_what_is_within() -> None:
    away = np.column_stack([8.0 * np.array(TIMES_S), np.zeros(len(TIMES_S))])
    away[-1] = np.nan
    scores = position_scores([recorded(observation(TWO_WAYS, positions=away))])
    likely = scores['displacement_m']['most likely']
    assert likely['final'] == {'0.25': pytest.approx(2.0), '0.5': pytest.approx(4.0), '1': None}
    assert likely['average']['0.5'] == pytest.approx(2.5)
    # unit covariance: 90 % lie within 2.15, 50 % within 1.18
    assert scores['inside'] == {'0.5': {'0.25': 0.0, '0.5': 0.0, '1': None}, '0.9': {'0.25': 1.0, '0.5': 0.0, '1': None}}
    assert scores['displacement_m']['constant velocity']['final']['0.5'] == pytest.approx(3.5)
