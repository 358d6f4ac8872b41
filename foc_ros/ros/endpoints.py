# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Topics of the node: types and quality of service, who cannot hear whom, topics of goals, and transforms from tf2."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from rclpy import qos
from rclpy.duration import Infinite
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.time import Time

from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import name_goal
from foc_ros.core.types import Array
from foc_ros.io.topics import CLOUD, COLLISION, COMMAND, DETECTIONS, GOAL, GOALS, HAND, MARKERS, OPTIONAL, TYPES

from .health import THROTTLE_S
from .messages.decode_poses import decode_stamp
from .messages.encode_guidance import TWIST_TYPE
from .messages.encode_prediction import GOAL_LIKELIHOOD_TYPE, encode_goal_likelihoods
from .messages.plane import Transform, compute_rotation
from .messages.types import MessageTypes, find_message_class
from .transforms import TransformUnavailableError

BEST_EFFORT, RELIABLE = qos.ReliabilityPolicy.BEST_EFFORT, qos.ReliabilityPolicy.RELIABLE
DEPTH = 10
HAND_DEPTH = 200
"""Length of the queue of hand poses: 0.2 s at 1 kHz."""
INPUTS = {
    GOALS: (RELIABLE, DEPTH),
    GOAL: (RELIABLE, DEPTH),
    CLOUD: (BEST_EFFORT, DEPTH),
    MARKERS: (RELIABLE, DEPTH),
    COLLISION: (RELIABLE, DEPTH),
    DETECTIONS: (BEST_EFFORT, DEPTH),
    HAND: (BEST_EFFORT, HAND_DEPTH),
    COMMAND: (BEST_EFFORT, 1),
}
"""Reliability and length of the queue of each input, in the order in which the executor takes their messages: the scene before
the hand. Best effort, which hears every publisher, where a later message makes up for a lost one."""
MOST_GOAL_TOPICS = 16
"""Number of goals with a topic of their own: each costs an endpoint in every participant. `~/likelihoods_by_name` has all."""
OVERRIDABLE = QoSOverridingOptions(
    [getattr(qos.QoSPolicyKind, kind) for kind in ('HISTORY', 'DEPTH', 'RELIABILITY', 'DURABILITY')]
)


def create_subscriptions(node: Node, receive: Callable[[str, Any], None]) -> dict[str, Any]:
    """Create the subscriptions, by topic; each calls `receive(topic, message)`.

    A scene that was published once, before the start of the node, is received with
    `qos_overrides./obstacles.subscription.durability: transient_local`, reliably. Inputs of `find_missing_packages` have none.
    The endpoints here have no event callbacks, because each of them lengthens every wake-up of rclpy's plain executor:
    `report_unconnected` finds the same in the graph.
    """
    subscriptions, kinds, missing = {}, TYPES | {COMMAND: TWIST_TYPE}, find_missing_packages()
    for role in (role for role in INPUTS if role not in missing):
        reliability, depth = INPUTS[role]
        name = f'qos_overrides.{node.resolve_topic_name(role)}.subscription.durability'
        if node.has_parameter(name) and node.get_parameter(name).value == 'transient_local':
            reliability = RELIABLE  # messages from before the subscription are sent again to such a one only
        subscriptions[role] = node.create_subscription(
            find_message_class(kinds[role]),
            role,
            partial(receive, role),
            _build_qos(reliability, depth),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=OVERRIDABLE,
        )
    return subscriptions


def create_publisher(node: Node, name: str, kind: str) -> Any:
    """Create the publisher of an output; name: of the topic below the node's name."""
    return node.create_publisher(
        find_message_class(kind),
        f'~/{name}',
        _build_qos(RELIABLE, DEPTH),
        event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        qos_overriding_options=OVERRIDABLE,
    )


def publish(node: Node, publisher: Any, message: Any) -> None:
    """Publish a message, unless the node's context has been shut down."""
    if node.context.ok():
        publisher.publish(message)


def _build_qos(reliability: qos.ReliabilityPolicy, depth: int) -> qos.QoSProfile:
    """Return a new profile, because rclpy writes the overrides of a topic into its profile."""
    volatile, keep_last = qos.DurabilityPolicy.VOLATILE, qos.HistoryPolicy.KEEP_LAST
    return qos.QoSProfile(reliability=reliability, durability=volatile, history=keep_last, depth=depth)


def find_missing_packages() -> dict[str, str]:
    """Return the package of messages that is not installed, by the optional input that needs it."""
    packages = {role: TYPES[role].partition('/')[0] for role in OPTIONAL}
    return {role: package for role, package in packages.items() if find_spec(package) is None}


def report_unconnected(node: Node, inputs: Mapping[str, Any], outputs: Iterable[Any], loggers: Mapping[str, Any]) -> list[str]:
    """Log which endpoints cannot hear each other, or need a package; return a text for each publisher that is not heard."""
    for role, package in find_missing_packages().items():
        if inputs and node.count_publishers(role):
            text = f'{role} is published, but cannot be received: the package {package} is not installed'
            loggers[role].error(text, throttle_duration_sec=THROTTLE_S)
    unheard = []
    for role, subscription in inputs.items():
        topic, wanted = subscription.topic_name, subscription.qos_profile
        pairs = [(each.node_name, each.qos_profile, wanted) for each in node.get_publishers_info_by_topic(topic)]
        remedy = f'(see qos_overrides.{topic}.subscription)'
        if texts := [f'{role} is not heard from {name}, {reason} {remedy}' for name, reason in _find_incompatible(pairs)]:
            loggers[role].warning('; '.join(texts), throttle_duration_sec=THROTTLE_S)
            unheard += texts
    if unserved := [text for each in outputs for text in describe_incompatible_subscriptions(node, each)]:
        node.get_logger().warning('; '.join(unserved), throttle_duration_sec=THROTTLE_S)
    return unheard


