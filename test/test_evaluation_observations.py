# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Observations hold what the predictor publishes and what really came, against values computed by hand."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from evaluation_samples import reach, write_tables

from foc_ros.analysis.csv_recordings import EPOCH_NS
from foc_ros.analysis.evaluation.baselines import power_rule_shares
from foc_ros.analysis.evaluation.observations import (
    ObservedRecording,
    interpolate_path,
    interpolate_steps,
    observe,
    observe_in_order,
)
from foc_ros.analysis.evaluation.questions import GAP, GOAL, PATH_CLASS, ask, find_relevant_obstacles
from foc_ros.analysis.evaluation.truth import TIMES_S, RecordedPath, find_ground_truth, find_open_gaps, find_rows_ahead
from foc_ros.analysis.recordings import BagRecording, convert_tables, find_recordings
from foc_ros.analysis.replay import Replay
from foc_ros.core import tracks
from foc_ros.core.classes.rows import find_direction, find_rows, locate_rows
from foc_ros.core.config import Config, replace_values
from foc_ros.core.learning.movements import find_reached_goal
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.shapes import Box, Circle, Shape, collect_obstacles
from foc_ros.core.solution import LEFT, RIGHT, Solution, Status
from foc_ros.io.bags import TYPESTORE, BagReader, Item
from foc_ros.ros.messages.encode_inputs import encode_goals
from foc_ros.ros.messages.types import RosbagsTypes

FAST = {'rate_hz': 4.0, 'foc.steps': 20, 'foc.strategy': 'fixed', 'foc.tau': 1e-4, 'foc.lam': 0.0, 'homotopy.max_detour': 100.0}
PLAIN = replace_values(Config(), FAST | {'likelihood.planning_horizon_s': 1000.0, 'likelihood.other_goal': 0.0})
AHEAD = replace_values(PLAIN, {'likelihood.beta': 3.0, 'likelihood.planning_horizon_s': 0.0, 'likelihood.lookahead_s': 0.4})
OBSTACLES = [(0.12, 0.0, 0.02), (0.22, 0.03, 0.02)]
GOALS = [(0.32, 0.05), (0.32, -0.05)]


@pytest.fixture(autouse=True)
def without_a_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tracks, 'SMOOTHING_S', 1e-9)


@pytest.fixture(scope='module')
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tables(tmp_path_factory.mktemp('data'), {'one': reach(0.06, GOALS[0])}, GOALS, OBSTACLES)


def observe_one(data: Path, config: Config) -> ObservedRecording:
    return observe(find_recordings(data)['one'], config)


@pytest.mark.parametrize('config', [PLAIN, AHEAD])
def test_the_published_likelihoods_follow_from_the_observations(data: Path, config: Config) -> None:
    recording = observe_one(data, config)
    assert len(recording.observations) >= 4
    for each in recording.observations:
        np.testing.assert_allclose(
            power_rule_shares(each, config.likelihood)[each.candidates.has_likelihood],
            each.candidates.likelihood[each.candidates.has_likelihood],
        )


def test_other_parameters_on_observations_give_the_likelihoods_of_a_replay_with_them(data: Path) -> None:
    for plain, ahead in zip(observe_one(data, PLAIN).observations, observe_one(data, AHEAD).observations, strict=True):
        tried = dict(zip(plain.candidates.labels, power_rule_shares(plain, AHEAD.likelihood), strict=True))
        published = dict(zip(ahead.candidates.labels, ahead.candidates.likelihood, strict=True))
        assert tried == pytest.approx(published)


def test_a_bag_is_observed_as_its_table_and_as_replay_predicts_it(data: Path, tmp_path: Path) -> None:
    convert_tables(data, None, None, tmp_path)
    recording = observe(BagRecording('one', tmp_path / 'one'), PLAIN)
    with BagReader(tmp_path / 'one') as reader:
        predictions = [step.prediction for step in Replay(PLAIN).steps(reader) if step.prediction is not None]
    for each, prediction in zip(recording.observations, predictions, strict=False):
        assert each.stamp_ns == prediction.stamp_ns and each.most_likely == prediction.most_likely
        assert each.candidates.likelihood.tolist() == [outcome.likelihood for outcome in prediction.candidates]
    first = recording.observations[0].candidates
    assert pickle.dumps(first) == pickle.dumps(observe_one(data, PLAIN).observations[0].candidates)


