# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The time limit of a prediction: what is not settled in time takes part with an estimate, and says so."""

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle

from foc_ros.core.config import Config, FocConfig, replace_values
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.hand.kalman import update
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.predict import predict
from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import Status
from foc_ros.core.tracks import NO_TRACKS, Tracks
from foc_ros.core.types import HandSample

OBSTACLES = make_obstacles([[0.12, 0.01], [0.2, -0.03]], [0.02, 0.02], 0.001)
SCENES = {
    'two circles': OBSTACLES,
    'a row of three': make_obstacles([[0.15, -0.07], [0.15, 0.005], [0.15, 0.07]], 0.02, 0.002),
    'one that moves': make_obstacles([[0.14, -0.05]], 0.03, 0.002, velocity=[[0.0, 0.06]]),
}
GOALS = np.array([[0.3, 0.0]])
CONFIG = replace_values(Config(), {'foc.steps': 20})
HANDS = [
    update(None, HandSample(1_000_000_000 + 20_000_000 * tick, np.array([1e-4 * tick, 0.0])), CONFIG.estimator).state
    for tick in range(20)
]
STRATEGIES = ('lv', 'hc', 'optimal', 'fixed', 'algorithm1')


class Counted(Deadline):
    """A deadline that allows a number of steps, whatever the clock says, to the search for classes as many as it likes."""

    def __init__(self, steps: int) -> None:
        super().__init__()
        self.steps = steps

    def allows(self, seconds: float = 0.0) -> bool:
        self.steps -= 1
        return self.steps >= 0

    def take_share(self, share: float, reserve_s: float = 0.0) -> Deadline:
        return NEVER if share < 0.5 else self


def predicted(tick: int, memory: Tracks, deadline: Deadline = NEVER, obstacles: Obstacles = OBSTACLES):
    return predict(CONFIG, HANDS[tick], obstacles, GOALS, memory, deadline=deadline)


def find_likelihoods(prediction: Prediction) -> dict[str, float]:
    return {each.label: each.likelihood for each in prediction.candidates_with_likelihood}


def test_a_budget_that_is_not_reached_changes_nothing():
    (free, memory), (ample, other) = predicted(0, NO_TRACKS), predicted(0, NO_TRACKS, Deadline(60.0))
    for one, two in ((free, ample), (predicted(1, memory)[0], predicted(1, other, Deadline(60.0))[0])):
        assert one.most_likely == two.most_likely
        for a, b in zip(one.candidates, two.candidates, strict=True):
            assert (a.candidate.label, a.likelihood) == (b.candidate.label, b.likelihood)
            np.testing.assert_array_equal(a.solution.mean, b.solution.mean)


@pytest.mark.parametrize('name', SCENES)
def test_a_deadline_that_has_passed_leaves_an_estimate_for_every_class(name):
    late, _ = predicted(0, NO_TRACKS, Counted(0), SCENES[name])
    final, _ = predicted(0, NO_TRACKS, obstacles=SCENES[name])
    shares, expected = find_likelihoods(late), find_likelihoods(final)
    assert shares.keys() == expected.keys()
    for each in late.candidates:
        unsettled = each.status in (Status.DEADLINE, Status.ESTIMATED)
        assert unsettled or each.solution.safety_factor >= 3.0 - 1e-4, 'solved at once'
        assert each.likelihood > 0.0
        assert each.status is Status.SOLVED or 'estimated' in each.solution.message
        assert np.isfinite(each.cost)
    for label, share in shares.items():
        assert share == pytest.approx(expected[label], abs=0.4)
    assert late.notes['unfinished'] == sum(each.status is Status.DEADLINE for each in late.candidates)


@pytest.mark.parametrize('name', SCENES)
def test_every_class_has_a_likelihood_whenever_the_time_ends(name):
    """The estimates lead to the answer: within 0.2 of it from the fourth iteration on, whatever was settled by then."""
    expected = find_likelihoods(predicted(0, NO_TRACKS, obstacles=SCENES[name])[0])
    for steps in range(40):
        late, _ = predicted(0, NO_TRACKS, Counted(steps), SCENES[name])
        shares = find_likelihoods(late)
        assert shares.keys() == expected.keys()
        assert sum(shares.values()) + late.unknown + late.other == pytest.approx(1.0)
        if steps >= 4:
            assert shares == pytest.approx(expected, abs=0.2)
        if not late.notes.get('unfinished'):
            assert shares == pytest.approx(expected, abs=1e-9)
            break
    assert 1 < steps < 39


def test_what_is_not_settled_goes_on_in_the_next_prediction():
    """With time for two iterations in each prediction, all classes are solved after a few."""
    memory, unfinished = NO_TRACKS, []
    for tick in range(20):
        prediction, memory = predicted(tick, memory, Counted(2))
        unfinished.append(prediction.notes.get('unfinished', 0))
        if not unfinished[-1]:
            break
    assert unfinished[0] > 0, 'the scene is no test'
    assert not unfinished[-1]
    assert find_likelihoods(prediction).keys() == find_likelihoods(predicted(tick, NO_TRACKS)[0]).keys()


@pytest.mark.parametrize('strategy', STRATEGIES)
def test_a_strategy_stops_at_its_deadline_with_the_best_so_far(strategy):
    problem, start = one_obstacle(0.94), cold_start(bowed((0, 0), (0.3, 0), 50, 0.05))
    settings = FocConfig(strategy=strategy, algorithm1_growth=1.5)
    free = solve_problem(problem, start, settings)
    for deadline in (Deadline(0.0), Counted(1), Counted(2)):
        late = solve_problem(problem, start, settings, deadline)
        assert late.status is Status.DEADLINE
        assert 'out of time' in late.message
        assert np.isfinite(late.mean).all()
        assert late.expected_effort <= late.effort
        assert late.qp_solves < free.qp_solves
    ample = solve_problem(problem, start, settings, Deadline(1e3))
    assert ample.status is free.status is Status.SOLVED
    np.testing.assert_array_equal(ample.mean, free.mean)
