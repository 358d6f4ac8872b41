# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Start one node for each arm: `ros2 launch foc_ros two_arms.launch.py left_hand:=/MTML/measured_cp`.

Both nodes read the same obstacles; each has its own goals, below its namespace, such as `/left/goals`.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

SIDES = {'left': '/MTML/measured_cp', 'right': '/MTMR/measured_cp'}
"""Namespace of each node, and the default topic of its hand."""
SHARED = {
    'obstacles': ('/obstacles', 'topic of the obstacles of both arms'),
    'obstacle_markers': ('/obstacle_markers', 'topic of the markers of both arms'),
    'plane': ('', 'task plane: xy, xz or yz'),
    'frame_id': ('', 'working frame'),
    'autostart': ('', 'true, or false for a lifecycle manager'),
    'params_file': ('', 'parameter file of both nodes; its section is /** or has their namespaces'),
}


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and both nodes."""
    source = PythonLaunchDescriptionSource(str(Path(__file__).with_name('foc.launch.py')))
    shared = [(name, LaunchConfiguration(name)) for name in SHARED]
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, default_value=value, description=words) for name, (value, words) in SHARED.items()),
            *(
                DeclareLaunchArgument(f'{side}_hand', default_value=topic, description=f'topic of the {side} hand')
                for side, topic in SIDES.items()
            ),
            *(
                IncludeLaunchDescription(
                    source,
                    launch_arguments=[*shared, ('namespace', side), ('hand_pose', LaunchConfiguration(f'{side}_hand'))],
                )
                for side in SIDES
            ),
        ]
    )
