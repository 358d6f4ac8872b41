# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public API: its doctests, what it accepts and refuses, and its extension points."""

import doctest
import json
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from prediction_samples import outcome, prediction
from reach_helpers import make_predictor

import foc_ros
import foc_ros.api
import foc_ros.core.config
import foc_ros.core.obstacles.shapes
import foc_ros.extending
import foc_ros.solving
from foc_ros import Circle, Config, FocConfig, Goal
from foc_ros.core.interpolation import interpolate_covariance
from foc_ros.core.solution import Status

CUP = foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003, name='cup')
FAST = foc_ros.Config().with_values({'foc.steps': 20, 'budget_s': 0.0})


@pytest.mark.parametrize(
    'module',
    [foc_ros.api, foc_ros.solving, foc_ros.extending, foc_ros.core.config, foc_ros.core.obstacles.shapes],
    ids=lambda module: module.__name__,
)
@pytest.mark.usefixtures('registries')
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
    return make_predictor(FAST, [(0.3, 0.0)], [CUP])


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


NO_TIMES = [1.0, 0.5, -9.0, float('nan'), '2']
NO_POSITIONS = [(0.0, float('nan')), (0.0, 0.0, 0.0), 'here', ('0', '0.1'), (0.0, 0.1j)]


@pytest.mark.parametrize(
    ('t', 'position', 'field'), [*((t, (0.0, 0.0), 't') for t in NO_TIMES), *((2.0, each, 'position') for each in NO_POSITIONS)]
)
def test_a_sample_that_cannot_be_used_is_refused_and_changes_nothing(t, position, field):
    predictor = predictor_of_one_cup()
    predictor.update(1.0, (0.0, 0.0))
    with pytest.raises(foc_ros.InputError, match=f'^{field}: expected') as caught:
        predictor.update(t, position)
    assert caught.value.field == field
    assert predictor.update(1.02, (0.0, 0.0)).t == 1.02


def test_an_outlier_is_refused_and_the_movement_goes_on():
    predictor, plain = (make_predictor(FAST, [(0.3, 0.0)]) for _ in range(2))
    for each in (predictor, plain):
        each.update(0.0, (0.0, 0.0))
    with pytest.raises(foc_ros.InputError, match=r'^position: expected a position within 0\.11 m .*, got one that is 0\.115 m'):
        predictor.update(0.02, (0.069, 0.092))
    means = [each.update(0.04, (0.01, 0.0)).candidates[0].solution.mean for each in (predictor, plain)]
    np.testing.assert_array_equal(*means)
    with pytest.raises(foc_ros.InputError, match=r'^position'):
        predictor.update(0.06, (0.3, 0.4))
    for t, position in ((0.08, (0.3, 0.41)), (0.08 + FAST.estimator.gap_s + 0.01, (0.0, 0.0))):  # the jump goes on; a gap
        restarted = predictor.update(t, position)
        np.testing.assert_array_equal(restarted.candidates[0].solution.mean[0], [*position, 0.0, 0.0, 0.0, 0.0])


def test_lists_states_tables_single_goals_and_both_spellings_of_the_centre_are_accepted():
    by_position = foc_ros.solve([0, 0], [0.3, 0], [CUP], config=FAST)
    table = foc_ros.core.obstacles.shapes.collect_obstacles([CUP])
    by_state = foc_ros.solve(np.zeros(6), np.array([0.3, 0.0]), table, config=FAST)
    np.testing.assert_array_equal(by_position.mean, by_state.mean)
    moving = foc_ros.solve((0, 0, 0.3, 0, 0, 0), (0.3, 0), config=FAST)
    np.testing.assert_allclose(moving.mean[0, 2], 0.3)
    for goals in ((0.3, 0.0), np.array([0.3, 0.0]), Goal((0.3, 0.0)), [(0.3, 0.0)], iter([(0.3, 0.0)])):
        assert [each.name for each in make_predictor(FAST, goals).update(0.0, (0.0, 0.0)).goals] == ['goal0']
    assert Circle(center=(0.1, 0.2), radius=0.01) == Circle((0.1, 0.2), 0.01)


