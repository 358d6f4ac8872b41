"""The topics of guidance: what its thread computes, its markers, and the operator's command with its share in it."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic
from typing import Any

from rclpy.node import Node

from foc_ros.core.config import Config
from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.io.topics import COMMAND

from .endpoints import create_guidance_publishers
from .guidance_loop import GuidanceLoop
from .health import THROTTLE_S
from .messages.decode_poses import decode_frame
from .messages.encode_guidance import LIVE_OUTPUTS, TWIST, Place, blend_twist, encode_guidance_markers
from .messages.types import MessageTypes, RclpyTypes


class GuidanceTopics:
    """Publishes guidance for a node between `create` and `destroy`.

    Attributes: loop, which has to be told what is new; publishers, by the name of the topic below the node's name.

    Parameters
    ----------
    node
        The node to which the topics belong.
    config
        All parameters.
    report
        Called in the thread of guidance with an exception of an update.
    """

    def __init__(self, node: Node, config: Config, report: Callable[[Exception], None]) -> None:
        self._node = node
        self._thread_types = RclpyTypes()  # messages of the thread of guidance; no other thread uses them
        self.publishers: dict[str, Any] = {}
        self.loop = GuidanceLoop(config, self._publish_output, report, node.get_logger().warning)

    def create(self) -> None:
        """Create the publishers and begin to update."""
        self.publishers = create_guidance_publishers(self._node)
        self.loop.start()

    def destroy(self) -> None:
        """End the updates and destroy the publishers."""
        self.loop.stop()
        for publisher in self.publishers.values():
            self._node.destroy_publisher(publisher)
        self.publishers = {}

    def encode_markers(self, types: MessageTypes) -> list[Any]:
        """Return the markers of the last output, none if guidance is disabled or has no hand."""
        output, newest = self.loop.output, self.loop.newest
        if output is None or newest.place is None or not newest.config.guidance.enabled:
            return []
        return encode_guidance_markers(output, newest.place, types)

    def blend_command(self, command: Any, types: MessageTypes) -> None:
        """Publish the operator's command with the share of guidance in it, or as it is where there is no guidance."""
        output, place, config = self.loop.output, self.loop.place, self.loop.newest.config
        if not config.guidance.enabled:
            return
        if output is not None and place is not None and monotonic() - output.t <= config.guidance.hold_s:
            frame_id = decode_frame(command.header)
            if frame_id == place.frame_id:
                command = blend_twist(output, command, config.plane, types)
            else:
                text = f'{COMMAND}: frame {frame_id!r} is not the working frame {place.frame_id!r}: not blended'
                self._node.get_logger().warning(text, throttle_duration_sec=THROTTLE_S)
        self._publish(TWIST, command)

    def _publish_output(self, output: GuidanceOutput, place: Place) -> None:
        """Publish an output; this happens in the thread of guidance."""
        for name, (_, encode) in LIVE_OUTPUTS.items():
            if name in self.publishers and self.publishers[name].get_subscription_count():
                self._publish(name, encode(output, place, self._thread_types))

    def _publish(self, name: str, message: Any) -> None:
        if self._node.context.ok():
            self.publishers[name].publish(message)
