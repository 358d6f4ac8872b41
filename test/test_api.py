# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public API: its doctests, what it accepts and refuses, and its extension points."""

import doctest
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import foc_ros
import foc_ros.api
import foc_ros.core.config
import foc_ros.core.obstacles.shapes
import foc_ros.extending
import foc_ros.solving
from foc_ros.core.plant.models import make_plant_model
from foc_ros.core.registry import LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES

CUP = foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003, name='cup')
FAST = foc_ros.Config().with_values({'foc.steps': 20, 'budget_s': 0.0})


@pytest.fixture(autouse=True)
def registries(monkeypatch):
    """What a test registers is gone after it."""
    for registry in (LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES):
        monkeypatch.setattr(registry, '_parts', dict(registry._parts))
    yield
    make_plant_model.cache_clear()


@pytest.mark.parametrize(
    'module',
    [foc_ros.api, foc_ros.solving, foc_ros.extending, foc_ros.core.config, foc_ros.core.obstacles.shapes],
    ids=lambda module: module.__name__,
)
def test_the_examples_of_the_docstrings_hold(module):
    results = doctest.testmod(module)
    assert results.attempted
    assert not results.failed


@pytest.mark.parametrize('name', foc_ros.__all__)
def test_every_public_name_exists_and_is_documented(name):
    assert getattr(foc_ros, name).__doc__


def test_the_import_is_lazy_and_fast():
    program = "import sys, foc_ros; print('numpy' in sys.modules, 'Predictor' in dir(foc_ros))"
    shown = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True, check=True).stdout
    assert shown.split() == ['False', 'True']
    with pytest.raises(AttributeError, match='no attribute'):
        _ = foc_ros.unknown


def predictor_of_one_cup():
    predictor = foc_ros.Predictor(FAST)
    predictor.set_goals([(0.3, 0.0)])
    predictor.set_obstacles([CUP])
    return predictor


def test_a_prediction_knows_its_scene_and_its_candidates():
    prediction = predictor_of_one_cup().update(t=1.5, position=[0.0, 0.0])
    assert prediction.t == 1.5
    assert prediction.obstacles.ids == ('cup',)
    np.testing.assert_array_equal(prediction.goal_positions, [[0.3, 0.0]])
    assert {each.label for each in prediction.candidates} == {'goal0:+cup', 'goal0:-cup'}
    best = prediction.candidates[0]
    assert best.likelihood == max(each.likelihood for each in prediction.candidates)
    assert best.status is foc_ros.Status.SOLVED
    assert best.eta >= 0.9 - 1e-5
    assert best.mean.shape == (21, 6)
    assert best.covariance.shape == (21, 6, 6)
    assert len(best.times) == 21
    assert best.effort > 0.0


def test_a_predictor_follows_a_movement_and_forgets_it():
    predictor = predictor_of_one_cup()
    for step in range(40):
        prediction = predictor.update(0.02 * step, (0.004 * step, -0.002 * step))
    assert prediction.most_likely == 'goal0:-cup'
    moving = prediction.candidates[0].mean[0, 2]
    assert moving > 0.1
    restarted = predictor.update(0.8 + FAST.estimator.gap_s, (0.16, -0.08))
    assert restarted.candidates[0].mean[0, 2] == 0.0
    predictor.reset()
    assert predictor.update(0.0, (0.0, 0.0)).t == 0.0


def test_moving_obstacles_move_on_from_the_update_that_first_sees_them():
    predictor = predictor_of_one_cup()
    predictor.update(5.0, (0.0, 0.0))
    predictor.set_obstacles([foc_ros.Circle((0.15, 0.1), 0.02, velocity=(0.0, -0.5))])
    np.testing.assert_allclose(predictor.update(5.1, (0.0, 0.0)).obstacles.centre, [[0.15, 0.1]])
    np.testing.assert_allclose(predictor.update(5.2, (0.0, 0.0)).obstacles.centre, [[0.15, 0.05]])


