# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffness for a dVRK arm
========================

The node publishes `~/guidance/stiffness` (std_msgs/Float64MultiArray) and `~/guidance/reference` (geometry_msgs/PoseStamped),
with the same force at the hand, for arms that control an impedance themselves. Here both become `crtk_msgs/CartesianImpedance`,
which an arm of the dVRK takes on `servo_ci`. Its text definition is all that is needed, without the package crtk_msgs.
"""

import matplotlib.pyplot as plt
import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation

import foc_ros

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
VECTOR, QUATERNION, POSE = 'geometry_msgs/msg/Vector3', 'geometry_msgs/msg/Quaternion', 'geometry_msgs/msg/PoseStamped'


def make(name, *values):
    """Return a message with the values of all its fields in their order."""
    return store.types[name](*values)


# %%
# The gains hold along the axes of a frame of their own, so the stiffness matrix becomes its eigenvalues in the frame of its
# eigenvectors. A gain that draws to the reference is negative. Orientation and the normal of the plane stay free. The damping
# `d` is 0, so that the force is that of guidance alone; a negative one [N s/m] also damps.
#
# In a node, keep the newest reference and call this with each stiffness, which the node publishes after it. Messages of rclpy do,
# too. Send a stiffness of zero where none comes for some periods.


def convert(stiffness, reference):
    """Return the impedance for both messages of guidance."""
    gains, axes = np.linalg.eigh(np.reshape(stiffness.data, (3, 3)))
    axes *= np.linalg.det(axes)  # a rotation, no mirror image
    zero, upright, at = make(VECTOR, 0.0, 0.0, 0.0), make(QUATERNION, 0.0, 0.0, 0.0, 1.0), reference.pose.position
    held, free = (make(HALF_PLANE, make(VECTOR, *p), zero, zero, zero) for p in (-gains, np.zeros(3)))
    frame = make(QUATERNION, *Rotation.from_matrix(axes).as_quat())
    return make(MESSAGE, reference.header, frame, make(VECTOR, at.x, at.y, at.z), upright, held, held, free, free)


# %%
# In place of the node, both messages are made here as :doc:`/interfaces` defines them, in the plane xy.


def publish(output, t):
    """Return stiffness and reference of a `GuidanceOutput` as the node publishes them."""
    matrix = np.zeros((3, 3))
    matrix[:2, :2] = output.stiffness
    rows = [make('std_msgs/msg/MultiArrayDimension', *each) for each in (('row', 3, 9), ('column', 3, 3))]
    stiffness = make('std_msgs/msg/Float64MultiArray', make('std_msgs/msg/MultiArrayLayout', rows, 0), matrix.ravel())
    header = make('std_msgs/msg/Header', make('builtin_interfaces/msg/Time', int(t), int(t % 1 * 1e9)), 'base')
    place = make('geometry_msgs/msg/Point', *output.reference, 0.0), make(QUATERNION, 0.0, 0.0, 0.0, 1.0)
    return stiffness, make(POSE, header, make('geometry_msgs/msg/Pose', *place))


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
    raw = store.serialize_cdr(convert(*publish(output, t)), MESSAGE)
    sent = store.deserialize_cdr(raw, MESSAGE)
    turn, at, gains = sent.force_orientation, sent.force_position, sent.position_positive.p
    frame = Rotation.from_quat((turn.x, turn.y, turn.z, turn.w))
    aside = frame.inv().apply((*position, 0.0) - np.array((at.x, at.y, at.z)))
    forces.append(frame.apply((gains.x, gains.y, gains.z) * aside)[:2])
    assert np.allclose(forces[-1], output.force, atol=1e-4), 'the arm would pull otherwise'

figure, axes = plt.subplots(figsize=(7, 3.5), layout='constrained')
axes.plot(times, forces, label=['along x', 'along y'])
axes.set(xlabel='time [s]', ylabel='force of the arm [N]')
axes.legend()
plt.show()
