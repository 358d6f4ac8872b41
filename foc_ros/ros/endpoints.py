"""Topics of the node: message types and quality of service, and the emptying of a subscription's queue."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSPolicyKind, QoSProfile, QoSReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from foc_ros.io.topics import CLOUD, COLLISION, COMMAND, DETECTIONS, GOAL, GOALS, HAND, MARKERS, OPTIONAL, TYPES

from .messages.encode_guidance import GUIDANCE_OUTPUTS, TWIST, TWIST_TYPE
from .messages.encode_prediction import OUTPUTS
from .messages.types import find_message_class

INPUTS = (GOALS, GOAL, CLOUD, MARKERS, COLLISION, DETECTIONS, HAND)
"""Input topics in the order in which the executor takes their messages: the scene before the hand."""
HAND_DEPTH = 200
"""Length of the queue of hand poses: 0.2 s at 1 kHz, during which a prediction may be computed."""
SCENE_DEPTH, OUTPUT_DEPTH = 10, 10
OVERRIDABLE = QoSOverridingOptions(
    (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)
)


def create_subscriptions(node: Node, receive: Callable[[str, Any], None]) -> dict[str, Any]:
    """Create the subscriptions, by topic; each calls `receive(topic, message)`.

    Hand poses are received as best-effort sensor data, the scene reliably. A scene that was published once, before the start of
    the node, is received with `qos_overrides./obstacles.subscription.durability: transient_local`, but then not from volatile
    publishers. Inputs of `find_missing_packages` have none.
    """
    subscriptions = {}
    missing = find_missing_packages()
    for role in INPUTS:
        if role in missing:
            continue
        reliability = QoSReliabilityPolicy.BEST_EFFORT if role == HAND else QoSReliabilityPolicy.RELIABLE
        qos = _build_qos(reliability, HAND_DEPTH if role == HAND else SCENE_DEPTH)
        subscriptions[role] = node.create_subscription(
            find_message_class(TYPES[role]), role, partial(receive, role), qos, qos_overriding_options=OVERRIDABLE
        )
    return subscriptions


def create_command_subscription(node: Node, receive: Callable[[Any], None]) -> Any:
    """Create the subscription of the operator's velocity command, of which only the newest counts."""
    qos = _build_qos(QoSReliabilityPolicy.BEST_EFFORT, 1)
    return node.create_subscription(find_message_class(TWIST_TYPE), COMMAND, receive, qos, qos_overriding_options=OVERRIDABLE)


def create_guidance_publishers(node: Node) -> dict[str, Any]:
    """Create the publishers of guidance, by the name of the topic below the node's name."""
    kinds = {name: kind for name, (kind, _) in GUIDANCE_OUTPUTS.items()} | {TWIST: TWIST_TYPE}
    return {name: _create_publisher(node, name, kind) for name, kind in kinds.items()}


def find_missing_packages() -> dict[str, str]:
    """Return the package of messages that is not installed, by the optional input that needs it."""
    packages = {role: TYPES[role].partition('/')[0] for role in OPTIONAL}
    return {role: package for role, package in packages.items() if find_spec(package) is None}


def create_publishers(node: Node) -> dict[str, Any]:
    """Create the publishers of the outputs, by the name of the topic below the node's name."""
    return {name: _create_publisher(node, name, kind) for name, (kind, _) in OUTPUTS.items()}


def _create_publisher(node: Node, name: str, kind: str) -> Any:
    qos = _build_qos(QoSReliabilityPolicy.RELIABLE, OUTPUT_DEPTH)
    return node.create_publisher(find_message_class(kind), f'~/{name}', qos, qos_overriding_options=OVERRIDABLE)


def take_queued(subscription: Any) -> list[Any]:
    """Take the messages from a subscription's queue, at most as many as it holds, because it may be filled meanwhile."""
    messages: list[Any] = []
    with subscription.handle:
        while len(messages) < HAND_DEPTH:
            taken = subscription.handle.take_message(subscription.msg_type, False)
            if taken is None:
                break
            messages.append(taken[0])
    return messages


def _build_qos(reliability: QoSReliabilityPolicy, depth: int) -> QoSProfile:
    """Return a new profile, because rclpy writes the overrides of a topic into its profile."""
    volatile, keep_last = QoSDurabilityPolicy.VOLATILE, QoSHistoryPolicy.KEEP_LAST
    return QoSProfile(reliability=reliability, durability=volatile, history=keep_last, depth=depth)
