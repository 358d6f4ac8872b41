# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Likelihoods that other tools plot by name: a topic for each goal, which comes and goes with it; the force without a stamp."""

from __future__ import annotations

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import pose_array  # noqa: E402
from node_helpers import TYPES, Bench, hand_path  # noqa: E402
from ros_helpers import Graph  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402

from foc_ros.ros.endpoints import MOST_GOAL_TOPICS  # noqa: E402

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
    tables = bench.wait_for('likelihoods_by_name', count + 1)
    goals, classes = tables[-1].status
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
    bench.move([next(poses) for _ in range(10)])
    assert len(heard[1]) == before, 'a goal that is gone has no likelihood'
    bench.health()
    assert list_goal_topics(bench) == ['goal0']
    bench.node.trigger_deactivate()
    bench.node.trigger_cleanup()
    assert not list_goal_topics(bench)


def test_the_number_of_topics_is_bounded(ros: Graph) -> None:
    bench = Bench(ros, outputs=('likelihoods_by_name',))
    bench.publish_scene(goals=[(0.3, 0.01 * row, 0.1) for row in range(MOST_GOAL_TOPICS + 2)])
    bench.move(hand_path(2))
    assert len(list_goal_topics(bench)) == MOST_GOAL_TOPICS
    goals, _ = bench.wait_for('likelihoods_by_name', 1)[-1].status
    assert len({each.key for each in goals.values} - {'unknown', 'other'}) == MOST_GOAL_TOPICS + 2


@pytest.mark.parametrize('is_wanted', [False, True])
def test_the_force_without_a_stamp_is_a_topic_by_parameter(ros: Graph, is_wanted: bool) -> None:
    from geometry_msgs.msg import Wrench, WrenchStamped

    guided = {'guidance.enabled': True, 'guidance.clearance': 0.0, 'guidance.unstamped': is_wanted}
    bench = Bench(ros, outputs=('prediction',), parameters=guided)
    assert ('guidance/wrench_unstamped' in bench.node._guidance.publishers) == is_wanted
    if not is_wanted:
        return
    plain = ros.collect(bench.player, Wrench, 'foc/guidance/wrench_unstamped')
    stamped = ros.collect(bench.player, WrenchStamped, 'foc/guidance/wrench')
    names = 'guidance/wrench_unstamped', 'guidance/wrench'
    publishers = [bench.node._guidance.publishers[name] for name in names]
    ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers), 'the subscriptions')
    bench.publish_scene()
    bench.move(hand_path(20))
    ros.spin_until(lambda: len(plain) > 3 and len(stamped) > 3, 'the force')
    forces = [(each.wrench.force.x, each.wrench.force.y, each.wrench.force.z) for each in stamped]
    found = [(each.force.x, each.force.y, each.force.z) for each in plain]
    assert set(found) & set(forces) and np.isfinite(found).all()
