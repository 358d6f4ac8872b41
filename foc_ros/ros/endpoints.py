# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Topics of the node: message types and quality of service, the emptying of a subscription's queue, and transforms from tf2."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from rclpy.duration import Infinite
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    QoSCompatibility,
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSLivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    QoSReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.time import Time

from foc_ros.core.types import Prediction, name_goal
from foc_ros.io.topics import CLOUD, COLLISION, COMMAND, DETECTIONS, GOAL, GOALS, HAND, MARKERS, OPTIONAL, TYPES

from .messages.encode_guidance import GUIDANCE_OUTPUTS, LIVE_OUTPUTS, TWIST, TWIST_TYPE
from .messages.encode_prediction import GOAL_LIKELIHOOD_TYPE, OUTPUTS, encode_goal_likelihoods
from .messages.plane import Transform, compute_rotation
from .messages.types import MessageTypes, find_message_class
from .transforms import TransformUnavailableError

INPUTS = (GOALS, GOAL, CLOUD, MARKERS, COLLISION, DETECTIONS, HAND)
"""Input topics in the order in which the executor takes their messages: the scene before the hand."""
BEST_EFFORT = (HAND, CLOUD, DETECTIONS)
"""Inputs of which a later message makes up for a lost one: best-effort subscriptions hear every publisher."""
HAND_DEPTH = 200
"""Length of the queue of hand poses: 0.2 s at 1 kHz, during which a prediction may be computed."""
SCENE_DEPTH, OUTPUT_DEPTH = 10, 10
MOST_GOAL_TOPICS = 16
"""Number of goals with a topic of their own: each costs an endpoint in every participant. `~/likelihoods_by_name` has all."""
OVERRIDABLE = QoSOverridingOptions(
    (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)
)


def create_subscriptions(node: Node, receive: Callable[[str, Any], None]) -> dict[str, Any]:
    """Create the subscriptions, by topic; each calls `receive(topic, message)`.

    A message of `BEST_EFFORT` is a complete state; those of the other inputs are changes, or are sent once, and are received
    reliably. A scene that was published once, before the start of the node, is received with
    `qos_overrides./obstacles.subscription.durability: transient_local`, reliably, but then not from volatile or best-effort
    publishers. Inputs of `find_missing_packages` have no subscription.

    The endpoints here have no event callbacks, because each of them lengthens every wake-up of rclpy's plain executor:
    `describe_incompatible_publishers` and `describe_incompatible_subscriptions` find the same in the graph.
    """
    subscriptions = {}
    missing = find_missing_packages()
    for role in INPUTS:
        if role in missing:
            continue
        is_best_effort = role in BEST_EFFORT and not _is_kept_by_publishers(node, role)
        reliability = QoSReliabilityPolicy.BEST_EFFORT if is_best_effort else QoSReliabilityPolicy.RELIABLE
        subscriptions[role] = node.create_subscription(
            find_message_class(TYPES[role]),
            role,
            partial(receive, role),
            _build_qos(reliability, HAND_DEPTH if role == HAND else SCENE_DEPTH),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=OVERRIDABLE,
        )
    return subscriptions


def _is_kept_by_publishers(node: Node, role: str) -> bool:
    """Return whether a parameter asks for messages from before the subscription; only reliable ones are sent again."""
    name = f'qos_overrides.{node.resolve_topic_name(role)}.subscription.durability'
    return bool(node.has_parameter(name) and node.get_parameter(name).value == 'transient_local')


def describe_incompatible_publishers(node: Node, role: str, subscription: Any) -> list[str]:
    """Return a text for each present publisher of an input that its subscription cannot hear."""
    found = node.get_publishers_info_by_topic(subscription.topic_name)
    reasons = [(each.node_name, _find_incompatibility(each.qos_profile, subscription.qos_profile)) for each in found]
    remedy = f'(see qos_overrides.{subscription.topic_name}.subscription)'
    return [f'{role} is not heard from {name}, incompatible QoS: {reason} {remedy}' for name, reason in reasons if reason]


def describe_incompatible_subscriptions(node: Node, publisher: Any) -> list[str]:
    """Return a text for each present subscription of an output that cannot receive its messages."""
    found, given = node.get_subscriptions_info_by_topic(publisher.topic_name), publisher.qos_profile
    # as in the profiles of the graph: what the node leaves open would count as shorter than infinite, and fit every liveliness
    rest = {'deadline': Infinite, 'liveliness': QoSLivelinessPolicy.AUTOMATIC, 'liveliness_lease_duration': Infinite}
    offered = QoSProfile(reliability=given.reliability, durability=given.durability, depth=given.depth, **rest)
    reasons = [(each.node_name, _find_incompatibility(offered, each.qos_profile)) for each in found]
    topic = publisher.topic_name
    remedy = f'(see qos_overrides.{topic}.publisher)'
    return [f'{name} cannot hear {topic}, incompatible QoS: {reason} {remedy}' for name, reason in reasons if reason]


def _find_incompatibility(publisher: QoSProfile, subscription: QoSProfile) -> str:
    """Return why a subscription cannot receive the messages of a publisher; empty if it can."""
    compatibility, reason = qos_check_compatible(publisher, subscription)
    return reason.removeprefix('ERROR: ').rstrip('; ') if compatibility == QoSCompatibility.ERROR else ''


