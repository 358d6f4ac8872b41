"""Refusal of impossible lifecycle transitions by an answer.

rclpy raises an exception in the service instead, and the caller waits without end.
"""

from __future__ import annotations

from typing import Any

from rclpy.lifecycle import LifecycleNode


def answer_refused_transitions(node: LifecycleNode) -> None:
    """Make `~/change_state` answer `success: false` to a transition that does not start in the present state."""
    service = node._service_change_state  # noqa: SLF001 (rclpy has no public way to it)
    change = service.callback

    def change_or_refuse(request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except Exception as error:
            wanted = request.transition.label or request.transition.id
            node.get_logger().warning(f'transition {wanted} is refused: {" ".join(str(error).split())}')
            response.success = False
            return response

    service.callback = change_or_refuse
