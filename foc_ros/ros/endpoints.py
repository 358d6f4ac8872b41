"""The node's topics: types, quality of service, and how a subscription's queue is emptied."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Any

from geometry_msgs.msg import PoseArray, PoseStamped
from nav_msgs.msg import Path
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSPolicyKind, QoSProfile, QoSReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import MarkerArray

from foc_ros.io.topics import CLOUD, GOAL, GOALS, HAND, MARKERS

INPUTS: dict[str, Any] = {GOALS: PoseArray, GOAL: PoseStamped, CLOUD: PointCloud2, MARKERS: MarkerArray, HAND: PoseStamped}
"""Message class by topic, in the order in which the executor looks at them: the scene before the hand."""
OUTPUTS: dict[str, Any] = {'prediction': PointCloud2, 'likelihoods': Float64MultiArray, 'path': Path, 'markers': MarkerArray}
"""Message class by topic below the node's name."""

HAND_DEPTH = 200
"""Hand poses kept while a prediction is computed: 0.2 s of them at 1 kHz."""
SCENE_DEPTH, OUTPUT_DEPTH = 10, 10
OVERRIDABLE = QoSOverridingOptions(
    (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)
)


def subscribe(node: Node, receive: Callable[[str, Any], None]) -> dict[str, Any]:
    """Return the subscriptions by topic; each calls `receive(topic, message)`.

    The hand comes as sensor data does, the scene reliably. A scene that is published once, before the node is there, is heard
    with `qos_overrides./obstacles.subscription.durability: transient_local`, which would not hear a volatile publisher.
    """
    # Overrides are written into the profile that is handed over, so each subscription has its own.
    hand, scene = _qos(QoSReliabilityPolicy.BEST_EFFORT, HAND_DEPTH), _qos(QoSReliabilityPolicy.RELIABLE, SCENE_DEPTH)
    subscriptions = {}
    for role, kind in INPUTS.items():
        qos = copy(hand if role == HAND else scene)
        subscriptions[role] = node.create_subscription(
            kind, role, partial(receive, role), qos, qos_overriding_options=OVERRIDABLE
        )
    return subscriptions


def advertise(node: Node) -> dict[str, Any]:
    """Return the publishers of the outputs by topic."""
    qos = _qos(QoSReliabilityPolicy.RELIABLE, OUTPUT_DEPTH)
    return {
        name: node.create_publisher(kind, f'~/{name}', copy(qos), qos_overriding_options=OVERRIDABLE)
        for name, kind in OUTPUTS.items()
    }


def waiting(subscription: Any) -> list[Any]:
    """Take the messages that wait in a subscription's queue, no more than fit into it while it keeps being filled."""
    messages: list[Any] = []
    with subscription.handle:
        while len(messages) < HAND_DEPTH:
            taken = subscription.handle.take_message(subscription.msg_type, False)
            if taken is None:
                break
            messages.append(taken[0])
    return messages


def _qos(reliability: QoSReliabilityPolicy, depth: int) -> QoSProfile:
    volatile, keep_last = QoSDurabilityPolicy.VOLATILE, QoSHistoryPolicy.KEEP_LAST
    return QoSProfile(reliability=reliability, durability=volatile, history=keep_last, depth=depth)
