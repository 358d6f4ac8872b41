"""Observations hold what the predictor publishes, and their likelihoods can be made again from them."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from evaluation_samples import reach, write_tables

from foc_ros.analysis.csv_recordings import EPOCH_NS, read_goals, read_movements, read_obstacles, write_movement
from foc_ros.analysis.evaluation.forecasts import power_rule
from foc_ros.analysis.evaluation.observations import Observations
from foc_ros.analysis.evaluation.observe import observe
from foc_ros.analysis.evaluation.questions import GAP, GOAL, WAY, question, relevant
from foc_ros.analysis.evaluation.recordings import BagRecording, find_recordings
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config, updated
from foc_ros.core.types import LEFT
from foc_ros.io.bags import TYPESTORE, BagReader, Item
from foc_ros.ros.messages.input_messages import goal_poses
from foc_ros.ros.messages.types import RosbagsTypes

FAST = {'rate_hz': 4.0, 'foc.steps': 20, 'foc.strategy': 'fixed', 'foc.tau': 1e-4, 'foc.lam': 0.0, 'homotopy.max_candidates': 6}
PLAIN = updated(Config(), FAST)
AHEAD = updated(PLAIN, {'likelihood.beta': 3.0, 'likelihood.spent_share': 0.3, 'likelihood.lookahead_s': 0.4})
PRICED = updated(PLAIN, {'duration.model': 'cost_of_time', 'duration.time_cost': 50.0})
OBSTACLES = [(0.12, 0.0, 0.02), (0.22, 0.03, 0.02)]
GOALS = [(0.32, 0.05), (0.32, -0.05)]


@pytest.fixture(scope='module')
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tables(tmp_path_factory.mktemp('data'), {'one': reach(0.06, GOALS[0])}, GOALS, OBSTACLES)


def seen(data: Path, config: Config) -> Observations:
    return observe(find_recordings(data)['one'], config)


@pytest.mark.parametrize('config', [PLAIN, AHEAD, PRICED])
def test_the_likelihoods_published_follow_from_the_observations(data: Path, config: Config) -> None:
    recording = seen(data, config)
    assert len(recording.each) >= 4
    for each in recording.each:
        np.testing.assert_allclose(power_rule(each, config.likelihood)[each.ways.solved], each.ways.likelihood[each.ways.solved])


def test_other_parameters_tried_on_observations_give_what_a_replay_with_them_gives(data: Path) -> None:
    for plain, ahead in zip(seen(data, PLAIN).each, seen(data, AHEAD).each, strict=True):
        tried = dict(zip(plain.ways.labels, power_rule(plain, AHEAD.likelihood), strict=True))
        published = dict(zip(ahead.ways.labels, ahead.ways.likelihood, strict=True))
        assert tried == pytest.approx(published)


def test_a_bag_is_observed_as_replay_predicts_it(data: Path, tmp_path: Path) -> None:
    bag = tmp_path / 'one'
    write_movement(
        bag,
        read_movements(data / 'recordings.csv')[0],
        read_obstacles(data / 'obstacles.csv'),
        read_goals(data / 'goals.csv'),
    )
    recording = observe(BagRecording('one', bag), PLAIN)
    with BagReader(bag) as reader:
        predictions = [step.prediction for step in Replay(PLAIN).steps(reader) if step.prediction is not None]
    for each, prediction in zip(recording.each, predictions, strict=False):
        assert each.stamp_ns == prediction.stamp_ns and each.most_likely == prediction.most_likely
        assert each.ways.likelihood.tolist() == [outcome.likelihood for outcome in prediction.candidates]
    assert pickle.dumps(recording.each[0].ways) == pickle.dumps(seen(data, PLAIN).each[0].ways)


def test_the_truth_is_the_path_s_own(data: Path) -> None:
    recording = seen(data, PLAIN)
    matters = relevant(recording)
    assert matters == {'0', '1'}
    first, last = recording.each[0], recording.each[-1]
    assert first.row.tolist() == [0, 1] and first.truth.goal == 0
    assert first.truth.sides.tolist() == [LEFT, LEFT] and first.truth.ahead.all()
    assert question(WAY, first, matters).open == 4 and question(GAP, first, matters).open == 2
    assert question(GOAL, first, matters).truth == 0
    progress = [each.truth.progress for each in recording.each]
    assert progress[0] == 0.0 and progress == sorted(progress) and progress[-1] > 0.5
    assert not last.truth.ahead[0] and np.isnan(last.truth.positions[-1]).all()


def test_the_same_recording_gives_the_same_observations(data: Path) -> None:
    assert pickle.dumps(seen(data, PLAIN)) == pickle.dumps(seen(data, PLAIN))


def test_where_goals_change_on_the_way_nothing_is_said_of_the_earlier_ones(data: Path) -> None:
    class Changing:
        name = 'changing'

        def items(self):
            """Three goals half way; the two from before come back with the tables' next message of them."""
            goals = goal_poses(RosbagsTypes(TYPESTORE), EPOCH_NS, 'world', np.array([(0.1 * k, 0.3, 0.0) for k in range(3)]))
            for item in find_recordings(data)['one'].items():
                yield item
                if item.role == 'hand_pose' and EPOCH_NS + 600_000_000 < item.log_ns < EPOCH_NS + 700_000_000:
                    yield Item('goals', '/goals', item.log_ns, goals, b'')

    recording = observe(Changing(), PLAIN)
    assert {len(each.goals) for each in recording.each} == {2, 3}
    assert all(each.truth.goal == (0 if len(each.goals) == 2 else None) for each in recording.each)
