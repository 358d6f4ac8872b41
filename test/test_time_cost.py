"""Durations if time has a cost: near the optimum, consistent during a movement, and longer for longer paths."""

import numpy as np
import pytest
from reach_helpers import bowed, reach

from foc_ros.core.config import Config, FocConfig, replace_values
from foc_ros.core.estimation.duration import choose_candidate_durations
from foc_ros.core.estimation.kalman_filter import compute_gramian, compute_transition
from foc_ros.core.estimation.time_cost import compute_least_effort, find_least_cost_time
from foc_ros.core.memory.memory import Memory
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.predictor import predict
from foc_ros.core.types import Candidate, HandState, make_obstacles

OBSTACLE = make_obstacles([[0.15, 0.02]], 0.04, 0.002)
AT_REST = HandState(0, np.zeros(6), 1e-8 * np.eye(6))


@pytest.mark.parametrize(('length', 'speed', 'acceleration'), [(0.3, 0.0, 0.0), (0.2, 0.5, -1.0), (0.05, -0.2, 3.0)])
def test_effort_along_a_line_is_that_of_least_energy(length: float, speed: float, acceleration: float) -> None:
    times = np.array([0.4, 1.0, 2.5])
    expected = []
    for T in times:
        missing = np.array([length, 0.0, 0.0]) - compute_transition(T) @ [0.0, speed, acceleration]
        expected.append(missing @ np.linalg.solve(compute_gramian(T), missing))
    np.testing.assert_allclose(compute_least_effort(length, speed, acceleration, times), expected, rtol=1e-9)


@pytest.mark.parametrize(('length', 'time_cost'), [(0.3, 100.0), (0.7, 0.2), (0.05, 1000.0)])
def test_from_rest_the_duration_grows_with_the_cube_root_of_the_length(length: float, time_cost: float) -> None:
    found = find_least_cost_time(length, (0.0, 0.0), time_cost, (0.05, 20.0))
    assert found == pytest.approx((3600.0 * length**2 / time_cost) ** (1 / 6), rel=0.005)


def test_during_a_movement_the_remaining_duration_is_the_planned_one() -> None:
    length, time_cost = 0.3, 50.0
    whole = (3600.0 * length**2 / time_cost) ** (1 / 6)
    for share in (0.2, 0.5, 0.8):
        s = share
        position = length * (10 * s**3 - 15 * s**4 + 6 * s**5)
        speed = length * (30 * s**2 - 60 * s**3 + 30 * s**4) / whole
        acceleration = length * (60 * s - 180 * s**2 + 120 * s**3) / whole**2
        left = find_least_cost_time(length - position, (speed, acceleration), time_cost, (0.05, 20.0))
        assert left == pytest.approx((1 - share) * whole, rel=0.02)


def test_the_duration_stays_within_its_bounds() -> None:
    assert find_least_cost_time(0.3, (0.0, 0.0), 1e-9, (0.3, 10.0)) == pytest.approx(10.0)
    assert find_least_cost_time(0.0, (0.0, 0.0), 100.0, (0.3, 10.0)) == pytest.approx(0.3)


@pytest.mark.parametrize('bow', [0.08, -0.08])
@pytest.mark.parametrize('time_cost', [20.0, 500.0])
def test_the_duration_of_a_curved_path_costs_little_more_than_the_true_optimum(bow: float, time_cost: float) -> None:
    """Over a grid of durations, each solved completely, the total cost is within 2 % of the least."""
    guess = bowed([0.0, 0.0], [0.3, 0.0], 50, bow)
    length = float(np.hypot(*np.diff(guess, axis=0).T).sum())
    config = replace_values(Config(), {'duration.model': 'cost_of_time', 'duration.time_cost': time_cost}).duration
    law = choose_candidate_durations(AT_REST, [Candidate('a', 0, (), guess, length)], [1.0], config)[0]

    def total(duration_s: float) -> float:
        problem = reach(OBSTACLE, duration=duration_s, noise=(0.02, 0.02), eta=0.8)
        solution = solve_problem(problem, cold_start(guess), FocConfig(strategy='lv'))
        return solution.effort * solution.dt + time_cost * duration_s

    best = min(total(law * factor) for factor in np.geomspace(0.7, 1.4, 15))
    assert total(law) <= 1.02 * best


def test_a_longer_path_takes_longer_with_this_model_only() -> None:
    scene = make_obstacles([[0.15, 0.03]], 0.05), np.array([[0.3, 0.0]])
    for model in ('cost_of_time', 'fitts', 'fixed'):
        config = replace_values(Config(), {'duration.model': model, 'duration.time_cost': 100.0})
        prediction = predict(config, AT_REST, *scene, Memory())[0]
        lasts = {each.candidate.length: each.solution.times[-1] for each in prediction.solved_candidates}
        assert len(lasts) == 2
        short, long = sorted(lasts)
        if model == 'cost_of_time':
            assert lasts[long] / lasts[short] == pytest.approx((long / short) ** (1 / 3), rel=0.01)
        else:
            assert lasts[long] == lasts[short]


def test_the_price_of_time_is_part_of_the_cost_with_this_model_only() -> None:
    scene = make_obstacles([[0.15, 0.03]], 0.05), np.array([[0.3, 0.0]])
    for model, price in (('cost_of_time', 100.0), ('fitts', 0.0), ('fixed', 0.0)):
        config = replace_values(Config(), {'duration.model': model, 'duration.time_cost': 100.0, 'likelihood.lookahead_s': 0.0})
        solved = predict(config, AT_REST, *scene, Memory())[0].solved_candidates
        assert len(solved) == 2
        for each in solved:
            solution = each.solution
            assert each.cost == pytest.approx(solution.effort * solution.dt + price * solution.times[-1])
        ratio = (solved[1].cost / solved[0].cost) ** config.likelihood.beta
        assert solved[0].likelihood / solved[1].likelihood == pytest.approx(ratio)