@pytest.mark.parametrize(
    ('t', 'position', 'field'),
    [
        (1.0, (0.0, 0.0), 't'),
        (0.5, (0.0, 0.0), 't'),
        (-9.0, (0.0, 0.0), 't'),
        (float('nan'), (0.0, 0.0), 't'),
        ('2', (0.0, 0.0), 't'),
        (2.0, (0.0, float('nan')), 'position'),
        (2.0, (0.0, 0.0, 0.0), 'position'),
        (2.0, 'here', 'position'),
    ],
)
def test_a_sample_that_cannot_be_used_is_refused_and_changes_nothing(t, position, field):
    predictor = predictor_of_one_cup()
    predictor.update(1.0, (0.0, 0.0))
    with pytest.raises(foc_ros.InputError, match=f'^{field}: expected') as caught:
        predictor.update(t, position)
    assert caught.value.field == field
    assert predictor.update(1.02, (0.0, 0.0)).t == 1.02


def test_without_goals_there_is_no_prediction():
    with pytest.raises(foc_ros.SceneError, match='goals'):
        foc_ros.Predictor(FAST).update(0.0, (0.0, 0.0))


@pytest.mark.parametrize('goals', [[], [(0.3, 0.0, 0.1, 0.0)], [(0.3, float('inf'))], [(0.3, 0.0, float('nan'))], 0.3])
def test_goals_that_cannot_be_used_are_refused(goals):
    with pytest.raises(foc_ros.SceneError, match='goals'):
        foc_ros.Predictor().set_goals(goals)


def test_an_outlier_is_refused_and_the_movement_goes_on():
    predictor, plain = foc_ros.Predictor(FAST), foc_ros.Predictor(FAST)
    for each in (predictor, plain):
        each.set_goals([(0.3, 0.0)])
        each.update(0.0, (0.0, 0.0))
    with pytest.raises(foc_ros.InputError, match=r'^position: expected a position within 0\.11 m .*, got one that is 0\.5 m'):
        predictor.update(0.02, (0.3, 0.4))
    means = [each.update(0.04, (0.01, 0.0)).candidates[0].solution.mean for each in (predictor, plain)]
    np.testing.assert_array_equal(*means)
    with pytest.raises(foc_ros.InputError, match=r'^position'):
        predictor.update(0.06, (0.3, 0.4))
    restarted = predictor.update(0.08, (0.3, 0.41))
    np.testing.assert_array_equal(restarted.candidates[0].solution.mean[0], [0.3, 0.41, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize('obstacles', [[(0.1, 0.0, 0.02)], [CUP, CUP]])
def test_obstacles_are_circles_with_different_names(obstacles):
    with pytest.raises(foc_ros.SceneError, match='obstacles'):
        foc_ros.solve((0, 0), (0.3, 0), obstacles)


@pytest.mark.parametrize(
    ('changed', 'field'),
    [
        ({'start': [0.0, 0.0, 0.0, 0.0]}, 'start'),
        ({'start': (0.0, float('nan'))}, 'start'),
        ({'start': (0.15, 0.0)}, 'start'),
        ({'goal': (0.3,)}, 'goal'),
        ({'strategy': 'fastest'}, 'foc.strategy'),
        ({'eta': 1.0}, 'foc.eta'),
        ({'duration_s': 0.0}, 'duration.fixed_s'),
        ({'config': {'eta': 0.9}}, 'config'),
        ({'guess': [(0.1, 0.1, 0.1)]}, 'guess'),
    ],
)
def test_a_scene_that_cannot_be_solved_is_refused_by_field(changed, field):
    with pytest.raises(foc_ros.InputError, match=f'^{field}: expected .*, got'):
        foc_ros.solve(**({'start': (0, 0), 'goal': (0.3, 0), 'obstacles': [CUP]} | changed))


def test_lists_states_and_tables_are_accepted():
    by_position = foc_ros.solve([0, 0], [0.3, 0], [CUP], config=FAST)
    by_state = foc_ros.solve(
        np.zeros(6), np.array([0.3, 0.0]), foc_ros.core.obstacles.shapes.collect_obstacles([CUP]), config=FAST
    )
    np.testing.assert_array_equal(by_position.mean, by_state.mean)
    moving = foc_ros.solve((0, 0, 0.3, 0, 0, 0), (0.3, 0), config=FAST)
    np.testing.assert_allclose(moving.mean[0, 2], 0.3)


def test_a_guess_chooses_the_class():
    labels = {foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST, guess=[(0.15, y)]).label for y in (0.08, -0.06)}
    assert labels == {'goal0:+cup', 'goal0:-cup'}


def test_the_solution_of_solve_is_the_most_likely_of_all_classes():
    candidates = foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], config=FAST)
    solution = foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST)
    assert solution.label == candidates[0].label
    np.testing.assert_array_equal(solution.mean, candidates[0].mean)
    assert sum(each.likelihood for each in candidates) == pytest.approx(1.0)
    goals = foc_ros.solve_classes((0, 0), [(0.3, 0.0), (0.3, 0.1)], config=FAST)
    assert {each.candidate.goal for each in goals} == {0, 1}