def test_the_solution_of_solve_is_the_most_likely_of_all_classes():
    candidates = foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], config=FAST)
    solution = foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST)
    assert solution.label == candidates[0].label
    np.testing.assert_array_equal(solution.mean, candidates[0].mean)
    assert sum(each.likelihood for each in candidates) == pytest.approx(1.0)
    goals = foc_ros.solve_classes((0, 0), [(0.3, 0.0), (0.3, 0.1)], config=FAST)
    assert {each.candidate.goal for each in goals} == {0, 1}


def test_predictions_and_solutions_are_drawn():
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    from matplotlib import pyplot as plt
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

    given, solution = Figure().subplots(), foc_ros.solve((0, 0), (0.3, 0), [CUP], config=FAST)
    prediction = predictor_of_one_cup().update(0.0, (0.0, 0.0))
    assert prediction.plot(given) is given
    axes = solution.plot()
    assert axes.get_xlabel() == 'x [m]'
    legends = axes.figure.findobj(Legend)
    words = [each.get_text() for legend in legends for each in legend.get_texts()]
    assert any(each.endswith('right of cup' if '-' in solution.label else 'left of cup') for each in words)
    foc_ros.plot_candidates(foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], config=FAST))
    with pytest.raises(foc_ros.InputError, match='candidates'):
        foc_ros.plot_candidates(prediction.candidates)
    plt.close('all')


TWO = [Goal((0.3, -0.1), name='bowl'), (0.3, 0.1)]


@pytest.fixture(scope='module')
def predicted():
    """Predict towards two goals, of which one has a name, past one obstacle that is given without a list."""
    return make_predictor(FAST, TWO, CUP).update(0.0, (0.0, 0.0))


def test_goals_have_names_and_likelihoods(predicted):
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


def test_a_goal_of_which_nothing_is_known_is_not_unlikely():
    lost = outcome('goal1:+l1', status=Status.ITERATION_LIMIT)
    lost = replace(lost, candidate=replace(lost.candidate, goal=1))
    made = prediction(outcome('goal0:+l1', 1.0), lost, goal_positions=np.array([[0.3, 0.0], [0.3, 0.1]]))
    assert [each.likelihood for each in made.goals] == [1.0, None]
    assert repr(made.goals[1]) == '<PredictedGoal goal1 at (0.3, 0.1) m, likelihood unknown>'


def test_a_prediction_is_the_sequence_of_its_candidates(predicted):
    assert list(predicted) == list(predicted.candidates)
    assert len(predicted) == len(predicted.candidates) == 4
    assert predicted[0] is predicted.candidates[0] and predicted[-2:] == predicted.candidates[-2:]
    best = next(each for each in predicted if each.label == predicted.most_likely)
    assert repr(predicted).endswith(f', most likely {best.description} ({best.likelihood:.2f})>'), 'words name the goal'
    nothing = prediction()
    assert len(nothing) == 0 and nothing, 'a prediction without candidates is one all the same'
    first = predicted.candidates[0]
    assert repr(first).startswith(f'<PredictedCandidate {first.description}, ')
    assert all(len(repr(each)) < 100 for each in (predicted, first, first.candidate, first.solution, *predicted.goals))


def test_positions_between_the_steps_are_on_the_mean_path(predicted):
    for each in predicted:
        np.testing.assert_allclose(each.position_at(each.times), each.mean[:, :2], atol=1e-15)
        np.testing.assert_allclose(each.covariance_at(each.times), each.covariance[:, :2, :2], rtol=1e-12)
        assert each.position_at(0.5).shape == (2,) and each.covariance_at([0.1, 0.5]).shape == (2, 2, 2)
        begin, end, dt = each.mean[:-1], each.mean[1:], each.times[1]
        between, step = each.times[:-1] + 0.5 * dt, 1e-4
        speed = (each.position_at(between + step) - each.position_at(between - step)) / (2.0 * step)
        half_way = 0.5 * (begin + end)[:, 2:4] - dt / 8.0 * (end - begin)[:, 4:6]  # of a constant jerk
        np.testing.assert_allclose(speed, half_way, atol=1e-5)
        for ask in (each.position_at, each.covariance_at):
            for t in (-0.1, 99.0, float('nan'), 'now', None, [0.1, 99.0]):
                with pytest.raises(foc_ros.InputError, match=r'^t: expected seconds from now in \[0, 1\.\d+\], .*, got'):
                    ask(t)


