# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Encoding of guidance: wrench, reference, stiffness, a blended command and markers, in the task plane only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.guidance.guide import GuidanceOutput

from .decode_poses import decode_frame
from .encode_inputs import NO_ROTATION, encode_array, encode_hand_pose
from .plane import lift, project
from .types import MessageTypes, make_header

ARROW, SPHERE = 0, 2
COLOUR = (0.0, 0.62, 0.45, 0.9)


@dataclass(frozen=True)
class SampleHeader:
    """What guidance refers to: stamp [ns], frame and height [m] of the hand sample, and the task plane."""

    stamp_ns: int
    frame_id: str
    height: float
    plane: str


def encode_wrench(output: GuidanceOutput, header: SampleHeader, types: MessageTypes) -> Any:
    """Encode the force as a geometry_msgs/WrenchStamped without torque."""
    stamped = make_header(types, header.stamp_ns, header.frame_id)
    return types.fill('geometry_msgs/msg/WrenchStamped', (stamped, encode_force(output, header, types)))


def encode_force(output: GuidanceOutput, header: SampleHeader, types: MessageTypes) -> Any:
    """Encode the force as a geometry_msgs/Wrench without torque and without a stamp, as drivers of haptic devices take it."""
    return types.make('geometry_msgs/msg/Wrench', force=lift(output.force, 0.0, header.plane))


def encode_reference(output: GuidanceOutput, header: SampleHeader, types: MessageTypes) -> Any:
    """Encode the reference as a geometry_msgs/PoseStamped, whose orientation means nothing."""
    return encode_hand_pose(types, header.stamp_ns, header.frame_id, lift(output.reference, header.height, header.plane))


def encode_stiffness(output: GuidanceOutput, header: SampleHeader, types: MessageTypes) -> Any:
    """Encode the stiffness [N/m] as a std_msgs/Float64MultiArray of 3 x 3."""
    axes = lift(np.eye(2), 0.0, header.plane)
    return encode_array(types, axes.T @ output.stiffness @ axes, (('row', 3, 9), ('column', 3, 3)))


def blend_twist(output: GuidanceOutput, header: SampleHeader, command: Any, types: MessageTypes) -> Any:
    """Return a TwistStamped command with the part in the plane blended; InputError for another frame or no finite number."""
    frame_id, linear = decode_frame(command.header), command.twist.linear
    if frame_id != header.frame_id:
        raise MessageError('header.frame_id', f'the working frame {header.frame_id!r}', repr(frame_id))
    velocity, across = project([linear.x, linear.y, linear.z], header.plane)
    blended = lift(output.blend_command(velocity), across, header.plane)
    return types.fill('geometry_msgs/msg/TwistStamped', (command.header, (blended, command.twist.angular)))


def encode_guidance_markers(output: GuidanceOutput, header: SampleHeader, types: MessageTypes) -> list[Any]:
    """Encode the force as an arrow from the hand, of 2 cm for each newton, and the reference as a sphere of 8 mm."""
    start = lift(output.position, header.height, header.plane)
    points = np.stack([start, start + 0.02 * lift(output.force, 0.0, header.plane)])
    reference = encode_reference(output, header, types)
    shared = {'ns': 'guidance', 'header': reference.header, 'lifetime': (1, 0), 'color': COLOUR}
    arrow = {'type': ARROW, 'scale': (0.004, 0.008, 0.0), 'pose': ((0.0, 0.0, 0.0), NO_ROTATION), 'points': points}
    sphere = {'id': 1, 'type': SPHERE, 'scale': (0.008, 0.008, 0.008), 'pose': reference.pose}
    return [types.make('visualization_msgs/msg/Marker', **shared, **each) for each in (arrow, sphere)]


TWIST, TWIST_TYPE = 'guidance/twist', 'geometry_msgs/msg/TwistStamped'
GUIDANCE_OUTPUTS: dict[str, tuple[str, Callable[[GuidanceOutput, SampleHeader, MessageTypes], Any]]] = {
    'guidance/wrench': ('geometry_msgs/msg/WrenchStamped', encode_wrench),
    'guidance/reference': ('geometry_msgs/msg/PoseStamped', encode_reference),
    'guidance/stiffness': ('std_msgs/msg/Float64MultiArray', encode_stiffness),
}
"""Message type and encoder of every output of each update, by the name of its topic below the node's name."""
LIVE_OUTPUTS = GUIDANCE_OUTPUTS | {'guidance/wrench_unstamped': ('geometry_msgs/msg/Wrench', encode_force)}
"""The same with what only a node publishes, if the parameter `guidance.unstamped` says so: a bag has no use for it."""
