# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Outputs of the node: their content, their time, and their agreement with the pipeline."""

import re
from typing import Any

import ros_required  # noqa: F401
import numpy as np
import pytest
from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped
from node_helpers import CROWD, GOALS, OK, TYPES, WARN, Bench, begin, figures, hand_path, list_labels, stamps
from process_helpers import ScenePlayer, ended, parameters, running
from std_msgs.msg import Float64

from foc_ros.ros import health
from foc_ros.ros.endpoints import MOST_GOAL_TOPICS


def test_nothing_is_predicted_before_all_inputs_are_received_and_diagnostics_report_it(ros):
    bench, (first, *poses) = Bench(ros), hand_path(3)
    assert 'no hand pose yet' in bench.health().message
    bench.move([first])
    status = bench.health()
    assert status.level == WARN and 'no obstacles received yet' in status.message
    bench.deliver('obstacles', cloud(TYPES, obstacle_table([]), 10 * SECOND))
    assert 'no goal received' in bench.health().message
    bench.deliver('goals', pose_array(TYPES, GOALS))
    assert bench.node.pipeline.is_due
    bench.deliver('hand_pose', first)
    assert figures(bench.health())['count hand_duplicate'] == '1'
    assert not bench.received['prediction'], 'a refused pose triggers no prediction'
    bench.move(poses)
    bench.wait_for('prediction', 1)


@pytest.mark.parametrize('is_fresh', [True, False])
def test_an_overloaded_node_predicts_from_the_newest_pose_and_counts_the_others(ros, monkeypatch, is_fresh):
    """Dropped cycles are counted; they are reported as a fault only if the predictions are not fresh."""
    monkeypatch.setattr(health, 'BUSY_S', 60.0 if is_fresh else 0.0)
    bench, poses = begin(ros, 1), hand_path(41)
    bench.wait_for('prediction', 1)
    bench.send('hand_pose', *poses[1:])
    assert stamps(bench.wait_for('prediction', 2)) == [stamps(poses)[0], stamps(poses)[-1]]
    status = bench.health()
    values = figures(status)
    fault = f'hand_superseded {values["dropped cycles"]}'
    assert (status.level, status.message) == ((OK, 'predicting') if is_fresh else (WARN, fault))
    assert int(values['dropped cycles']) > 0
    assert values['hand_pose refused'] == '0 of 41'
    assert int(values['count predictions']) == 2


def test_a_looping_bag_restarts_the_movement(ros):
    bench, poses = begin(ros), hand_path(7, rate_hz=10.0)
    for turn in range(2):
        bench.move(poses)
        status = bench.health()
        assert status.level == (WARN if turn else OK), status.message
    assert stamps(bench.wait_for('prediction', 14)) == stamps(poses) * 2
    assert (status.message, figures(status)['count hand_restarted_backward']) == ('hand_restarted_backward 1', '1')
    bench.move(hand_path(8, rate_hz=10.0)[7:])
    status = bench.health()
    assert status.level == OK, status.message


def test_diagnostics_contain_rates_ages_times_and_candidates(ros):
    bench = begin(ros, 10)
    bench.wait_for('prediction', 5)
    status = bench.health()
    values = figures(status)
    assert status.name == 'foc: prediction'
    assert values['working frame'] == 'world'
    assert (values['obstacles of cloud'], values['goals']) == ('1', '1')
    assert float(values['hand_pose age [s]']) >= 0.0
    assert [float(text) > 0.0 for text in values['solve time p50, p99 [ms]'].split(', ')] == [True, True]
    labels = list_labels(bench.received['likelihoods'][-1])
    for label in labels:
        assert values[f'candidate {label}'].startswith('solved, likelihood ')
    assert values['most likely'] == labels[0]
    likelihoods = np.array(bench.received['likelihoods'][-1].data).reshape(-1, 4)[:, 0]
    assert likelihoods.sum() == pytest.approx(1.0)


def test_diagnostics_are_published_once_a_second_even_while_simulated_time_stands_still(ros):
    bench = Bench(ros, outputs=[], ticking=True, use_sim_time=True)
    assert 10**9 in [timer.timer_period_ns for timer in bench.node.timers]
    ros.spin_until(lambda: len(bench.diagnostics) >= 2, 'diagnostics')
    assert bench.node.get_clock().now().nanoseconds == 0
    (status,) = bench.diagnostics[-1].status
    assert status.level == WARN and 'no hand pose yet' in status.message


PREFIX = '/foc/goal_likelihood/'


def list_goal_topics(bench):
    """Return the goals for which the node has a topic: the graph of ROS may know them for longer."""
    names = [each.topic_name for each in bench.node.publishers]
    return sorted(name.removeprefix(PREFIX) for name in names if name.startswith(PREFIX))


