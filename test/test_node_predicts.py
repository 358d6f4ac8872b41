# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Outputs of the node: their content, their time, and their agreement with the pipeline."""

from __future__ import annotations

import time

import ros_required  # noqa: F401
import numpy as np
import pytest
from message_helpers import SECOND, cloud, obstacle_table, pose_array
from node_helpers import (
    GOALS,
    OK,
    TYPES,
    WARN,
    Bench,
    begin,
    figures,
    hand_path,
    list_labels,
    stamps,
)
from ros_helpers import Graph
from std_msgs.msg import Float64

from foc_ros.ros import health, node
from foc_ros.ros.endpoints import MOST_GOAL_TOPICS
from foc_ros.ros.messages.encode_prediction import encode_outputs


def test_nothing_is_predicted_before_all_inputs_are_received_and_diagnostics_report_it(ros: Graph) -> None:
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
def test_an_overloaded_node_predicts_from_the_newest_pose_and_counts_the_others(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, is_fresh: bool
) -> None:
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


def test_a_looping_bag_restarts_the_movement(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(8, rate_hz=10.0)
    for turn in range(2):
        bench.move(poses)
        status = bench.health()
        assert status.level == (WARN if turn else OK), status.message
    assert stamps(bench.wait_for('prediction', 16)) == stamps(poses) * 2
    assert (status.message, figures(status)['count hand_restarted_backward']) == ('hand_restarted_backward 1', '1')
    bench.move(hand_path(9, rate_hz=10.0)[8:])
    status = bench.health()
    assert status.level == OK, status.message


def test_only_subscribed_outputs_are_encoded(ros: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []
    monkeypatch.setattr(node, 'encode_outputs', lambda *args: asked.append(list(args[-1])) or encode_outputs(*args))
    bench = begin(ros, 1, outputs=['likelihoods'])
    bench.wait_for('likelihoods', 1)
    assert asked == [['likelihoods']]


def test_diagnostics_contain_rates_ages_times_and_candidates(ros: Graph) -> None:
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


def test_diagnostics_are_published_once_a_second_even_while_simulated_time_stands_still(ros: Graph) -> None:
    bench, heard_s = Bench(ros, outputs=[], ticking=True, use_sim_time=True), []
    for count in (1, 3):
        ros.spin_until(lambda count=count: len(bench.diagnostics) >= count, 'diagnostics')
        heard_s.append(time.monotonic())
    assert heard_s[1] - heard_s[0] == pytest.approx(2.0, abs=0.9)
    assert bench.node.get_clock().now().nanoseconds == 0
    (status,) = bench.diagnostics[-1].status
    assert status.level == WARN and 'no hand pose yet' in status.message


PREFIX = '/foc/goal_likelihood/'


def list_goal_topics(bench: Bench) -> list[str]:
    own = bench.node.get_name(), bench.node.get_namespace()
    found = bench.node.get_publisher_names_and_types_by_node(*own)
    return sorted(name.removeprefix(PREFIX) for name, _ in found if name.startswith(PREFIX))


def test_each_goal_has_a_topic_for_as_long_as_it_is_there(ros: Graph) -> None:
    bench = Bench(ros, outputs=('likelihoods', 'likelihoods_by_name'))
    assert not list_goal_topics(bench), 'no goal yet'
    heard = [ros.collect(bench.player, Float64, f'foc/goal_likelihood/goal{row}') for row in range(2)]
    bench.publish_scene(goals=[(0.3, 0.0, 0.1), (0.3, 0.1, 0.1)])
    poses = iter(hand_path(40))
    bench.move([next(poses)])
    assert list_goal_topics(bench) == ['goal0', 'goal1']
    publishers = bench.node._goal_topics.publishers
    ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers), 'the subscriptions')
    count = len(bench.received['likelihoods'])
    bench.move([next(poses) for _ in range(10)])
    ros.spin_until(lambda: all(heard), 'the likelihoods of both goals')
    goals, classes = bench.wait_for('likelihoods_by_name', count + 1)[-1].status
    shares = {each.key: float(each.value) for each in goals.values}
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-5)
    shares.pop('unknown', None)
    shares.pop('other', None)
    assert shares == pytest.approx({f'goal{row}': each[-1].data for row, each in enumerate(heard)}, abs=1e-5)
    for name, share in shares.items():
        of_goal = [float(each.value) for each in classes.values if each.key.startswith(f'{name}:')]
        assert sum(of_goal) == pytest.approx(share, abs=1e-5)

    bench.deliver('goals', pose_array(TYPES, [(0.3, 0.0, 0.1)]))
    bench.move([next(poses) for _ in range(10)])  # the last message from before arrives meanwhile
    before = len(heard[1])
    bench.move([next(poses) for _ in range(4)])
    assert len(heard[1]) == before, 'a goal that is gone has no likelihood'
    bench.health()
    assert list_goal_topics(bench) == ['goal0']

    bench.deliver('goals', pose_array(TYPES, [(0.3, 0.01 * row, 0.1) for row in range(MOST_GOAL_TOPICS + 2)]))
    count = len(bench.received['likelihoods_by_name'])
    bench.move([next(poses) for _ in range(4)])
    assert len(list_goal_topics(bench)) == MOST_GOAL_TOPICS
    goals, _ = bench.wait_for('likelihoods_by_name', count + 1)[-1].status
    assert len({each.key for each in goals.values} - {'unknown', 'other'}) == MOST_GOAL_TOPICS + 2
    bench.change('deactivate', 'cleanup')
    assert not list_goal_topics(bench)