def create_command_subscription(node: Node, receive: Callable[[Any], None]) -> Any:
    """Create the subscription of the operator's velocity command, of which only the newest counts."""
    qos = _build_qos(QoSReliabilityPolicy.BEST_EFFORT, 1)
    events = SubscriptionEventCallbacks(use_default_callbacks=False)
    kind = find_message_class(TWIST_TYPE)
    return node.create_subscription(kind, COMMAND, receive, qos, event_callbacks=events, qos_overriding_options=OVERRIDABLE)


def create_guidance_publishers(node: Node) -> dict[str, Any]:
    """Create the publishers of guidance, by the name of the topic below the node's name."""
    outputs = LIVE_OUTPUTS if node.get_parameter('guidance.unstamped').value else GUIDANCE_OUTPUTS
    kinds = {name: kind for name, (kind, _) in outputs.items()} | {TWIST: TWIST_TYPE}
    return {name: _create_publisher(node, name, kind) for name, kind in kinds.items()}


def find_missing_packages() -> dict[str, str]:
    """Return the package of messages that is not installed, by the optional input that needs it."""
    packages = {role: TYPES[role].partition('/')[0] for role in OPTIONAL}
    return {role: package for role, package in packages.items() if find_spec(package) is None}


def create_publishers(node: Node) -> dict[str, Any]:
    """Create the publishers of the outputs, by the name of the topic below the node's name."""
    return {name: _create_publisher(node, name, kind) for name, (kind, _) in OUTPUTS.items()}


class GoalTopics:
    """One topic for the likelihood of each goal, `~/goal_likelihood/goal0` and so on, which any tool plots by its name.

    A topic is made with the first prediction that has its goal. `remove_absent`, which the node calls once a second, removes
    those of goals that are gone, so that goals that come and go do not keep the graph busy.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._goals = 0
        self.publishers: list[Any] = []

    def publish(self, prediction: Prediction, types: MessageTypes) -> None:
        """Publish the likelihood of each goal of which something is known; there is no message for another."""
        self._goals = min(len(prediction.goal_positions), MOST_GOAL_TOPICS)
        for row in range(len(self.publishers), self._goals):
            self.publishers.append(_create_publisher(self._node, f'goal_likelihood/{name_goal(row)}', GOAL_LIKELIHOOD_TYPE))
        heard = [row for row in range(self._goals) if self.publishers[row].get_subscription_count()]
        messages = encode_goal_likelihoods(prediction, types) if heard else {}
        for row in heard:
            if row in messages and self._node.context.ok():
                self.publishers[row].publish(messages[row])

    def remove_absent(self) -> None:
        """Remove the topics of goals that the last prediction did not have."""
        while len(self.publishers) > self._goals:
            self._node.destroy_publisher(self.publishers.pop())

    def destroy(self) -> None:
        """Remove all topics."""
        self._goals = 0
        self.remove_absent()


def _create_publisher(node: Node, name: str, kind: str) -> Any:
    qos = _build_qos(QoSReliabilityPolicy.RELIABLE, OUTPUT_DEPTH)
    events = PublisherEventCallbacks(use_default_callbacks=False)
    message_class = find_message_class(kind)
    return node.create_publisher(message_class, f'~/{name}', qos, event_callbacks=events, qos_overriding_options=OVERRIDABLE)


def take_queued(subscription: Any) -> list[Any]:
    """Take the messages from a subscription's queue, at most as many as it holds, because it may be filled meanwhile."""
    messages: list[Any] = []
    with subscription.handle:
        while len(messages) < HAND_DEPTH and (taken := subscription.handle.take_message(subscription.msg_type, subscription.raw)):
            messages.append(taken[0])
    return messages


def _build_qos(reliability: QoSReliabilityPolicy, depth: int) -> QoSProfile:
    """Return a new profile, because rclpy writes the overrides of a topic into its profile."""
    volatile, keep_last = QoSDurabilityPolicy.VOLATILE, QoSHistoryPolicy.KEEP_LAST
    return QoSProfile(reliability=reliability, durability=volatile, history=keep_last, depth=depth)


class TfListener:
    """A buffer of tf2 and its listener; a jump of the node's clock back in time clears it.

    Parameters
    ----------
    node
        The node that subscribes to `/tf` and `/tf_static`.
    notify
        Called after each transform that arrives, in the thread of the node's executor.

    Raises
    ------
    ImportError
        If `tf2_ros` is not installed.
    """

    def __init__(self, node: Node, notify: Callable[[], None]) -> None:
        import tf2_ros

        self._unavailable = tf2_ros.TransformException
        self._notify = notify
        self._buffer: Any = tf2_ros.Buffer(node=node)
        self._listener = tf2_ros.TransformListener(self, node)

    def look_up(self, target: str, source: str, stamp_ns: int) -> Transform:
        """Return the transform from one frame to another at a stamp [ns], the newest one for a stamp of 0, without waiting.

        Raises TransformUnavailableError.
        """
        try:
            found = self._buffer.lookup_transform(target, source, Time(nanoseconds=stamp_ns))
        except self._unavailable as error:
            raise TransformUnavailableError(' '.join(str(error).split())) from None
        shift = found.transform.translation
        translation = np.array([shift.x, shift.y, shift.z])
        return Transform(compute_rotation(found.transform.rotation), translation, Time.from_msg(found.header.stamp).nanoseconds)

    def set_transform(self, transform: Any, authority: str) -> None:
        """Take a transform from the listener."""
        self._buffer.set_transform(transform, authority)
        self._notify()

    def set_transform_static(self, transform: Any, authority: str) -> None:
        """Take a transform that never changes from the listener."""
        self._buffer.set_transform_static(transform, authority)
        self._notify()