def test_each_goal_has_a_topic_for_as_long_as_it_is_there(ros):
    bench = Bench(ros, outputs=('likelihoods', 'likelihoods_by_name'))
    assert not list_goal_topics(bench), 'no goal yet'
    heard = [ros.collect(bench.player, Float64, f'foc/goal_likelihood/goal{row}') for row in range(2)]
    bench.publish_scene(goals=[(0.3, 0.0, 0.1), (0.3, 0.1, 0.1)])
    poses = iter(hand_path(60))
    while list_goal_topics(bench) != ['goal0', 'goal1']:  # on a busy computer the first predictions may be late
        bench.move([next(poses)])
    publishers = bench.node._goal_topics.publishers
    ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers), 'the subscriptions')
    bench.move([next(poses) for _ in range(10)])
    ros.spin_until(lambda: all(heard), 'the likelihoods of both goals')
    goals, _ = bench.wait_for('likelihoods_by_name', len(bench.received['likelihoods']))[-1].status
    shares = {each.key: float(each.value) for each in goals.values if each.key.startswith('goal')}
    assert shares == pytest.approx({f'goal{row}': each[-1].data for row, each in enumerate(heard)}, abs=1e-5)

    bench.deliver('goals', pose_array(TYPES, [(0.3, 0.0, 0.1)]))
    bench.move([next(poses) for _ in range(10)])  # the last message from before arrives meanwhile
    ros.spin_for(0.1)
    before = len(heard[1])
    bench.move([next(poses) for _ in range(4)])
    assert len(heard[1]) == before, 'a goal that is gone has no likelihood'
    bench.health()
    assert list_goal_topics(bench) == ['goal0']

    bench.deliver('goals', pose_array(TYPES, [(0.3, 0.01 * row, 0.1) for row in range(MOST_GOAL_TOPICS + 2)]))
    count = len(bench.received['likelihoods_by_name'])
    bench.move([next(poses) for _ in range(4)])
    goals, _ = bench.wait_for('likelihoods_by_name', count + 1)[-1].status
    assert len(list_goal_topics(bench)) == MOST_GOAL_TOPICS, 'as many topics as there may be'
    assert len({each.key for each in goals.values} - {'unknown', 'other'}) == MOST_GOAL_TOPICS + 2
    bench.deliver('goals', pose_array(TYPES, []))
    bench.health()
    assert not list_goal_topics(bench), 'no prediction says that the last goals are gone'
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.move([next(poses) for _ in range(4)])
    ros.spin_until(lambda: list_goal_topics(bench) == ['goal0'], 'the topic of the goal')
    bench.change('deactivate', 'cleanup')
    assert not list_goal_topics(bench)


LIGHT = ['foc.steps:=20', 'homotopy.max_candidates:=1', 'rate_hz:=10.0', 'scene.timeout_s:=0.0', 'estimator.hand_timeout_s:=10.0']
RELIABLE = [f'qos_overrides./{name}.subscription.reliability:=reliable' for name in ('hand_pose', 'obstacles')]
UNTIMED = 'budget_s:=0.0'
"""While 500,000 rows are decoded a second, a prediction on two busy cores may miss its budget."""


@pytest.fixture
def player(ros):
    """Yield the player of a node that knows the scene, and stop the node; its text on standard error is `errors`."""
    made = ScenePlayer(ros)
    with running(ros, *parameters(*LIGHT, *RELIABLE, UNTIMED)) as process:
        made.connect()
        made.publish_scene()
        ros.spin_until(made.is_scene_known, 'the scene')
        made.stop = lambda: ended(process)
        yield made


def check(player, least):
    """Stop the node, and check that it took every pose, predicted often enough, and complained of nothing."""
    player.ros.spin_until(lambda: player.figure('hand_pose refused') == f'0 of {player.sent}', 'all poses in the diagnostics')
    assert player.stop()[0] == 0
    stamps = [each.header.stamp.sec * SECOND + each.header.stamp.nanosec for each in player.predictions]
    assert stamps == sorted(set(stamps))
    assert len(stamps) + int(player.figure('dropped cycles') or 0) >= least
    assert player.figure('count internal_errors') is None
    told = [each for each in player.statuses if 'count predictions' in figures(each)]
    assert told
    # a slow machine may drop cycles
    assert [each.message for each in told if not re.fullmatch(r'predicting|hand_superseded \d+', each.message)] == []


def test_ten_thousand_obstacles_at_50_hz(player):
    """Every pose is received, predictions are made from the newest, and the level is OK."""
    flood = cloud(TYPES, obstacle_table(CROWD), 10 * SECOND)
    player.play_in_time(3.0, 100.0, lambda i: i % 2 or player.publishers['obstacles'].publish(flood))
    check(player, 6)
    assert len(player.predictions) > 5
    assert player.figure('obstacles of cloud') == '10000'
    assert int(player.figure('note culled') or 0) > 9000


def test_poses_at_1_khz(player):
    player.play_in_time(2.0, 1000.0)
    assert player.sent == 2000
    check(player, 15)


def test_bad_poses_at_1_khz_write_few_lines_to_the_log(player):
    nowhere: Any = pose_stamped(TYPES, (float('nan'), 0.0, 0.0), 10 * SECOND)
    player.play_in_time(2.0, 0.0, lambda _: [player.publishers['hand_pose'].publish(nowhere) for _ in range(10)])
    player.ros.spin_until(lambda: player.figure('hand_pose refused') == '2000 of 2000', 'all poses in the diagnostics')
    code, errors = player.stop()
    lines = [line for line in errors.splitlines() if 'expected a finite number' in line]
    assert code == 0 and 1 <= len(lines) <= 5, f'{len(lines)} lines'
    assert '(1 of 1 refused so far)' in lines[0]
    assert WARN in {each.level for each in player.statuses}
    assert player.predictions == []
