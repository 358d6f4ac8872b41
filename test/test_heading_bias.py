"""A heading bias: its costs are those of a hand that heads straight, and it is learnt from reaches that bend to one side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foc_ros.core.candidates import rank_candidates, solve_candidates
from foc_ros.core.config import Config, replace_values
from foc_ros.core.heading_bias import Reaches, make_reaches
from foc_ros.core.learning.choices import HEADING_OFFSETS
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.predictor import build_problem
from foc_ros.core.types import NANOSECONDS, Array, Candidate, HandSample, HandState, PredictedCandidate, make_obstacles
from foc_ros.ros.parameters import load_parameter_file, write_parameter_file

GOALS = np.array([[0.3, 0.15], [0.33, 0.0], [0.3, -0.15]])
CONFIG = replace_values(Config(), {'rate_hz': 20.0, 'foc.steps': 15, 'estimator.position_stddev': 1e-4})
NONE = make_obstacles(np.zeros((0, 2)), 0.02, 0.001)
BIAS = 0.3


def turn(state: Array, angle: float) -> Array:
    """Return a state (6,) whose velocity and acceleration are turned to the left."""
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.concatenate([state[:2], turned @ state[2:4], turned @ state[4:]])


def solve(state: Array, config: Config) -> list[PredictedCandidate]:
    """Return the solution for each goal without obstacles in 1 s."""
    hand = HandState(0, state, 1e-8 * np.eye(6))
    problems = [build_problem(config, hand, NONE, goal, 1.0) for goal in GOALS]
    candidates = [
        Candidate(f'goal{row}:', row, (), np.linspace(state[:2], goal, config.foc.steps + 1), 0.0)
        for row, goal in enumerate(GOALS)
    ]
    return solve_candidates(candidates, problems, config.foc)


@pytest.mark.parametrize('arrival', ['rest', 'passing'])
def test_with_its_bias_a_hand_costs_what_one_costs_that_heads_straight(arrival: str) -> None:
    config = replace_values(CONFIG, {'duration.arrival': arrival, 'foc.endpoint_stddev': 1e-3, 'foc.steps': 40})
    straight = np.array([0.05, 0.01, 0.3, 0.05, 0.4, -0.2])
    solved, biased = solve(straight, config), solve(turn(straight, BIAS), config)
    costs, reaches = (
        np.array([each.cost for each in biased]),
        make_reaches(biased, GOALS, HandState(0, straight, np.eye(6)), config),
    )
    assert reaches is not None
    expected = [each.cost for each in solved]
    assert abs(np.log(costs / expected)).max() > 0.1
    np.testing.assert_allclose(reaches.compute_unbiased_costs(costs, BIAS), expected, rtol=0.01)
    np.testing.assert_allclose(reaches.compute_unbiased_costs(costs, 0.0), costs, rtol=1e-12)


def test_the_bias_falls_with_the_rest_of_the_way() -> None:
    state = np.array([0.1, 0.0, 0.3, 0.05, 0.0, 0.0])
    solved, hand = solve(state, CONFIG), HandState(0, state, np.eye(6), onset_ns=0, onset_position=np.array([0.02, 0.0]))
    reaches = make_reaches(solved, GOALS, hand, CONFIG)
    assert reaches is not None
    left = np.hypot(*(GOALS - state[:2]).T)
    np.testing.assert_allclose(reaches.remaining, left / (left + 0.08), rtol=1e-12)
    costs = np.array([each.cost for each in solved])
    whole = reaches._replace(remaining=np.ones(3))
    for goal, share in enumerate(reaches.remaining):
        found = reaches.compute_unbiased_costs(costs, BIAS)[goal]
        assert found == pytest.approx(whole.compute_unbiased_costs(costs, BIAS * share)[goal], rel=1e-12)


def test_the_cost_of_obstacles_stays_and_no_cost_is_negative() -> None:
    starts = np.array([[0.0, 0.0, 0.3, 0.1, 0.0, 0.0]] * 2)
    reaches = Reaches(starts, GOALS[:2], np.array([1.0, 1.2]), np.array([1.0, 0.5]), passing=False)
    free = reaches.compute_unbiased_costs(np.zeros(2), 0.0)
    assert (free > 0.0).all(), 'no class needs less than the least effort'
    added = np.array([0.0, 70.0])
    np.testing.assert_allclose(
        reaches.compute_unbiased_costs(free + added, BIAS), reaches.compute_unbiased_costs(free, BIAS) + added, rtol=1e-12
    )


def test_a_hand_with_a_bias_leads_to_the_goal_that_it_is_turned_from() -> None:
    towards = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    solved = solve(turn(towards, BIAS), CONFIG)
    hand = HandState(0, towards, 1e-8 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))
    found = []
    for bias in (0.0, BIAS):
        config = replace_values(CONFIG, {'likelihood.heading_bias': bias})
        ranked, _ = rank_candidates(solved, config, NONE, hand, GOALS)
        found.append({each.candidate.goal: each.likelihood for each in ranked})
    assert max(found[0], key=found[0].__getitem__) == 0 and max(found[1], key=found[1].__getitem__) == 1


def test_a_plant_that_is_not_driven_by_jerk_has_no_bias() -> None:
    config = replace_values(CONFIG, {'foc.plant': 'damped_mass', 'likelihood.heading_bias': BIAS})
    solved = solve(np.array([0.05, 0.0, 0.3, 0.0, 0.0, 0.0]), config)
    assert make_reaches(solved, GOALS, HandState(0, np.zeros(6), np.eye(6)), config) is None
    costs = np.array([1.0, 2.0])
    biased = replace(config.likelihood, heading_bias=BIAS)
    np.testing.assert_array_equal(compute_likelihoods(costs, biased), compute_likelihoods(costs, Config().likelihood))


def follow(pipeline: Pipeline, bow: float) -> list[float]:
    """Pass eight reaches to the goals in turn through a pipeline, bent by a share of their length; return mean likelihoods.

    They are those of the true goal between 20 and 50 % of the way.
    """
    pipeline.set_obstacles('cloud', NONE, None, 'world')
    pipeline.set_goals(GOALS, 'world')
    found = []
    for number in range(8):
        goal, given = GOALS[number % len(GOALS)], []
        for t in np.arange(0.0, 1.8, 0.025):
            s = float(np.clip((t - 0.3) / 0.9, 0.0, 1.0))
            done = 10 * s**3 - 15 * s**4 + 6 * s**5
            position = done * goal + bow * np.sin(np.pi * done) * np.array([-goal[1], goal[0]])
            pipeline.add_hand_sample(HandSample(int((1 + 10 * number + t) * NANOSECONDS), position, 0.0, 'world'))
            if pipeline.is_due and (made := pipeline.predict()) is not None and 0.2 < done < 0.6:
                given += [sum(each.likelihood for each in made.candidates if each.candidate.goal == number % len(GOALS))]
        found.append(float(np.mean(given)))
    return found


def test_it_is_learnt_from_reaches_that_bend_to_one_side(tmp_path: Path) -> None:
    biases = []
    for bow in (-0.12, 0.0, 0.12):
        pipeline = Pipeline(CONFIG)
        given = follow(pipeline, bow)
        biases.append(pipeline.adapted_config.likelihood.heading_bias)
        if bow:
            unlearnt = follow(Pipeline(replace_values(CONFIG, {'likelihood.adaptation': 'none'})), bow)
            assert np.mean(given[-3:]) > np.mean(unlearnt[-3:]) + 0.1
    assert biases[0] < -0.1 and abs(biases[1]) < 0.05 and biases[2] > 0.1
    write_parameter_file('--operator', tmp_path / 'operator.yaml', pipeline.adapted_config)
    assert load_parameter_file(tmp_path / 'operator.yaml').likelihood.heading_bias == biases[2]
    pipeline.reset()
    assert pipeline.adapted_config.likelihood.heading_bias == 0.0


def test_without_evidence_the_bias_is_that_of_the_parameters_and_it_stays_within_the_bounds() -> None:
    preferences = Pipeline(CONFIG).learnt.preferences
    for given in (-0.7, 0.0, 0.25):
        assert preferences.find_heading_bias(replace(CONFIG.likelihood, heading_bias=given)) == pytest.approx(given, abs=1e-12)
    certain = replace(preferences, movements=1, bias_scores=np.where(HEADING_OFFSETS[-1] == HEADING_OFFSETS, 0.0, -1e3))
    assert certain.adapt(replace(CONFIG.likelihood, heading_bias=0.3)).heading_bias == 0.8