def test_the_ground_truth_is_that_of_the_path(data: Path) -> None:
    recording = observe_one(data, PLAIN)
    relevant = find_relevant_obstacles(recording)
    assert relevant == {'0', '1'}
    first, last = recording.observations[0], recording.observations[-1]
    assert first.row.tolist() == [0, 1] and first.truth.goal == 0
    assert first.truth.sides.tolist() == [LEFT, LEFT] and first.truth.is_ahead.all()
    assert ask(PATH_CLASS, first, relevant).possible == 4 and ask(GAP, first, relevant).possible == 2
    assert ask(GOAL, first, relevant).truth == 0
    progress = [each.truth.progress for each in recording.observations]
    assert progress[0] == 0.0 and progress == sorted(progress) and progress[-1] > 0.5
    assert not last.truth.is_ahead[0] and np.isnan(last.truth.positions[-1]).all()
    assert 0.0 <= last.truth.left_s < 0.3 and first.truth.left_s == pytest.approx(1.2, abs=0.1)


def test_no_goal_is_true_for_predictions_with_other_goals(data: Path) -> None:
    class Changing:
        name, goal = 'changing', None

        def items(self):
            """Yield three goals half way; the two earlier ones return with the next message of the tables."""
            goals = encode_goals(RosbagsTypes(TYPESTORE), EPOCH_NS, 'world', np.array([(0.1 * k, 0.3, 0.0) for k in range(3)]))
            for item in find_recordings(data)['one'].items():
                yield item
                if item.role == 'hand_pose' and EPOCH_NS + 600_000_000 < item.log_ns < EPOCH_NS + 700_000_000:
                    yield Item('goals', '/goals', item.log_ns, goals, b'')

    recording = observe(Changing(), PLAIN)
    assert {len(each.goals) for each in recording.observations} == {2, 3}
    assert all(each.truth.goal == (0 if len(each.goals) == 2 else None) for each in recording.observations)


@pytest.mark.parametrize('dt', [0.011, 0.13])
def test_predictions_are_compared_at_the_exact_time(dt: float) -> None:
    steps = dt * np.arange(8)
    states = np.column_stack([steps**3, steps**2, 3.0 * steps**2, 2.0 * steps, 6.0 * steps, np.full(8, 2.0)])
    plan = Solution(Status.SOLVED, '', dt, states, np.tile(np.eye(6), (8, 1, 1)), np.zeros((7, 2)), 0.0, {}, 0.0, 0.0, 0.9)
    expected = np.minimum(TIMES_S, steps[-1])
    np.testing.assert_allclose(interpolate_path(plan), np.column_stack([expected**3, expected**2]), atol=1e-12)
    np.testing.assert_allclose(interpolate_steps(2.0 * steps, dt), 2.0 * expected)
    assert interpolate_steps(np.zeros((8, 2, 2)), dt).shape == (len(TIMES_S), 2, 2)


@pytest.mark.parametrize('duration_s', [0.4, 1.0])
def test_in_order_a_recording_has_its_own_hand_and_obstacles_only(tmp_path: Path, duration_s: float) -> None:
    """Markers stay until they are deleted; those of another recording are not in the scene of this one."""
    rows, scenes, times_s = [], [], np.arange(0.0, duration_s, 0.02)
    for name in ('one_1', 'one_2'):
        for t in times_s:
            rows.append(f'{name},{t:.2f},0.0,{0.4 * min(t / 0.8, 1.0):.4f},0.7')
        scenes += [f'{name},Target,0,0.45,0.7,0.05,0.05,0.1', f'{name},Near,0.05,0.2,0.7,0.05,0.05,0.1']
    scenes.insert(2, 'one_1,Far,-0.1,0.2,0.7,0.05,0.05,0.1')
    (tmp_path / 'recordings.csv').write_text('\n'.join(['recording,t_s,x_m,y_m,z_m', *rows]))
    (tmp_path / 'scenes.csv').write_text('\n'.join(['recording,object,x_m,y_m,z_m,width_m,depth_m,height_m', *scenes]))
    found = find_recordings(tmp_path)
    config = Config().with_values({'rate_hz': 2.0, 'foc.steps': 20})
    observed, failed = observe_in_order([found['one_1'], found['one_2']], config)
    assert not failed and [len(each.path.positions) for each in observed] == [len(times_s)] * 2
    before, after = ({name.partition('/')[0] for name in each.observations[0].ids} for each in observed)
    assert before == {'Near', 'Far'} and after == {'Near'}


