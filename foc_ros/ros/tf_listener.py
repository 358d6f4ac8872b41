"""Transforms from tf2, where it is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.time import Time

from .messages.transform_messages import Transform
from .transforms import TransformUnavailableError


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
        return Transform(found.transform.rotation, found.transform.translation, Time.from_msg(found.header.stamp).nanoseconds)

    def set_transform(self, transform: Any, authority: str) -> None:
        """Take a transform from the listener."""
        self._buffer.set_transform(transform, authority)
        self._notify()

    def set_transform_static(self, transform: Any, authority: str) -> None:
        """Take a transform that never changes from the listener."""
        self._buffer.set_transform_static(transform, authority)
        self._notify()
