# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes at the edge of what can be predicted: each has a decided answer, and what fails or is not followed keeps a share.

And what becomes of the classes that are followed when obstacles move, are replaced, or get other names.
"""

from dataclasses import replace

import numpy as np
import pytest
from bag_helpers import TYPES
from prediction_samples import outcome as make_outcome
from reach_helpers import make_predictor

import foc_ros
from foc_ros.core import candidates
from foc_ros.core.config import Config, replace_values
from foc_ros.core.deadline import Deadline
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.clearance import measure_clearance
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.predict import predict
from foc_ros.core.solution import Status
from foc_ros.core.tracks import FULL_CHANGE_S, NO_TRACKS
from foc_ros.core.types import HandSample, HandState
from foc_ros.io.json_output import encode_prediction
from foc_ros.play.scene import FIRST_SCENE
from foc_ros.reporting.views import read_snapshot
from foc_ros.ros.messages.encode_markers import encode_markers
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud

GOALS = np.array([[0.3, 0.0]])
CONFIG = replace_values(Config(), {'foc.steps': 30})


def total(prediction):
    return sum(each.likelihood for each in prediction.candidates) + prediction.unknown + prediction.other


def predicted(obstacles):
    hand = HandState(1, np.zeros(6), np.diag([1e-6, 1e-6, 1e-4, 1e-4, 1e-2, 1e-2]))
    prediction, memory = predict(CONFIG, hand, obstacles, GOALS, NO_TRACKS)
    for outcome in prediction.candidates:
        for array in (outcome.solution.mean, outcome.solution.covariance, outcome.solution.control):
            assert np.isfinite(array).all()
        assert outcome.has_likelihood or outcome.likelihood == 0.0
    assert total(prediction) == pytest.approx(1.0)
    assert (prediction.most_likely is None) == (not prediction.candidates_with_likelihood)
    numbers = {each.way: each.label for each in prediction.candidates}
    assert numbers.get(memory.most_likely) == prediction.most_likely
    return prediction


def test_a_hand_inside_an_obstacle_leaves_it_or_says_why_not():
    prediction = predicted(make_obstacles([[0.01, 0.0]], [0.03], 0.001))
    assert prediction.notes['hand_inside'] == 1
    assert prediction.candidates
    for outcome in prediction.candidates:
        assert 'inside the margin of 0 now' in outcome.solution.message
        assert np.hypot(*(outcome.solution.path[-1] - [0.01, 0.0])) > 0.03
    assert not [outcome for outcome in prediction.solved_candidates if outcome.solution.eta < CONFIG.foc.eta]


def test_a_class_whose_search_goes_astray_for_a_moment_is_not_unlikely():
    config = Config().with_values({'budget_s': 0.0, 'scene.hand_radius': 0.005})
    obstacles = foc_ros.Circle((0.0214, 0.0277), 0.03), foc_ros.Box((0.15, -0.0185), (0.04, 0.06))
    first = {each.label: each for each in make_predictor(config, (0.35, 0.0), obstacles).update(0.0, (0.0, 0.0))}
    assert first['goal0:+0+1'].status is Status.SOLVED
    assert first['goal0:+0+1'].likelihood > 0.05


def test_of_ten_thousand_obstacles_those_near_the_way_decide():
    near = [[0.1, 0.02], [0.2, -0.02]]
    angles = np.random.default_rng(7).uniform(0.0, 2.0 * np.pi, 9_998)
    far = [0.15, 0.0] + np.stack((np.cos(angles), np.sin(angles)), axis=1) * np.linspace(1.0, 3.0, 9_998)[:, None]
    few, many = predicted(make_obstacles(near, 0.02, 0.001)), predicted(make_obstacles([*near, *far], 0.02, 0.001))
    assert many.notes['culled'] == 10_000 - CONFIG.scene.max_obstacles
    assert 'culled' not in few.notes
    assert [each.label for each in many.solved_candidates] == [each.label for each in few.solved_candidates]
    for one, other in zip(many.solved_candidates, few.solved_candidates, strict=True):
        assert one.likelihood == pytest.approx(other.likelihood, rel=1e-6)
        assert np.abs(one.solution.path - other.solution.path).max() < 1e-6


WIDE = foc_ros.Config().with_values({'scene.hand_radius': 0.01})
CUPS = foc_ros.Circle((0.15, 0.01), radius=0.02, radius_stddev=0.002), foc_ros.Circle((0.2, -0.05), radius=0.015)


def test_a_solution_keeps_the_hand_away_where_it_fits_and_shows_the_given_obstacles():
    wide = foc_ros.solve((0, 0), (0.3, 0), CUPS, config=WIDE)
    grown = foc_ros.solve((0, 0), (0.3, 0), [replace(each, radius=each.radius + 0.01) for each in CUPS])
    np.testing.assert_array_equal(wide.mean, grown.mean)
    assert wide.obstacles.radius.tolist() == [0.02, 0.015]
    assert wide.problem is not None and wide.problem.obstacles.radius.tolist() == [0.03, 0.025]
    beside = (0.175, 0.01)
    with pytest.raises(foc_ros.SceneError, match=r'^start: expected a point outside obstacle 0, of radius 0\.03 m'):
        foc_ros.solve(beside, (0.3, 0), CUPS, config=WIDE)
    solution = foc_ros.solve((0, 0), beside, CUPS, config=WIDE)
    assert solution.status is foc_ros.Status.SOLVED, 'a goal that the hand cannot reach beside an obstacle is that obstacle'
    np.testing.assert_allclose(solution.mean[-1, :2], beside, atol=1e-6)
    plots = pytest.importorskip('matplotlib.figure')
    axes = wide.plot(plots.Figure().subplots())
    assert {0.02, 0.015} <= {patch.radius for patch in axes.patches if hasattr(patch, 'radius')}


SHARE_CONFIG = replace_values(Config(), {'foc.steps': 20, 'likelihood.other_goal': 0.0, 'homotopy.max_detour': 100.0})
HAND = HandState(0, np.zeros(6), np.zeros((6, 6)), frame_id='world')
ROW = make_obstacles([[0.15, 0.04], [0.15, -0.045]], 0.025, 0.001)


def ask(config=SHARE_CONFIG, goals=GOALS, obstacles=ROW):
    return predict(config, HAND, obstacles, goals, NO_TRACKS)[0]


def let_fail(monkeypatch, number, status):
    solve = candidates.solve_problems

    def fail(*given):
        return [replace(each, status=status) if row == number else each for row, each in enumerate(solve(*given))]

    monkeypatch.setattr(candidates, 'solve_problems', fail)


@pytest.mark.parametrize(('number', 'status'), [(0, Status.LEFT_CLASS), (1, Status.ITERATION_LIMIT), (2, Status.INFEASIBLE)])
def test_a_class_that_the_search_sees_and_the_solver_fails_in_keeps_a_share(monkeypatch, status, number):
    known = {each.way: each for each in ask().candidates}
    let_fail(monkeypatch, number, status)
    found = ask()
    (failed,) = [each for each in found.candidates if 'length of its path' in each.solution.message]
    assert failed.way == number and failed.status is Status.ESTIMATED and len(found.candidates) == 4
    # classes that are so unlikely that they go on in the next prediction are estimated too
    assert found.notes['estimated'] == sum(each.status is Status.ESTIMATED for each in found.candidates)
    assert 0.25 < failed.likelihood / known[number].likelihood < 4.0
    assert total(found) == pytest.approx(1.0)
    np.testing.assert_allclose(failed.mean[0], HAND.mean, atol=1e-12)
    np.testing.assert_allclose(failed.mean[-1, :2], GOALS[0], atol=1e-9)


@pytest.mark.parametrize('horizon_s', [1000.0, 0.0])
def test_what_is_seen_and_not_followed_is_unknown(horizon_s):
    config = replace_values(SHARE_CONFIG, {'likelihood.planning_horizon_s': horizon_s})
    whole, one = ask(config), ask(replace_values(config, {'homotopy.max_candidates': 1}))
    assert whole.unknown == 0.0 and len(whole.candidates) == 4 and len(one.candidates) == 1
    followed = next(each for each in whole.candidates if each.label == one.most_likely)
    assert one.unknown == pytest.approx(1.0 - followed.likelihood, abs=0.15)
    assert one.candidates[0].likelihood == pytest.approx(1.0 - one.unknown)


def test_goals_that_are_not_followed_are_unknown():
    angles = np.linspace(-0.7, 0.7, 80)
    goals = 0.3 * np.column_stack([np.cos(angles), np.sin(angles)])
    found = ask(replace_values(SHARE_CONFIG, {'foc.steps': 5}), goals, make_obstacles())
    assert len(found.candidates) == 64
    assert found.unknown == pytest.approx(16.0 / 80.0, abs=0.02) and total(found) == pytest.approx(1.0)


def test_the_cost_of_a_class_that_is_not_followed_is_the_largest_that_candidates_lead_to_expect():
    right, left = make_outcome('goal0:+1', cost=1.0), make_outcome('goal1:-1', bend=-0.1, cost=50.0, safety_factor=1.0)
    left = replace(left, candidate=replace(left.candidate, goal=1))
    unfollowed = replace(left.candidate, label='goal0:-1', goal=0, length=1.1 * left.candidate.length)
    for solved, known_cost in (([right, left], 50.0), ([right], 1.0)):
        (found,) = candidates.estimate_unfollowed([unfollowed], solved, [1.0, 1.0])
        assert known_cost < found.cost < 3.0 * known_cost and found.status is Status.ESTIMATED


def test_the_shares_of_unknown_classes_and_of_another_goal_are_published_and_read_back():
    config = replace_values(SHARE_CONFIG, {'homotopy.max_candidates': 1, 'likelihood.other_goal': 0.2})
    whole, one = ask(), ask(config)
    assert min(one.unknown, one.other) > 0.05
    table, cloud = encode_likelihoods(one, TYPES), encode_prediction_cloud(one, 'xy', TYPES)
    assert table.layout.dim[0].label == f'{one.candidates[0].label};unknown;other'
    rows = np.asarray(table.data).reshape(-1, 4)
    assert rows[:, 0].sum() == pytest.approx(1.0) and np.isnan(rows[1:, 1:]).all()
    assert rows[1:, 0].tolist() == [one.unknown, one.other]
    assert encode_likelihoods(whole, TYPES).layout.dim[0].label.split(';') == [each.label for each in whole.candidates]
    read, encoded = read_snapshot(cloud, table, 'xy', one.obstacles, one.goal_positions), encode_prediction(one)
    assert (read.unknown, read.other) == (encoded['unknown'], encoded['other']) == (one.unknown, one.other)
    texts = [each.text for each in encode_markers(one, 'xy', TYPES).markers]
    shares = f'{100 * one.unknown:.0f} % unknown', f'{100 * one.other:.0f} % another goal'
    assert any(all(share in text for share in shares) for text in texts)


def test_a_class_that_the_search_misses_keeps_its_answer_for_a_moment():
    one = replace_values(SHARE_CONFIG, {'homotopy.max_candidates': 1})
    whole, tracks = predict(SHARE_CONFIG, HAND, ROW, GOALS, NO_TRACKS)
    lost = {each.label for each in whole.solved_candidates} - {whole.most_likely}
    ages = []
    for tick in range(1, 13):
        prediction, tracks = predict(one, replace(HAND, stamp_ns=20_000_000 * tick), ROW, GOALS, tracks)
        ages.append({each.label: each.age_s for each in prediction.candidates if each.label in lost})
        assert total(prediction) == pytest.approx(1.0)
        assert all(np.hypot(*each.mean[0, :2]) < 1e-9 for each in prediction.candidates)
    assert len(lost) == 2
    for tick, found in enumerate(ages, 1):
        assert found == ({label: pytest.approx(0.02 * tick) for label in lost} if tick <= 10 else {})


@pytest.mark.parametrize('length', [0.8, 0.9, 1.2])
@pytest.mark.parametrize('shape', ['box', 'capsule'])
def test_both_ways_round_a_long_wall_are_found(shape, length):
    wall = foc_ros.Capsule((0.15, -length / 2), (0.15, length / 2), 0.01)
    found = foc_ros.solve_classes((0, 0), (0.3, 0), foc_ros.Box((0.15, 0), (0.02, length)) if shape == 'box' else wall)
    assert [each.status for each in found] == [Status.SOLVED] * 2
    assert all(np.abs(each.mean[:, 1]).max() < 0.75 * length for each in found)


@pytest.mark.parametrize(('bow', 'goal', 'period'), [(-0.04, 0, 8), (-0.04, 2, 12), (0.0, 1, 4), (0.04, 0, 8), (0.06, 0, 12)])
def test_with_time_for_one_qp_at_a_time_likely_paths_stay_near(bow, goal, period):
    """A hand moves in a bow [m] to a goal, through obstacles too, with a prediction every so many hundredths of a second."""
    pipeline, goals, farthest = Pipeline(Config(), is_timed=False), np.array(FIRST_SCENE.points), []
    pipeline.set_goals(goals, '')
    pipeline.set_obstacles('test', FIRST_SCENE.tabulate(), None, '')
    for tick, s in enumerate(np.minimum(np.arange(150) / 80, 1.0).tolist()):
        share = 10 * s**3 - 15 * s**4 + 6 * s**5
        position = share * goals[goal] + [0.0, bow * np.sin(np.pi * share)]
        pipeline.add_hand_sample(HandSample(1_000_000_000 + 10_000_000 * tick, position))
        if tick % period == 0:
            prediction = pipeline.predict(Deadline(0.0))
            likely = [each for each in prediction.candidates if each.likelihood > 0.05]
            farthest += [float(np.abs(each.mean[:, :2] - [0.15, 0.0]).max()) for each in likely]
    # inside an obstacle, a hand is expected to go wide: paths lead up to 0.77 m away where there is no limit of time
    assert len(farthest) > 10 and max(farthest) < 0.8


CROSSED = [foc_ros.Box((0.202, 0.023), (0.086, 0.065)), foc_ros.Circle((0.0654, -0.0028), 0.0127)]


@pytest.mark.parametrize('obstacles', [foc_ros.Box((0.15, 0.0), (0.01, 0.5)), CROSSED], ids=['wall', 'box and circle'])
def test_one_qp_at_a_time_comes_to_the_likelihoods_of_all_classes(obstacles):
    """The search has no time for more than a few classes. A solution takes more than three times the effort of its guess."""
    free, late = (foc_ros.Predictor(foc_ros.Config(budget_s=budget_s)) for budget_s in (0.0, 1e-4))
    for each in (free, late):
        each.set_obstacles(obstacles)
        each.set_goals([(0.3, 0.0)])
    wanted = free.update(0.0, (0.0, 0.003))
    found = [late.update(0.02 * tick, (0.0, 0.003)) for tick in range(13)][-1]
    found_shares = {each.label: each.likelihood for each in found.candidates}
    assert all(abs(found_shares[each.label] - each.likelihood) < 0.03 for each in wanted.candidates)


@pytest.mark.parametrize('aside', [-0.03, 0.0, 0.06])
def test_a_guess_is_in_the_class_in_which_it_passes_a_moving_obstacle_in_time(aside):
    """The post is on the left of the straight line now, and on the right of it when the hand comes."""
    post = foc_ros.Circle((0.15, 0.12), 0.03, velocity=(0.0, -0.36), name='post')
    solution = foc_ros.solve((0.0, 0.0), (0.3, 0.0), post, duration_s=1.0, guess=[(0.15, aside)])
    assert (solution.status.value, solution.label) == ('solved', 'goal0:+post')


GOAL, TICK_S = (0.3, 0.0), 0.02


def make_gate(y, names=('a', 'b')):
    return [foc_ros.Circle((0.15, 0.055), 0.03, name=names[0]), foc_ros.Circle((0.15, y), 0.03, name=names[1])]


POST = foc_ros.Circle((0.17, 0.01), 0.03, name='5')
CUP, JAR = foc_ros.Circle((0.15, -0.01), 0.03, name='cup'), foc_ros.Circle((0.15, 0.02), 0.03, name='jar')
CHANGED_SCENES = {
    'moves into the gap': (make_gate(-0.055), make_gate(-0.002)),
    'is replaced': ([CUP], [JAR]),
    'has another name': ([POST], [foc_ros.Circle((0.17, 0.01), 0.03, name='7')]),
    'is in another row': (make_gate(-0.055, ('', '')), make_gate(-0.055, ('', ''))[::-1]),
}


def follow(before, after, ticks=10):
    """Return the last prediction among obstacles, and those after they have changed, for a hand at rest."""
    predictor = make_predictor(Config(budget_s=0.0), GOAL, before)
    known = [predictor.update(TICK_S * tick, (0.0, 0.0)) for tick in range(ticks)][-1]
    predictor.set_obstacles(after)
    return known, [predictor.update(TICK_S * (ticks + tick), (0.0, 0.0)) for tick in range(ticks)]


@pytest.mark.parametrize('name', CHANGED_SCENES)
def test_no_path_that_an_obstacle_blocks_or_whose_obstacles_are_gone_is_held(name):
    _, changed = follow(*CHANGED_SCENES[name])
    fresh = make_predictor(Config(budget_s=0.0), GOAL, CHANGED_SCENES[name][1]).update(0.0, (0.0, 0.0))
    for prediction in changed:
        assert {each.label for each in prediction} == {each.label for each in fresh}
        for each in prediction:
            assert measure_clearance(each.solution.path, prediction.obstacles, each.solution.dt) > 0.0
        shares = [each.likelihood for each in prediction] + [prediction.unknown, prediction.other]
        assert sum(shares) == pytest.approx(1.0)
    assert {each.label: each.likelihood for each in changed[-1]} == pytest.approx(
        {each.label: each.likelihood for each in fresh}, abs=0.01
    )


def test_what_a_blocked_class_had_is_unknown_until_the_others_have_won_it():
    known, changed = follow(*CHANGED_SCENES['moves into the gap'])
    lost, most = known.candidates[0], TICK_S / FULL_CHANGE_S
    assert lost.label == 'goal0:-a+b' and lost.likelihood > 0.7
    assert changed[0].unknown >= lost.likelihood - most - 1e-9
    assert np.diff([each.unknown for each in changed]).max() <= 1e-9
    assert changed[-1].unknown < 0.01


def test_two_classes_that_an_obstacle_does_not_tell_apart_when_the_hand_is_there_are_one_without_its_name():
    """The post moves ahead of the hand, past the goal. Noise decides on which side of it the shorter guess is."""
    noise, predictor = np.random.default_rng(0), make_predictor(Config(budget_s=0.0), GOAL)
    merged = 0
    for tick in range(40):
        t = TICK_S * tick
        predictor.set_obstacles(foc_ros.Circle((0.12 + 0.4 * t, 0.0), 0.02, name='post', velocity=(0.4, 0.0)))
        (only,) = prediction = predictor.update(t, (0.3 * t**2, 0.0) + 5e-4 * noise.normal(size=2))
        merged += prediction.notes.get('merged', 0)
        assert (only.label, only.way) == ('goal0:', 0) and only.likelihood > 0.95
    assert merged > 10, 'the post is no test'


def test_a_class_that_is_no_candidate_any_more_gains_no_likelihood():
    """The hand turns away from a class that was never likely, while all other classes become dearer."""
    walls = [foc_ros.Circle((0.16, y), 0.022, radius_stddev=0.002) for y in (-0.1, -0.03, 0.04, 0.11)]
    predictor = make_predictor(Config(budget_s=0.0, homotopy={'max_detour': 1.15}), (0.32, 0.02), walls)
    before, held = {}, 0
    for tick in range(60):
        t = 0.01 * tick
        prediction = predictor.update(t, (0.25 * t, 0.45 * t**2))
        for each in prediction:
            if 'not followed' in each.solution.message:
                held += 1
                assert each.likelihood <= before[each.way] + 1e-9
        before = {each.way: each.likelihood for each in prediction}
    assert held, 'the hand is no test'
