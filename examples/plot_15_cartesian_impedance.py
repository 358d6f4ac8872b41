# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffness for a dVRK arm
========================

Guidance also has a stiffness and a reference, with the same force at the hand, for arms that control an impedance themselves.
Here both become the message `crtk_msgs/CartesianImpedance`, which an arm of the dVRK takes on `servo_ci`. Its text definition
is all that is needed to make it, without the package crtk_msgs.
"""

import matplotlib.pyplot as plt
import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import foc_ros
from foc_ros.ros.messages.types import RosbagsTypes, make_header

GAINS = 'geometry_msgs/Vector3 p\ngeometry_msgs/Vector3 d\ngeometry_msgs/Vector3 bias\ngeometry_msgs/Vector3 deadband\n'
IMPEDANCE = """std_msgs/Header header
geometry_msgs/Quaternion force_orientation
geometry_msgs/Vector3 force_position
geometry_msgs/Quaternion torque_orientation
crtk_msgs/CartesianImpedanceHalfPlaneGains position_positive
crtk_msgs/CartesianImpedanceHalfPlaneGains position_negative
crtk_msgs/CartesianImpedanceHalfPlaneGains orientation_positive
crtk_msgs/CartesianImpedanceHalfPlaneGains orientation_negative
"""
HALF_PLANE, MESSAGE = 'crtk_msgs/msg/CartesianImpedanceHalfPlaneGains', 'crtk_msgs/msg/CartesianImpedance'
store = get_typestore(Stores.ROS2_JAZZY)
store.register(get_types_from_msg(GAINS, HALF_PLANE) | get_types_from_msg(IMPEDANCE, MESSAGE))
types = RosbagsTypes(store)

# %%
# The gains hold along the axes of a frame of their own, so the stiffness matrix becomes its eigenvalues in the frame of its
# eigenvectors. A gain that draws to the reference is negative. Orientation and the normal of the plane stay free.


def encode_impedance(output, stamp_ns, height=0.0, frame_id='base'):
    """Return the message for a `GuidanceOutput`, in the plane xy of the frame of the arm."""
    stiffness, axes = np.linalg.eigh(output.stiffness)
    angle = np.arctan2(axes[1, 0], axes[0, 0])
    x, y = output.reference
    vector, quaternion = 'geometry_msgs/msg/Vector3', 'geometry_msgs/msg/Quaternion'
    gains = types.make(HALF_PLANE, p=types.make(vector, x=-stiffness[0], y=-stiffness[1]))
    return types.make(
        MESSAGE,
        header=make_header(types, stamp_ns, frame_id),
        force_orientation=types.make(quaternion, z=np.sin(angle / 2), w=np.cos(angle / 2)),
        force_position=types.make(vector, x=x, y=y, z=height),
        torque_orientation=types.make(quaternion, w=1.0),
        position_positive=gains,
        position_negative=gains,
    )


# %%
# A hand goes towards the edge of a cup. The force that the arm would make of each message is that of guidance.

config = foc_ros.Config(budget_s=0.0)
predictor, guidance = foc_ros.Predictor(config), foc_ros.Guidance(config)
predictor.set_goals((0.3, 0.05))
predictor.set_obstacles(foc_ros.Circle((0.15, 0.0), radius=0.03, name='cup'))
times, forces = np.arange(0.0, 1.2, 0.005), []
for tick, t in enumerate(times):
    position = np.array([0.25 * t, 0.035])
    if tick % 8 == 0:
        prediction = predictor.update(t, position)
    output = guidance.update(t, position, (0.25, 0.0), prediction)
    raw = store.serialize_cdr(encode_impedance(output, round(1e9 * t)), MESSAGE)
    sent = store.deserialize_cdr(raw, MESSAGE)
    turn = 2 * np.arctan2(sent.force_orientation.z, sent.force_orientation.w)
    frame = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    aside = position - (sent.force_position.x, sent.force_position.y)
    forces.append(frame @ ((sent.position_positive.p.x, sent.position_positive.p.y) * (frame.T @ aside)))
    assert np.allclose(forces[-1], output.force, atol=1e-4), 'the arm would pull otherwise'

figure, axes = plt.subplots(figsize=(7, 3.5), layout='constrained')
axes.plot(times, forces, label=['along x', 'along y'])
axes.set(xlabel='time [s]', ylabel='force of the arm [N]')
axes.legend()
plt.show()