DIRECTION = np.array([1.0, 0.0])


def test_obstacles_that_overlap_along_the_direction_stand_in_one_row() -> None:
    centre = np.array([[3.0, 0.0], [1.0, 1.0], [1.15, -1.0], [2.0, 0.0]])
    ends = np.zeros(2), np.array([[4.0, 0.0]])
    assert find_rows(make_obstacles(centre, 0.1), DIRECTION, *ends).tolist() == [2, 0, 0, 1]
    assert find_rows(make_obstacles(), DIRECTION, *ends).shape == (0,)


def test_a_row_stands_at_the_middle_of_its_obstacles() -> None:
    np.testing.assert_allclose(locate_rows(np.array([3.0, 1.0, 1.2]), np.array([1, 0, 0])), [1.1, 3.0])


def test_a_row_is_passed_for_good_only_when_the_path_does_not_come_back() -> None:
    place = np.array([0.0, 1.5, 0.5, 2.5])
    assert find_rows_ahead(np.array([1.0, 2.0, 3.0]), place).tolist() == [True, True, False]
    assert find_rows_ahead(np.array([1.0, 2.0, 3.0]), place[1:]).tolist() == [True, True, False]
    assert find_rows_ahead(np.array([1.0, 2.0, 3.0]), place[3:]).tolist() == [False, False, False]


def test_the_direction_is_towards_the_mean_of_the_goals() -> None:
    np.testing.assert_allclose(find_direction(np.array([1.0, 1.0]), np.array([[2.0, 3.0], [0.0, 3.0]])), [0.0, 1.0])
    np.testing.assert_allclose(find_direction(np.zeros(2), np.zeros((1, 2))), [1.0, 0.0])


START, END = np.zeros(2), np.array([[2.0, 0.0]])
WALLS = [Box((1.0, side * 0.5), (3.0, 0.1), name=f'wall{side}') for side in (-1, 1)]


def find_ways(*shapes: Shape, hand_radius: float = 0.0) -> tuple[list[int], list[list[list[int]]]]:
    """Return the row of each obstacle, and the sides of the open gaps of each row."""
    obstacles = collect_obstacles(shapes)
    row = find_rows(obstacles, DIRECTION, START, END)
    return row.tolist(), [sides.tolist() for sides in find_open_gaps(obstacles, row, DIRECTION, hand_radius)]


def test_a_wall_is_in_no_row_and_a_box_across_the_way_is() -> None:
    across = Box((0.5, 0.0), (0.05, 0.4)), Box((1.5, 0.1), (0.4, 0.05), np.pi / 2)
    assert find_ways(*across, *WALLS)[0] == [0, 1, -1, -1]
    assert find_ways(Box((1.0, 0.3), (1.0, 0.05)), Box((2.5, 0.0), (0.1, 2.0)))[0] == [0, -1]  # beside a part; behind the goal
    assert find_ways(Circle((1.0, 30.0), radius=20.0))[0] == [0]


def test_boxes_overlap_along_the_direction_with_their_extents() -> None:
    long, turned = Box((1.0, 0.3), (1.0, 0.1)), Box((1.0, 0.3), (1.0, 0.1), np.pi / 2)
    assert find_ways(long, Box((1.4, -0.3), (0.1, 0.1)))[0] == [0, 0]
    assert find_ways(turned, Box((1.4, -0.3), (0.1, 0.1)))[0] == [0, 1]
    assert find_ways(Box((1.0, 0.3), (0.2, 0.1), radius=0.3), Box((1.4, -0.3), (0.1, 0.1)))[0] == [0, 0]


