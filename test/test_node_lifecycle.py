# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The managed node: it predicts only while it is active, and every client can read and change its state."""

from __future__ import annotations

from typing import Any

import pytest
import ros_helpers

ros_helpers.require_ros()

from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState  # noqa: E402
from message_helpers import SECOND, cloud, obstacle_table, pose_array  # noqa: E402
from node_helpers import GOALS, ROWS, TYPES, Bench, begin, figures, hand_path  # noqa: E402
from ros_helpers import Graph  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402


def change(bench: Bench, label: str) -> bool:
    request = ChangeState.Request(transition=Transition(label=label))
    return bool(bench.ros.call(bench.player, ChangeState, 'foc/change_state', request).success)


def state_of(bench: Bench) -> str:
    return str(bench.ros.call(bench.player, GetState, 'foc/get_state', GetState.Request()).current_state.label)


def predicted(bench: Bench, poses: list[Any]) -> int:
    before = int(figures(bench.health()).get('count predictions', 0))
    bench.move(poses)
    return int(figures(bench.health()).get('count predictions', 0)) - before


def test_a_managed_node_waits_for_configuration_and_activation(ros: Graph) -> None:
    bench = Bench(ros, outputs=[], connected=False, parameters={'autostart': False})
    assert state_of(bench) == 'unconfigured'
    assert not bench.player.get_subscriptions_info_by_topic('hand_pose')
    status = bench.health()
    assert (status.level, status.message) == (b'\x00', 'unconfigured: nothing is predicted')
    assert change(bench, 'configure')
    bench.connect()
    bench.publish_scene()
    assert predicted(bench, hand_path(4)) == 0
    status = bench.health()
    assert (status.level, status.message) == (b'\x00', 'inactive: nothing is predicted')
    assert change(bench, 'activate')
    assert state_of(bench) == 'active'
    assert predicted(bench, hand_path(6)[4:]) == 1


def test_a_manager_changes_the_state_by_number(ros: Graph) -> None:
    bench = Bench(ros, outputs=[], connected=False, parameters={'autostart': False})
    for number, state in (
        (Transition.TRANSITION_CONFIGURE, 'inactive'),
        (Transition.TRANSITION_ACTIVATE, 'active'),
        (Transition.TRANSITION_DEACTIVATE, 'inactive'),
        (Transition.TRANSITION_CLEANUP, 'unconfigured'),
    ):
        request = ChangeState.Request(transition=Transition(id=number))
        assert ros.call(bench.player, ChangeState, 'foc/change_state', request).success
        assert state_of(bench) == state


def test_a_deactivated_node_keeps_the_scene_and_can_be_activated_again(ros: Graph) -> None:
    bench, poses = begin(ros, outputs=[]), hand_path(12)
    assert predicted(bench, poses[:4]) == 2
    assert change(bench, 'deactivate')
    assert predicted(bench, poses[4:8]) == 0
    answer = ros.call(bench.player, SetBool, 'foc/engage', SetBool.Request(data=True))
    assert (answer.success, answer.message) == (True, 'engaged, but inactive')
    assert predicted(bench, poses[8:10]) == 0
    assert change(bench, 'activate')
    assert predicted(bench, poses[10:]) == 1


def test_the_clutch_is_kept_through_a_deactivation(ros: Graph) -> None:
    bench, poses = begin(ros, outputs=[]), hand_path(8)
    ros.call(bench.player, SetBool, 'foc/engage', SetBool.Request(data=False))
    assert change(bench, 'deactivate')
    assert change(bench, 'activate')
    assert predicted(bench, poses[:4]) == 0
    assert bench.health().message == 'disengaged'


def test_cleaning_up_forgets_all_but_the_parameters(ros: Graph) -> None:
    bench = begin(ros, 2, outputs=[], parameters={'foc.eta': 0.7})
    assert change(bench, 'deactivate')
    assert change(bench, 'cleanup')
    assert state_of(bench) == 'unconfigured'
    ros.spin_until(lambda: not bench.publishers['hand_pose'].get_subscription_count(), 'the end of the subscription')
    assert not bench.node.pipeline.scene.sources
    assert change(bench, 'configure')
    bench.connect()
    assert bench.node.pipeline.config.foc.eta == 0.7
    assert change(bench, 'activate')
    bench.publish_scene()
    assert predicted(bench, hand_path(2)) == 1


def test_messages_that_wait_when_the_node_is_cleaned_up_are_left(ros: Graph) -> None:
    bench = begin(ros, outputs=[])
    bench.send('hand_pose', *hand_path(50))
    bench.send('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
    bench.node.trigger_deactivate()
    bench.node.trigger_cleanup()
    ros.spin_for(0.2)
    assert not bench.node.pipeline.scene.sources


@pytest.mark.parametrize('label', ['activate', 'cleanup', 'no such transition'])
def test_an_impossible_transition_is_refused_by_an_answer(ros: Graph, label: str) -> None:
    bench = Bench(ros, outputs=[])
    assert not change(bench, label)
    assert state_of(bench) == 'active'
    bench.publish_scene()
    assert predicted(bench, hand_path(2)) == 1


def test_a_node_that_is_shut_down_stays_finalized(ros: Graph) -> None:
    bench = Bench(ros, outputs=[])
    transitions = ros.call(
        bench.player, GetAvailableTransitions, 'foc/get_available_transitions', GetAvailableTransitions.Request()
    ).available_transitions
    assert 'deactivate' in [each.transition.label for each in transitions]
    assert change(bench, 'shutdown')
    assert state_of(bench) == 'finalized'
    assert not change(bench, 'configure')
    assert bench.health().message == 'finalized: nothing is predicted'


def test_a_failed_configuration_is_logged_and_can_be_repeated(ros: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    from foc_ros.ros import endpoints

    bench = Bench(ros, outputs=[], connected=False, parameters={'autostart': False})
    with monkeypatch.context() as patch:
        patch.setattr(endpoints, 'create_subscriptions', lambda *_: 1 / 0)
        assert not change(bench, 'configure')
    assert state_of(bench) == 'unconfigured'
    assert change(bench, 'configure')
    assert state_of(bench) == 'inactive'


def test_a_silent_scene_stops_predictions_until_it_is_received_again(ros: Graph) -> None:
    """Unstamped obstacles have no age, so only the silence of their source shows that it has stopped."""
    bench, poses = Bench(ros, parameters={'scene.timeout_s': 1.0}), hand_path(12)
    scene = cloud(TYPES, obstacle_table(ROWS), 0)
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.deliver('obstacles', scene)
    bench.move(poses[:2])
    bench.wait_for('prediction', 1)
    ros.spin_for(1.1)
    bench.move(poses[2:6])
    status = bench.health()
    assert status.level == b'\x01'
    assert 'no prediction: obstacles silent for' in status.message
    assert int(figures(status)['count predict_obstacles_silent']) == len(poses[2:6])
    assert len(bench.received['prediction']) == 1
    bench.deliver('obstacles', scene)
    bench.move(poses[6:8])
    bench.wait_for('prediction', 2)


def test_no_prediction_is_made_from_a_late_pose(ros: Graph) -> None:
    bench = begin(ros, parameters={'estimator.hand_timeout_s': 5.0})
    now_s = bench.node.get_clock().now().nanoseconds / SECOND
    bench.move(hand_path(1, start_s=now_s))
    bench.wait_for('prediction', 1)
    bench.move(hand_path(1, start_s=now_s - 20.0))
    status = bench.health()
    assert status.level == b'\x01'
    assert 'older than the time of the node' in status.message
    assert len(bench.received['prediction']) == 1
