"""Old place, to be removed."""

from .encode_inputs import goal_poses as goal_poses
from .encode_inputs import hand_pose as hand_pose
from .encode_inputs import obstacle_cloud as obstacle_cloud