def test_gaps_too_narrow_for_the_hand_are_closed() -> None:
    right, left = Box((1.0, -0.2), (0.1, 0.3)), Box((1.0, 0.2), (0.1, 0.2))  # gaps of 0.10, 0.15 and 0.15 m
    through = [[RIGHT, RIGHT], [LEFT, RIGHT], [LEFT, LEFT]]
    for hand_radius, is_open in ((0.0, [True] * 3), (0.06, [False, True, True]), (0.08, [False] * 3)):
        row, (gaps,) = find_ways(right, left, *WALLS, hand_radius=hand_radius)
        assert row == [0, 0, -1, -1]
        assert gaps == [[*sides, 0, 0] for sides, each in zip(through, is_open, strict=True) if each]
    assert find_ways(right, left, hand_radius=0.08)[1] == [[through[0], through[2]]]


def test_the_gap_between_turned_boxes_is_their_distance() -> None:
    for gap, count in ((0.1, 3), (0.099, 2)):
        first = Box((1.0, 0.0), (0.2, 0.2), np.pi / 4)
        second = Box((1.0, 0.1 * np.sqrt(2.0) + gap + 0.02 + 0.05), (0.3, 0.1), radius=0.02)
        assert len(find_ways(first, second, hand_radius=0.04999)[1][0]) == count


TRUE_GOALS = np.array([[1.0, 0.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ('path', 'expected'),
    [
        pytest.param([(0.0, 0.0), (0.9, 0.0), (1.1, 0.1), (1.3, 0.1)], (0, 1), id='overshoots'),
        pytest.param([(0.0, 0.0), (0.9, 0.0), (0.1, 0.9)], (1, 2), id='both, the last counts'),
        pytest.param([(0.0, 0.0), (0.2, 0.1)], (None, 1), id='none'),
    ],
)
def test_the_goal_reached_is_the_last_one_that_the_path_came_near(path, expected) -> None:
    assert find_reached_goal(np.array(path), TRUE_GOALS) == expected


def test_a_single_goal_is_reached_wherever_the_path_is_nearest() -> None:
    assert find_reached_goal(np.array([(0.0, 0.0), (0.5, 0.0), (0.4, 0.0)]), TRUE_GOALS[:1]) == (0, 1)


def test_progress_is_the_share_of_distance_and_noise_at_rest_adds_none() -> None:
    rest = np.array([[0.0, 0.0], [0.001, 0.0], [-0.001, 0.0], [0.001, 0.001]])
    positions = np.vstack([rest, [[0.25, 0.0], [0.5, 0.0], [1.0, 0.0]], [[1.0, 0.1]]])
    path = RecordedPath(np.arange(8) * 100_000_000, positions, TRUE_GOALS)
    assert path.goal == 0 and path.end_ns == 600_000_000
    np.testing.assert_allclose(path.progress, [0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 1.0])


def test_true_positions_are_interpolated_and_unknown_beyond_the_end() -> None:
    path = RecordedPath(np.array([0, 500_000_000, 1_000_000_000]), np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]), TRUE_GOALS)
    np.testing.assert_allclose(
        path.interpolate(250_000_000, np.array([0.25, 0.5, 1.0])), [[0.5, 0.0], [0.75, 0.0], [np.nan, np.nan]]
    )


def test_a_hand_that_passes_a_row_and_comes_back_to_a_goal_before_it_has_a_truth() -> None:
    x = np.concatenate([np.linspace(0.0, 0.3, 30), np.linspace(0.29, 0.15, 10)])
    positions, goals = np.column_stack([x, np.zeros(40)]), np.array([[0.15, 0.0], [0.5, 0.0]])
    path = RecordedPath(np.arange(40) * 10_000_000, positions, goals, 0)
    obstacles = make_obstacles([[0.2, 0.1]], 0.02)
    truth = find_ground_truth(0, path, obstacles, np.array([0]), DIRECTION, goals)
    assert truth.is_ahead.tolist() == [True] and truth.approach == 0.0 and truth.goal == 0