def test_covariances_between_the_steps_are_those_of_the_motor_noise():
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


def test_plain_values_and_the_table_are_those_of_the_prediction(predicted):
    read = json.loads(json.dumps(predicted.to_dict(), allow_nan=False))
    assert [each['name'] for each in read['goals']] == ['bowl', 'goal1']
    assert [each['likelihood'] for each in read['goals']] == [each.likelihood for each in predicted.goals]
    assert [each['label'] for each in read['candidates']] == [each.label for each in predicted]
    np.testing.assert_array_equal(read['candidates'][0]['mean'], predicted.candidates[0].mean[:, :2])
    rows = predicted.to_records()
    assert len(rows) == 4 * 21 and len({tuple(row) for row in rows}) == 1
    assert all(isinstance(value, (str, int, float)) for value in rows[0].values())
    best = [row for row in rows if row['label'] == predicted.most_likely]
    np.testing.assert_array_equal([(row['x_m'], row['y_m']) for row in best], predicted.candidates[0].mean[:, :2])
    np.testing.assert_array_equal([row['xy_m2'] for row in best], predicted.candidates[0].covariance[:, 0, 1])
    assert {row['goal'] for row in rows} == {'bowl', 'goal1'}


def test_a_group_of_parameters_is_given_as_a_whole_or_by_its_values():
    assert Config(foc=FocConfig(eta=0.95)) == Config(foc={'eta': 0.95}) == Config().with_values({'foc.eta': 0.95})
    assert isinstance(Config(foc={'eta': 0}).foc.eta, float), 'a whole number becomes the type of the parameter'
    measured = Config().with_values({'foc.steps': np.int64(20), 'rate_hz': np.float32(25.0), 'predict_height': np.bool_(False)})
    assert measured == Config().with_values({'foc.steps': 20, 'rate_hz': 25.0, 'predict_height': False}), 'numbers of NumPy count'
    with pytest.raises(foc_ros.ParameterError, match=r'foc\.steps: expected a number in \[5, 400\], got 401$'):
        Config().with_values({'foc.steps': np.int64(401)})
    with pytest.raises(foc_ros.ParameterError, match=r'foc\.steps') as caught:
        Config(foc={'steps': 1, 'eta': 2})
    assert [each.partition(':')[0] for each in caught.value.__notes__] == ['foc.eta'], 'all that are wrong are named at once'


def solve_with(**changed):
    return foc_ros.solve(**({'start': (0, 0), 'goal': (0.3, 0), 'obstacles': [CUP]} | changed))


NO_GOALS = [], [(0.3, 0.0, 0.1, 0.0)], [(0.3, float('inf'))], [(0.3, 0.0, float('nan'))], 0.3
NO_SCENES = [
    ({'obstacles': [(0.1, 0.0, 0.02)]}, r'obstacles\[0\]'),
    ({'obstacles': [CUP, CUP]}, 'obstacles'),
    ({'start': [0.0, 0.0, 0.0, 0.0]}, 'start'),
    ({'start': (0.0, float('nan'))}, 'start'),
    ({'start': (0.15, 0.0)}, 'start'),
    ({'goal': (0.3,)}, 'goal'),
    ({'strategy': 'fastest'}, r'foc\.strategy'),
    ({'eta': 1.0}, r'foc\.eta'),
    ({'duration_s': 0.0}, r'duration\.fixed_s'),
    ({'config': {'eta': 0.9}}, 'config'),
    ({'guess': [(0.1, 0.1, 0.1)]}, 'guess'),
]


