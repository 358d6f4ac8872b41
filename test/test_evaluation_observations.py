# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Observations hold what the predictor publishes and what really came, against values computed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from bag_helpers import TYPES
from evaluation_samples import reach, write_tables

from foc_ros.analysis.evaluation import observations
from foc_ros.analysis.evaluation.baselines import power_rule_shares
from foc_ros.analysis.evaluation.observations import GAP, GOAL, PATH_CLASS, WIDENINGS, ask, find_relevant_obstacles, observe
from foc_ros.analysis.evaluation.truth import RecordedPath, find_ground_truth, warn_of_several_movements
from foc_ros.analysis.fitting.one_replay import widen_covariances
from foc_ros.analysis.recordings import EPOCH_NS, find_recordings
from foc_ros.core import tracks
from foc_ros.core.classes.rows import find_rows
from foc_ros.core.config import Config, replace_values
from foc_ros.core.learning.movements import find_reached_goal
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.solution import LEFT
from foc_ros.io.bags import Item
from foc_ros.ros.messages.encode_inputs import encode_goals

FAST = {'rate_hz': 4.0, 'foc.steps': 20, 'foc.strategy': 'fixed', 'foc.tau': 1e-4, 'foc.lam': 0.0, 'homotopy.max_detour': 100.0}
PLAIN = replace_values(Config(), FAST | {'likelihood.planning_horizon_s': 1000.0, 'likelihood.other_goal': 0.0})
AHEAD = replace_values(PLAIN, {'likelihood.beta': 3.0, 'likelihood.planning_horizon_s': 0.0, 'likelihood.lookahead_s': 0.4})
OBSTACLES = [(0.12, 0.0, 0.02), (0.22, 0.03, 0.02)]
GOALS = [(0.32, 0.05), (0.32, -0.05)]
DIRECTION = np.array([1.0, 0.0])


@pytest.fixture(autouse=True)
def without_limited_changes(monkeypatch):
    monkeypatch.setattr(tracks, 'FULL_CHANGE_S', 1e-9)


@pytest.fixture(scope='module')
def data(tmp_path_factory):
    return write_tables(tmp_path_factory.mktemp('data'), {'one': reach(0.06, GOALS[0])}, GOALS, OBSTACLES)


def observe_one(data, config):
    return observe(find_recordings(data)['one'], config, with_plans=True)


def test_other_parameters_on_observations_give_the_likelihoods_of_a_replay_with_them(data):
    for plain, ahead in zip(observe_one(data, PLAIN).observations, observe_one(data, AHEAD).observations, strict=True):
        tried = dict(zip(plain.candidates.labels, power_rule_shares(plain, AHEAD.likelihood), strict=True))
        published = dict(zip(ahead.candidates.labels, ahead.candidates.likelihood, strict=True))
        assert tried == pytest.approx(published)


def test_of_a_recording_that_begins_anew_the_last_run_is_observed(data):
    once = find_recordings(data)['one']
    twice = SimpleNamespace(name='twice', goal=None, items=lambda: [*once.items()] * 2)
    given, found = (observe(each, PLAIN) for each in (once, twice))
    np.testing.assert_array_equal(found.path.stamps_ns, given.path.stamps_ns)
    ours, expected = ([(each.stamp_ns, each.truth.progress) for each in one.observations] for one in (found, given))
    assert ours == expected


@pytest.mark.parametrize('plant', ['triple_integrator', 'damped_mass'])
def test_other_widenings_of_observations_give_the_covariances_of_a_replay_with_them(data, plant):
    known = replace_values(PLAIN, {'foc.plant': plant, 'duration.adaptation': 'none', 'covariance.adaptation': 'none'})
    settings = (0.0, 0.0, 0.0), (0.5, 0.02, 0.3)
    given = [replace_values(known, dict(zip(WIDENINGS, each, strict=True))) for each in settings]
    replays = [observe_one(data, each).observations for each in given]
    for both in zip(*replays, strict=True):
        for given, setting, other in zip(both, settings[::-1], both[::-1], strict=True):
            tried = widen_covariances(given, [setting])[0]
            np.testing.assert_allclose(tried, other.candidates.covariance, rtol=1e-9, atol=1e-12)


def test_the_ground_truth_is_that_of_the_path(data):
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


def test_no_goal_is_true_for_predictions_with_other_goals(data):
    class Changing:
        name, goal = 'changing', None

        def items(self):
            """Yield three goals half way; the two earlier ones return with the next message of the tables."""
            goals = encode_goals(TYPES, EPOCH_NS, 'world', np.array([(0.1 * k, 0.3, 0.0) for k in range(3)]))
            for item in find_recordings(data)['one'].items():
                yield item
                if item.role == 'hand_pose' and EPOCH_NS + 600_000_000 < item.log_ns < EPOCH_NS + 700_000_000:
                    yield Item('goals', '/goals', item.log_ns, goals, b'')

    recording = observe(Changing(), PLAIN)
    assert {len(each.goals) for each in recording.observations} == {2, 3}
    assert all(each.truth.goal == (0 if len(each.goals) == 2 else None) for each in recording.observations)


