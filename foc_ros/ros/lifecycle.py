"""Transitions that cannot be made now, refused by an answer.

rclpy raises inside the service where a transition does not start in the present state, and whoever asked waits for ever.
"""

from __future__ import annotations

from typing import Any

from rclpy.lifecycle import LifecycleNode


def answer_refused_transitions(node: LifecycleNode) -> None:
    """Make `~/change_state` of a node answer `success: false` to what it cannot do in its state."""
    service = node._service_change_state  # noqa: SLF001 (there is no other way to it)
    change = service.callback

    def answered(request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except Exception as error:
            wanted = request.transition.label or request.transition.id
            node.get_logger().warning(f'transition {wanted} is refused: {" ".join(str(error).split())}')
            response.success = False
            return response

    service.callback = answered