def describe_incompatible_subscriptions(node: Node, publisher: Any) -> list[str]:
    """Return a text for each present subscription of an output that cannot receive its messages."""
    topic, given = publisher.topic_name, publisher.qos_profile
    # as in the profiles of the graph: what the node leaves open would count as shorter than infinite, and fit every liveliness
    rest = {'deadline': Infinite, 'liveliness': qos.LivelinessPolicy.AUTOMATIC, 'liveliness_lease_duration': Infinite}
    offered = qos.QoSProfile(reliability=given.reliability, durability=given.durability, depth=given.depth, **rest)
    pairs = [(each.node_name, offered, each.qos_profile) for each in node.get_subscriptions_info_by_topic(topic)]
    remedy = f'(see qos_overrides.{topic}.publisher)'
    return [f'{name} cannot hear {topic}, {reason} {remedy}' for name, reason in _find_incompatible(pairs)]


def _find_incompatible(pairs: Iterable[tuple[str, qos.QoSProfile, qos.QoSProfile]]) -> Iterator[tuple[str, str]]:
    """Yield name and reason of those names whose profile of the publisher does not fit that of the subscription."""
    for name, offered, wanted in pairs:
        compatibility, reason = qos.qos_check_compatible(offered, wanted)
        if compatibility == qos.QoSCompatibility.ERROR:
            yield name, f'incompatible QoS: {reason.removeprefix("ERROR: ").rstrip("; ")}'


def answer_refused_transitions(service: Any, logger: Any) -> None:
    """Let `~/change_state` refuse a transition by `success: false`: rclpy raises an exception, and the caller waits."""
    change = service.callback

    def change_or_refuse(request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except Exception as error:
            wanted = request.transition.label or request.transition.id
            logger.warning(f'transition {wanted} is refused: {" ".join(str(error).split())}')
            response.success = False
            return response

    service.callback = change_or_refuse


def take_queued(subscription: Any) -> list[Any]:
    """Take the messages from a subscription's queue, at most as many as it holds, because it may be filled meanwhile."""
    messages: list[Any] = []
    with subscription.handle:
        while len(messages) < HAND_DEPTH and (taken := subscription.handle.take_message(subscription.msg_type, subscription.raw)):
            messages.append(taken[0])
    return messages


class GoalTopics:
    """One topic for the likelihood of each goal, made with the first prediction of it, which any tool plots by its name."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.publishers: list[Any] = []

    def publish(self, prediction: Prediction, types: MessageTypes) -> None:
        """Publish the likelihood of each goal of which something is known; there is no message for another."""
        goals = min(len(prediction.goal_positions), MOST_GOAL_TOPICS)
        for row in range(len(self.publishers), goals):
            self.publishers.append(create_publisher(self._node, f'goal_likelihood/{name_goal(row)}', GOAL_LIKELIHOOD_TYPE))
        heard = [row for row in range(goals) if self.publishers[row].get_subscription_count()]
        messages = encode_goal_likelihoods(prediction, types) if heard else {}
        for row in heard:
            if row in messages:
                publish(self._node, self.publishers[row], messages[row])

    def remove_absent(self, goals: Array | None) -> None:
        """Remove the topics of goals that are gone; goals (g, 2): those that there are now, None if none was received."""
        while len(self.publishers) > (0 if goals is None else len(goals)):
            self._node.destroy_publisher(self.publishers.pop())


class TfListener:
    """A buffer of tf2 and its listener, which calls `notify` after each transform; a jump of the clock back in time clears it."""

    def __init__(self, node: Node, notify: Callable[[], None]) -> None:
        import tf2_ros

        self._unavailable = tf2_ros.TransformException
        self._notify = notify
        self._buffer: Any = tf2_ros.Buffer(node=node)
        self._listener = tf2_ros.TransformListener(self, node)

    def look_up(self, target: str, source: str, stamp_ns: int) -> Transform:
        """Return a transform as `TransformSource.look_up` says, without waiting."""
        try:
            found = self._buffer.lookup_transform(target, source, Time(nanoseconds=stamp_ns))
        except self._unavailable as error:
            raise TransformUnavailableError(' '.join(str(error).split())) from None
        shift, turn = found.transform.translation, found.transform.rotation
        return Transform(compute_rotation(turn), np.array([shift.x, shift.y, shift.z]), decode_stamp(found.header))

    def set_transform(self, transform: Any, authority: str) -> None:
        """Take a transform from the listener."""
        self._buffer.set_transform(transform, authority)
        self._notify()

    def set_transform_static(self, transform: Any, authority: str) -> None:
        """Take a transform that never changes from the listener."""
        self._buffer.set_transform_static(transform, authority)
        self._notify()