@pytest.mark.parametrize('duration_s', [0.4, 1.0])
def test_in_order_a_recording_has_its_own_hand_and_obstacles_only(tmp_path, duration_s):
    """Markers stay until they are deleted; those of another recording are not in the scene of this one."""
    names, times_s = ('one_1', 'one_2'), np.arange(0.0, duration_s, 0.02)
    rows = [f'{name},{t:.2f},0.0,{0.4 * min(t / 0.8, 1.0):.4f},0.7' for name in names for t in times_s]
    boxes = 'one_1,Target,0,0.45', 'one_1,Near,0.05,0.2', 'one_1,Far,-0.1,0.2', 'one_2,Target,0,0.45', 'one_2,Near,0.05,0.2'
    scenes = [f'{box},0.7,0.05,0.05,0.1' for box in boxes]
    (tmp_path / 'recordings.csv').write_text('\n'.join(['recording,t_s,x_m,y_m,z_m', *rows]))
    (tmp_path / 'scenes.csv').write_text('\n'.join(['recording,object,x_m,y_m,z_m,width_m,depth_m,height_m', *scenes]))
    found = find_recordings(tmp_path)
    config = Config().with_values({'rate_hz': 2.0, 'foc.steps': 20})
    observed, failed = observations.observe_in_order([found['one_1'], found['one_2']], config)
    assert not failed and [len(each.path.positions) for each in observed] == [len(times_s)] * 2
    before, after = ({name.partition('/')[0] for name in each.observations[0].ids} for each in observed)
    assert before == {'Near', 'Far'} and after == {'Near'}


def test_obstacles_that_overlap_along_the_direction_stand_in_one_row():
    centre = np.array([[3.0, 0.0], [1.0, 1.0], [1.15, -1.0], [2.0, 0.0]])
    ends = np.zeros(2), np.array([[4.0, 0.0]])
    assert find_rows(make_obstacles(centre, 0.1), DIRECTION, *ends).tolist() == [2, 0, 0, 1]
    assert find_rows(make_obstacles(), DIRECTION, *ends).shape == (0,)


TRUE_GOALS = np.array([[1.0, 0.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ('path', 'expected'),
    [
        pytest.param([(0.0, 0.0), (0.9, 0.0), (1.1, 0.1), (1.3, 0.1)], (0, 1), id='overshoots'),
        pytest.param([(0.0, 0.0), (0.9, 0.0), (0.1, 0.9)], (1, 2), id='both, the last counts'),
        pytest.param([(0.0, 0.0), (0.2, 0.1)], (None, 1), id='none'),
    ],
)
def test_the_goal_reached_is_the_last_one_that_the_path_came_near(path, expected):
    assert find_reached_goal(np.array(path), TRUE_GOALS) == expected


def test_progress_is_the_share_of_distance_and_positions_are_unknown_beyond_the_end():
    """Noise at rest adds nothing to the progress."""
    rest = np.array([[0.0, 0.0], [0.001, 0.0], [-0.001, 0.0], [0.001, 0.001]])
    positions = np.vstack([rest, [[0.25, 0.0], [0.5, 0.0], [1.0, 0.0]], [[1.0, 0.1]]])
    path = RecordedPath(np.arange(8) * 100_000_000, positions, TRUE_GOALS)
    assert path.goal == 0 and path.end_ns == 600_000_000
    np.testing.assert_allclose(path.progress, [0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 1.0])
    ahead = path.interpolate(350_000_000, np.array([0.1, 0.2, 0.4]))
    np.testing.assert_allclose(ahead, [[0.375, 0.0], [0.75, 0.0], [np.nan, np.nan]])


def test_a_recording_of_several_movements_is_named_but_a_goal_that_is_passed_or_where_the_hand_begins_counts_not():
    def move(*stops, rest_s):
        """Return the path in steps of 10 ms that rests at each stop, 0.5 s apart."""
        x = np.interp(np.arange(0.0, len(stops) * (0.5 + rest_s), 0.01), *zip(*times(stops, rest_s), strict=True))
        return RecordedPath(np.arange(len(x)) * 10_000_000, np.column_stack([x, np.zeros(len(x))]), goals)

    def times(stops, rest_s):
        for number, each in enumerate(stops):
            yield from ((number * (0.5 + rest_s), each), (number * (0.5 + rest_s) + rest_s, each))

    goals = np.array([[0.2, 0.0], [0.5, 0.0]])
    paths = {
        'one': move(0.0, 0.5, rest_s=0.5),
        'passing': move(0.0, 0.2, 0.5, rest_s=0.0),
        'between goals': move(0.2, 0.5, rest_s=0.5),
        'back': move(0.0, 0.5, 0.0, rest_s=0.5),
        'two': move(0.0, 0.2, 0.5, rest_s=0.5),
        'again': move(0.0, 0.5, 0.0, 0.5, rest_s=0.5),
    }
    (words,) = warn_of_several_movements(paths.items())
    assert words.startswith('two, again: the hand comes to rest at goals more than once; one recording per movement is expected')


def test_a_hand_that_passes_a_row_and_comes_back_to_a_goal_before_it_has_a_truth():
    x = np.concatenate([np.linspace(0.0, 0.3, 30), np.linspace(0.29, 0.15, 10)])
    positions, goals = np.column_stack([x, np.zeros(40)]), np.array([[0.15, 0.0], [0.5, 0.0]])
    path = RecordedPath(np.arange(40) * 10_000_000, positions, goals, 0)
    obstacles = make_obstacles([[0.2, 0.1]], 0.02)
    truth = find_ground_truth(0, path, obstacles, np.array([0]), DIRECTION, goals)
    assert truth.is_ahead.tolist() == [True] and truth.approach == 0.0 and truth.goal == 0
