"""Messages to records and back. The same functions serve rclpy's messages and those read from a bag with rosbags."""

from .inputs import goal_of_pose, goals_of_pose_array, hand_sample
from .marker_scene import MarkerScene
from .obstacle_cloud import CloudScene, cloud_obstacles
from .types import MessageTypes, RclpyTypes, RosbagsTypes

__all__ = [
    'CloudScene',
    'MarkerScene',
    'MessageTypes',
    'RclpyTypes',
    'RosbagsTypes',
    'cloud_obstacles',
    'goal_of_pose',
    'goals_of_pose_array',
    'hand_sample',
]