def test_monte_carlo_confirms_eta():
    solution = foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST)
    assert foc_ros.monte_carlo(solution, 2000, seed=1).step[2] >= 0.9
    with pytest.raises(foc_ros.InputError, match='samples'):
        foc_ros.monte_carlo(solution, 0)
    with pytest.raises(foc_ros.InputError, match='solution'):
        foc_ros.monte_carlo(predictor_of_one_cup().update(0.0, (0.0, 0.0)).candidates[0].solution)


def test_predictions_and_solutions_are_drawn():
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    from matplotlib import pyplot as plt
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

    given = Figure().subplots()
    prediction = predictor_of_one_cup().update(0.0, (0.0, 0.0))
    assert prediction.plot(given) is given
    assert len(given.lines) >= 2
    for drawn in (foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST), prediction):
        assert drawn.plot().get_xlabel() == 'x [m]'
    solution = foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST)
    legends = solution.plot().figure.findobj(Legend)
    words = [each.get_text() for legend in legends for each in legend.get_texts()]
    assert any(each.endswith('right of cup' if '-' in solution.label else 'left of cup') for each in words)
    foc_ros.plot_candidates(foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], config=FAST))
    with pytest.raises(foc_ros.InputError, match='candidates'):
        foc_ros.plot_candidates(prediction.candidates)
    plt.close('all')


def test_a_replay_yields_predictions_that_can_be_drawn():
    prediction = next(foc_ros.replay('foc_ros/recordings/reaching.mcap', FAST))
    assert isinstance(prediction, foc_ros.Prediction)
    assert len(prediction.goals)


def test_a_strategy_from_outside_builds_on_another_one():
    def solve_with_less(problems, starts, settings, deadline):
        results = foc_ros.get_strategy('lv')(problems, starts, settings, deadline)
        etas.extend(foc_ros.compute_eta(*each) for each in zip(problems, (each.control for each in results), strict=True))
        return [replace(each, message='as lv') for each in results]

    etas = []
    foc_ros.register_strategy('as_lv', solve_with_less)
    solutions = [foc_ros.solve((0, 0), (0.3, 0), [CUP], strategy=name, config=FAST) for name in ('lv', 'as_lv')]
    np.testing.assert_array_equal(solutions[0].mean, solutions[1].mean)
    assert solutions[1].message == 'as lv'
    assert min(etas) >= 0.9 - 1e-5
    with pytest.raises(foc_ros.InputError, match='strategy: expected one of lv'):
        foc_ros.get_strategy('shortest')


def test_a_likelihood_rule_from_outside_is_used():
    foc_ros.register_likelihood_rule('even', lambda costs, config: np.zeros(len(costs)))
    even = FAST.with_values({'likelihood.rule': 'even'})
    candidates = foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], config=even)
    np.testing.assert_allclose([each.likelihood for each in candidates], 0.5)
    with pytest.raises(foc_ros.InputError, match='a new name besides cost_ratio'):
        foc_ros.register_likelihood_rule('even', lambda costs, config: costs)
    with pytest.raises(foc_ros.InputError, match='a function'):
        foc_ros.register_likelihood_rule('odd', 3)
    with pytest.raises(foc_ros.ParameterError, match=r'likelihood\.rule: expected one of cost_ratio, .*even'):
        FAST.with_values({'likelihood.rule': 'odd'})
    assert 'odd' not in LIKELIHOOD_RULES