@pytest.mark.parametrize(
    ('create', 'text'),
    [
        (lambda: foc_ros.Predictor(FAST).update(0.0, (0.0, 0.0)), 'goals'),
        *((lambda goals=goals: foc_ros.Predictor().set_goals(goals), 'goals') for goals in NO_GOALS),
        *((lambda changed=changed: solve_with(**changed), f'^{field}: expected .*, got') for changed, field in NO_SCENES),
        (lambda: solve_with(guess=np.linspace((0.3, 0), (0, 0), 31)), r'31 points, the first within 0\.03 m of the start'),
        (lambda: solve_with(guess=np.linspace((0, 0), (0, 0.3), 31)), r'31 points, the last within 0\.03 m of the goal'),
        (lambda: foc_ros.monte_carlo(solve_with(), 0), 'samples'),
        (lambda: foc_ros.monte_carlo(predictor_of_one_cup().update(0.0, (0.0, 0.0)).candidates[0].solution), 'solution'),
        (lambda: foc_ros.monte_carlo(solve_with(), seed=-1), r'seed: expected a number in \[0, 4\.29497e\+09\], got -1'),
        (lambda: foc_ros.monte_carlo(solve_with(), seed=0.5), 'seed: expected a whole number, got 0.5'),
        (lambda: foc_ros.Predictor(library=5), 'library: expected a file, or demonstrations, got 5'),
        (lambda: FocConfig(eta=2), r'foc\.eta: expected a number in \[0, 0\.999\], got 2'),
        (lambda: Config(foc={'eta': 2}), r'foc\.eta: expected a number in \[0, 0\.999\], got 2'),
        (lambda: Config(foc={'zeta': 2}), r'foc\.zeta: expected a known parameter .*foc\.eta.*, got 2'),
        (lambda: Config(foc=0.95), r'foc: expected a mapping of its parameters to their values, got 0\.95'),
        (lambda: Config(duration=FocConfig()), 'duration: expected a mapping'),
        (lambda: Config(rate_hz='fast'), r"rate_hz: expected a finite number in \[0\.1, 1000\] Hz, got 'fast'"),
        (lambda: Circle((0, 0), center=(0, 0), radius=0.1), r'obstacle\.center: expected one centre, got two'),
        (lambda: foc_ros.Predictor().set_obstacles(None), 'obstacles: expected a list of Circle'),
        (lambda: foc_ros.Predictor().set_goals(Goal((0, 0), name='')), r"goal\.name: expected a text that is not empty, got ''"),
        (lambda: Goal((0, 0), nam='bowl'), r"goal\.nam: expected an argument of Goal \(did you mean name\?\), got 'bowl'"),
        (
            lambda: foc_ros.Box((0, 0), (1, 1), angle=0.3),
            r'obstacle\.angle: expected an argument of Box: centre, size, yaw, .*0\.3',
        ),
        (lambda: Circle((0, 0), r=0.3), r'obstacle\.r: .* \(did you mean radius\?\)'),
        (lambda: foc_ros.Capsule((0, 0), (1, 1), radios=0.3), r'obstacle\.radios: .* \(did you mean radius\?\)'),
        (lambda: Config(eta=0.9), r'^eta: expected a known parameter \(did you mean foc\.eta\?\), got 0\.9'),
        (lambda: Config(beta=2.0), r'^beta: .* \(did you mean likelihood\.beta\?\)'),
        (lambda: FocConfig(etaa=0.9), r'^foc\.etaa: expected a known parameter \(did you mean foc\.eta\?\), got 0\.9'),
        (lambda: Goal((0, 0), object=' '), r'goal\.object: expected a text that is not empty'),
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
def test_what_cannot_be_meant_is_refused_in_one_sentence(create, text):
    with pytest.raises(foc_ros.InputError, match=text):
        create()


@pytest.mark.parametrize('copy', [lambda given: given, lambda given: pickle.loads(pickle.dumps(given))], ids=['own', 'pickled'])
def test_arrays_are_read_only(predicted, copy):
    for each in predicted.candidates:
        for record in (each.solution, each.candidate, predicted.obstacles):
            arrays = [value for value in vars(copy(record)).values() if isinstance(value, np.ndarray)]
            assert arrays and not any(array.flags.writeable for array in arrays)
